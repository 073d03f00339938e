"""Pages of the reference that are made from the code have all of it."""

from __future__ import annotations

import json
import re
import sys
from importlib import import_module
from inspect import isclass, isroutine

import jsonschema
import msgspec
import pytest

from hand_models.parameters import hand_table, surface_table
from service.wire import schema
from tests.suite.helpers.checkout import ROOT


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


@pytest.mark.slow
def test_the_bytes_of_the_keys_are_messages():
    pages = import_module("generation.transcripts").key_pages()
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
