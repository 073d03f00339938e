"""Pages in headless Chromium: they draw, they answer, and their console has no error."""

from __future__ import annotations

import json
import math
import re
import subprocess
from base64 import b64decode
from dataclasses import replace
from html import unescape
from itertools import combinations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from planner import evaluate
from planner.advice.changes import pose_message
from planner.pages import write_plan_page, write_route_page
from planner.result import Advice
from service.answering import route_of
from service.commands.cli import run_command_line
from service.commands.stances import read_route
from tests.suite.helpers.browser import PROGRAM as BROWSER, Browser
from tests.suite.helpers.commands import DONE, result
from tests.suite.helpers.pictures import answered

HEADLESS = [
    "--headless", "--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader",
    "--window-size=1280,900", "--enable-logging=stderr", "--v=0", "--virtual-time-budget=30000",
]  # fmt: skip

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(BROWSER is None, reason="Chromium is not installed"),
]

PRESSED = """
<script>
const seen = {};
const settled = async (ready) => { while (!ready()) await new Promise((r) => setTimeout(r, 20)); };
(async () => {
  await settled(() => document.body.dataset.shown !== undefined);
  seen.traces = document.getElementById("scene").data.length;
  seen.drawn = document.querySelectorAll("#slices .main-svg").length > 0;
  seen.hover = document.getElementById("scene").data.flatMap((trace) => trace.text ?? []);
  seen.narrow = document.documentElement.scrollWidth <= innerWidth;
  const column = () => [...document.querySelectorAll("#tables tbody")].at(0).rows;
  document.querySelectorAll("#tables th button")[1].click();
  seen.sorted = [...column()].map((row) => Number(row.cells[1].textContent));
  seen.sort = document.querySelectorAll("#tables th")[1].ariaSort;
  STEPS
  const told = { id: "seen", textContent: JSON.stringify(seen) };
  document.body.append(Object.assign(document.createElement("pre"), told));
})();
</script></body>"""

STEPS = """
  const slider = document.getElementById("stage");
  slider.value = 0; slider.dispatchEvent(new Event("input"));
  await settled(() => document.body.dataset.shown === "0");
  seen.first = document.getElementById("where").textContent;
  document.getElementById("after").click();
  await settled(() => document.body.dataset.shown === "1");
  seen.second = document.getElementById("where").textContent;
  seen.bars = document.querySelectorAll("#margin .bars .point").length;
"""

ADVISED = """
  const button = () => document.querySelector("#notes li button");
  button().focus(); button().click();
  await settled(() => button().textContent === "hide" && document.activeElement === button());
  seen.advised = document.getElementById("scene").data.length;
  seen.button = document.activeElement.textContent;
  button().click();
  await settled(() => button().textContent === "draw" && document.activeElement === button());
  seen.again = document.activeElement.textContent;
"""


PLACES = """
  const axes = document.getElementById("scene")._fullLayout.scene;
  const around = (limits) => data.groups.every(({ places }) => places.every((place) =>
    place.every((c, k) => limits[k][0] < c && c < limits[k][1])));
  seen.within = around(["x", "y", "z"].map((c) => axes[c + "axis"].range));
  // also of a page with the rock alone, as there is without a climb
  for (const { scene } of data.stages) {
    scene.surfaces = scene.surfaces.filter((surface) => surface.kind === "rock");
    scene.arrows = [];
  }
  seen.within &&= around(bounds());
  const bar = document.querySelector("#scene .cbfills").getBoundingClientRect();
  seen.below = axes._scene.container.getBoundingClientRect().bottom <= bar.top;
"""


def opened(file, steps=""):
    """What a browser shows of a page once its buttons were pressed, and what was seen meanwhile."""
    text = file.read_text("utf-8").replace("</body>", PRESSED.replace("STEPS", steps))
    file.write_text(text, "utf-8")
    done = subprocess.run(
        [BROWSER, *HEADLESS, "--dump-dom", file.as_uri()],
        capture_output=True, text=True, timeout=300, check=True,
    )  # fmt: skip
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    assert [line for line in console if re.search("error|uncaught", line, re.IGNORECASE)] == []
    found = re.search(r'<pre id="seen">(.*?)</pre>', done.stdout)[1]
    return json.loads(unescape(found)), done.stdout


