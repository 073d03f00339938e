"""``crux serve -c FILE.toml`` and ``--check``: options of a file, strictly read; nothing starts."""

from __future__ import annotations

import json
import re
import socket
import tomllib

import pytest

from service.commands.cli import run_command_line
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.commands import BAD_INPUT, DONE, complaint, result
from tests.suite.helpers.served import free_endpoint


@pytest.fixture
def checked(tmp_path, capfd):
    """What ``--check`` says of options in a file, and further ones."""

    def check(text: str, *more: str) -> dict:
        file = tmp_path / "serve.toml"
        file.write_text(text)
        assert run_command_line(["serve", "-c", str(file), *more, "--check", "--json"]) == DONE
        return result(capfd)

    return check


def test_options_have_their_own_names_and_the_command_line_wins(checked):
    first, second = free_endpoint(), free_endpoint()
    text = f'listen = "{first}"\nworkers = 3\ndeadline = 2.5\nros2 = true\ndomain = 9\n'
    found = checked(text)
    assert found["listen"] == [first]
    assert (found["workers"], found["deadline"], found["ros_domain"]) == (3, 2.5, 9)
    assert "crux/robosimian/plan" in found["keys"]
    assert found["open_to_the_network"] == []
    # some editors of Windows begin a file with a byte order mark
    found = checked(f"\ufeff{text}", "-l", second, "--workers", "1", "--deadline", "4")
    assert (found["listen"], found["workers"], found["deadline"]) == ([second], 1, 4.0)


def test_lists_and_files_beside_the_file(checked, tmp_path):
    ends = [free_endpoint(), free_endpoint()]
    (tmp_path / "zenoh.json5").write_text('{mode: "router", listen: {endpoints: []}}')
    assert checked(f'listen = {json.dumps(ends)}\nconfig = "zenoh.json5"\n')["listen"] == ends
    found = checked('config = "zenoh.json5"\nrecord = "a.mcap"\nrecord-limit = 2\n', "-l", ends[0])
    assert found["listen"] == ends[:1]
    assert found["record"] == str(tmp_path / "a.mcap")
    assert not (tmp_path / "a.mcap").exists()


def test_zenohs_own_file_is_read_as_ever(tmp_path, capfd):
    endpoint, file = free_endpoint(), tmp_path / "zenoh.json5"
    file.write_text(f'{{listen: {{endpoints: ["{endpoint}"]}}}}')
    assert run_command_line(["serve", "--config", str(file), "--check", "--json"]) == DONE
    assert result(capfd)["listen"] == [endpoint]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("wrokers = 2", r"wrokers: unknown option; valid are cfg, config, .*workers"),
        ("check = true", r"check: unknown option"),
        ("workers = 0", r"workers: 0 is not in the range 1<=x<=256; got 0"),
        ("workers = true", r"workers: must be a whole number, got True"),
        ('workers = "2"', r"workers: must be a whole number, got '2'"),
        ("deadline = nan", r"deadline: nan is not in the range"),
        ("ros2 = 1", r"ros2: must be true or false, got 1"),
        ("listen = 7447", r"listen: must be a text, or a list of them, got 7447"),
        ('record = ""', r"record: must name a file, got ''"),
        ('log-format = "xml"', r"log-format: 'xml' is not one of 'text', 'json'"),
        ("[serve]\nworkers = 2", r"serve: unknown option"),
        ("workers 2", r"Expected '=' after a key"),
        ('robot = "nosuch.toml"', r"serve.toml: robot: .*nosuch.toml: No such file or directory"),
        ('hand = "nosuch.toml"', r"serve.toml: hand: .*nosuch.toml: No such file or directory"),
        ('config = "no.json5"', r"serve.toml: config: .*no.json5: No such file or directory"),
        ('listen = "tcp/127.0.0.1"', r"serve.toml: listen: 'tcp/127.0.0.1' is not an endpoint"),
        ('connect = ["tcp"]', r"serve.toml: connect: 'tcp' is not an endpoint"),
        ('record = "a.txt"', r"serve.toml: record: must end in .mcap"),
        ('record = "no/a.mcap"', r"serve.toml: record: cannot write"),
        ("domain = 3", r"serve.toml: domain: has no meaning without --ros2"),
        ('cfg = "mode"', r"serve.toml: cfg: KEY:VALUE is needed"),
    ],
)
def test_what_is_wrong_in_the_file_is_told(tmp_path, capfd, text, told):
    file = tmp_path / "serve.toml"
    file.write_text(text)
    assert run_command_line(["serve", "-c", str(file), "--check"]) == BAD_INPUT
    line = complaint(capfd)
    assert str(file) in line
    assert re.search(told, line), line


