"""Time from mouse to new colours on the live page, and of a page's first picture, in Chromium.

``python -m benchmarks.live_page``, from a checkout. A ring is dragged by the browser's own mouse
events. A move takes from its event until WebGL has drawn the plan; its parts are the question to
the server and the drawing. The peer is an empty redraw of the same scene, as finely as it is drawn
while the mouse moves: without a graphics card it is most of the time.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
from rich.console import Console

from benchmarks.load.bulk import children
from benchmarks.results import Line, Table, print_tables, span
from planner import evaluate, write_route_page
from service.answering import route_of
from service.answering.own_models import BUNDLED_ROBOTS
from service.commands.stances import read_route, read_with_text
from service.viewing import LivePlan, LiveServer, MovableStance
from tests.suite.helpers.browser import Browser

TIMED = """
const begun = new WeakMap(), spent = { whole: [], ask: [], draw: [], redraw: [] };
const pixel = new Uint8Array(4), drawn = () => { // waits for it
  const { gl } = byId("scene")._fullLayout.scene._scene.glplot;
  WebGLRenderingContext.prototype.readPixels.call(gl, 0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
};
const change0 = change, ask0 = ask, take0 = take;
change = (next, brief) => {
  if (event) begun.set(next, event.timeStamp); // what is aimed again has none
  return change0(next, brief);
};
ask = async (path, question) => {
  const start = performance.now(), found = await ask0(path, question);
  if (question.brief) spent.ask.push(performance.now() - start);
  return found;
};
take = async (answer, brief) => {
  const start = performance.now(), asked = sound;
  await take0(answer, brief);
  if (!brief) return;
  drawn();
  if (!begun.has(asked)) return;
  const now = performance.now();
  spent.draw.push(now - start); spent.whole.push(now - begun.get(asked));
};
async function redraws(count) {
  hurry(true);
  for (let n = 0; n < count; n++) {
    const start = performance.now();
    byId("scene")._fullLayout.scene._scene.glplot.redraw(); await frame(); drawn();
    spent.redraw.push(performance.now() - start);
  }
  hurry(false);
}
"""

SHOWN = """
new MutationObserver((_, watch) => {
  if (document.body?.dataset.shown === undefined) return;
  window.shownAt ??= performance.now(); watch.disconnect();
}).observe(document, { subtree: true, childList: true, attributes: true });
"""


def processor_time(browser: Browser) -> dict[str, float]:
    """Processor time so far of this process, which plans, and of all of the browser [s]."""
    ticks = 0
    for each in (browser.process_id, *children(browser.process_id)):
        with suppress(FileNotFoundError):  # one that has just ended
            words = Path(f"/proc/{each}/stat").read_text().rpartition(")")[2].split()
            ticks += int(words[11]) + int(words[12])  # user and system
    return {"server": time.process_time(), "browser": ticks / os.sysconf("SC_CLK_TCK")}


def dragging(browser: Browser, limb: str, count: int, pause: Callable[[], object]) -> None:
    """Drag a ring to and fro, so many mouse events."""
    x, y = browser.middle(f"[data-limb={limb}]")
    browser.mouse("mousePressed", x, y)
    for n in range(1, count + 1):
        off = 20.0 * np.sin(0.3 * n)
        browser.mouse("mouseMoved", x + off, y + 0.3 * off + 4.0)
        pause()
    browser.mouse("mouseReleased", x + off, y)
    browser.until("!busy && !wanted && !document.body.classList.contains('stale')")


def row(what: str, seconds: list[float], more: str = "") -> Line:
    """Median, 95 % quantile and worst of some times [s]."""
    cells = (span(float(np.quantile(seconds, part))) for part in (0.5, 0.95, 1.0))
    return Line(f"{what} ({len(seconds)})", (*cells, more))


def live(stance: str, limb: str, count: int, folder: Path) -> Table:
    """Times of moves on the live page of a stance."""
    request, given = read_with_text(stance)
    plan = LivePlan(MovableStance(request, BUNDLED_ROBOTS), stance, folder / "moved.json", given)
    plan.prepare()
    with LiveServer(plan, 0) as server, Browser(folder / f"{stance}-{limb}") as browser:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        browser.open(server.address)
        browser.run("new Promise((go) => setTimeout(go, 2000))")
        browser.run(TIMED)
        dragging(browser, limb, 10, lambda: browser.until("!busy"))  # warm
        rows = []
        for what, pause in (
            ("one by one", lambda: browser.until("!busy && !wanted")),
            ("60 mouse events a second", lambda: time.sleep(1 / 60)),
        ):
            browser.run("for (const each of Object.values(spent)) each.length = 0")
            before = processor_time(browser)
            dragging(browser, limb, count if "one" in what else 5 * count, pause)
            used = {k: v - before[k] for k, v in processor_time(browser).items()}
            browser.run("redraws(40)")
            seconds = {k: [1e-3 * t for t in v] for k, v in browser.run("spent").items()}
            shares = ", ".join(f"{k} {span(v / len(seconds['whole']))}" for k, v in used.items())
            rows += [
                row(f"**{what}: from mouse to new colours**", seconds["whole"], shares),
                row("of it the question to the server", seconds["ask"]),
                row("of it the drawing", seconds["draw"]),
                row("peer: an empty redraw of the scene", seconds["redraw"]),
            ]
        coarse = browser.run("slow")
        server.shutdown()
        thread.join()
    note = "Processor time is that of all processes, per plan that was drawn. "
    note += f"Drawn {'coarsely' if coarse else 'finely'} while the mouse moves."
    columns = ("p50", "p95", "worst", "processor time")
    return Table(f"{stance}: {limb} dragged", columns, rows, note)


def first_picture(route: str, folder: Path, count: int) -> Table:
    """Size of a climb's page, and time from opening it until it is drawn."""
    file = folder / "route.html"
    write_route_page(evaluate(route_of(read_route(route)), 1), file)
    scenes, seconds = [], []
    with Browser(folder / "profile") as browser:
        browser.send("Page.addScriptToEvaluateOnNewDocument", source=SHOWN)
        before = processor_time(browser)["browser"]
        for _ in range(count):
            browser.open(file.as_uri())
            drawn = browser.run("performance.getEntriesByName('scene drawn')[0].startTime")
            scenes.append(1e-3 * drawn)
            seconds.append(1e-3 * browser.run("shownAt"))
        used = (processor_time(browser)["browser"] - before) / count
    title = f"page of {route}: {file.stat().st_size / 1e6:.1f} MB"
    rows = [
        row("until the scene is drawn: the first picture", scenes),
        row("until slices and margins are drawn, too", seconds, f"browser {span(used)}"),
    ]
    note = "The first of these times is that of a browser that has just started."
    return Table(title, ("p50", "p95", "worst", "processor time"), rows, note)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stance", default="wall-300")
    parser.add_argument("--route", default="six-moves")
    parser.add_argument("--count", type=int, default=60, help="moves that are timed")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        where = Path(folder)
        tables = [live(asked.stance, limb, asked.count, where) for limb in ("body", "front_right")]
        tables.append(first_picture(asked.route, where, 5))
    print_tables(tables, Console(width=140))


if __name__ == "__main__":
    main()
