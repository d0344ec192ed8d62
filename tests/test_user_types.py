"""A user's script, as pyright and mypy see it: right calls pass, wrong names and wrong words are errors."""

import ast
import inspect
import json
import os
import re
import subprocess
import sys

import pytest

import pointshade_gl as ps

from .support.places import ROOT, TESTS

pytestmark = pytest.mark.system

SCRIPT = (TESTS / "support" / "user_script.py").read_text(encoding="utf-8")
CHECKERS = {
    "pyright": ["--outputjson", "--pythonpath", sys.executable, "-p", "."],
    "mypy": ["--strict", "--output", "json", "--cache-dir", os.devnull, "script.py"],
}


def members(kind):
    """The public fields, methods and properties that a class of ours defines; with each, whether the class has it."""
    for one in (one for one in kind.__mro__ if one.__module__.startswith(ps.__name__)):
        for name in {*vars(one), *vars(one).get("__annotations__", ())}:
            own = vars(one).get(name)
            is_older = isinstance(own, property) and (own.__doc__ or "").startswith("Older name of")
            if not name.startswith("_") and not is_older:
                yield name, isinstance(own, classmethod)


def public_names():
    """How a script writes each public name: `ps.render`, `ps.gltf.load_scene`, `camera.project` of a Camera."""
    for prefix, module in [("ps", ps), *((f"ps.{name}", getattr(ps, name)) for name in ps._MODULES)]:
        own = [name for name, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__]
        for name in getattr(module, "__all__", [one for one in own if not one.startswith("_")]):
            yield f"{prefix}.{name}"
            value = getattr(module, name)
            made = re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()
            for member, of_class in members(value) if inspect.isclass(value) else ():
                yield f"{prefix}.{name}.{member}" if of_class else f"{made}.{member}"


def variables(tree):
    """The names that a script gives to values."""
    stored = (node for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store))
    return sorted({node.id for node in stored})


def errors_by_line(checker, folder):
    """What a checker says of script.py, by the number of the line, from 1."""
    (folder / "pyrightconfig.json").write_text(json.dumps({"extraPaths": [str(ROOT)], "typeCheckingMode": "strict"}))
    line = [sys.executable, "-m", checker, *CHECKERS[checker]]
    environment = {**os.environ, "MYPYPATH": str(ROOT)}
    said = subprocess.run(line, capture_output=True, text=True, timeout=250, cwd=folder, env=environment).stdout
    if checker == "pyright":
        found = json.loads(said)["generalDiagnostics"]
        return {one["range"]["start"]["line"] + 1: one["message"] for one in found if one["severity"] == "error"}
    found = [one for one in map(json.loads, said.splitlines()) if one["file"] == "script.py"]
    return {one["line"]: one["message"] for one in found if one["severity"] == "error"}


def test_a_script_uses_each_public_name():
    used = {ast.unparse(node) for node in ast.walk(ast.parse(SCRIPT)) if isinstance(node, ast.Attribute)}
    assert set(public_names()) - used == set()


@pytest.mark.parametrize("checker", CHECKERS)
def test_right_calls_pass_and_each_wrong_one_is_an_error(checker, tmp_path):
    """No type has every name: `picture.nothing`, of each variable and of each public name, is an error as well."""
    unknown = [f"{name}.nothing  # wrong" for name in (*variables(ast.parse(SCRIPT)), *public_names())]
    lines = [*SCRIPT.splitlines(), *unknown]
    (tmp_path / "script.py").write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = errors_by_line(checker, tmp_path)
    wrong = {number for number, line in enumerate(lines, 1) if line.endswith("# wrong")}
    assert [lines[number - 1] for number in sorted(wrong - set(found))] == []
    assert {lines[number - 1]: message for number, message in found.items() if number not in wrong} == {}
