"""Options, each spelt once: a dataclass field carries its default, its documentation and its command-line option."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Collection, Iterable
from dataclasses import Field, dataclass, field, fields, is_dataclass
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

from ..notes.words import did_you_mean

# panels of the help, in its order
OPTIONS, BATCH, WINDOW = "Options", "Batch", "Window"
READING, CAMERA, NETWORK, CLOUD = "Reading files", "Depth and its camera", "Depth from a network", "Point clouds"
SURFACE, SETS, LIGHT, SHADING = "Normals and noise", "Several views as one", "Light", "Shading"
VIEW, PICTURE, FILM, PAGE = "Point of view", "Picture", "Film", "Pages and points"
PANELS = (
    OPTIONS, BATCH, READING, CAMERA, NETWORK, CLOUD, SURFACE, SETS, LIGHT, SHADING, VIEW, PICTURE, FILM, PAGE, WINDOW,
)  # fmt: skip
WIDTH = 112  # columns of documentation
MOST_VALUES = 6  # that the documentation of a type lists
KINDS = {  # how the documentation calls a type
    "Environment": "Environment",
    "Numbers": "array",
    "PathLike[str]": "path",
    "Sequence[Light]": "sequence of Light",
    "SizeName": "str",
    "tuple[int, int]": "(width, height)",
}
HEADING = "\n\nParameters\n----------\n"
_Any = TypeVar("_Any", bound=Any)
_P = ParamSpec("_P")
_R = TypeVar("_R")
_Self = TypeVar("_Self")


@dataclass(frozen=True)
class Cli:
    """How a field is typed on the command line.

    panel    of the help in which it is listed; "": there is no such option
    metavar  stands for its value there; None: the known values
    known    values that the shell completes
    kind     type of the text where it is not that of the default
    read     value of such a text
    short    a second name, such as "--ao"
    """

    panel: str = ""
    metavar: str | None = None
    known: tuple[str, ...] = ()
    kind: type = str
    read: Callable[[str], Any] | None = None
    short: str = ""


@dataclass(frozen=True)
class Option:
    """What a field has beside its name, type and default.

    doc   in Python's help
    help  in that of the command line
    """

    doc: str
    help: str
    cli: Cli


def opt(default: Any, doc: str, help: str = "", cli: Cli = Cli()) -> Any:
    """Return a dataclass field with a default and an `Option`; the command line's help is the doc, unless given."""
    option = Option(doc, help or f"{doc[0].upper()}{doc[1:]}.", cli)
    return field(default=default, metadata={"option": option})


def option_of(one: Field[Any]) -> Option:
    """Return what stands beside a field."""
    return one.metadata["option"]


def number_or_text(text: str) -> float | str:
    """Return the number that a text is, or else the text."""
    try:
        return float(text)
    except ValueError:
        return text


def option_class(group: type[_Any]) -> type[_Any]:
    """Decorate a dataclass of options: its help lists them."""
    parameters = inspect.signature(group).parameters
    group.__doc__ = with_parameters(group.__doc__, [entry_of(one, parameters[one.name]) for one in fields(group)])
    return group


def takes(known: type, *groups: type, like: Callable[..., Any] | None = None) -> Callable[[_Any], _Any]:
    """Decorate a function with `**options: Unpack[known]`: its signature and its help list them all.

    groups  the dataclasses whose fields they are
    like    a function whose help has the other parameters, if they are not documented here

    The function raises TypeError for other names, with the near one.
    """
    found = {one.name: one for group in groups for one in fields(group)}

    def decorate(function: _Any) -> _Any:
        signature = inspect.signature(function)
        plain = [one for one in signature.parameters.values() if one.kind is not one.VAR_KEYWORD]
        names = [name for name in keys_of(known) if name not in signature.parameters]
        named = [_parameter(name, found.get(name), known.__annotations__[name]) for name in names]
        parameters = {one.name: one for one in (*plain, *named)}
        listed = [found[name] for name in parameters if name in found]
        entries = (
            [entry for name, entry in _entries(inspect.getdoc(like)).items() if name in parameters] if like else []
        )
        entries += [entry_of(one, parameters[one.name]) for one in listed]
        called: Any = _checking(function, parameters)
        called.__doc__ = with_parameters(function.__doc__, entries, parameters)
        called.__signature__ = signature.replace(parameters=[*parameters.values()])
        return called

    return decorate