def test_a_plan_is_drawn_and_its_tables_sort(tmp_path):
    question, plan = answered("solved")
    body = replace(question.stance.body, position=question.stance.body.position + 0.02)
    words = "<img src=x onerror='seen.broken = true'>"
    changes = {"stance.body": pose_message(body)}
    advice = Advice("body", [], words, changes, 1.0, "optimal", math.nan, None, True)
    advised = replace(plan, advice=(advice,), warnings=(words,))
    write_plan_page(advised, question, tmp_path / "plan.html", "a wall")
    seen, page = opened(tmp_path / "plan.html", ADVISED)
    assert plan.reason in page
    assert "<canvas" in page
    assert seen["drawn"]
    assert seen["narrow"]
    for hand in plan.hands:
        for tile, (shear, normal, _) in zip(hand.tiles, hand.loads, strict=True):
            told = f"shear {shear:.1f} N, normal {normal:.1f} N".replace("-0.0", "-?0.0")
            name = f"{hand.limb}, {tile.finger}, {tile.phalanx}<br>".replace("_", " ")
            found = any(name in text and re.search(told, text) for text in seen["hover"])
            assert found == (tile.contact != "none")
    # of rock, palms, body, links, lines, dots, tiles, forces; then of the advice
    assert (seen["traces"], seen["advised"]) == (15, 20)
    assert (seen["button"], seen["again"]) == ("hide", "draw")
    assert "broken" not in seen
    assert page.count("utilisation –") == 1
    used = sorted((round(hand.utilisation, 2) for hand in plan.hands), reverse=True)
    assert (seen["sort"], seen["sorted"]) == ("descending", used)


def test_a_search_is_drawn_on_its_rock_with_its_placements(tmp_path, capfd):
    file, folder = tmp_path / "climb.html", tmp_path / "climb"
    asked = ["climb", "small-wall", "--from", "height:0.8", "--to", "height:0.8"]
    asked += ["--stand-off", "0.6", "--spacing", "0.3", "--body-spacing", "0.3", "--workers", "1"]
    assert (
        run_command_line([*asked, "-o", str(folder), "--html", str(file), "--spread", "--json"])
        == DONE
    )
    reply = result(capfd)
    assert file.stat().st_size < 6e6
    text = file.read_text("utf-8")
    data = json.loads(re.search(r'id="data">(.*?)</script>', text)[1])
    wall = np.load(folder / "wall.npz")
    places, bodies = (group["places"] for group in data["groups"])
    np.testing.assert_allclose(places, wall["place_pose"][:, :, 3], atol=6e-5)
    assert len(bodies) == len(wall["body_pose"])
    assert (data["bound"], data["crux"]) == (reply["bound"], reply["deciding"]["stage"])
    assert min(stage["load_factor"] for stage in data["stages"]) == reply["least"]
    crux = data["stages"][data["crux"]]
    spread = reply["deciding"]["spread"]
    assert crux["spread"]["utilisation"] == [spread["utilisation"][k] for k in ("low", "high")]
    assert crux["samples"]["rows"][0][1] == spread["holds"]
    assert any("without the palms'" in sentence for sentence in crux["sure"])
    assert all(stage.get("advice") is None for stage in data["stages"] if stage is not crux)
    # another placement is planned, and its palm drawn there
    moved = [each for each in crux["advice"] if "at placement" in each["sentence"]]
    assert moved
    for each in moved:
        factor, limb, place = re.match(
            r"load factor ([\d.]+) in this stage with (\w+) at placement (\d+)", each["sentence"]
        ).groups()
        assert float(factor) > reply["least"]
        assert each["holds"]
        (move,) = (m for m in each["moves"] if m["text"].startswith(limb.replace("_", " ")))
        np.testing.assert_allclose(np.mean(move["to"], axis=0), places[int(place)], atol=3e-4)
        assert move["from"] != move["to"]
    # the rock is whole in each stage, and once in the page
    surfaces = [each for stage in data["stages"] for each in stage["scene"]["surfaces"]]
    rocks = [each for each in surfaces if each["kind"] == "rock"]
    assert len(rocks) == len(data["stages"])
    assert all(rock == rocks[0] for rock in rocks)
    # the rock is under the palm of each placement
    corners = np.frombuffer(b64decode(data["meshes"][rocks[0]["corners"]]), "<f4").reshape(-1, 3)
    away, _ = cKDTree(corners).query(wall["place_pose"][:, :, 3])
    assert away.max() < 0.05
    seen, page = opened(file, ADVISED + PLACES)
    assert "the bound is about the placements" in page
    assert (seen["within"], seen["below"]) == (True, True)
    assert seen["traces"] == 15 + 2
    assert (seen["button"], seen["again"]) == ("hide", "draw")


