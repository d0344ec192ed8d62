"""Docstrings are plain text for `help()` and editors: here names in them become links, and signs stay what they are."""

import dataclasses
import inspect
import re
from types import ModuleType

from sphinx.application import Sphinx

import pointshade_gl as ps
from pointshade_gl import viewer

MODULES = {"batch": ps.batch, "gltf": ps.gltf, "sources": ps.sources, "viewer": viewer}
SIGNS = re.compile(r"(?<!\\)([*|\\])|(?<=\w)(_)(?!\w)")  # of reStructuredText: strong text, substitutions, links
OPTION = re.compile(r"(?<![\w`-])(--[a-z][\w-]*)")  # of the command line
ENTRY = re.compile(r"(\w+)  +(.*)")  # of a table in a module's docstring: a word, and what it means
DOCTEST = re.compile(r"\s*(>>>|\.\.\. ?)")


def public_name(text: str) -> str:
    """Return the full name of `render`, `ps.render`, `Appearance.upsample` or `batch.map`; "" of what is not public."""
    first, *rest = text.removeprefix("ps.").removeprefix("pointshade_gl.").removesuffix("()").split(".")
    if first in MODULES and rest and hasattr(MODULES[first], rest[0]):
        return f"pointshade_gl.{first}.{'.'.join(rest)}"
    owner: object = getattr(ps, first, None) if first in ps.__all__ else None
    if owner is None or (rest and not inspect.isclass(owner)):
        return ""
    fields = {one.name for one in dataclasses.fields(owner)} if dataclasses.is_dataclass(owner) else set()
    if rest and (rest[0] in fields or not hasattr(owner, rest[0])):
        return f"pointshade_gl.{first}"  # a field is documented among the parameters of its class
    return ".".join(("pointshade_gl", first, *rest))


def linked(match: re.Match[str]) -> str:
    """Return `name` as a link if it is public, else as code."""
    text = match[1]
    target = public_name(text) if re.fullmatch(r"[\w.]+(\(\))?", text) else ""
    return f":py:obj:`{text} <{target}>`" if target else f"``{text}``"


def as_restructured(line: str) -> str:
    """Return a line of plain text as reStructuredText."""
    if DOCTEST.match(line):
        return line
    pieces = re.split(r"(`[^`]+`)", OPTION.sub(r"`\1`", line))
    return "".join(
        re.sub(r"`([^`]+)`", linked, one) if k % 2 else SIGNS.sub(r"\\\1\2", one) for k, one in enumerate(pieces)
    )


def process_docstring(app: Sphinx, what: str, name: str, owner: object, options: object, lines: list[str]) -> None:
    if what == "module":
        lines[:] = [ENTRY.sub(r"\1\n        \2", line) if ENTRY.match(line) else line for line in lines]
        lines[:] = "\n".join(lines).splitlines()
    lines[:] = [as_restructured(line) for line in lines]
    if what in ("attribute", "property"):
        lines.insert(0, "")  # else napoleon takes what stands before a colon for the type


def process_signature(
    app: Sphinx, what: str, name: str, owner: object, options: object, signature: str | None, returned: str | None
) -> tuple[str, None] | None:
    """Write the default of an option that is a group of options without the group's own defaults: `Appearance()`."""
    if not callable(owner) or isinstance(owner, ModuleType):
        return None
    try:
        found = inspect.signature(owner)
    except (TypeError, ValueError):
        return None
    parameters = [
        one.replace(annotation=one.empty, default=shown(one.default))
        for one in found.parameters.values()
        if one.name not in ("self", "cls")
    ]
    return str(found.replace(parameters=parameters, return_annotation=found.empty)), None


class Shown:
    """A text that stands for itself."""

    def __init__(self, text: str):
        self.text = text

    def __repr__(self) -> str:
        return self.text


def shown(default: object) -> object:
    if default is inspect.Parameter.empty or default is None:
        return default
    if dataclasses.is_dataclass(default) or "<" in repr(default):
        is_plain = dataclasses.is_dataclass(default) and not isinstance(default, type)
        return Shown(f"{type(default).__name__}()" if is_plain else "...")
    return default


def skip_member(app: Sphinx, what: str, name: str, owner: object, skip: bool, options: object) -> bool | None:
    """Leave out what our classes only inherit from others."""
    module = getattr(getattr(owner, "fget", owner), "__module__", "") or ""
    is_foreign = callable(owner) and not module.startswith("pointshade_gl")
    return True if is_foreign else None


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("autodoc-process-docstring", process_docstring, priority=400)  # before napoleon
    app.connect("autodoc-process-signature", process_signature)
    app.connect("autodoc-skip-member", skip_member)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
