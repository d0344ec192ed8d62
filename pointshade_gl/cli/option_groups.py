"""Options of the command line as fields: spelt here, or made of the fields of the library (scene/option_fields.py)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field, fields, make_dataclass
from types import MappingProxyType
from typing import Any

import typer

from ..scene.option_fields import option_of
from .completion import one_of

Typed = tuple[str, Any, Any]  # name, type and field, as `make_dataclass` takes them


def said(
    help: str, *names: str, panel: str = "", known: Iterable[str] = (), default: Any = None, was: str = "", **more: Any
) -> Any:
    """Return the field of an option, in a panel of the help. names: if its field's name does not tell all of them.

    known  values that the shell completes
    was    its older name, which is understood, too
    more   as for `typer.Option`
    """
    completed = one_of(known) if known else None
    how = typer.Option(*names, help=help, autocompletion=completed, rich_help_panel=panel or None, **more)
    return field(default=default, metadata={"typer": how, "was": was})


def group_of(found: Iterable[Typed]) -> Any:
    """Return a class for a group of options (see cli/options.py) to inherit from."""
    return make_dataclass("Fields", list(found), bases=(FieldOptions,), frozen=True)


def typed(
    group: type, panels: tuple[str, ...], defaults: Mapping[str, Any] | None = MappingProxyType({})
) -> list[Typed]:
    """Return the options of a dataclass that stand in these panels of the help, panel by panel.

    defaults  others than those of the fields; None: what is not typed is None, as the command decides about it
    """
    listed = [one for one in fields(group) if option_of(one).help and option_of(one).panel in panels]
    listed.sort(key=lambda one: (panels.index(option_of(one).panel), option_of(one).place))
    found: list[Typed] = []
    for one in listed:
        has, is_switch = option_of(one), one.default is False
        kind = has.kind if one.default is None or has.read else type(one.default)
        names = [f"--{one.name.replace('_', '-')}", *filter(None, [has.short])] if is_switch or has.short else []
        default = None if defaults is None and not is_switch else (defaults or {}).get(one.name, one.default)
        how = {"panel": has.panel, "known": has.known, "was": has.was, "metavar": has.metavar}
        found.append((one.name, kind if is_switch else kind | None, said(has.help, *names, default=default, **how)))
    return found


class FieldOptions:
    """The options that were typed, and the values that they stand for."""

    @property
    def changed(self) -> list[str]:
        """Return the names of those that differ from their defaults."""
        own: Any = self
        return [one.name for one in fields(own) if getattr(self, one.name) != one.default]

    def values_of(self, group: type) -> dict[str, Any]:
        """Return what was typed for a dataclass, by the names of its fields. Raises ValueError."""
        return {
            one.name: read(value) if isinstance(value, str) and (read := option_of(one).read) else value
            for one in fields(group)
            if (value := getattr(self, one.name, None)) is not None
        }
