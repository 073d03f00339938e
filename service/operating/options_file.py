"""Read the options of a command from a TOML file, in which they have their own names and units."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import click
from click.core import ParameterSource

from hand_models.base import InvalidInputError, errors_under, in_file

__all__ = ["naming_file", "read_options"]

GIVEN_OPTIONS: Final = f"{__name__}.given"
"""Where the context of a command keeps the file and the options that it gives."""


def read_options(path: Path, context: click.Context, without: frozenset[str]) -> dict[str, Any]:
    """Return the values that a file gives to options of a command.

    Parameters
    ----------
    path : Path
        TOML with a line for each option, such as ``metrics-port = 9464``; a list for an option that
        may be given several times. Files are named as seen from the folder of this file.
    context : click.Context
        Context of the command.
    without : frozenset of str
        Options that the file may not have.

    Returns
    -------
    dict
        Values by the names of click's parameters, as for `click.Context.default_map`.

    Raises
    ------
    InvalidInputError
        If the file cannot be read, an option is unknown, or its value is not valid.
    """
    known = {
        option.opts[-1].removeprefix("--"): option
        for option in context.command.get_params(context)
        if isinstance(option, click.Option)
    }
    known = {name: option for name, option in known.items() if name not in without}
    found: dict[str, Any] = {}
    with in_file(str(path)):
        for name, value in tomllib.loads(path.read_text("utf-8-sig")).items():
            option = known.get(name)
            if option is None:
                valid = ", ".join(sorted(known))
                raise InvalidInputError(f"unknown option; valid are {valid}", field=name)
            assert option.name is not None
            with errors_under(name):
                found[option.name] = _value(option, value, path.parent, context)
    names = {f"--{name}": option.name for name, option in known.items() if option.name in found}
    context.meta[GIVEN_OPTIONS] = path, names
    return found


@contextmanager
def naming_file(context: click.Context) -> Iterator[None]:
    """Context manager that names the file in errors of options that it gives.

    Parameters
    ----------
    context : click.Context
        Context for which `read_options` was called, or not.

    Raises
    ------
    InvalidInputError
        In place of an InvalidInputError whose field is an option, such as ``--listen``.
    """
    try:
        yield
    except InvalidInputError as error:
        path, names = context.meta.get(GIVEN_OPTIONS, (None, {}))
        option = names.get(error.field)
        if option is None or (
            # the file itself was given there, and may name another
            option != "file" and context.get_parameter_source(option) is ParameterSource.COMMANDLINE
        ):
            raise
        name = str(error.field).removeprefix("--")
        raise InvalidInputError(error.message, field=f"{path}: {name}") from None


def _value(option: click.Option, value: Any, folder: Path, context: click.Context) -> Any:
    """Return a value of the file as click takes it, if it is valid."""
    several = option.multiple and isinstance(value, list)
    entries: list[Any] = value if several else [value]
    kinds, words = _kinds(option)
    for each in entries:
        if not isinstance(each, kinds) or (isinstance(each, bool) and kinds is not bool):
            more = ", or a list of them" if option.multiple else ""
            raise InvalidInputError(f"must be {words}{more}, got {each!r}")
    if isinstance(option.type, click.Path):
        if not all(entries):
            raise InvalidInputError(f"must name a file, got {value!r}")
        entries = [str(folder / each) for each in entries]
    try:
        read = tuple(option.type.convert(each, option, context) for each in entries)
        if option.callback is not None and not option.is_eager:
            # what reads several files; an eager one reads this file
            option.callback(context, option, read if option.multiple else read[0])
    except InvalidInputError as error:
        # of a file that the option names
        raise InvalidInputError(str(error)) from None
    except click.BadParameter as error:
        raise InvalidInputError(f"{error.message.rstrip('.')}; got {value!r}") from None
    return entries if option.multiple else entries[0]


def _kinds(option: click.Option) -> tuple[type | tuple[type, ...], str]:
    """Return the types of TOML's values that an option takes, and their name."""
    if option.is_flag:
        return bool, "true or false"
    if isinstance(option.type, click.types.FloatParamType):
        return (int, float), "a number"
    if isinstance(option.type, click.types.IntParamType):
        return int, "a whole number"
    return str, "a text"
