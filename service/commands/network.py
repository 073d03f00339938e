"""Define the commands of a service: serve, query, top, and keys of who may ask it."""

from __future__ import annotations

import gc
import logging
import os
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import planner
from hand_models import hand
from hand_models.base import InvalidInputError
from service import operating, recording, requests, ros2 as ros, security, serving, tables, wire
from service.commands import options, stances
from service.commands.declaring import argument, command, flag, group, option

if TYPE_CHECKING:
    import zenoh

__all__ = ["keys_command", "query_command", "serve_command", "top_command", "zenoh_options"]


def _configuration(
    context: click.Context, _: click.Parameter, paths: tuple[Path, ...]
) -> Path | None:
    """Return zenoh's file; take options of ``crux serve`` from a TOML file."""
    zenoh_files = [path for path in paths if path.suffix != ".toml"]
    option_files = [path for path in paths if path.suffix == ".toml"]
    if option_files and context.command.name != "serve":
        raise click.BadParameter(f"{option_files[0]}: only crux serve takes options from TOML")
    if len(option_files) > 1:
        raise click.BadParameter(f"one TOML file at most, got {', '.join(map(str, option_files))}")
    named = None
    for path in option_files:
        found = operating.read_options(path, context, frozenset({"help", "check"}))
        context.default_map = found
        (named,) = found.pop("file", None) or (None,)
    return zenoh_files[-1] if zenoh_files else None if named is None else Path(named)


def _zenoh_config(no_multicast_scouting: bool, **flags: Any) -> zenoh.Config:
    return serving.zenoh_config(**flags, multicast=not no_multicast_scouting)


zenoh_options = group(
    _zenoh_config,
    mode=option("Zenoh session mode.", click.Choice(serving.SESSION_MODES), usage="-m --mode"),
    connect=option("Connect to it.", usage="-e --connect ENDPOINT", multiple=True),
    listen=option("Listen on it.", usage="-l --listen ENDPOINT", multiple=True),
    file=option(
        "Zenoh JSON5 configuration; of crux serve also a TOML file with these options.",
        options.ANY_PATH,
        usage="-c --config",
        multiple=True,
        is_eager=True,
        callback=_configuration,
    ),
    settings=option("One setting.", usage="--cfg KEY:VALUE", multiple=True),
    no_multicast_scouting=flag("Look for nobody by multicast."),
)
"""Zenoh's flags, of which a command gets a configuration."""


