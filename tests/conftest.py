"""Settings of all tests, and what tests of different packages need."""

import functools
import gc
import importlib
import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from pathlib import Path

import pytest
from hypothesis import settings

# what a shell has in the background ignores it, and so would commands that tests interrupt
signal.signal(signal.SIGINT, signal.default_int_handler)

# commands that tests start read compiled modules, as installed ones do, whatever the shell says
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=15)
settings.load_profile("repeatable")


LONG = (
    *("test_golden.py", "test_climb_command.py", "test_closing.py", "test_blocks.py"),
    *("test_advice.py", "test_moved_by_micrometres.py", "test_moved_rock.py", "test_widths.py"),
    *("test_robust_load_factor.py", "test_search_benchmarks.py", "test_plain_opening.py"),
    *("test_climb.py", "test_calibrate.py", "test_reliability.py", "test_random_plans.py"),
    *("test_many_questions.py", "test_reply_sizes.py", "test_open_loop.py", "test_spread.py"),
    *("test_seats_on_walls.py", "test_field_names.py", "test_benchmark_table.py"),
    *("test_compliant_plan.py", "test_contact_rest.py", "test_detail.py", "test_survival.py"),
    *("test_ways_of_asking.py", "test_route.py", "test_network.py", "test_cli.py"),
    *("test_dispatcher.py", "test_service.py", "test_com_region.py", "test_less_tension.py"),
)
"""Files whose tests take longest together, which one process each goes through."""

# looking for garbage among all that is imported, compiled and collected takes a tenth of it
gc.disable()

STARTED = time.monotonic()

COLLECT = (sys.executable, "-m", "pytest", "--collect-only", "-q", "-n", "0")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option for machines on which a run has to end in time."""
    told = "skip the tests that have not begun this many seconds after the start, and say which"
    parser.addoption("--skip-after", type=float, metavar="SECONDS", help=told)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test for which no time is left."""
    most = item.config.getoption("--skip-after")
    if most is not None and time.monotonic() - STARTED > most:
        pytest.skip(f"no time left after {most:g} s")


def pytest_configure(config: pytest.Config) -> None:
    """Compile and rewrite once, on all cores, what each process of tests would do for itself."""
    if hasattr(config, "workerinput") or config.option.collectonly:
        return
    modules = _uncompiled()
    if not modules:
        return
    with ProcessPoolExecutor(min(len(modules) + 1, os.cpu_count() or 1)) as pool:
        done = [pool.submit(importlib.import_module, module) for module in modules]
        done.append(pool.submit(subprocess.run, COLLECT, capture_output=True))
        for each in done:
            each.exception()  # that of a test module is its collection's to tell


def _uncompiled() -> list[str]:
    """Return modules that numba has not compiled since they changed, those of others first."""
    sources = [
        path
        for package in ("hand_models", "planner", "service")
        for path in Path(find_spec(package).origin).parent.rglob("*.py")
        if "@compiled(" in path.read_text()
    ]
    return [
        ".".join(path.relative_to(path.parents[2]).with_suffix("").parts)
        for path in sorted(sources, key=lambda path: (path.stem == "closing", path))
        if not any(
            kept.stat().st_mtime > path.stat().st_mtime
            for kept in (path.parent / "__pycache__").glob(f"{path.stem}.*.nbi")
        )
    ]


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what takes long, so that no process is left alone with it at the end.

    That is files of which it is known, and of others those with the most tests.
    """
    tests = Counter(item.path for item in items)
    places = {name: place for place, name in enumerate(LONG)}
    items.sort(key=lambda item: (places.get(item.path.name, len(LONG)), -tests[item.path]))


@pytest.fixture
def alone():
    """A zenoh session that is its own whole network."""
    from tests.suite.helpers.served import lonely_session

    with lonely_session() as opened:
        yield opened


@pytest.fixture(scope="session")
def rock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """File of a scan: half a metre of a rough wall."""
    import trimesh

    from tests.suite.helpers.rocks import fractal_wall

    path = tmp_path_factory.mktemp("rock") / "wall.ply"
    trimesh.Trimesh(*fractal_wall(3, size=0.5, count=101), process=False).export(path)
    return path


@pytest.fixture
def few_places(monkeypatch: pytest.MonkeyPatch) -> None:
    """Close hands at 8 places about their own instead of 128 where "robust" is asked for."""
    from hand_models.fixed_wrist import ScatterSettings, robustness

    few = functools.partial(robustness, draws=8)
    monkeypatch.setattr("service.answering.hand_spaces.robustness", few)
    monkeypatch.setattr("planner.solving.robust.SCATTER_SETTINGS", ScatterSettings(places=8))


@pytest.fixture
def few_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plan every third of the samples of parameters where a spread is asked for."""
    from planner.question import drawn_hands

    def few(*given, **more):
        return drawn_hands(*given, **more)[::3]

    monkeypatch.setattr("planner.solving.spread.drawn_hands", few)


@pytest.fixture
def few_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plan 25 changed stances instead of 100 where advice is asked for."""
    from planner.advice import advising

    few = functools.partial(advising.advise, plans=25)
    monkeypatch.setattr(advising, "advise", few)


def draw_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw nothing into the pictures of a route, which take longer than its plans."""
    from matplotlib.figure import Figure

    for name in ("draw_route", "draw_climb", "draw_support"):
        monkeypatch.setattr(f"planner.pictures.report.{name}", lambda *_: Figure((1.0, 1.0)))


@pytest.fixture
def blank_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw nothing into the pictures of a route."""
    draw_nothing(monkeypatch)


@pytest.fixture(scope="module")
def blank_pictures_of_all() -> Iterator[None]:
    """Draw nothing into the pictures of a route in all tests of a module."""
    with pytest.MonkeyPatch.context() as patched:
        draw_nothing(patched)
        yield


@pytest.fixture
def stance_file(tmp_path: Path):
    """Writes a request to a file, and returns its path."""

    def write(request: object, name: str = "stance.json") -> str:
        path = tmp_path / name
        path.write_text(request if isinstance(request, str) else json.dumps(request))
        return str(path)

    return write


def pytest_collection_finish() -> None:
    """Look for what is no longer used seldom, and not among what is loaded by now."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 20, 20)
    gc.enable()
