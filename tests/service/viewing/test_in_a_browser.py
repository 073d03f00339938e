"""The live page in headless Chromium: dragged with the mouse and keys, undone, and saved."""

from __future__ import annotations

import math
import re
import threading

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import planner
from service import answering
from service.answering.own_models import BUNDLED_ROBOTS
from service.commands.stances import read_request, read_with_text
from service.viewing import LivePlan, LiveServer, MovableStance
from tests.suite.helpers.browser import PROGRAM, Browser

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(PROGRAM is None, reason="Chromium is not installed"),
]

REST = "!busy && !wanted && !document.body.classList.contains('stale')"


class Published:
    """Streams with one slip, in place of a service's."""

    def after(self, count, seconds):
        lost = [{"limb": "rear_left", "finger": "inner_left", "phalanx": "distal"}]
        hand = {"limb": "rear_left", "tensions": [40.0, 41.0, 42.0, 43.0]}
        points = {"status": "optimal", "utilisation": 0.9, "hands": [hand], "lost": lost}
        reply = {"stream": "7", "number": 3, "age": 0.002, "skipped": 0, "set_points": points}
        if count:
            threading.Event().wait(0.2)
        return {"count": 1, "reply": None if count else reply | {"error": None}}


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A browser with the page of wall-300, and the file that is saved."""
    folder = tmp_path_factory.mktemp("live")
    request, given = read_with_text("wall-300")
    file = folder / "moved.json"
    plan = LivePlan(MovableStance(request, BUNDLED_ROBOTS), "wall", file, given)
    with LiveServer(plan, 0, Published()) as server, Browser(folder / "profile") as browser:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        browser.open(server.address)
        yield browser, file
        server.shutdown()
        thread.join()


def middle(browser, name):
    return browser.middle(f"[data-limb={name}]")


def drag(browser, name, dx, dy, steps=5, modifiers=0):
    x, y = middle(browser, name)
    browser.mouse("mousePressed", x, y, modifiers=modifiers)
    for n in range(1, steps + 1):
        browser.mouse("mouseMoved", x + dx * n / steps, y + dy * n / steps, modifiers=modifiers)
        browser.until("!busy")
    return x, y


def shown(browser):
    browser.until(REST)
    return browser.run("[data.stages[0].utilisation, byId('outcome').textContent, moves]")


def test_a_person_drags_undoes_and_saves(page):
    browser, file = page
    first = shown(browser)
    # while the mouse is down the plan has changed already, and the ring is under the mouse
    x, y = drag(browser, "front_right", 0, -20)
    browser.until("data.stages[0].utilisation < 0.95 && !busy")
    browser.mouse("mouseReleased", x, y - 20)
    second = shown(browser)
    assert second[1] != first[1]
    at = middle(browser, "front_right")
    assert at == pytest.approx((x, y - 20), abs=3)
    x, y = drag(browser, "body", 30, 10)
    browser.mouse("mouseReleased", x + 30, y + 10)
    third = shown(browser)
    assert middle(browser, "body") == pytest.approx((x + 30, y + 10), abs=3)
    browser.run("byId('save').click()")
    browser.until("byId('said').textContent.startsWith('saved')")
    request = read_request(str(file))
    plan = planner.plan(answering.question(request))
    assert plan.utilisation == pytest.approx(third[0], rel=1e-6)
    browser.run("byId('undo').click()")
    assert shown(browser)[:2] == second[:2]
    browser.press("z", 2)
    assert shown(browser) == first
    assert browser.run("byId('undo').disabled")
    browser.press("z", 2 + 8)
    assert shown(browser)[:2] == second[:2]
    browser.run("byId('redo').click()")
    assert shown(browser)[2] == third[2]
    assert browser.run("byId('redo').disabled")
    browser.press("z", 2)
    browser.press("z", 2)
    assert shown(browser) == first
    # by a millimetre, along the axis of the hand that looks most like the arrow; shift: by ten
    browser.run("document.querySelector('[data-limb=rear_left]').focus()")
    browser.press("ArrowUp")
    browser.press("ArrowRight", 8)
    # the hand's x is up the wall, and its y to the right of who faces the wall
    assert shown(browser)[2]["hands"] == {"rear_left": [0.001, 0.01, 0]}
    # off the rock there are words, and the last plan stays
    browser.run("change(withShift('rear_left', [3, 0, 0]))")
    browser.until("byId('said').classList.contains('wrong')")
    assert "there is no rock 3000 mm along x" in browser.run("byId('said').textContent")
    browser.press("z", 2)
    shown(browser)
    assert browser.errors == []


def test_body_and_hands_turn_by_mouse_and_keys(page):
    browser, _ = page
    browser.run("change({ body: [0, 0, 0, 0, 0, 0], hands: {} })")
    first = shown(browser)
    # to the right with shift: about the vertical of the screen, by 0.005 rad a pixel
    x, y = drag(browser, "body", 20, 0, modifiers=8)
    browser.mouse("mouseReleased", x + 20, y, modifiers=8)
    second = shown(browser)
    up = browser.run("screenAxes()[1]")
    assert second[2]["body"] == pytest.approx([0, 0, 0, *(0.1 * c for c in up)], abs=1e-4)
    assert second[0] != first[0]
    assert "body turned by [" in browser.run("byId('said').textContent")
    browser.press("z", 2)
    assert shown(browser) == first
    # a hand about its approach, as a wheel whose top the mouse has: clockwise for who sees its back
    browser.run("byId('turn').click()")
    x, y = drag(browser, "front_left", 20, 0)
    browser.mouse("mouseReleased", x + 20, y)
    assert shown(browser)[2]["hands"] == {"front_left": [0, 0, 0.1]}
    browser.run("byId('turn').click()")
    browser.press("z", 2)
    assert shown(browser) == first
    for name, keys in {"body": "rpy", "rear_left": "yr"}.items():
        browser.run(f"document.querySelector('[data-limb={name}]').focus()")
        for key in keys:
            browser.press(key)
            shown(browser)
    browser.press("y", 8)
    moves = shown(browser)[2]
    assert moves["hands"] == {"rear_left": [0, 0, 0]}  # r does nothing
    one = math.radians(1)
    given = answering.question(read_request("wall-300")).stance.body.rotation
    turned = Rotation.from_rotvec(moves["body"][3:]).as_matrix() @ given
    # about its own axes, one after the other
    steps = [Rotation.from_rotvec(one * axis).as_matrix() for axis in np.eye(3)]
    np.testing.assert_allclose(turned, given @ steps[0] @ steps[1] @ steps[2], atol=2e-4)
    assert browser.errors == []


@pytest.mark.parametrize("way", [-25, 25])
def test_a_hand_that_is_dragged_around_curved_rock_stays_under_the_mouse(page, way):
    browser, _ = page
    browser.run("change({ body: [0, 0, 0, 0, 0, 0], hands: {} })")
    shown(browser)
    x, y = drag(browser, "front_right", 0, way)
    browser.until("!busy && !wanted")
    assert middle(browser, "front_right") == pytest.approx((x, y + way), abs=1.5)
    # where the rock has turned its palm
    moved = browser.run("moves.hands.front_right")
    assert math.hypot(*moved[:2]) > 0.08
    browser.mouse("mouseReleased", x, y + way)
    shown(browser)
    assert browser.errors == []


def test_a_drag_that_ends_beside_the_rock_goes_back_to_it(page):
    browser, _ = page
    browser.run("change({ body: [0, 0, 0, 0, 0, 0], hands: {} })")
    first = shown(browser)
    x, y = drag(browser, "front_right", 0, -15, steps=1)
    browser.until("!busy && data.stages[0].utilisation !== " + repr(first[0]))
    browser.mouse("mouseMoved", x, y - 600)
    browser.until("!busy && byId('said').classList.contains('wrong')")
    assert "there is no rock" in browser.run("byId('said').textContent")
    browser.mouse("mouseReleased", x, y - 600)
    moves = shown(browser)[2]
    assert 0 < moves["hands"]["front_right"][0] < 0.1
    browser.until("byId('said').textContent.startsWith('back to where it can be: ')")
    browser.press("z", 2)
    assert shown(browser) == first


def test_a_finger_drags_at_390_pixels(page):
    browser, _ = page
    browser.resize(390, 800)
    browser.send("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=1)
    browser.run("change({ body: [0, 0, 0, 0, 0, 0], hands: {} })")
    first = shown(browser)
    browser.run("byId('scene').scrollIntoView({ block: 'center' })")
    browser.until("byId('scene')._fullLayout.width < 390")
    x, y = middle(browser, "body")
    browser.touch("touchStart", x, y)
    for n in range(1, 6):
        browser.touch("touchMove", x + 4 * n, y)
        browser.until("!busy")
    browser.touch("touchEnd")
    second = shown(browser)
    assert second[1] != first[1]
    assert middle(browser, "body") == pytest.approx((x + 20, y), abs=3)
    assert browser.run("scrollX") == 0
    browser.send("Emulation.setTouchEmulationEnabled", enabled=False)
    browser.resize(1280, 900)
    browser.press("z", 2)
    shown(browser)
    assert browser.errors == []


def test_a_stream_is_shown_and_the_page_fits(page):
    browser, _ = page
    browser.until("document.body.dataset.followed === '1'")
    assert browser.run("byId('stream-words').textContent").startswith("optimal, utilisation 0.90")
    assert browser.run("byId('stream-lost').textContent") == "slipped: rear left inner left distal"
    assert browser.run("byId('stream-table').querySelectorAll('td').length") == 12
    (cross,) = browser.run("byId('scene').data.at(-1).text")
    assert cross == "rear left, inner left, distal: slipped"
    for width in (1280, 390):
        for dark in (False, True):
            browser.resize(width, 900, dark=dark)
            browser.until("document.documentElement.scrollWidth <= innerWidth")
    # hover with the mouse itself shows the numbers of a tile
    browser.resize(1280, 900)
    browser.until("byId('scene')._fullLayout.width > 1000")
    box = browser.run("byId('scene').getBoundingClientRect().toJSON()")
    places = browser.run("data.stages[0].scene.tiles.map((t) => pixelOf(t.start))")
    told = "document.querySelector('.hovertext')?.textContent ?? ''"
    for x, y in places:  # some are hidden by rings, or by the rock
        for off in (2, 1, 0):
            browser.mouse("mouseMoved", box["x"] + x + off, box["y"] + y, held=False)
            browser.run("new Promise((go) => setTimeout(go, 60))")
        if "shear" in browser.run(told):
            break
    assert re.search("utilisation .* N, normal .* N, lateral .* N", browser.run(told))
    # who goes far stays within the axes
    browser.run("change({ ...moves, body: [-1, 0, 0, 0, 0, 0] })")
    shown(browser)
    low = browser.run("byId('scene')._fullLayout.scene.xaxis.range[0]")
    assert low < -0.45 - 1.0 - 0.2
    assert browser.errors == []
