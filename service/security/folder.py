"""Write a folder of keys: an authority, and a zenoh configuration for each that it vouches for."""

from __future__ import annotations

import base64
import datetime
import os
import re
from collections.abc import Sequence
from ipaddress import ip_address
from pathlib import Path
from typing import Any, Final

import msgspec

from hand_models.base import InvalidInputError
from service.security.authority import Authority
from service.security.rights import Role, access_control

__all__ = ["KeyFolder", "NamedKey"]

INDEX_FILE, AUTHORITY_FILE, AUTHORITY_KEY = "keys.json", "ca.pem", "ca-key.pem"
AUTHORITY_YEARS: Final = 10
"""How long an authority is valid, and the longest that a certificate can be."""
MODES_BY_ROLE: Final = {Role.SERVICE: "peer", Role.ROUTER: "router"}
"""Zenoh mode of the roles to which others connect."""
SECRET_MODE, PUBLIC_MODE = 0o600, 0o644


class NamedKey(msgspec.Struct, frozen=True, kw_only=True):
    """A certificate of a folder.

    Attributes
    ----------
    name : str
        Common name of the certificate, and name of its files.
    role : Role
        What its owner may do.
    hosts : tuple of str
        Names and addresses at which its owner listens; empty for clients.
    until : datetime
        End of its validity.
    """

    name: str
    role: Role
    hosts: tuple[str, ...]
    until: datetime.datetime


class _Index(msgspec.Struct, kw_only=True):
    """Index of a folder: robot, port, ROS domain, and all certificates."""

    v: int = 1
    robot: str
    port: int
    domain: int | None
    names: list[NamedKey] = []


