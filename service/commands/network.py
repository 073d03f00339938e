"""Commands that answer and ask over zenoh."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click
import msgspec

from service.commands.options import (
    PICTURES,
    FiniteRange,
    OutputFile,
    Own,
    json_option,
    own_options,
    stance_argument,
    timeout_option,
    wait_option,
    with_extras,
)
from service.commands.stances import read_request
from service.processes import kill_children
from service.requests import DEFAULT_DEADLINE, LONGEST_DEADLINE
from service.serving import (
    MODES,
    ended_in_time,
    listening,
    open_session,
    start_zenoh_log,
    zenoh_config,
)
from service.tables import draw_plan, note, remark, say, show, verbosity
from service.wire import DEFAULT_ROBOT, UNREACHABLE, ServiceError, service_key

if TYPE_CHECKING:
    import zenoh

__all__ = ["demo", "query", "schema", "serve"]

LEVELS: Final = {-1: logging.ERROR, 0: logging.WARNING, 1: logging.INFO}
"""Of what is logged, by what is to be said: with more, a line a question."""

PATIENCE: Final = 120.0
"""How long the demo waits for its own service, however busy the machine [s]."""

ZENOH_THREADS: Final = (
    "(rx: (worker_threads: 4), net: (worker_threads: 4), tx: (worker_threads: 4))"
)
"""By default, where ``ZENOH_RUNTIME`` does not say otherwise."""

DEMO_STANCE: Final = "wall-300-joints"


def zenoh_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a click command zenoh's flags, and pass it their ``config``."""

    @click.option("-m", "--mode", type=click.Choice(MODES), help="Zenoh session mode.")
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
        config = zenoh_config(**flags, multicast=not no_multicast_scouting)
        return command(config=config, **given)

    return with_config


@click.command()
@zenoh_options
@own_options
@click.option(
    "--workers",
    type=click.IntRange(1, 256),
    help="Processes that answer; by default one a core, but at least 2. One more has the streams.",
)
@click.option(
    "--deadline",
    "seconds",
    type=FiniteRange(0.0, min_open=True, max=LONGEST_DEADLINE),
    default=DEFAULT_DEADLINE,
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
@json_option
def serve(
    config: zenoh.Config,
    own: Own,
    workers: int | None,
    seconds: float,
    metrics_port: int | None,
    log_format: str,
    as_json: bool,
) -> None:
    """Answer questions on zenoh until SIGTERM or Ctrl-C.

    Without -l only programs on this machine can ask. The hand of --hand is that of every question;
    a question's own numbers go on top. The robot of --robot is the only one that is planned for,
    and gives the keys its name.
    """
    stop = _StopSignal()
    # a client that does not read stops one of these for as long as zenoh waits for it
    os.environ.setdefault("ZENOH_RUNTIME", ZENOH_THREADS)
    from service.serving import JsonLines, LogThread, PlanService, closed, exposed

    handler = LogThread()
    form = logging.Formatter("crux: %(levelname)s: %(message)s")
    handler.setFormatter(JsonLines() if log_format == "json" else form)
    logging.basicConfig(handlers=[handler], level=LEVELS[verbosity()])
    start_zenoh_log()
    closed(config)
    endpoints = listening(config)
    with ended_in_time(open_session(config)) as session:
        service = PlanService(session, own.robot, own.hand, workers=workers, seconds=seconds)
        if metrics_port is not None:
            service.serve_metrics(metrics_port)
        if service.has_rival():
            note(
                f"another service already answers {service_key(service.robot, '…')}: queries may "
                "reach either; --no-multicast-scouting keeps services apart"
            )
        with service:
            stop.waits_for()
            if as_json:
                say({"v": 1, "keys": service.keys, "listen": endpoints})
            where = ", ".join(endpoints) or "no address"
            remark(f"serving {', '.join(service.keys)}; listening on {where}")
            if open_to := exposed(config):
                note(
                    f"{', '.join(open_to)}: whoever reaches it can ask, and read what zenoh tells "
                    "of this session (@/**); access control is zenoh's (-c FILE)"
                )
            stop.wait()


class _StopSignal:
    """SIGTERM or Ctrl-C, from now on: at first they end this process and those that it started.

    A signal may well arrive in a thread of zenoh's or of a solver's, and does not wake the main
    thread then; what does is the byte that its handler writes to a pipe.
    """

    NUMBERS = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        self._arrived, wakeup = os.pipe()
        os.set_blocking(wakeup, False)
        signal.set_wakeup_fd(wakeup, warn_on_full_buffer=False)
        for number in self.NUMBERS:
            signal.signal(number, _leave)

    def waits_for(self) -> None:
        """From now on there are questions that are to be told of the end."""
        for number in self.NUMBERS:
            signal.signal(number, lambda *_: None)

    def wait(self) -> None:
        """Wait for the first; a second one kills."""
        os.read(self._arrived, 1)
        for number in self.NUMBERS:
            signal.signal(number, signal.SIG_DFL)


def _leave(*_: object) -> None:
    try:
        # one may be in the middle of being started
        kill_children()
    finally:
        os._exit(0)


@click.command()
@stance_argument
@zenoh_options
@timeout_option
@wait_option
@own_options
@json_option
def query(
    stance: str,
    config: zenoh.Config,
    timeout: float | None,
    wait: float | None,
    own: Own,
    as_json: bool,
) -> int:
    """Ask a running service for a plan.

    It has to serve the robot that the stance or --robot names.
    """
    from service.serving import CruxClient

    request = with_extras(own.asked(read_request(stance)), whole=not as_json)
    start_zenoh_log()
    name = request.stance.robot or DEFAULT_ROBOT
    with CruxClient(config, name, timeout=timeout, wait=wait) as client:
        reply = client.plan(request)
    return show(reply, as_json)


@click.command()
@click.option(
    "-o",
    "--output",
    "picture",
    type=OutputFile(*PICTURES),
    default="crux-demo.png",
    show_default=True,
    metavar="FILE",
    help="Where the picture goes.",
)
@own_options
@json_option
def demo(picture: Path, own: Own, as_json: bool) -> int:
    """Start the service, ask it for a plan of a real stance, and draw the answer.

    A robot of --robot whose limbs do not reach that stance's holds is planned for without joints.
    """
    from service import answering
    from service.serving import CruxClient, PlanService
    from service.tables import console

    request = with_extras(own.asked(read_request(DEMO_STANCE)))
    start_zenoh_log()
    config = zenoh_config(settings=["listen/endpoints:[]"], multicast=False)
    with open_session(config) as session, PlanService(session, own.robot, workers=1) as service:
        client = CruxClient(session, service.robot, timeout=PATIENCE)
        try:
            reply = client.plan(request)
        except ServiceError as error:
            if error.kind != UNREACHABLE:
                raise
            remark(f"planned without joints: {error.message}")
            stance = msgspec.structs.replace(request.stance, joints=None)
            request = msgspec.structs.replace(request, stance=stance)
            reply = client.plan(request)
    draw_plan(answering.planned(request, own.robots), picture)
    status = show(reply, as_json)
    if not as_json:
        console().print(f"picture: {picture}", markup=False)
    return status


@click.command()
@json_option
def schema(as_json: bool) -> None:
    """Print the JSON Schema of every message."""
    from service.wire import schema as message_schema

    text = msgspec.json.encode(message_schema())
    click.echo(text if as_json else msgspec.json.format(text))
