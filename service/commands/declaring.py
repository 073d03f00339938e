"""Declare the options of a command once: as the defaults of the parameters that get their values.

A function whose parameters have such defaults becomes a command by `command`. Help lists options
in the order of the parameters.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import wraps
from typing import Any, NamedTuple

import click

__all__ = ["argument", "command", "flag", "group", "option"]


class Declared(NamedTuple):
    """Option or argument; ``names`` has its flags, by default that of the parameter's name."""

    kind: type[click.Option | click.Argument]
    names: tuple[str, ...]
    settings: dict[str, Any]

    def made(self, parameter: str) -> click.Parameter:
        """Return click's option or argument whose value a parameter gets."""
        names = self.names
        if not names and self.kind is click.Option:
            names = (f"--{parameter.replace('_', '-')}",)
        return self.kind([*names, parameter], **self.settings)


class Group(NamedTuple):
    """Options whose values a function makes one value of, by their parameters' names."""

    build: Callable[..., Any]
    members: dict[str, Declared]


def option(words: str | None, kind: Any = None, *, usage: str = "", **settings: Any) -> Any:
    """Return the declaration of an option; a default is shown in the help.

    Parameters
    ----------
    words : str or None
        Help text.
    kind : click.ParamType or type, optional
        Type of the value; by default that of the default, or text.
    usage : str, optional
        Flags and the word for the value as help shows them, such as ``-o --output FILE``. By
        default the flag has the name of the parameter, and the word is that of the type.
    **settings
        Further settings of `click.Option`.
    """
    if settings.get("default") is not None:
        settings.setdefault("show_default", True)
    flags = [word for word in usage.split() if word.startswith("-")]
    if value := usage.split()[len(flags) :]:
        settings["metavar"] = value[0]
    return Declared(click.Option, tuple(flags), {"help": words, "type": kind} | settings)


def flag(words: str, **settings: Any) -> Any:
    """Return the declaration of an option without a value, as `option` does."""
    return option(words, is_flag=True, **settings)


def argument(kind: Any = None, **settings: Any) -> Any:
    """Return the declaration of an argument of a type, with settings of `click.Argument`."""
    return Declared(click.Argument, (), {"type": kind} | settings)


def group(build: Callable[..., Any], **members: Declared) -> Any:
    """Return the declaration of several options, whose values become one.

    Parameters
    ----------
    build : callable
        Returns the value from those of the options, which it gets by name.
    **members
        Declarations of the options, in the order of the help.
    """
    return Group(build, members)


def command(
    name: str,
    of: click.Group | None = None,
    within: Callable[[click.Context], AbstractContextManager[Any]] = nullcontext,
    **settings: Any,
) -> Callable[[Callable[..., Any]], click.Command]:
    """Return a decorator that makes a command of a function with declarations as defaults.

    Parameters
    ----------
    name : str
    of : click.Group, optional
        Group of the command.
    within : callable, optional
        Returns a context manager in which the command runs, from its click context.
    **settings
        Further settings of `click.Command`.
    """

    def decorate(function: Callable[..., Any]) -> click.Command:
        parameters = inspect.signature(function).parameters.values()
        declared = {each.name: each.default for each in parameters}
        groups = {key: each for key, each in declared.items() if isinstance(each, Group)}

        @wraps(function)
        def called(**given: Any) -> Any:
            with within(click.get_current_context()):
                for key, each in groups.items():
                    given[key] = each.build(**{name: given.pop(name) for name in each.members})
                return function(**given)

        single: dict[str, Declared] = {}
        for key, each in declared.items():
            single |= each.members if isinstance(each, Group) else {key: each}
        params = [each.made(key) for key, each in single.items()]
        words = function.__doc__
        made = click.Command(name, callback=called, help=words, params=params, **settings)
        if of is not None:
            of.add_command(made)
        return made

    return decorate
