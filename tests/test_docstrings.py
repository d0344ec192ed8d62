"""Docstrings of public names have NumPy's sections, and document the parameters that there are."""

import inspect
import re
from functools import cached_property
from itertools import pairwise

import pytest

import pointshade_gl as ps
from pointshade_gl import viewer

LATER: set[str] = set()
MODULES = {  # public names that ps.__all__ has not
    "batch": (ps.batch, ps.batch.__all__),
    "sources": (ps.sources, ("views_of", "choose_views", "is_scene", "check_posed")),
    "viewer": (viewer, viewer.__all__),
}
SECTIONS = (  # in this order
    "Parameters",
    "Attributes",
    "Returns",
    "Yields",
    "Other Parameters",
    "Raises",
    "Warns",
    "See Also",
    "Notes",
    "References",
    "Examples",
)


def documented():
    """All public names, and the public members that their classes define, with what they stand for."""
    for name in ps.__all__:
        if name in LATER:
            continue
        value = getattr(ps, name)
        yield name, value
        for member, own in vars(value).items() if inspect.isclass(value) else ():
            is_documented = inspect.isroutine(own) or isinstance(own, property | cached_property)
            if is_documented and not member.startswith("_") and f"{name}.{member}" not in LATER:
                yield f"{name}.{member}", own.__func__ if isinstance(own, classmethod | staticmethod) else own


DOCUMENTED = dict(documented())
DOCUMENTED |= {f"{name}.{one}": getattr(module, one) for name, (module, names) in MODULES.items() for one in names}


def sections(text):
    """The lines of each section by its title; "" has those before the first. Raises ValueError for a broken heading."""
    found = {"": []}
    lines = text.split("\n")
    here, k = found[""], 0
    while k < len(lines):
        is_heading = k + 1 < len(lines) and re.fullmatch(r"-{3,}", lines[k + 1])
        if not is_heading:
            here.append(lines[k])
            k += 1
            continue
        title = lines[k]
        if title not in SECTIONS or title in found or len(lines[k + 1]) != len(title) or (here and here[-1]):
            raise ValueError(f"{title!r} is no heading of a new section, underlined, after an empty line")
        found[title] = here = []
        k += 2
    return found


def entries(lines):
    """The names that a section documents: `depth : (h, w) float`, `width, height : int`; each has a text below it."""
    found = []
    for line, below in pairwise([*lines, ""]):
        if line and not line.startswith(" "):
            if not below.startswith("    "):
                raise ValueError(f"{line!r} has no text below it")
            names, colon, kind = line.partition(" : ")
            if colon and not kind:
                raise ValueError(f"{line!r} has no type")
            found.extend(name.lstrip("*") for name in names.split(", "))
    return found


def parameters(value):
    """The names of the parameters with which callers call it."""
    if isinstance(value, property | cached_property) or (inspect.isclass(value) and issubclass(value, Exception)):
        return []
    return [name for name in inspect.signature(value).parameters if name not in ("self", "cls")]


def test_what_comes_later_is_public():
    assert {name.partition(".")[0] for name in LATER} <= set(ps.__all__)


def test_a_docstring_begins_with_one_sentence_in_one_line():
    firsts = {name: inspect.getdoc(value).split("\n") for name, value in DOCUMENTED.items()}
    assert [name for name, (first, *rest) in firsts.items() if not first.endswith(".") or any(rest[:1])] == []


def test_sections_have_numpys_form_and_order():
    wrong = []
    for name, value in DOCUMENTED.items():
        found = [title for title in sections(inspect.getdoc(value)) if title]
        if found != [title for title in SECTIONS if title in found]:
            wrong.append(name)
    assert wrong == []


def test_all_parameters_are_documented_and_no_others():
    wrong = []
    for name, value in DOCUMENTED.items():
        found = sections(inspect.getdoc(value))
        told = entries([*found.get("Parameters", ()), *found.get("Other Parameters", ())])
        if sorted(told) != sorted(parameters(value)):
            wrong.append(name)
    assert wrong == []


@pytest.mark.parametrize(
    "text",
    [
        "One.\n\nParameters\n---------\na : int\n    Text.",
        "One.\nParameters\n----------\na : int\n    Text.",
        "One.\n\nArguments\n---------\na : int\n    Text.",
        "One.\n\nParameters\n----------\na : int\n\nb : int\n    Text.",
        "One.\n\nParameters\n----------\na : \n    Text.",
    ],
)
def test_broken_sections_are_found(text):
    with pytest.raises(ValueError, match=r"is no heading|has no t"):
        entries(sections(text)["Parameters"])