def takes_as(
    like: Callable[Concatenate[Any, _P], Any],
) -> Callable[[Callable[Concatenate[_Self, ...], _R]], Callable[Concatenate[_Self, _P], _R]]:
    """Decorate a method that hands its arguments on to another: its signature and its help list that one's."""

    def decorate(function: Any) -> Any:
        signature = inspect.signature(like)
        function.__doc__ = with_parameters(function.__doc__, _entries(like.__doc__).values(), signature.parameters)
        returns = inspect.signature(function).return_annotation
        function.__signature__ = signature.replace(return_annotation=returns)
        return function

    return decorate


def _parameter(name: str, one: Field[Any] | None, kind: Any) -> inspect.Parameter:
    """Return the parameter of a keyword, None by default if it is no field."""
    default, kind = (None, getattr(kind, "__forward_arg__", kind)) if one is None else (one.default, one.type)
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)


def keys_of(known: type) -> list[str]:
    """Return the keys of a TypedDict, those of the one that it extends first."""
    return list(known.__annotations__)


def with_parameters(doc: str | None, entries: Iterable[str], order: Iterable[str] = ()) -> str:
    """Return a docstring whose section "Parameters" also has entries, unless it has them already.

    order  of their names
    """
    text = inspect.cleandoc(doc or "")
    found = _entries(text)
    for entry in entries:
        found.setdefault(entry.partition(" :")[0], entry)
    places = {name: place for place, name in enumerate(order)}
    section = sorted(found, key=lambda name: places.get(name, -1))
    before, _, after = text.partition(HEADING)
    ends = [at for title in ("Returns", "Raises") if (at := before.find(f"\n\n{title}\n---")) >= 0]
    end = min(ends, default=len(before))
    rest = before[end:] + after[after.find("\n\n") :] if "\n\n" in after else before[end:]
    return before[:end] + HEADING + "\n".join(found[name] for name in section) + rest + "\n"


def _entries(text: str | None) -> dict[str, str]:
    """Return the entries of the section "Parameters" of a docstring, by their names."""
    section = (text or "").partition(HEADING)[2].partition("\n\n")[0]
    return {entry.partition(" :")[0]: entry for entry in re.split(r"\n(?=\w)", section) if entry}


def entry_of(one: Field[Any], parameter: inspect.Parameter) -> str:
    """Return the lines about an option in a section "Parameters"."""
    doc = option_of(one).doc
    stated = f"{doc[0].upper()}{doc[1:].removesuffix('.')}."
    value = parameter.default
    default = f"{type(value).__name__}()" if is_dataclass(value) and value == type(value)() else _quoted(value)
    state = "optional" if value is None else f"default {default}"
    return f"{one.name} : {_kinds(str(parameter.annotation), option_of(one).cli.known)}, {state}\n{_filled(stated)}"


def _kinds(annotation: str, known: tuple[str, ...]) -> str:
    """Return the types of an option in words: `Shading` is the values that it allows, if they are few."""
    kinds = [kind for kind in annotation.split(" | ") if kind != "None"]
    values = f"{{{', '.join(map(_quoted, known))}}}" if 0 < len(known) <= MOST_VALUES else "str"
    stated = [KINDS.get(kind, values if kind[0].isupper() and known else kind) for kind in kinds]
    return " or ".join([", ".join(stated[:-1]), stated[-1]] if stated[1:] else stated)


def _quoted(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _filled(text: str) -> str:
    """Return a text in indented lines of WIDTH columns. `textwrap` would take a tenth of the package's import."""
    lines = ["   "]
    for word in text.split():
        if len(lines[-1]) + 1 + len(word) > WIDTH:
            lines.append("   ")
        lines[-1] += f" {word}"
    return "\n".join(lines)


def _checking(function: Callable[..., Any], known: Collection[str]) -> Any:
    """Return the function, which names a wrong keyword and the near one."""

    @wraps(function)
    def checked(*args: Any, **options: Any) -> Any:
        for name in options:
            if name not in known:
                near = did_you_mean(name, known)
                if not near and name.endswith(("size", "width", "height")) and "camera" in known:
                    near = ": a picture has the size of its camera, camera.fitted(width, height)"
                raise TypeError(f"{function.__name__}() got an unexpected keyword argument {name!r}{near}")
        return function(*args, **options)

    return checked
