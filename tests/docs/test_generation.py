"""Pages of the reference that are made from the code have all of it."""

from __future__ import annotations

import json
import re
import sys
from importlib import import_module
from inspect import isclass, isroutine

import jsonschema
import msgpack
import msgspec
import pytest

from hand_models.parameters import hand_table, surface_table
from service.answering import answer_plan
from service.requests import WrenchRequest
from service.wire import Format, schema
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.requests import plan_request


@pytest.fixture(autouse=True)
def pages_of_docs(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    yield
    for name in [name for name in sys.modules if name.partition(".")[0] == "generation"]:
        del sys.modules[name]


def test_every_message_is_told_and_every_link_leads_to_one():
    text = import_module("generation.messages").message_page()
    labels = re.findall(r"^\((message-.*)\)=$", text, re.MULTILINE)
    assert len(labels) == len({*labels}) == len(schema()["$defs"])
    assert {*re.findall(r"\(#(message-[^)]*)\)", text)} <= {*labels}
    for part in schema()["$defs"].values():
        assert all(f"| `{field}` |" in text for field in part["properties"])


def test_every_number_of_hand_and_rock_is_told_with_its_unit_and_kind():
    text = import_module("generation.parameters").parameter_page()
    for table in (hand_table(), surface_table()):
        for _, name, quantity in table:
            row = rf"^\| `{re.escape(name)}` \| .* \| {re.escape(quantity.unit)} \|"
            assert re.search(rf"{row} {quantity.source} \|", text, re.MULTILINE), name


@pytest.mark.parametrize("package", ["hand_models", "planner", "service"])
def test_every_class_and_function_of_a_package_is_on_its_page(package: str):
    index = import_module(package)
    page = import_module("generation.api").api_pages()[f"api/{package}.rst"]
    told = {*re.findall(r"^\.\. auto(?:class|function):: (\w+)$", page, re.MULTILINE)}
    values = {name: getattr(index, name) for name in index.__all__}
    assert told == {name for name, value in values.items() if isroutine(value) or isclass(value)}


def leaves(value: object, path: str = "") -> list[tuple[str, object]]:
    """The values of a decoded message with their paths, and of arrays and maps the sizes."""
    if isinstance(value, dict):
        inner = [leaves(each, f"{path}.{name}" if path else name) for name, each in value.items()]
    elif isinstance(value, list):
        inner = [leaves(each, f"{path}[{i}]") for i, each in enumerate(value)]
    else:
        return [(path, value)]
    return [(path, len(value)), *(leaf for each in inner for leaf in each)]


def check_layout(payload: bytes) -> None:
    """The annotated bytes are the message that another decoder reads, each byte once."""
    found = import_module("generation.layouts").items(payload)
    assert [(item.path, item.value) for item in found] == leaves(msgpack.unpackb(payload))
    assert [item.start for item in found] == [0, *(item.end for item in found[:-1])]
    assert found[-1].end == len(payload)


def test_messages_are_annotated_as_another_decoder_reads_them():
    wrench = WrenchRequest(v=1, number=2**40, time=-1.5, body_wrench=(1e300, 0, -3, 200, 7e4, -300))
    check_layout(Format.MSGPACK.encode(wrench))
    check_layout(Format.MSGPACK.encode(answer_plan(plan_request())))
    odd = {"": [True, False, None, -33, -(2**31), 2**63, "é" * 40, "x" * 300], "a": {}, "b": []}
    odd["c"] = [*list(range(20)), {str(i): i for i in range(20)}]
    check_layout(msgpack.packb(odd))
    with pytest.raises(ValueError, match="byte 0xc1 at 0"):
        check_layout(b"\xc1")


@pytest.mark.slow
def test_the_bytes_of_the_keys_are_messages():
    pages = import_module("generation.transcripts").key_pages()
    layouts = import_module("generation.layouts")
    page = layouts.layout_page(pages)
    for name, heading in layouts.SHOWN.items():
        payload = pages[f"bytes/{name}.msgpack"]
        check_layout(payload)
        assert f"## {heading}\n\n{len(payload):,} bytes" in page
    assert "hands[0].tensions[3]: float64" in page
    assert "body_wrench[5]: " in page
    whole = schema()
    payloads = {name: content for name, content in pages.items() if name.startswith("bytes/")}
    # a request and a reply, in two formats, of each key where queries or wrenches get answers
    assert len(payloads) == 10 * 2 * 2
    told = "\n".join(content.decode() for name, content in pages.items() if "keys/" in name)
    assert all(f"- Key: `{key}`\n" in told for key in whole["keys"])
    for name, content in payloads.items():
        if name.endswith(".json"):
            message = json.loads(content)
            jsonschema.validate(message, whole)
            other = msgspec.msgpack.decode(payloads[name.removesuffix("json") + "msgpack"])
            assert other.keys() == message.keys()
            assert f"{len(content):,} bytes" in pages[_page(name)].decode()


def _page(name: str) -> str:
    return f"keys/{re.split('[/-]', name)[1]}.md"
