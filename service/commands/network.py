"""Define the commands of the service on zenoh: serve, keys, query, schema."""

from __future__ import annotations

import gc
import logging
import os
import signal
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import msgspec

from hand_models.base import InvalidInputError
from service import processes, requests, security, serving, tables, wire
from service.commands import options, stances
from service.ros2 import ros_domain

if TYPE_CHECKING:
    import zenoh

__all__ = [
    "keys_command",
    "query_command",
    "schema_command",
    "serve_command",
    "zenoh_options",
]


def zenoh_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add zenoh's flags to a click command; the command gets them as one ``config`` argument.

    Parameters
    ----------
    command : callable
        Function of the command, with a keyword argument ``config`` of type `zenoh.Config`.
    """

    @click.option(
        "-m", "--mode", type=click.Choice(serving.SESSION_MODES), help="Zenoh session mode."
    )
    @click.option("-e", "--connect", multiple=True, metavar="ENDPOINT", help="Connect to it.")
    @click.option("-l", "--listen", multiple=True, metavar="ENDPOINT", help="Listen on it.")
    @click.option(
        "-c", "--config", "file", type=click.Path(path_type=Path), help="Zenoh JSON5 configuration."
    )
    @click.option("--cfg", "settings", multiple=True, metavar="KEY:VALUE", help="One setting.")
    @click.option("--no-multicast-scouting", is_flag=True, help="Look for nobody by multicast.")
    @wraps(command)
    def with_config(no_multicast_scouting: bool, **given: Any) -> Any:
        names = ("mode", "connect", "listen", "file", "settings")
        flags = {name: given.pop(name) for name in names}
        config = serving.zenoh_config(**flags, multicast=not no_multicast_scouting)
        return command(config=config, **given)

    return with_config


@click.command("serve")
@zenoh_options
@options.own_options
@click.option(
    "--workers",
    type=click.IntRange(1, 256),
    help="Processes that answer; by default one a core, but at least 2. One more has the streams.",
)
@click.option(
    "--deadline",
    "seconds",
    type=options.FiniteRange(0.0, min_open=True, max=requests.LONGEST_DEADLINE),
    default=requests.DEFAULT_DEADLINE,
    show_default=True,
    metavar="SECONDS",
    help="Of a question that names none, from its arrival.",
)
@click.option(
    "--metrics-port",
    type=click.IntRange(1, 65535),
    help="Give Prometheus its text over HTTP on this port of this machine.",
)
@click.option("--log-format", type=click.Choice(["text", "json"]), default="text")
@click.option("--ros2", is_flag=True, help="Be a node of ROS 2, too, by rmw_zenoh's convention.")
@click.option(
    "--domain",
    type=click.IntRange(0, 232),
    help="ROS domain of --ros2; by default that of ROS_DOMAIN_ID, or 0.",
)
@options.json_option
def serve_command(
    config: zenoh.Config,
    own: options.Own,
    workers: int | None,
    seconds: float,
    metrics_port: int | None,
    log_format: str,
    ros2: bool,
    domain: int | None,
    as_json: bool,
) -> None:
    """Answer questions on zenoh until SIGTERM or Ctrl-C.

    Without -l only programs on this machine can ask. The hand of --hand is that of every question;
    numbers that a question gives replace the hand's. The robot of --robot is the only one that is
    planned for, and gives the keys its name.
    """
    if domain is not None and not ros2:
        raise InvalidInputError("has no meaning without --ros2; give both", field="--domain")
    stop = _StopSignal()
    # a client that does not read blocks one of these threads while zenoh waits for it
    threads = "(rx: (worker_threads: 4), net: (worker_threads: 4), tx: (worker_threads: 4))"
    os.environ.setdefault("ZENOH_RUNTIME", threads)

    handler = serving.LogThread()
    form = logging.Formatter("crux: %(levelname)s: %(message)s")
    handler.setFormatter(serving.JsonLines() if log_format == "json" else form)
    # with verbosity 1 there is one line for each question
    levels = {-1: logging.ERROR, 0: logging.WARNING, 1: logging.INFO}
    logging.basicConfig(handlers=[handler], level=levels[tables.verbosity()])
    serving.start_zenoh_log()
    serving.closed(config)
    endpoints = serving.listening(config)
    with serving.ended_in_time(serving.open_session(config)) as session:
        service = serving.PlanService(
            session,
            own.robot,
            own.hand,
            workers=workers,
            seconds=seconds,
            ros_domain=ros_domain(domain) if ros2 else None,
        )
        if metrics_port is not None:
            service.serve_metrics(metrics_port)
        if rivals := service.rivals():
            tables.note(rivals)
        where = ", ".join(endpoints) or "no address"
        tables.remark(f"listening on {where}; the workers start, which takes some seconds")
        with service:
            stop.waits_for()
            # what is loaded stays: no question waits until it is looked through for garbage
            gc.freeze()
            node = service.ros
            if as_json:
                own_names = {} if node is None else {"ros2": node.names}
                tables.say({"v": 1, "keys": service.keys, "listen": endpoints} | own_names)
            tables.remark(f"ready; serving {', '.join(service.keys)}")
            if node is not None:
                tables.remark(f"in ROS 2: {', '.join(node.names)}")
            if open_to := serving.exposed(config):
                tables.note(
                    f"{', '.join(open_to)}: whoever reaches it can ask, and read what zenoh "
                    "publishes about this session (@/**); access control is zenoh's (-c FILE)"
                )
            stop.wait()


class _StopSignal:
    """Handler of SIGTERM and Ctrl-C; at first they end this process and its child processes.

    A signal may arrive in a thread of zenoh or of a solver, and then does not wake the main
    thread. The byte that the handler writes to a pipe wakes it.
    """

    NUMBERS = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        self._arrived, wakeup = os.pipe()
        os.set_blocking(wakeup, False)
        signal.set_wakeup_fd(wakeup, warn_on_full_buffer=False)
        for number in self.NUMBERS:
            signal.signal(number, _leave)

    def waits_for(self) -> None:
        """Let signals end `wait`, not the process, so that open questions are answered first."""
        for number in self.NUMBERS:
            signal.signal(number, lambda *_: None)

    def wait(self) -> None:
        """Wait for the first signal; a second one kills the process."""
        os.read(self._arrived, 1)
        for number in self.NUMBERS:
            signal.signal(number, signal.SIG_DFL)


def _leave(*_: object) -> None:
    try:
        # a child process may just be starting
        processes.kill_children()
    finally:
        os._exit(0)


@click.command("query")
@options.stance_argument
@zenoh_options
@options.timeout_option
@options.wait_option
@options.own_options
@options.json_option
def query_command(
    stance: str,
    config: zenoh.Config,
    timeout: float | None,
    wait: float | None,
    own: options.Own,
    as_json: bool,
) -> int:
    """Ask a running service for a plan.

    The service has to be for the robot that the stance or --robot names.
    """
    request = options.with_extras(own.asked(stances.read_request(stance)), whole=not as_json)
    serving.start_zenoh_log()
    name = request.stance.robot or wire.DEFAULT_ROBOT
    with serving.CruxClient(config, name, timeout=timeout, wait=wait) as client:
        reply = client.plan(request)
    return tables.show(reply, as_json)


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


@click.command("schema")
@options.json_option
def schema_command(as_json: bool) -> None:
    """Print the JSON Schema of every message."""
    text = msgspec.json.encode(wire.schema())
    click.echo(text if as_json else msgspec.json.format(text))
