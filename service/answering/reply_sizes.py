"""Fit replies into the client's limit of bytes: less detail, or an error that lists sizes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from msgspec import NODEFAULT, UNSET
from msgspec.structs import fields, replace

from hand_models.base import LimitError
from service.answering.answers import Planned
from service.answering.streams import brief_set_points
from service.replies import ClimbReply, PartReply, PlanReply, Reply, SetPointsReply
from service.requests import Detail, PlanRequest, Query, Request, SetPointsRequest
from service.wire import Format

__all__ = ["fitted", "fitted_part"]


def fitted(request: Request, found: Reply | Planned, form: Format) -> tuple[Reply, bytes]:
    """Encode a reply so that it takes no more bytes than the request's ``max_reply_bytes``.

    Where the request gives no ``detail``, the reply has as much detail as fits.

    Parameters
    ----------
    request : Request
        Request that is answered.
    found : Reply or Planned
        The answer with everything that was requested.
    form : Format
        Encoding of the reply.

    Returns
    -------
    reply : Reply
        The reply that fits.
    payload : bytes
        The encoded reply.

    Raises
    ------
    LimitError
        If no reply fits. The message lists the sizes of smaller replies [bytes].
    """
    reply = found.reply if isinstance(found, Planned) else found
    payload = form.encode(reply)
    most = request.max_reply_bytes if isinstance(request, Query) else None
    if most is None or len(payload) <= most:
        return reply, payload
    sizes = {}
    given = request.detail if isinstance(request, PlanRequest | SetPointsRequest) else None
    for detail, smaller in _with_less_detail(found, given or "full"):
        part = form.encode(smaller)
        if given is None and len(part) <= most:
            return smaller, part
        sizes[f"with detail {detail}"] = len(part)
    bare = reply
    modelled = isinstance(request, PlanRequest) and "model" in request.want
    if modelled and isinstance(found, Planned) and isinstance(reply, PlanReply):
        bare = found.in_detail("full").reply
        if isinstance(bare, PlanReply):
            bare = replace(bare, com_region=reply.com_region)
    without = {words: len(form.encode(less)) for words, less in _with_less_in_it(reply, bare)}
    sizes |= {words: size for words, size in without.items() if size < len(payload)}
    raise _too_large(len(payload), most, sizes)


def fitted_part(request: Request, part: PartReply, form: Format) -> Iterator[bytes]:
    """Yield a part of an answer, encoded, in so many replies that each has the bytes it may have.

    Raises
    ------
    LimitError
        If a single knot has more bytes than the request's ``max_reply_bytes``.
    """
    payload = form.encode(part)
    most = request.max_reply_bytes if isinstance(request, Query) else None
    if most is None or len(payload) <= most:
        yield payload
        return
    knots = part.knots or []
    if len(knots) < 2:
        raise _too_large(len(payload), most, {})
    half = len(knots) // 2
    for some in (knots[:half], knots[half:]):
        yield from fitted_part(request, replace(part, knots=some), form)


def _with_less_detail(found: Reply | Planned, given: Detail) -> Iterator[tuple[Detail, Reply]]:
    """Yield the replies of less detail, from the most to the least."""
    if isinstance(found, Planned):
        details: tuple[Detail, ...] = ("full", "hands", "set_points")
        for detail in details[details.index(given) + 1 :]:
            yield detail, found.in_detail(detail).reply
    elif isinstance(found, SetPointsReply) and given != "set_points":
        yield "set_points", brief_set_points(found)


def _with_less_in_it(reply: Reply, bare: Reply) -> Iterator[tuple[str, Reply]]:
    """Yield the reply without each of the extras that were asked for, and without all of them.

    ``bare``: the reply without the model, or the same reply if it has no model.
    """
    wanted = {"spread", "advice", "robust", "open_loop", "clearance", "redundancy", "survival"}
    wanted |= {"com_region", "prices", "trajectory"}
    wanted |= {"vertices", "half_spaces", "opening"}
    if isinstance(reply, ClimbReply):
        wanted.add("certificate")
    blank: dict[str, Any] = {
        field.name: None if field.default is NODEFAULT else field.default
        for field in fields(reply)
        if field.name in wanted or field.name == "along"
    }
    there = [name for name in blank if getattr(reply, name) not in (None, UNSET, [])]
    if bare is not reply:
        yield "without model in want", bare
    for name in there:
        words = "without directions" if name == "along" else f"without {name} in want"
        yield words, replace(reply, **{name: blank[name]})
    if len(there) + (bare is not reply) > 1:
        yield "without all of these", replace(bare, **{name: blank[name] for name in there})


def _too_large(size: int, most: int, sizes: dict[str, int]) -> LimitError:
    message = f"the reply takes {size} bytes, and no more than {most} are allowed"
    if sizes:
        others = ", ".join(f"{taken} {words}" for words, taken in sizes.items())
        message += f"; it takes {others}"
    if not any(taken <= most for taken in sizes.values()):
        message += f"; allow {_next(min([size, *sizes.values()]))}"
    return LimitError(message, field="max_reply_bytes")


def _next(size: int) -> int:
    """Return a round number of bytes that also takes the same reply with other times in it."""
    # three times, of up to 20 digits more each
    return ((size + 60) // 100 + 1) * 100
