"""The architecture: layers that import one way, no circles of files or packages, few names at the top.

Imports for types alone count, too.
"""

import ast
import re
from collections import Counter
from itertools import pairwise

import pytest

from .support.places import ROOT as CHECKOUT

PACKAGE = "pointshade_gl"
ROOT = CHECKOUT / PACKAGE

# What each package at the top may import, besides itself: the arrows of the picture in docs/contributing.md.
LAYERS = {
    "notes": "",
    "checks": "notes",
    "scene": "notes checks",
    "estimation": "notes checks scene",
    "gpu": "notes checks scene estimation",
    "pipeline": "notes checks scene estimation gpu",
    "files": "notes checks scene",
    "renderer": "notes checks scene estimation gpu pipeline files",
    "viewer": "notes checks scene estimation gpu pipeline files renderer",
    "page": "notes checks scene estimation gpu pipeline files renderer",
    "batch": "notes checks scene estimation gpu pipeline files renderer page",
    "bench": "notes checks scene estimation gpu pipeline files renderer",
    "cli": "notes checks scene estimation gpu pipeline files renderer viewer page batch bench",
}
BESIDE = "__main__", "gltf", "sources"  # files at the top
MOST_AT_THE_TOP = 18
MOST_FILES = 220


def module_name(path):
    """pointshade_gl.files.depth for its file; a folder's __init__.py is the folder's module."""
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(ROOT.rglob("*.py"))}


def package_of(name):
    """The folder that a module lies in."""
    return name if MODULES[name].name == "__init__.py" else name.rpartition(".")[0]


def imports(name):
    """The modules of the package that a module imports: at its top, inside functions, for types."""
    package = package_of(name).split(".")
    for node in ast.walk(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in MODULES)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                if f"{source}.{alias.name}" in MODULES:
                    yield f"{source}.{alias.name}"
                elif source in MODULES:
                    yield source


GRAPH = {name: sorted(set(imports(name))) for name in MODULES}


def packages(graph):
    """The same between folders. A folder and one inside it are one room."""
    rooms = {package_of(name): set() for name in graph}
    for name, targets in graph.items():
        here = package_of(name)
        for there in map(package_of, targets):
            if not f"{here}.".startswith(f"{there}.") and not f"{there}.".startswith(f"{here}."):
                rooms[here].add(there)
    return {room: sorted(targets) for room, targets in rooms.items()}


def find_circle(graph):
    """Modules that import each other in a circle, from one of them back to itself; None without one."""
    done = set()

    def visit(name, way):
        if name in way:
            return [*way[way.index(name) :], name]
        if name not in done:
            for target in graph[name]:
                if circle := visit(target, [*way, name]):
                    return circle
            done.add(name)
        return None

    return next((circle for name in graph if (circle := visit(name, []))), None)


def layer(name):
    """The package at the top that a module belongs to; empty for the package itself."""
    return [*name.split("."), ""][1]


def test_no_files_import_each_other_in_a_circle():
    circle = find_circle(GRAPH)
    assert circle is None, " -> ".join(circle)


def test_no_packages_import_each_other_in_a_circle():
    circle = find_circle(packages(GRAPH))
    assert circle is None, " -> ".join(circle)


def test_every_package_at_the_top_is_a_layer():
    assert {layer(name) for name in MODULES} - {"", *BESIDE} == set(LAYERS)


@pytest.mark.parametrize("above", LAYERS)
def test_a_layer_imports_only_what_lies_below_it(above):
    allowed = {above, *LAYERS[above].split()}
    wrong = [
        f"{name} -> {target}"
        for name, targets in GRAPH.items()
        if layer(name) == above
        for target in targets
        if layer(target) not in {"", *BESIDE, *allowed}
    ]
    assert not wrong


def test_few_names_lie_at_the_top():
    top = [entry.name for entry in ROOT.iterdir() if entry.name != "__pycache__"]
    assert len(top) <= MOST_AT_THE_TOP, sorted(top)


def test_a_name_of_a_file_or_a_class_means_one_thing():
    files = [path.name for path in MODULES.values() if path.name != "__init__.py"]
    texts = (path.read_text(encoding="utf-8") for path in MODULES.values())
    classes = [name for text in texts for name in re.findall(r"^class (\w+)", text, re.MULTILINE)]
    assert [name for name, count in Counter(files + classes).items() if count > 1] == []
    assert len(MODULES) <= MOST_FILES


def test_the_contributors_page_draws_these_layers():
    page = (ROOT.parent / "docs" / "contributing.md").read_text(encoding="utf-8")
    picture = page.split("```mermaid", 1)[1].split("```", 1)[0]
    arrows = [line.split("-->") for line in picture.splitlines() if "-->" in line]
    drawn = {(above.strip(), below.strip()) for chain in arrows for above, below in pairwise(chain)}
    assert {name for arrow in drawn for name in arrow} == set(LAYERS)
    below = {name: set() for name in LAYERS}
    for name in LAYERS:  # in this order all that a layer may import has been seen
        for _, target in (arrow for arrow in drawn if arrow[0] == name):
            below[name] |= {target, *below[target]}
    assert below == {name: set(allowed.split()) for name, allowed in LAYERS.items()}


def test_a_circle_is_found_and_named():
    assert find_circle({"a": ["b"], "b": ["c", "d"], "c": [], "d": ["b"]}) == ["b", "d", "b"]
    assert find_circle({"a": ["b", "c"], "b": ["c"], "c": []}) is None
    assert find_circle({"a": ["a"]}) == ["a", "a"]


def test_the_graph_holds_what_functions_and_types_import():
    assert f"{PACKAGE}.bench.command" in GRAPH[f"{PACKAGE}.cli.commands.info_command"]  # inside a function
    assert f"{PACKAGE}.scene.graph" in GRAPH[f"{PACKAGE}.files.gltf"]  # under `if TYPE_CHECKING:`
    assert f"{PACKAGE}.scene.camera" in GRAPH[PACKAGE] and f"{PACKAGE}.notes.version" in GRAPH[f"{PACKAGE}.cli.main"]


def test_the_files_that_code_and_documents_name_are_there():
    files = [
        path
        for top in ("pointshade_gl", "shaders", "tests", "assets", "examples")
        for path in (CHECKOUT / top).rglob("*.*")
    ]
    names = {f"/{path.relative_to(CHECKOUT).as_posix()}" for path in files}
    named = re.compile(r"(?<![\w./%{-])(?:[a-z_]+/)*[a-z_]+\.(?:py|glsl|frag|vert|comp|js)\b")
    texts = [path for path in files if path.suffix in (".py", ".js", ".glsl", ".frag", ".vert", ".comp", ".md")]
    texts = [path for path in texts if path.relative_to(CHECKOUT).parts[0] in ("pointshade_gl", "shaders")]
    pages = set((CHECKOUT / "docs").glob("*.md")) - {CHECKOUT / "docs/contributing.md"}  # it makes files as examples
    for path in [*texts, CHECKOUT / "README.md", CHECKOUT / "CONTRIBUTING.md", *pages]:
        for name in set(named.findall(path.read_text(encoding="utf-8"))) - {"azure_kinect_mkv_reader.py", "three.js"}:
            assert any(known.endswith(f"/{name}") for known in names), f"{path.name} names {name}"
