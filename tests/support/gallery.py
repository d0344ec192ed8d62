"""The gallery: which examples there are, in which order, and what they say about themselves.

`examples/README.md` and the documentation show what is listed here; `pytest --update-golden
tests/clients/test_gallery.py` rewrites the pictures and that page.
"""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path
from typing import NamedTuple

from .example_scripts import EXAMPLES, PICTURES

SECTIONS = {
    "First pictures": ["lit_frame", "three_lamps"],
    "In other programs": [
        "jupyter", "marimo_notebook", "gradio_light", "comfyui_node", "fastapi_upload", "rerun_log", "blender_cycles",
        "open3d_roundtrip", "trimesh_roundtrip",
    ],
}  # fmt: skip
COLUMNS = 3
INTRODUCTION = """# Gallery

Short scripts and command lines, each with the picture that it makes. They run from any folder, without a network, with what
is built in; your own frame takes the place of `vase`. Copy what you need. Those in other programs say at their top what
to install.
"""


class Example(NamedTuple):
    """An example: its file, its title, and what it says below the title."""

    path: Path
    title: str
    text: str

    @property
    def picture(self) -> Path:
        """Where its stored picture lies."""
        return PICTURES / f"{self.path.stem}.png"


def example(name: str) -> Example:
    """Read an example by its name without a suffix: the title, and the text up to the end of its comment."""
    (path,) = [path for path in EXAMPLES.glob(f"{name}.*") if path.suffix in (".py", ".sh", ".ipynb")]
    source = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        said = ast.get_docstring(ast.parse(source)) or ""
    elif path.suffix == ".sh":
        lines = source.partition("\n\n")[0].splitlines()
        said = "\n".join(line.removeprefix("#").strip() for line in lines)
    else:
        said = "".join(json.loads(source)["cells"][0]["source"]).removeprefix("# ")
    title, _, text = said.partition("\n")
    return Example(path, title.strip().rstrip("."), text.strip())


def runs_alone(one: Example) -> bool:
    """Whether it needs nothing but this package; test_examples.py runs the others beside their programs."""
    return one.path.stem not in SECTIONS["In other programs"]


def examples() -> list[Example]:
    """Return all of them, in the order of the gallery."""
    return [example(name) for names in SECTIONS.values() for name in names]


def gallery_page() -> str:
    """examples/README.md: a table of pictures for each section."""
    parts = [INTRODUCTION]
    for section, names in SECTIONS.items():
        cells = [_cell(example(name)) for name in names]
        cells += [""] * (-len(cells) % COLUMNS)
        rows = [cells[start : start + COLUMNS] for start in range(0, len(cells), COLUMNS)]
        table = ["| " * COLUMNS + "|", "|---" * COLUMNS + "|", *(f"| {' | '.join(row)} |" for row in rows)]
        parts.append("\n".join([f"## {section}", "", *table, ""]))
    return "\n".join(parts)


def _cell(one: Example) -> str:
    name = one.path.name
    return f"[![{one.title}](pictures/{one.picture.name})]({name})<br>**[{one.title}]({name})**<br>{summary(one)}"


def summary(one: Example) -> str:
    """The first sentence below the title."""
    return re.split(r"(?<=\.)\s", re.sub(r"\s+", " ", one.text.split("\n\n")[0]))[0]