class KeyFolder:
    """Folder with an authority, its key, and a configuration of zenoh for each certificate.

    A configuration has certificate and key inside it, so it is one file to copy. Those of services
    and routers have the rights of all names, by their roles.

    Parameters
    ----------
    path : Path
        Folder that `make` has made.

    Raises
    ------
    InvalidInputError
        If it is no such folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._index = msgspec.json.decode((path / INDEX_FILE).read_bytes(), type=_Index)
        except OSError:
            raise InvalidInputError(
                f"{path}: has no {INDEX_FILE}, so it is no folder of keys; crux keys make {path} "
                "makes one",
                field="DIR",
            ) from None
        except msgspec.MsgspecError as error:
            raise InvalidInputError(f"{path / INDEX_FILE}: {error}", field="DIR") from None

    @property
    def names(self) -> tuple[NamedKey, ...]:
        """All certificates, the oldest first."""
        return tuple(self._index.names)

    @classmethod
    def make(
        cls, path: Path, robot: str, hosts: Sequence[str], port: int, days: int, domain: int | None
    ) -> KeyFolder:
        """Make a folder with an authority, a service, a planner and an observer.

        Parameters
        ----------
        path : Path
            Folder to make, or an empty one.
        robot : str
            Name of the robot whose keys the rights are for.
        hosts : sequence of str
            Names and addresses of the service's machine for its clients.
        port : int
            TCP port of the service.
        days : int
            Validity of the certificates [days].
        domain : int or None
            ROS domain for whose nodes there is a certificate, too; None for none.

        Raises
        ------
        InvalidInputError
            If the folder has files already, or a host is none.
        """
        if path.exists() and (not path.is_dir() or any(path.iterdir())):
            raise InvalidInputError(
                f"{path}: exists, and keys are not overwritten; give a new folder, or add a name "
                f"with crux keys add {path} NAME --role ROLE",
                field="DIR",
            )
        for host in hosts:
            _check_host(host)
        end = _now() + datetime.timedelta(days=365 * AUTHORITY_YEARS)
        authority, key = Authority.made(f"crux {robot}", end)
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        _write(path / AUTHORITY_KEY, key, SECRET_MODE)
        _write(path / AUTHORITY_FILE, authority.certificate, PUBLIC_MODE)
        index = _Index(robot=robot, port=port, domain=domain)
        _write(path / INDEX_FILE, msgspec.json.encode(index), PUBLIC_MODE)
        folder = cls(path)
        folder.add("service", Role.SERVICE, hosts, days)
        folder.add("planner", Role.PLANNER, (), days)
        folder.add("observer", Role.OBSERVER, (), days)
        if domain is not None:
            folder.add("ros", Role.ROS, (), days)
        return folder

    def add(self, name: str, role: Role, hosts: Sequence[str], days: int) -> list[Path]:
        """Make a certificate and its configuration, and give its name the rights of its role.

        Parameters
        ----------
        name : str
            Common name.
        role : Role
        hosts : sequence of str
            Names and addresses at which a service or a router listens; empty for others.
        days : int
            Validity of the certificate [days].

        Returns
        -------
        list of Path
            Configurations of services and routers that have changed.

        Raises
        ------
        InvalidInputError
            If the name is taken or impossible, a host is none, the authority's key is not there,
            or a configuration was edited so that it is no JSON.
        """
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", name):
            raise InvalidInputError(
                f"must be 1 to 64 letters, digits, '_', '.' or '-', got {name!r}", field="NAME"
            )
        if self._file(name).exists() or any(each.name == name for each in self.names):
            raise InvalidInputError(
                f"{self._file(name)}: exists, and keys are not overwritten; take another name, or "
                f"first crux keys remove {self.path} {name}",
                field="NAME",
            )
        if role is Role.ROS and self._index.domain is None:
            raise InvalidInputError(
                "these keys are for no ROS domain; make others with crux keys make DIR --domain N",
                field="--role",
            )
        if bool(hosts) != (role in MODES_BY_ROLE):
            need = (
                "needs the hosts at which it listens" if role in MODES_BY_ROLE else "has no hosts"
            )
            raise InvalidInputError(f"a {role} {need}", field="--host")
        for host in hosts:
            _check_host(host)
        until = _now() + datetime.timedelta(days=days)
        added = NamedKey(name=name, role=role, hosts=tuple(hosts), until=until)
        made = self._authority().certify(name, hosts, until)
        tls = {
            "root_ca_certificate_base64": _base64((self.path / AUTHORITY_FILE).read_bytes()),
            "enable_mtls": True,
            "verify_name_on_connect": True,
            "close_link_on_expiration": True,
        }
        for use in ("connect", "listen") if hosts else ("connect",):
            tls[f"{use}_certificate_base64"] = _base64(made.certificate)
            tls[f"{use}_private_key_base64"] = _base64(made.key)
        config: dict[str, Any] = {
            "scouting": {"multicast": {"enabled": False}},
            "transport": {"link": {"protocols": ["tls"], "tls": tls}},
        }
        if hosts:
            where = [f"tls/{_listening_address(hosts)}:{self._index.port}"]
            config |= {
                "mode": MODES_BY_ROLE[role],
                # none in client mode
                "listen": {"endpoints": dict.fromkeys(MODES_BY_ROLE.values(), where)},
            }
        else:
            services = [each for each in self.names if each.role is Role.SERVICE]
            there = [_bracketed(host) for each in services for host in each.hosts]
            endpoints = [f"tls/{host}:{self._index.port}" for host in there]
            config |= {"mode": "client", "connect": {"endpoints": endpoints}}
        self._index.names.append(added)
        changed = self._with_rights()
        if hosts:
            config["access_control"] = self._rights()
        _write(self._file(name), self._text(added, config), SECRET_MODE)
        self._write_all(changed)
        return list(changed)

    def remove(self, name: str) -> list[Path]:
        """Remove a name's configuration, and its rights from those of services and routers.

        Returns
        -------
        list of Path
            Configurations of services and routers that have changed.

        Raises
        ------
        InvalidInputError
            If there is no such name, or a configuration was edited so that it is no JSON.
        """
        kept = [each for each in self.names if each.name != name]
        if len(kept) == len(self.names):
            known = ", ".join(each.name for each in self.names)
            raise InvalidInputError(f"{name!r} is not among the names: {known}", field="NAME")
        self._index.names = kept
        changed = self._with_rights()
        self._write_all(changed)
        self._file(name).unlink(missing_ok=True)
        return list(changed)

    def _authority(self) -> Authority:
        try:
            certificate = (self.path / AUTHORITY_FILE).read_bytes()
            return Authority(certificate, (self.path / AUTHORITY_KEY).read_bytes())
        except OSError as error:
            raise InvalidInputError(
                f"{error.filename}: {error.strerror}; a name is added where the authority's "
                f"{AUTHORITY_FILE} and {AUTHORITY_KEY} are",
                field="DIR",
            ) from None

    def _file(self, name: str) -> Path:
        return self.path / f"{name}.json5"

    def _rights(self) -> dict[str, Any]:
        names: dict[Role, list[str]] = {}
        for each in self.names:
            names.setdefault(each.role, []).append(each.name)
        return access_control(self._index.robot, names, self._index.domain)

    def _with_rights(self) -> dict[Path, bytes]:
        """Return the configurations that give rights, with those of all names."""
        found = {}
        for each in self.names:
            path = self._file(each.name)
            # one that was moved away keeps the rights that it has
            if each.role in MODES_BY_ROLE and path.exists():
                text = re.sub(rb"(?m)^\s*//.*$", b"", path.read_bytes())
                try:
                    config = msgspec.json.decode(text, type=dict[str, Any])
                except msgspec.MsgspecError as error:
                    raise InvalidInputError(
                        f"{path}: was edited, and is no JSON ({error}); rights are only added to "
                        "JSON with comments in lines of their own",
                        field="DIR",
                    ) from None
                found[path] = self._text(each, config | {"access_control": self._rights()})
        return found

    def _write_all(self, configurations: dict[Path, bytes]) -> None:
        for path, text in configurations.items():
            _replace(path, text, SECRET_MODE)
        _replace(
            self.path / INDEX_FILE,
            msgspec.json.format(msgspec.json.encode(self._index)),
            PUBLIC_MODE,
        )

    def _text(self, key: NamedKey, config: dict[str, Any]) -> bytes:
        comment = (
            f"// {key.role} {key.name!r} of {self._index.robot}, until {key.until:%Y-%m-%d}, with "
            "its private key: keep it secret\n"
        )
        return comment.encode() + msgspec.json.format(msgspec.json.encode(config)) + b"\n"


def _now() -> datetime.datetime:
    return datetime.datetime.now(datetime.UTC).replace(microsecond=0)


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _write(path: Path, data: bytes, mode: int) -> None:
    """Write a new file, which nobody else can read meanwhile."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
        file.write(data)


def _replace(path: Path, data: bytes, mode: int) -> None:
    """Replace a file by another at once."""
    new = path.with_name(f".{path.name}.new")
    new.unlink(missing_ok=True)
    _write(new, data, mode)
    new.replace(path)


def _check_host(host: str) -> None:
    """Refuse what is neither a host's name nor its address, such as one with a port."""
    try:
        ip_address(host)
    except ValueError:
        labels = host.split(".")
        if not all(re.fullmatch(r"(?!-)[A-Za-z0-9_-]{1,63}(?<!-)", each) for each in labels):
            raise InvalidInputError(
                f"{host!r} is no name or address of a machine; valid are, for example, robot.local "
                "and 192.168.1.7, without a port",
                field="--host",
            ) from None


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _listening_address(hosts: Sequence[str]) -> str:
    """Return the address at which a machine of these names listens."""
    addresses = []
    for host in hosts:
        try:
            addresses.append(ip_address("127.0.0.1" if host == "localhost" else host))
        except ValueError:
            addresses.append(ip_address("0.0.0.0"))
    if all(each.is_loopback for each in addresses):
        return _bracketed(str(addresses[0]))
    return "[::]" if any(each.version == 6 for each in addresses) else "0.0.0.0"