@command("serve", within=operating.naming_file)
def serve_command(
    config: zenoh.Config = zenoh_options,
    own: options.Own = options.own_options,
    workers: int | None = option(
        "Processes that answer; by default one a core, but at least 2. One more has the streams.",
        click.IntRange(1, 256),
    ),
    seconds: float = option(
        "Of a question that names none, from its arrival.",
        options.FiniteRange(0.0, min_open=True, max=requests.LONGEST_DEADLINE),
        usage="--deadline SECONDS",
        default=requests.DEFAULT_DEADLINE,
    ),
    metrics_port: int | None = option(
        "Give Prometheus its text over HTTP on this port of this machine.", click.IntRange(1, 65535)
    ),
    log_format: str = option(
        None, click.Choice(["text", "json"]), default="text", show_default=False
    ),
    ros2: bool = flag("Be a node of ROS 2, too, by rmw_zenoh's convention."),
    domain: int | None = option(
        "ROS domain of --ros2; by default that of ROS_DOMAIN_ID, or 0.", click.IntRange(0, 232)
    ),
    record: Path | None = option(
        "Record questions and answers there; if the file exists, in FILE-2.mcap, and so on.",
        click.Path(path_type=Path, dir_okay=False),
        usage="FILE.mcap",
    ),
    record_limit: float | None = option(
        "Of all files of --record together: the oldest are deleted.",
        options.FiniteRange(0.01, 1e6),
        usage="GB",
    ),
    check: bool = flag("Say what would be served, and start nothing."),
    as_json: bool = options.json_option,
) -> None:
    """Answer questions on zenoh until SIGTERM or Ctrl-C.

    Without -l only programs on this machine can ask. A file -c FILE.toml has options by their
    names, such as metrics-port = 9464; those of the command line replace them. The hand of --hand
    is that of every question; numbers that a question gives replace the hand's. The robot of
    --robot is the only one that is planned for, and gives the keys its name.
    """
    if domain is not None and not ros2:
        raise InvalidInputError("has no meaning without --ros2; give both", field="--domain")
    if record_limit is not None and record is None:
        raise InvalidInputError("has no meaning without --record", field="--record-limit")
    if record is not None and record.suffix != ".mcap":
        raise InvalidInputError(f"must end in .mcap, got {record}", field="--record")
    ros_number = ros.ros_domain(domain) if ros2 else None
    if check:
        serving.closed(config)
        endpoints = serving.listening(config)
        operating.check_endpoints(endpoints, metrics_port)
        if record is not None:
            operating.check_recording(record)
        (robot,) = own.robots
        if ros_number is not None:
            ros.check_node(robot, ros_number)
        count = max(2, planner.cores()) if workers is None else workers
        _say_checked(
            {
                "keys": serving.service_keys(robot),
                "listen": endpoints,
                "open to the network": serving.exposed(config),
                "workers": count,
                "deadline": seconds,
                "metrics": None if metrics_port is None else f"127.0.0.1:{metrics_port}",
                "ros domain": ros_number,
                "record": None if record is None else str(record),
            },
            as_json,
        )
        return
    stop = operating.StopSignal()
    planner.begin_fork_server()  # it loads what workers need, while this process loads zenoh
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
    operating.check_endpoints(endpoints, metrics_port)
    with serving.ended_in_time(serving.open_session(config)) as session, ExitStack() as stack:
        recorder = None
        if record is not None:
            (robot,) = own.robots
            limit = None if record_limit is None else round(1e9 * record_limit)
            recorder = recording.Recorder(record, robot, own.hand, limit)
            stack.callback(recorder.close)
        service = serving.PlanService(
            session,
            own.robot,
            own.hand,
            workers=workers,
            seconds=seconds,
            ros_domain=ros_number,
            recorder=recorder,
        )
        if metrics_port is not None:
            service.serve_metrics(metrics_port)
        if rivals := service.rivals():
            tables.note(rivals)
        where = ", ".join(endpoints) or "no address"
        compiled = hand.closing_is_compiled()
        start = "takes some seconds" if compiled else "compiles for minutes, once per installation"
        tables.remark(f"listening on {where}; the start of the workers {start}")
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
            with operating.supervised(service.is_alive):
                # one that started at the same time has its token by now
                if (found := service.rivals()) and found != rivals:
                    tables.note(found)
                stop.wait()


def _say_checked(found: dict[str, Any], as_json: bool) -> None:
    """Print what would be served; with verbosity -1 only as JSON."""
    if as_json:
        tables.say({"v": 1} | {key.replace(" ", "_"): value for key, value in found.items()})
    elif tables.verbosity() >= 0:
        out = tables.console()
        for word, value in found.items():
            text = ", ".join(map(str, value)) if isinstance(value, list | tuple) else value
            out.print(f"{word}: {'none' if text in (None, '') else text}")


