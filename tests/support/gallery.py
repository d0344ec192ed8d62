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

import numpy as np
from PIL import Image

from .example_scripts import EXAMPLES, PICTURES

SECTIONS = {
    "First pictures": ["lit_frame", "turntable", "paper_figure", "photograph", "realsense_folder", "page"],
    "Light": ["three_lamps", "soft_shadows", "environments", "unlight", "shared_albedo"],
    "Scenes and point clouds": ["two_objects", "other_view", "lit_cloud", "export_points", "splat_forms"],
    "Depth and normals": ["normal_maps", "view_depth", "estimators", "own_normals", "holes"],
    "Several views, films, many pictures": [
        "three_cameras", "align_views", "temporal_film", "batch_folders", "render_pool", "own_context",
    ],
    "In other programs": [
        "jupyter", "canvas_notebook", "marimo_notebook", "qt_views", "canvas_server", "gradio_light", "comfyui",
        "fastapi_upload", "rerun_log", "blender_cycles", "open3d_roundtrip", "open3d_mesh", "trimesh_roundtrip",
    ],
}  # fmt: skip
ELSEWHERE = {"page", *SECTIONS["In other programs"]}  # what other programs show: the stored picture is theirs
COLUMNS = 3
INTRODUCTION = """# Gallery

Short scripts and command lines, each with the picture that it makes. They run from any folder, without a network, with
what is built in; your own frame takes the place of `vase`. Copy what you need. Those in other programs say at their top
what to install.
"""


class Example(NamedTuple):
    """An example: its file (__init__.py of a folder), its title, and what it says below the title."""

    path: Path
    title: str
    text: str

    @property
    def name(self) -> str:
        """Its name: of its file without a suffix, or of its folder."""
        return self.path.parent.name if self.path.name == "__init__.py" else self.path.stem

    @property
    def link(self) -> str:
        """What the page of all examples leads to: its file, or what its folder says about itself."""
        return f"{self.name}/README.md" if self.path.name == "__init__.py" else self.path.name

    @property
    def picture(self) -> Path:
        """Where its stored picture lies."""
        return PICTURES / f"{self.name}.webp"


def example(name: str) -> Example:
    """Read an example by its name without a suffix: the title, and the text up to the end of its comment."""
    found = [*EXAMPLES.glob(f"{name}.*"), *EXAMPLES.glob(f"{name}/__init__.py")]
    (path,) = [path for path in found if path.suffix in (".py", ".sh", ".ipynb")]
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
    """Whether this package alone makes its picture; tests run the others beside their programs."""
    return one.name not in ELSEWHERE


def examples() -> list[Example]:
    """Return all of them, in the order of the gallery."""
    return [example(name) for names in SECTIONS.values() for name in names]


def stored_picture(name: str) -> np.ndarray:
    """The stored picture of an example, (h, w, 4) uint8."""
    with Image.open(PICTURES / f"{name}.webp") as image:
        return np.asarray(image.convert("RGBA"))


def save_stored(name: str, picture: np.ndarray) -> None:
    """Store a picture, without loss, in as few bytes as can be."""
    Image.fromarray(picture).save(PICTURES / f"{name}.webp", lossless=True, quality=100, method=6, exact=True)


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
    shown = f"[![{one.title}](pictures/{one.picture.name})]({one.link})"
    return f"{shown}<br>**[{one.title}]({one.link})**<br>{summary(one)}"


def summary(one: Example) -> str:
    """The first sentence below the title."""
    return re.split(r"(?<=\.)\s", re.sub(r"\s+", " ", one.text.split("\n\n")[0]))[0]
