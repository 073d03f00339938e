"""Define the commands that serve, ask and publish over zenoh: serve, query, play, demo, schema."""

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
from service import answering, bulk, processes, requests, serving, tables, wire
from service.commands import options, stances
from service.ros2 import ros_domain

if TYPE_CHECKING:
    import zenoh

__all__ = ["demo_command", "play_command", "query_command", "schema_command", "serve_command"]


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
        if service.has_rival():
            tables.note(
                f"another service already answers {wire.service_key(service.robot, '…')}: queries "
                "may reach either; --no-multicast-scouting keeps services apart"
            )
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


@click.command("play")
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@zenoh_options
@click.option(
    "--rate",
    type=options.FiniteRange(1.0, 1e4),
    default=100.0,
    show_default=True,
    metavar="HZ",
    help="Least number of set-points in a second.",
)
@click.option(
    "--speed",
    type=options.FiniteRange(0.0, min_open=True, max=100.0),
    default=1.0,
    show_default=True,
    help="Time of the climb over time that passes; 1 keeps the controller's rates.",
)
@click.option("--up-to-failure", is_flag=True, help="Play a climb that ends in the middle, too.")
@click.option(
    "--wait",
    type=options.FiniteRange(0.0, 1e6),
    metavar="SECONDS",
    help="Wait so long for a subscriber, the robot's controller; by default "
    f"{serving.SERVING_SETTINGS.search_timeout:g}.",
)
@options.json_option
def play_command(
    folder: Path,
    config: zenoh.Config,
    rate: float,
    speed: float,
    up_to_failure: bool,
    wait: float | None,
    as_json: bool,
) -> None:
    """Send the set-points of a climb to a robot: publish them in time, until the end or Ctrl-C.

    DIR is what crux route has written. Between knots, set-points are interpolated. Each is a
    message at crux/<robot>/play; the last one comes again with the state done, or stopped. The
    robot has to be at the start of the climb.
    """
    knots, about = bulk.read_climb(folder)
    failure = about.climb.failure
    if failure is not None and not up_to_failure:
        raise InvalidInputError(
            f"{folder}: the climb fails in move {failure.move} ({failure.phase}): "
            f"{failure.reason}; --up-to-failure plays what comes before",
            field="DIR",
        )
    if unsure := [knot.index for knot in knots if not knot.verified]:
        raise InvalidInputError(f"{folder}: knot {unsure[0]} is not verified", field="DIR")
    duration = knots[-1].time - knots[0].time
    if not as_json:
        tables.remark(f"playing {about.route}: {len(knots)} knots in {duration / speed:.1f} s")
        if speed > 1.0:
            tables.note(f"at speed {speed:g}, tensions and joints exceed the controller's rates")
    serving.start_zenoh_log()
    with serving.open_session(config) as session:
        delays = [0.0]
        sent = serving.play(
            session, about.robot, knots, rate=rate, speed=speed, wait=wait, late=delays.append
        )
    # a controller hardly feels less than a period, or 10 ms
    if not as_json and max(delays) > max(1.0 / rate, 0.01):
        tables.note(
            f"set-points were late, one of them by {1e3 * max(delays):.0f} ms: the climb took "
            f"{sum(delays):.2f} s longer; try a lower --rate, or a machine with less to do"
        )
    if as_json:
        tables.say({"v": 1, "set_points": sent, "knots": len(knots), "time": duration})
    else:
        tables.console().print(f"{sent} set-points of {len(knots)} knots were published")


@click.command("demo")
@click.option(
    "-o",
    "--output",
    "picture",
    type=options.OutputFile(*options.PICTURE_ENDINGS),
    default="crux-demo.png",
    show_default=True,
    metavar="FILE",
    help="Where the picture goes.",
)
@click.option(
    "--climb",
    "folder",
    is_flag=False,
    flag_value="crux-climb",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="[DIR]",
    help="Search for a climb on the bundled knob-wall instead; where its files go.",
)
@options.page_option
@options.own_options
@options.json_option
def demo_command(
    picture: Path, folder: Path | None, page: Path | None, own: options.Own, as_json: bool
) -> int:
    """Start the service, ask it for a plan of a real stance, and draw the answer.

    A robot of --robot whose limbs do not reach that stance's holds is planned for without joints.
    """
    if folder is not None:
        from service import climbs
        from service.commands.routes import search_climb

        asked = own.asked(climbs.demo_request())
        return search_climb(asked, folder, options.WorkersOption(None, None), own, as_json, page)
    tables.write_alone(picture)
    request = options.with_extras(own.asked(stances.read_request("wall-300-joints")))
    serving.start_zenoh_log()
    config = serving.zenoh_config(settings=["listen/endpoints:[]"], multicast=False)
    with (
        serving.open_session(config) as session,
        serving.PlanService(session, own.robot, workers=1) as service,
    ):
        # [s] its own service answers, also on a busy machine
        client = serving.CruxClient(session, service.robot, timeout=120.0)
        try:
            reply = client.plan(request)
        except wire.ServiceError as error:
            if error.kind != "unreachable":
                raise
            tables.remark(f"planned without joints: {error.message}")
            stance = msgspec.structs.replace(request.stance, joints=None)
            request = msgspec.structs.replace(request, stance=stance)
            reply = client.plan(request)
    answer = answering.planned(request, own.robots)
    tables.write_plan_picture(answer, picture)
    if page is not None:
        tables.write_answer_page(answer, page, "wall-300-joints")
    status = tables.show(reply, as_json)
    if not as_json:
        tables.console().print(f"picture: {picture}")
    return status


@click.command("schema")
@options.json_option
def schema_command(as_json: bool) -> None:
    """Print the JSON Schema of every message."""
    text = msgspec.json.encode(wire.schema())
    click.echo(text if as_json else msgspec.json.format(text))
