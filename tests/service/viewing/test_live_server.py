"""The live page's server: who is answered, what is bounded, and that plans are those of crux."""

from __future__ import annotations

import contextlib
import http.client
import json
import socket
import threading

import msgspec
import pytest

import planner
from planner import deadline
from service import answering, serving, viewing
from service.answering.own_models import BUNDLED_ROBOTS
from service.commands.stances import read_request, read_with_text
from service.replies import PublishedReply
from service.viewing import FollowedStreams, LivePlan, LiveServer, MovableStance
from service.viewing.settings import VIEWING_SETTINGS
from service.wire import Format, stream_key
from tests.suite.helpers.patience import soon


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    """A server, and the file that it saves."""
    file = tmp_path_factory.mktemp("saved") / "moved.json"
    request, given = read_with_text("wall-300")
    plan = LivePlan(MovableStance(request, BUNDLED_ROBOTS), "wall", file, given)
    with LiveServer(plan, 0) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield server, file
        server.shutdown()
        thread.join()


def asked(server, method, path, body=None, **headers):
    """Status, headers and text of an answer; None leaves a header out."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=60)
    host = f"127.0.0.1:{server.server_port}"
    given = {"Host": host, "Origin": f"http://{host}", "X-Crux-Token": server.token}
    given |= {name.replace("_", "-"): value for name, value in headers.items()}
    connection.putrequest(method, path, skip_host=True)
    if body is not None and "Content_Length" not in headers:
        given["Content-Length"] = str(len(body))
    for name, value in given.items():
        if value is not None:
            connection.putheader(name, value)
    connection.endheaders(body)
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, answer.headers, text


def answer(server, path, **question):
    status, _, text = asked(server, "POST", path, json.dumps(question).encode())
    assert status == 200
    return json.loads(text)


def test_the_page_needs_the_token_and_this_machine_as_its_host(live):
    server, _ = live
    page = f"/?token={server.token}"
    status, headers, text = asked(server, "GET", page)
    assert status == 200
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert (headers["Referrer-Policy"], headers["Cache-Control"]) == ("no-referrer", "no-store")
    assert server.token not in text
    assert server.address.startswith("http://127.0.0.1:")
    for path in ("/", "/?token=", f"{page}x", "/?token=%C3%A9%FF", "http://[/"):
        status, _, text = asked(server, "GET", path)
        assert (status, "open the whole address" in text) == (403, True)
    # a name that another site lets point here
    for host in ("example.org", f"example.org:{server.server_port}", "127.0.0.1", "", None):
        status, _, text = asked(server, "GET", page, Host=host)
        assert (status, "crux view has printed" in text) == (403, True)
    assert asked(server, "GET", f"/elsewhere?token={server.token}")[0] == 404


def test_many_connections_at_once_are_kept():
    """Before any is accepted: what is not kept is not connected."""
    with LiveServer(None, 0) as server, contextlib.ExitStack() as connected:
        for _ in range(60):
            address = ("127.0.0.1", server.server_port)
            connected.enter_context(socket.create_connection(address, timeout=5.0))


def test_connections_beyond_the_bound_are_refused_and_make_no_thread(monkeypatch):
    monkeypatch.setattr(viewing.live_server._Handler, "timeout", 600.0)
    with LiveServer(None, 0) as server, contextlib.ExitStack() as connected:
        serving_thread = threading.Thread(target=server.serve_forever, daemon=True)
        serving_thread.start()
        before = threading.active_count()
        held = [
            connected.enter_context(
                socket.create_connection(("127.0.0.1", server.server_port), timeout=60.0)
            )
            for _ in range(VIEWING_SETTINGS.most_connections)
        ]
        page = f"/?token={server.token}x"
        for _ in range(20):
            status, headers, text = asked(server, "GET", page)
            assert (status, headers["Retry-After"]) == (503, "1")
            assert "too many connections" in text
        assert threading.active_count() <= before + VIEWING_SETTINGS.most_connections
        # one that ends makes room for another
        held[0].close()
        assert soon(lambda: asked(server, "GET", page)[0] == 403)
        server.shutdown()
        serving_thread.join()


def test_questions_need_the_token_and_the_pages_own_origin(live):
    server, _ = live
    body = b'{"moves": {}}'
    for headers in (
        {"X_Crux_Token": None},
        {"X_Crux_Token": "guessed"},
        {"Origin": None},
        {"Origin": "http://example.org"},
        {"Origin": "null"},
        {"Origin": f"https://127.0.0.1:{server.server_port}"},
        {"Host": f"example.org:{server.server_port}"},
    ):
        for path in server.answers:
            assert asked(server, "POST", path, body, **headers)[0] == 403
    assert asked(server, "POST", "/elsewhere", body)[0] == 404
    assert asked(server, "PUT", "/plan", body)[0] == 501


def test_bodies_are_bounded_and_strict(live):
    server, _ = live
    for length in (2**14 + 1, 10**12, "9" * 5000):
        assert asked(server, "POST", "/plan", b"{}", Content_Length=str(length))[0] == 413
    for length in (None, "-1", "many"):
        assert asked(server, "POST", "/plan", b"{}", Content_Length=length)[0] == 411
    for body, words in (
        (b"{", "not valid JSON"),
        (b'{"moves": {"body": [0, 0]}}', "moves.body"),
        (b'{"moves": {"body": [0, 0, 1e9, 0, 0, 0]}}', "moves.body"),
        (b'{"moves": {"head": 1}}', "head"),
        (b'{"moves": {"hands": {"tail": [0, 0.1, 0]}}}', "unknown limb 'tail'"),
    ):
        status, _, text = asked(server, "POST", "/plan", body)
        assert (status, words in json.loads(text)["error"]) == (200, True)
    assert "--follow" in answer(server, "/follow")["error"]


def test_a_moved_stance_is_planned_and_saved_as_crux_plan_has_it(live):
    server, file = live
    moves = {
        "body": [0.0, 0.03, 0.01, 0.0, 0.0, 0.02],
        "hands": {"front_right": [0.01, 0.02, 0.05]},
    }
    shown = [answer(server, "/plan", moves=moves, brief=b)["answer"] for b in (True, False)]
    name = answer(server, "/save", moves=moves)["answer"]
    assert name == str(file)
    request = read_request(str(file))
    plan = planner.plan(answering.question(request))
    for each in shown:
        assert each["stage"]["status"] == plan.status
        assert each["stage"]["utilisation"] == pytest.approx(plan.utilisation, rel=1e-6)
        (place,) = (
            hand.pose.position
            for hand in answering.question(request).stance.hands
            if hand.limb == "front_right"
        )
        assert each["handles"]["front_right"]["place"] == pytest.approx(place.tolist(), abs=1e-8)
    assert "tables" not in shown[0]["stage"]
    assert len(shown[1]["stage"]["slices"]) == 4
    # what was not moved has the bytes that it had
    given = json.loads(read_with_text("wall-300")[1].text)
    saved = json.loads(file.read_bytes())
    assert saved["stance"]["hands"][1:] == given["stance"]["hands"][1:]
    back = answer(server, "/plan", moves={}, brief=True)["answer"]["stage"]
    unmoved = planner.plan(answering.question(read_request("wall-300")))
    assert back["utilisation"] == unmoved.utilisation


def test_an_impossible_stance_does_not_replace_what_is_saved(live):
    server, file = live
    answer(server, "/save", moves={})
    kept = file.read_bytes()
    for moves, field in (
        ({"body": [0.0, 0.0, 50.0, 0.0, 0.0, 0.0]}, "stance.hands[0].pose.position: "),
        ({"hands": {"front_left": [5.0, 0.0, 0.0]}}, "hands.front_left: there is no rock 5000 mm"),
    ):
        assert answer(server, "/save", moves=moves)["error"].startswith(field)
        assert file.read_bytes() == kept


def test_what_goes_wrong_is_said(live, monkeypatch, capfd):
    server, file = live

    def failing(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(viewing.live_plan, "whole_file", failing)
    assert answer(server, "/save", moves={})["error"] == f"-o: {file}: No space left on device"
    monkeypatch.setattr(viewing.live_plan.planner, "plan", lambda _: 1 / 0)
    status, _, text = asked(server, "POST", "/plan", b"{}")
    assert (status, "crux view has failed" in text) == (500, True)
    said = []

    def told():
        said.append(capfd.readouterr().err)
        return "ZeroDivisionError" in "".join(said)

    assert soon(told)


def test_a_newer_question_ends_the_search_for_advice(live, monkeypatch):
    server, _ = live
    begun, found = threading.Event(), []

    def endless(question, plan):
        begun.set()
        assert soon(deadline.expired)
        deadline.check("all changes were tried")

    monkeypatch.setattr(viewing.live_plan.planner, "with_advice", endless)
    asking = threading.Thread(target=lambda: found.append(answer(server, "/advice", moves={})))
    asking.start()
    assert begun.wait(60)
    assert answer(server, "/plan", moves={}, brief=True)["answer"]["stage"]["status"] == "optimal"
    asking.join(60)
    assert found == [{"answer": None}]


def test_published_set_points_are_followed():
    with serving.open_session(serving.zenoh_config(multicast=False)) as session:
        streams = FollowedStreams(session, "robosimian")
        assert streams.after(0, 0.0) == {"count": 0, "reply": None}
        key, form = stream_key("robosimian", "7", "set_points"), Format.MSGPACK
        for number in (1, 2):
            reply = PublishedReply(stream="7", number=number, time=None, age=0.001, skipped=0)
            session.put(key, form.encode(reply), encoding=form.label(reply))
            session.put(key, b"nonsense", encoding="application/json")
        assert soon(lambda: streams.after(1, 0.0)["count"] == 2)
        newest = streams.after(1, 60.0)
        assert newest == {"count": 2, "reply": msgspec.to_builtins(reply)}
        assert streams.after(2, 0.0) == {"count": 2, "reply": None}