def test_an_option_of_the_command_line_is_none_of_the_file(tmp_path, capfd):
    file = tmp_path / "serve.toml"
    file.write_text('listen = "tcp/127.0.0.1:1"\nrecord = "a.mcap"\n')
    assert run_command_line(["serve", "-c", str(file), "-l", "tcp/1", "--check"]) == BAD_INPUT
    assert complaint(capfd).startswith("crux: --listen: 'tcp/1' is not an endpoint")


def test_a_quiet_check_says_what_is_wrong_and_nothing_else(capfd):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        said = []
        # the start says what the check says
        for more in (["--check", "-q"], []):
            assert run_command_line(["serve", "-l", endpoint, *more]) == BAD_INPUT
            said.append(complaint(capfd))
    assert said[0].startswith(
        f"crux: --listen: {endpoint} cannot be opened: Address already in use"
    )
    assert said[0] == said[1]
    assert run_command_line(["serve", "--check", "-q"]) == DONE
    assert capfd.readouterr() == ("", "")


def test_one_file_and_for_serve_alone(tmp_path, capfd):
    file = tmp_path / "a.toml"
    file.write_text("")
    twice = ["-c", str(file), "-c", str(file)]
    assert run_command_line(["serve", "--check", *twice]) == BAD_INPUT
    assert "one TOML file at most" in complaint(capfd)
    assert run_command_line(["top", "-c", str(file)]) == BAD_INPUT
    assert "only crux serve takes options from TOML" in complaint(capfd)


def test_a_check_finds_what_a_start_would_fail_on(tmp_path, capfd):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen(1)
        port = taken.getsockname()[1]
        endpoint = f"tcp/127.0.0.1:{port}"
        for options, told in (
            (["-l", endpoint], f"--listen: {endpoint} cannot be opened: Address already in use"),
            (["--metrics-port", str(port)], f"--metrics-port: tcp/127.0.0.1:{port} cannot be"),
            (["--record", str(tmp_path / "no" / "a.mcap")], "--record: cannot write"),
            (["--record", "a.bag"], "--record: must end in .mcap"),
            (["--record-limit", "1"], "--record-limit: has no meaning without --record"),
            (["--cfg", "no_such_key:1"], "--cfg: "),
        ):
            assert run_command_line(["serve", "--check", *options]) == BAD_INPUT
            assert told in complaint(capfd)


def test_a_check_tells_people_what_would_be_served(capfd):
    assert run_command_line(["serve", "--check", "-l", free_endpoint()]) == DONE
    out, err = capfd.readouterr()
    assert err == ""
    assert "workers: " in out
    assert "record: none" in out


def test_the_bundled_file_and_unit_are_valid(capfd, monkeypatch):
    folder = ROOT / "examples" / "service"
    text = (folder / "serve.toml").read_text("utf-8")
    monkeypatch.setattr("service.operating.check_endpoints", lambda *_: None)
    assert run_command_line(["serve", "-c", str(folder / "serve.toml"), "--check"]) == DONE
    capfd.readouterr()
    assert tomllib.loads(text)["metrics-port"] == 9464
    unit = (folder / "crux.service").read_text("utf-8")
    assert re.search(r"^Type=notify$", unit, re.M)
    assert re.search(r"^WatchdogSec=\d+$", unit, re.M)
