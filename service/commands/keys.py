"""Define ``crux keys``: certificates of a service and its clients, and their rights."""

from __future__ import annotations

from pathlib import Path

import click

from service import security, tables, wire
from service.commands import options

__all__ = ["keys_command"]


@click.group("keys")
def keys_command() -> None:
    """Make certificates and rights: who may ask a service, and who may only watch it.

    DIR is the folder that crux keys make makes. It has a zenoh configuration for each name, for -c
    of crux serve and of all clients.
    """


folder_argument = click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
hosts_option = click.option(
    "--host",
    "hosts",
    multiple=True,
    metavar="HOST",
    help="Name or address of the machine that listens, as others reach it; may be repeated.",
)
days_option = click.option(
    "--days",
    type=click.IntRange(1, 3650),
    default=365,
    show_default=True,
    help="Validity of the certificates.",
)


@keys_command.command("make")
@folder_argument
@hosts_option
@click.option("--port", type=click.IntRange(1, 65535), default=7447, show_default=True)
@days_option
@click.option(
    "--robot",
    default=wire.DEFAULT_ROBOT,
    show_default=True,
    metavar="NAME",
    help="Robot for whose keys the rights are.",
)
@click.option(
    "--domain",
    type=click.IntRange(0, 232),
    help="ROS domain of crux serve --ros2; its nodes get a certificate, too.",
)
@options.json_option
def make_command(
    folder: Path,
    hosts: tuple[str, ...],
    port: int,
    days: int,
    robot: str,
    domain: int | None,
    as_json: bool,
) -> None:
    """Make an authority, and keys of a service, a planner and an observer.

    Without --host, they are for this machine alone.
    """
    where = hosts or ("localhost", "127.0.0.1")
    made = security.KeyFolder.make(folder, robot, where, port, days, domain)
    _tell_names(made, as_json)
    tables.remark(f"{folder}/ca-key.pem makes further names: keep it where nobody else reads it")


@keys_command.command("add")
@folder_argument
@click.argument("name", metavar="NAME")
@click.option("--role", type=click.Choice([*map(str, security.Role)]), required=True)
@hosts_option
@days_option
@options.json_option
def add_command(
    folder: Path, name: str, role: str, hosts: tuple[str, ...], days: int, as_json: bool
) -> None:
    """Make the key of another name, and give it the rights of its role."""
    keys = security.KeyFolder(folder)
    changed = keys.add(name, security.Role(role), hosts, days)
    _tell_names(keys, as_json)
    _tell_changed(changed)


@keys_command.command("remove")
@folder_argument
@click.argument("name", metavar="NAME")
@options.json_option
def remove_command(folder: Path, name: str, as_json: bool) -> None:
    """Take all rights from a name, and remove its configuration."""
    keys = security.KeyFolder(folder)
    changed = keys.remove(name)
    _tell_names(keys, as_json)
    _tell_changed(changed)


@keys_command.command("list")
@folder_argument
@options.json_option
def list_command(folder: Path, as_json: bool) -> None:
    """List names, roles, hosts, and until when they are valid."""
    _tell_names(security.KeyFolder(folder), as_json)


def _tell_names(keys: security.KeyFolder, as_json: bool) -> None:
    if as_json:
        tables.say({"v": 1, "folder": str(keys.path), "names": keys.names})
        return
    for each in keys.names:
        hosts = f", at {', '.join(each.hosts)}" if each.hosts else ""
        line = f"{keys.path / each.name}.json5: {each.role}, until {each.until:%Y-%m-%d}{hosts}"
        tables.console().print(line, soft_wrap=True, highlight=False)


def _tell_changed(changed: list[Path]) -> None:
    if changed:
        tables.remark(
            f"changed: {', '.join(map(str, changed))}; copy them to their machines and start those "
            "services anew: the rights are read at the start"
        )