@command("query")
def query_command(
    stance: str = options.stance_argument,
    config: zenoh.Config = zenoh_options,
    timeout: float | None = options.timeout_option,
    wait: float | None = options.wait_option,
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
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


@command("top")
def top_command(
    config: zenoh.Config = zenoh_options,
    robot: planner.RobotFile | None = options.robot_option,
    interval: float = option(
        "Between two looks at the service.",
        options.FiniteRange(0.1, 3600.0),
        default=2.0,
        usage="SECONDS",
    ),
    once: bool = flag("Look once: all questions since the service's start."),
    as_json: bool = options.json_option,
) -> None:
    """Show what a running service does, until Ctrl-C: clients, queue, workers, streams, times.

    Rates, errors and times are those since the look before. p50 and p99 are quantiles; they are
    estimated from times that are counted in buckets.
    """
    from rich.live import Live

    serving.start_zenoh_log()
    name = wire.DEFAULT_ROBOT if robot is None else robot.name
    timeout = serving.SERVING_SETTINGS.client_timeout
    with serving.open_session(config) as session:
        now = operating.read_snapshot(session, name, timeout)
        if once and not as_json:
            tables.console().print(operating.draw_top(now))
            return
        out = tables.console()
        # a file, or another program, gets one look after the other
        live = out.is_terminal and not as_json
        shown = Live(console=out, auto_refresh=False, screen=True)
        with ExitStack() as stack:
            if live:
                stack.enter_context(shown)
            before = None
            while True:
                if as_json:
                    tables.say(operating.top_json(now, before))
                elif live:
                    shown.update(operating.draw_top(now, before), refresh=True)
                else:
                    out.print(operating.draw_top(now, before))
                    out.file.flush()
                if once:
                    return
                time.sleep(interval)
                before, now = now, operating.read_snapshot(session, name, timeout)


@click.group("keys", no_args_is_help=False)
def keys_command() -> None:
    """Make certificates and rights: who may ask a service, and who may only watch it.

    DIR is the folder that crux keys make makes. It has a zenoh configuration for each name, for -c
    of crux serve and of all clients.
    """


folder_argument = argument(options.ANY_PATH, metavar="DIR")
hosts_option = option(
    "Name or address of the machine that listens, as others reach it; may be repeated.",
    usage="--host HOST",
    multiple=True,
)
days_option = option("Validity of the certificates.", click.IntRange(1, 3650), default=365)


@command("make", of=keys_command)
def make_command(
    folder: Path = folder_argument,
    hosts: tuple[str, ...] = hosts_option,
    port: int = option(None, click.IntRange(1, 65535), default=7447),
    days: int = days_option,
    robot: str = option(
        "Robot for whose keys the rights are.", default=wire.DEFAULT_ROBOT, usage="NAME"
    ),
    domain: int | None = option(
        "ROS domain of crux serve --ros2; its nodes get a certificate, too.", click.IntRange(0, 232)
    ),
    as_json: bool = options.json_option,
) -> None:
    """Make an authority, and keys of a service, a planner and an observer.

    Without --host, they are for this machine alone.
    """
    where = hosts or ("localhost", "127.0.0.1")
    made = security.KeyFolder.make(folder, robot, where, port, days, domain)
    _tell_names(made, as_json)
    tables.remark(f"{folder}/ca-key.pem makes further names: keep it where nobody else reads it")


@command("add", of=keys_command)
def add_command(
    folder: Path = folder_argument,
    name: str = argument(metavar="NAME"),
    role: str = option(None, click.Choice([*map(str, security.Role)]), required=True),
    hosts: tuple[str, ...] = hosts_option,
    days: int = days_option,
    as_json: bool = options.json_option,
) -> None:
    """Make the key of another name, and give it the rights of its role."""
    keys = security.KeyFolder(folder)
    changed = keys.add(name, security.Role(role), hosts, days)
    _tell_names(keys, as_json)
    _tell_changed(changed)


@command("remove", of=keys_command)
def remove_command(
    folder: Path = folder_argument,
    name: str = argument(metavar="NAME"),
    as_json: bool = options.json_option,
) -> None:
    """Take all rights from a name, and remove its configuration."""
    keys = security.KeyFolder(folder)
    changed = keys.remove(name)
    _tell_names(keys, as_json)
    _tell_changed(changed)


@command("list", of=keys_command)
def list_command(
    folder: Path = folder_argument,
    as_json: bool = options.json_option,
) -> None:
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
