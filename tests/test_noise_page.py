"""The tables of docs/noise-model.md list every constant of the noise model, with the value that the code has."""

import ast
import re
from contextlib import suppress

import numpy as np
import pytest

from .support.places import ROOT

PAGE = (ROOT / "docs/noise-model.md").read_text(encoding="utf-8")
TABLES: dict[str, dict[str, str]] = {}
for path, rows in re.findall(r"^`([\w/]+\.(?:py|glsl))`\n(.*?)(?=^#|\Z)", PAGE, re.MULTILINE | re.DOTALL):
    found = re.findall(r"^\| `(\w+)` \| (.*?) \| (?:derived|published|measured|chosen) \| \S", rows, re.MULTILINE)
    TABLES.setdefault(path, {}).update(found)
WHOLE = "estimation/noise_model.py", ".glsl"  # files of which every constant is on the page
MATHS = {"radians": np.radians, "sqrt": np.sqrt}


def constants_of(path):
    """{name: value}: the numbers that a module of Python or a file of GLSL names in capitals."""
    text = (ROOT / path).read_text(encoding="utf-8")
    if path.endswith(".glsl"):
        found = re.findall(r"^const (?:float|int) (\w+) = (.*?);", text, re.MULTILINE)
        return {name: float(value) for name, value in found}
    names, known = [], MATHS | {"np": np}
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign) and not any(isinstance(part, ast.Lambda) for part in ast.walk(node)):
            target = node.targets[0]
            names += [one.id for one in getattr(target, "elts", [target]) if isinstance(one, ast.Name)]
            if names and names[-1].isupper():
                with suppress(NameError):  # a number of another module
                    exec(ast.unparse(node), known)
    return {name: known[name] for name in names if name.isupper() and name in known}


def test_there_are_tables():
    assert len(TABLES) > 15 and all(TABLES.values())


@pytest.mark.parametrize("path", TABLES)
def test_a_table_lists_what_the_file_has(path):
    expected, known = constants_of(path), dict(MATHS)
    found = {}
    for name, value in TABLES[path].items():
        found[name] = known[name] = eval(value, known)
    if not path.endswith(WHOLE):
        expected = {name: expected[name] for name in found}
    assert found == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("folder", ["pointshade_gl/estimation/noise_*.py", "shaders/common/noise_*.glsl"])
def test_no_file_of_the_model_is_left_out(folder):
    files = {path.relative_to(ROOT).as_posix() for path in ROOT.glob(folder)}
    assert {path for path in files if constants_of(path)} <= set(TABLES)
