"""Folders of keys: what is in them, who can read it, and what is refused."""

from __future__ import annotations

import datetime
import json
import ssl
import stat
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from hand_models.base import InvalidInputError
from service.commands.cli import run_command_line
from service.security import KeyFolder, Role
from service.serving import listening, zenoh_config
from tests.suite.helpers.commands import BAD_INPUT, DONE, complaint

HOSTS = ("robot.local", "192.168.1.7")


def made(path: Path, hosts: tuple[str, ...] = HOSTS, domain: int | None = None) -> KeyFolder:
    return KeyFolder.make(path, "robosimian", hosts, 7447, 30, domain)


def configuration(path: Path, name: str) -> dict:
    comment, text = (path / f"{name}.json5").read_text().split("\n", 1)
    assert comment.startswith("// ")
    return json.loads(text)


def certificate(path: Path, name: str) -> x509.Certificate:
    import base64

    tls = configuration(path, name)["transport"]["link"]["tls"]
    return x509.load_pem_x509_certificate(base64.b64decode(tls["connect_certificate_base64"]))


def subjects(path: Path, name: str) -> dict[str, list[str]]:
    rights = configuration(path, name)["access_control"]
    return {each["id"]: each["cert_common_names"] for each in rights["subjects"]}


def test_nobody_else_can_read_what_is_secret(tmp_path):
    folder = tmp_path / "keys"
    made(folder)
    modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in folder.iterdir()}
    assert modes == {
        "ca-key.pem": 0o600,
        "ca.pem": 0o644,
        "keys.json": 0o644,
        "service.json5": 0o600,
        "planner.json5": 0o600,
        "observer.json5": 0o600,
    }
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    KeyFolder(folder).add("second", Role.PLANNER, (), 30)
    for name in ("service", "second"):
        assert stat.S_IMODE((folder / f"{name}.json5").stat().st_mode) == 0o600


def test_certificates_say_who_where_and_how_long(tmp_path):
    folder = tmp_path / "keys"
    made(folder)
    authority = x509.load_pem_x509_certificate((folder / "ca.pem").read_bytes())
    now = datetime.datetime.now(datetime.UTC)
    for name, hosts in (("service", HOSTS), ("planner", ()), ("observer", ())):
        own = certificate(folder, name)
        own.verify_directly_issued_by(authority)
        (common,) = own.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
        assert common.value == name
        left = own.not_valid_after_utc - now
        assert datetime.timedelta(days=29) < left <= datetime.timedelta(days=30)
        assert own.not_valid_before_utc < now
        usages = own.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
        # a client cannot pass for a service
        assert (ExtendedKeyUsageOID.SERVER_AUTH in usages) == bool(hosts)
        named = x509.SubjectAlternativeName
        if hosts:
            found = own.extensions.get_extension_for_class(named).value
            assert found.get_values_for_type(x509.DNSName) == ["robot.local"]
            assert [*map(str, found.get_values_for_type(x509.IPAddress))] == ["192.168.1.7"]
        else:
            with pytest.raises(x509.ExtensionNotFound):
                own.extensions.get_extension_for_class(named)
    # another implementation takes it for an authority's
    ssl.create_default_context(cafile=str(folder / "ca.pem"))


@pytest.mark.parametrize(
    ("hosts", "where"),
    [
        (("localhost", "127.0.0.1"), "tls/127.0.0.1:7447"),
        (("::1",), "tls/[::1]:7447"),
        (HOSTS, "tls/0.0.0.0:7447"),
        (("robot.local", "fd00::7"), "tls/[::]:7447"),
    ],
)
def test_a_service_listens_where_its_hosts_are(hosts, where, tmp_path):
    made(tmp_path / "keys", hosts)
    config = zenoh_config(file=tmp_path / "keys" / "service.json5")
    assert listening(config) == [where]
    assert listening(zenoh_config(file=tmp_path / "keys" / "service.json5", mode="client")) == []
    there = configuration(tmp_path / "keys", "planner")["connect"]["endpoints"]
    assert there == [f"tls/[{host}]:7447" if ":" in host else f"tls/{host}:7447" for host in hosts]


def test_a_name_has_the_rights_of_its_role_until_it_is_removed(tmp_path):
    folder = tmp_path / "keys"
    made(folder)
    keys = KeyFolder(folder)
    before = configuration(folder, "service")
    assert keys.add("anna", Role.PLANNER, (), 5) == [folder / "service.json5"]
    assert keys.add("relay", Role.ROUTER, ("relay.local",), 5) == [folder / "service.json5"]
    expected = {
        "service": ["service"],
        "planner": ["planner", "anna"],
        "observer": ["observer"],
        "router": ["relay"],
    }
    for name in ("service", "relay"):
        assert subjects(folder, name) == expected
    after = configuration(folder, "service")
    assert after | {"access_control": None} == before | {"access_control": None}
    assert keys.remove("anna") == [folder / "service.json5", folder / "relay.json5"]
    assert subjects(folder, "relay") == expected | {"planner": ["planner"]}
    assert not (folder / "anna.json5").exists()
    assert [each.name for each in KeyFolder(folder).names] == [
        "service",
        "planner",
        "observer",
        "relay",
    ]


