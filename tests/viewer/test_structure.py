"""The window's files: one application, and what decides needs neither GL nor a window."""

import ast

import pytest

from ..test_structure import GRAPH, MODULES, PACKAGE

VIEWER = f"{PACKAGE}.viewer"
FILES = {name: path for name, path in MODULES.items() if name.startswith(f"{VIEWER}.")}


def named(path):
    """All names that a file uses or imports, also where only types need them."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom | ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.Name):
            yield node.id


WINDOW = {name: {target for target in GRAPH[name] if target in FILES} for name in FILES}


def test_only_the_applications_files_name_it():
    users = {name for name, path in FILES.items() if "Viewer" in named(path)}
    assert users == {f"{VIEWER}.viewer", f"{VIEWER}.canvas"}


@pytest.mark.parametrize("name", ["controller", "keys", "state", "events", "document"])
def test_the_pure_files_need_neither_gl_nor_a_window(name):
    drawing = {f"{VIEWER}.{one}" for one in ("window", "screen", "panel_sections", "viewer")}
    reached, todo = set(), [f"{VIEWER}.{name}"]
    while todo:
        reached.add(todo.pop())
        todo = [target for one in reached for target in WINDOW[one] if target not in reached]
    assert not reached & drawing
    libraries = {"moderngl", "glfw", "imgui_bundle", "imgui"}
    assert not {one for file in reached for one in named(FILES[file])} & libraries
