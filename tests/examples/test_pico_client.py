"""The client in C: what its source sends, and what a limit of 4,096 bytes lets through."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import zenoh

from service import PlanRequest
from service.answering import dispatch
from service.serving import zenoh_config
from service.wire import decode_request
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.replies import PLAN

SOURCE = ROOT / "examples" / "pico_client.c"
FRAGMENTS = 4096
"""Z_FRAG_MAX_SIZE of zenoh-pico, as it is built by default [bytes]."""

BATCH = 2048
"""Z_BATCH_UNICAST_SIZE of it [bytes]."""

TOLD = 0.5
"""How long a reply that is dropped is waited for [s]."""

SIZES = re.compile(r"(\d+) (with detail \w+|without \w+ in want)")
STRING = r'"(?:[^"\\]|\\.)*"'


def request_of(source: str) -> bytes:
    """The bytes that the compiler makes of ``REQUEST``: literals side by side, some by a macro."""
    lines = source.replace("\\\n", " ")
    macros = dict(re.findall(rf"#define (\w+) +((?:{STRING} *)+)$", lines, re.MULTILINE))
    value = re.search(rf"char REQUEST\[\] =\s*((?:(?:{STRING}|\w+)\s*)+);", lines)
    assert value is not None
    parts = [
        literal
        for each in re.findall(rf"{STRING}|\w+", value[1])
        for literal in re.findall(STRING, macros.get(each, each))
    ]
    return "".join(map(json.loads, parts)).encode()


REQUEST = request_of(SOURCE.read_text("utf-8"))


def asked(endpoint: str, request: bytes, timeout: float = PATIENCE) -> list[dict[str, Any]]:
    """The replies that a client sees which takes no more than zenoh-pico does."""
    settings = [
        f"transport/link/rx/max_message_size:{FRAGMENTS}",
        f"transport/link/tx/batch_size:{BATCH}",
    ]
    config = zenoh_config(mode="client", connect=[endpoint], multicast=False, settings=settings)
    with zenoh.open(config) as session:
        replies = session.get(PLAN, payload=request, encoding="application/json", timeout=timeout)
        told = [reply.ok or reply.err for reply in replies]
        return [
            json.loads(each.payload.to_bytes())
            for each in told
            if str(each.encoding).startswith("application/json")  # an error of zenoh's own has none
        ]


def test_the_source_asks_a_plan_that_fits() -> None:
    request = decode_request(REQUEST, PlanRequest)
    assert (request.detail, request.max_reply_bytes) == ("set_points", 4000)
    bundled = json.loads((ROOT / "service" / "examples" / "wall-300.json").read_text("utf-8"))
    assert json.loads(REQUEST)["stance"] == bundled["stance"]
    assert len(REQUEST) < FRAGMENTS
    answer = dispatch.handle(PLAN, REQUEST)
    assert answer.status == "optimal"
    assert len(answer.payload) < BATCH


def test_a_reply_of_set_points_arrives(endpoint: str) -> None:
    (reply,) = asked(endpoint, REQUEST)
    assert (reply["id"], reply["status"]) == ("pico", "optimal")
    assert [len(hand["tensions"]) for hand in reply["hands"]] == [4, 4, 4, 4]


def test_a_whole_plan_is_lost_without_a_word(endpoint: str) -> None:
    message = json.loads(REQUEST)
    del message["max_reply_bytes"]
    message["detail"] = "full"
    assert asked(endpoint, json.dumps(message).encode(), TOLD) == []


@pytest.mark.parametrize("want", [[], ["model", "clearance", "prices"]])
def test_what_does_not_fit_is_an_error_that_arrives(endpoint: str, want: list[str]) -> None:
    message = json.loads(REQUEST) | {"detail": "full", "want": want, "deadline": 100.0}
    (reply,) = asked(endpoint, json.dumps(message).encode())
    error = reply["error"]
    assert (error["kind"], error["field"]) == ("limit", "max_reply_bytes")
    taken = {words: int(size) for size, words in SIZES.findall(error["message"])}
    assert taken["with detail set_points"] < taken["with detail hands"] < FRAGMENTS
    assert [name for name in want if f"without {name} in want" not in taken] == []


def test_where_no_detail_is_given_as_much_comes_as_fits(endpoint: str) -> None:
    message = json.loads(REQUEST)
    del message["detail"]
    (reply,) = asked(endpoint, json.dumps(message).encode())
    assert len(reply["hands"][0]["wrench"]) == 6  # of detail hands


@pytest.mark.parametrize(
    ("library", "header", "flag"),
    [("zenohpico", "zenoh-pico.h", "-DZENOH_LINUX"), ("zenohc", "zenoh.h", "-DZENOH_C")],
)
def test_the_client_is_built_and_asks(
    library: str, header: str, flag: str, endpoint: str, tmp_path: Path
) -> None:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    flags = ["-std=c11", flag]
    if shutil.which("pkg-config") is not None:
        found = subprocess.run(
            ["pkg-config", "--cflags", "--libs", library],
            capture_output=True,
            text=True,
            check=False,
        )
        flags += found.stdout.split()
    probe = tmp_path / "probe.c"
    probe.write_text(f"#include <{header}>\n")
    there = subprocess.run([compiler, *flags, "-fsyntax-only", str(probe)], capture_output=True)
    if there.returncode:
        pytest.skip(f"{library} is not installed: its {header} is not found")
    program = tmp_path / "pico_client"
    subprocess.run(
        [compiler, str(SOURCE), *flags, f"-l{library}", "-o", str(program)],
        check=True,
        cwd=tmp_path,
    )
    done = subprocess.run(
        [str(program), endpoint], capture_output=True, text=True, check=True, timeout=PATIENCE
    )
    assert json.loads(done.stdout)["status"] == "optimal"