def test_a_service_s_own_settings_stay_when_a_name_is_added(tmp_path):
    folder = tmp_path / "keys"
    made(folder)
    file = folder / "service.json5"
    file.write_text(file.read_text().replace("{", '{\n  // of ours\n  "metadata": {"a": 1},', 1))
    KeyFolder(folder).add("anna", Role.OBSERVER, (), 5)
    assert configuration(folder, "service")["metadata"] == {"a": 1}
    file.write_text("{mode: 'peer'}")
    with pytest.raises(InvalidInputError, match="was edited, and is no JSON"):
        KeyFolder(folder).add("bert", Role.OBSERVER, (), 5)


def test_zenoh_takes_every_configuration(tmp_path):
    folder = tmp_path / "keys"
    keys = made(folder, domain=3)
    keys.add("relay", Role.ROUTER, ("relay.local",), 5)
    keys.add("stage", Role.PLAYER, (), 5)
    for each in keys.names:
        zenoh_config(file=folder / f"{each.name}.json5")
    rules = configuration(folder, "service")["access_control"]["rules"]
    in_ros = {rule["id"].split()[0] for rule in rules if "3/**" in rule["key_exprs"]}
    assert in_ros == {"service", "router", "ros"}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["make", "{made}"], "DIR: {made}: exists, and keys are not overwritten; give a new"),
        (["make", "{new}", "--host", "a:7447"], "--host: 'a:7447' is no name or address"),
        (["make", "{new}", "--days", "0"], "Invalid value for '--days': 0 is not in the range"),
        (["add", "{made}", "planner", "--role", "planner"], "NAME: {made}/planner.json5: exists"),
        (["add", "{made}", "../x", "--role", "planner"], "NAME: must be 1 to 64 letters"),
        (["add", "{made}", "x", "--role", "king"], "Invalid value for '--role': 'king'"),
        (["add", "{made}", "x", "--role", "router"], "--host: a router needs the hosts"),
        (["add", "{made}", "x", "--role", "planner", "--host", "a"], "--host: a planner has no"),
        (["add", "{made}", "x", "--role", "ros"], "--role: these keys are for no ROS domain"),
        (["add", "{new}", "x", "--role", "planner"], "DIR: {new}: has no keys.json"),
        (["remove", "{made}", "x"], "NAME: 'x' is not among the names: service, planner"),
        ([], "Missing command; see crux keys --help"),
        (["list", "{new}"], "DIR: {new}: has no keys.json, so it is no folder of keys; crux keys"),
    ],
)
def test_what_is_impossible_changes_nothing(words, told, tmp_path, capfd):
    folder, new = tmp_path / "keys", tmp_path / "new"
    made(folder)
    before = {path: path.read_bytes() for path in folder.iterdir()}
    names = {"made": str(folder), "new": str(new)}
    assert run_command_line(["keys", *(word.format(**names) for word in words)]) == BAD_INPUT
    assert complaint(capfd).startswith(f"crux: {told.format(**names)}")
    assert {path: path.read_bytes() for path in folder.iterdir()} == before
    assert not new.exists()


def test_without_the_authority_s_key_no_name_is_added(tmp_path, capfd):
    folder = tmp_path / "keys"
    made(folder)
    (folder / "ca-key.pem").unlink()
    assert run_command_line(["keys", "add", str(folder), "x", "--role", "observer"]) == BAD_INPUT
    assert "ca-key.pem: No such file or directory; a name is added where" in complaint(capfd)


def test_the_command_line_makes_adds_lists_and_removes(tmp_path, capfd):
    folder = str(tmp_path / "keys")
    assert run_command_line(["keys", "make", folder, "--host", "robot.local"]) == DONE
    out, err = capfd.readouterr()
    assert out.splitlines()[0].startswith(f"{folder}/service.json5: service, until 20")
    assert out.splitlines()[0].endswith(", at robot.local")
    assert "ca-key.pem makes further names" in err
    assert run_command_line(["keys", "add", folder, "anna", "--role", "player"]) == DONE
    assert f"changed: {folder}/service.json5; copy" in " ".join(capfd.readouterr().err.split())
    assert run_command_line(["keys", "list", folder, "--json", "-q"]) == DONE
    listed = json.loads(capfd.readouterr().out)
    assert [(each["name"], each["role"]) for each in listed["names"]] == [
        ("service", "service"),
        ("planner", "planner"),
        ("observer", "observer"),
        ("anna", "player"),
    ]
    assert run_command_line(["keys", "remove", folder, "anna"]) == DONE
