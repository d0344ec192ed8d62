"""Imports: no circles, and only tests and the benchmark import the mirror."""

import ast
from pathlib import Path

PACKAGE = "pointshade_gl"
ROOT = Path(__file__).resolve().parent.parent / PACKAGE


def module_name(path):
    """pointshade_gl.files.depth for its file; a folder's __init__.py is the folder's module."""
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(ROOT.rglob("*.py"))}


def running(tree):
    """All nodes of a syntax tree except those below `if TYPE_CHECKING:`."""
    yield tree
    guarded = isinstance(tree, ast.If) and "TYPE_CHECKING" in ast.unparse(tree.test)
    for child in tree.orelse if guarded else ast.iter_child_nodes(tree):
        yield from running(child)


def imports(name):
    """The modules of the package that a module imports when it runs, at its top or inside a function."""
    path = MODULES[name]
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in running(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in MODULES)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            source = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                if f"{source}.{alias.name}" in MODULES:
                    yield f"{source}.{alias.name}"
                elif source in MODULES:
                    yield source


GRAPH = {name: sorted(set(imports(name))) for name in MODULES}


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


def test_no_modules_import_each_other_in_a_circle():
    circle = find_circle(GRAPH)
    assert circle is None, " -> ".join(circle)


def test_only_the_benchmark_and_tests_import_the_reference():
    mirror = f"{PACKAGE}.reference"
    users = {name for name, targets in GRAPH.items() if any(target.startswith(mirror) for target in targets)}
    assert {name for name in users if not name.startswith((mirror, f"{PACKAGE}.bench"))} == set()


def test_a_circle_is_found_and_named():
    assert find_circle({"a": ["b"], "b": ["c", "d"], "c": [], "d": ["b"]}) == ["b", "d", "b"]
    assert find_circle({"a": ["b", "c"], "b": ["c"], "c": []}) is None
    assert find_circle({"a": ["a"]}) == ["a", "a"]


def test_the_graph_holds_what_functions_import_and_not_what_only_types_need():
    assert f"{PACKAGE}.bench.command" in GRAPH[f"{PACKAGE}.cli"]  # inside a function
    assert f"{PACKAGE}.scene" not in GRAPH[f"{PACKAGE}.gltf"]  # under `if TYPE_CHECKING:`
    assert f"{PACKAGE}.camera" in GRAPH[PACKAGE] and PACKAGE in GRAPH[f"{PACKAGE}.cli"]
