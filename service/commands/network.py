"""Define the commands of a service: serve, query, top, and replay of what was recorded."""

from __future__ import annotations

import gc
import logging
import os
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import planner
from hand_models import hand
from hand_models.base import InvalidInputError
from service import (
    operating,
    recording,
    requests,
    ros2 as ros,
    serving,
    tables,
    wire,
)
from service.commands import options, stances

if TYPE_CHECKING:
    import zenoh

__all__ = ["query_command", "replay_command", "serve_command", "top_command"]


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
        "-c",
        "--config",
        "file",
        type=click.Path(path_type=Path),
        multiple=True,
        is_eager=True,
        callback=_configuration,
        help="Zenoh JSON5 configuration; of crux serve also a TOML file with these options.",
    )
    @click.option("--cfg", "settings", multiple=True, metavar="KEY:VALUE", help="One setting.")
    @click.option("--no-multicast-scouting", is_flag=True, help="Look for nobody by multicast.")
    @wraps(command)
    def with_config(no_multicast_scouting: bool, **given: Any) -> Any:
        names = ("mode", "connect", "listen", "file", "settings")
        flags = {name: given.pop(name) for name in names}
        with operating.naming_file(click.get_current_context()):
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
@click.option(
    "--record",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE.mcap",
    help="Record questions and answers there; if the file exists, in FILE-2.mcap, and so on.",
)
@click.option(
    "--record-limit",
    type=options.FiniteRange(0.01, 1e6),
    metavar="GB",
    help="Of all files of --record together: the oldest are deleted.",
)
@click.option("--check", is_flag=True, help="Say what would be served, and start nothing.")
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
    record: Path | None,
    record_limit: float | None,
    check: bool,
    as_json: bool,
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
    if tables.verbosity() < 0 and not as_json:
        return
    if as_json:
        tables.say({"v": 1} | {key.replace(" ", "_"): value for key, value in found.items()})
        return
    for word, value in found.items():
        text = ", ".join(map(str, value)) if isinstance(value, list | tuple) else value
        tables.console().print(f"{word}: {'none' if text in (None, '') else text}", markup=False)


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


@click.command("top")
@zenoh_options
@options.robot_option
@click.option(
    "--interval",
    type=options.FiniteRange(0.1, 3600.0),
    default=2.0,
    show_default=True,
    metavar="SECONDS",
    help="Between two looks at the service.",
)
@click.option("--once", is_flag=True, help="Look once: all questions since the service's start.")
@options.json_option
def top_command(
    config: zenoh.Config,
    robot: planner.RobotFile | None,
    interval: float,
    once: bool,
    as_json: bool,
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


@click.command("replay")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@options.own_options
@options.json_option
def replay_command(file: Path, own: options.Own, as_json: bool) -> int:
    """Ask all questions of a recording again, here, and say what has moved in the answers.

    FILE is one of crux serve --record. Answers are compared to the digit, without identifiers and
    times on a clock. The exit status is 3 if an answer has moved. The hand is the recorded
    service's unless --hand gives another; of a robot of your own, give --robot again.
    """
    recorded = recording.Recording(file)
    replay = recording.Replay(recorded, own.robots, own.hand)
    with tables.progress("replaying", line=f"replaying {file}") as step:
        for _ in replay.run(recorded.questions(step)):
            pass
    operating.note_losses(recorded, file)
    if as_json:
        tables.say(operating.replay_json(replay))
    else:
        operating.print_replay(replay, tables.console())
    if replay.moved:
        return tables.ExitStatus.OVERLOADED
    lost = recorded.damaged or (recorded.whole is False and not replay.asked)
    return tables.ExitStatus.FAILED if lost else tables.ExitStatus.DONE