def test_a_climb_is_drawn_stage_by_stage(tmp_path):
    found, file = evaluate(route_of(read_route("knobs")), 1), tmp_path / "route.html"
    write_route_page(found, file)
    assert file.stat().st_size < 6e6
    seen, _ = opened(file, STEPS)
    count = len(found.stages)
    assert seen["first"] == f"stage 0 of {count - 1}: start"
    assert seen["second"].startswith(f"stage 1 of {count - 1}: 1 ")
    assert seen["bars"] == count
    assert seen["drawn"]


LABELS = """[...document.querySelectorAll("#labels .label")].map((each) => ({
  text: each.textContent, title: each.title, folded: each.classList.contains("folded"),
  box: each.getBoundingClientRect().toJSON() }))"""

CROWD = """
  drawnAdvice = null;
  const { labels: all } = data.stages[0].scene, { place } = all[0];
  for (let n = 0; n < 150; n++) all.push({ place: place.map((c) => c + 1e-3 * n), text: `${n}th` });
  show()"""


def overlaps(labels):
    """Pairs of the texts of labels whose boxes have more in common than the rounding of places."""
    pairs = combinations([each for each in labels if not each["folded"]], 2)
    sides = ("left", "right"), ("top", "bottom")
    return [
        (one["text"], other["text"])
        for one, other in pairs
        if all(
            min(one["box"][high], other["box"][high]) - max(one["box"][low], other["box"][low])
            > 0.2
            for low, high in sides
        )
    ]


@pytest.mark.parametrize(("width", "dark"), [(1280, False), (390, True)])
def test_labels_never_lie_on_each_other_and_important_ones_stay(tmp_path, width, dark):
    question, plan = answered("solved")
    body = replace(question.stance.body, position=question.stance.body.position + 0.02)
    changes = {"stance.body": pose_message(body)}
    advice = Advice("body", [], "shift", changes, 1.0, "optimal", math.nan, None, True)
    file = tmp_path / "plan.html"
    write_plan_page(replace(plan, advice=(advice,)), question, file, "a wall")
    limbs = {hand.limb.replace("_", " ") for hand in plan.hands}
    with Browser(tmp_path / "profile", width) as browser:
        browser.resize(width, 900, dark=dark)
        browser.open(file.as_uri())
        placed = "placedFor && labels.every((each) => each.element.style.transform)"
        for press in ("views button:nth-child(2)", "views button:nth-child(3)", "notes li button"):
            browser.run(f"document.querySelector('#{press}').click()")
            browser.until("drawnAdvice === 0" if "notes" in press else "!drawnAdvice")
            browser.until(placed)
            found = browser.run(LABELS)
            assert overlaps(found) == []
            shown = {each["text"].split("\n")[0] for each in found if not each["folded"]}
            assert shown >= limbs | {"B"}
        scene = browser.run("byId('scene').getBoundingClientRect().toJSON()")
        for each in found:
            assert scene["left"] <= each["box"]["left"]
            assert each["box"]["right"] <= scene["right"]
        # a crowd: those of hands that carry stay, the others say on hover what they are
        browser.run(CROWD)
        browser.until(placed)
        found = browser.run(LABELS)
        folded = [each for each in found if each["folded"]]
        assert folded
        assert all(each["title"] == each["text"] for each in folded)
        assert not limbs & {each["text"].split("\n")[0] for each in folded}
        assert overlaps(found) == []
        assert browser.errors == []
