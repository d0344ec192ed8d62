"""Options of the command line that are made of the fields of the library: see scene/option_fields.py."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import Field, field, fields, make_dataclass
from typing import Annotated, Any

import typer

from ..scene.option_fields import option_of
from .completion import one_of

Typed = tuple[str, Any, Any]  # name, annotated type and field, as `make_dataclass` takes them


def group_of(found: Iterable[Typed]) -> Any:
    """Return a class for a group of options (see cli/options.py) to inherit from."""
    return make_dataclass("Fields", list(found), bases=(FieldOptions,), frozen=True)


def typed(group: type, panels: tuple[str, ...], with_defaults: bool = True) -> list[Typed]:
    """Return the options of a dataclass that stand in these panels of the help, panel by panel.

    with_defaults  False: what is not typed is None, as the command decides about it
    """
    listed = [one for one in fields(group) if option_of(one).help and option_of(one).panel in panels]
    listed.sort(key=lambda one: (panels.index(option_of(one).panel), option_of(one).place))
    return [
        (one.name, _annotated(one), field(default=_default(one, with_defaults), metadata={"was": option_of(one).was}))
        for one in listed
    ]


def _default(one: Field[Any], with_defaults: bool) -> Any:
    return one.default if with_defaults or one.default is False else None


def _annotated(one: Field[Any]) -> Any:
    said, is_switch = option_of(one), one.default is False
    kind = said.kind if one.default is None or is_switch else type(one.default)
    how = typer.Option(
        *([f"--{one.name.replace('_', '-')}"] if is_switch else []),
        metavar=said.metavar,
        help=said.help,
        autocompletion=one_of(said.known) if said.known else None,
        rich_help_panel=said.panel,
    )
    return Annotated[bool if is_switch else kind | None, how]


class FieldOptions:
    """The options that were typed, and the values that they stand for."""

    def values_of(self, group: type) -> dict[str, Any]:
        """Return what was typed for a dataclass, by the names of its fields. Raises ValueError."""
        return {
            one.name: read(value) if isinstance(value, str) and (read := option_of(one).read) else value
            for one in fields(group)
            if (value := getattr(self, one.name, None)) is not None
        }
