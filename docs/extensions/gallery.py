"""The gallery of the documentation: sphinx-gallery makes the pages of what lies in examples/, this runs the examples.

Each runs as a user types it, in a folder of its own, as the tests run it; so that whatever its language, its page shows
the picture and what it prints. Those that want other programs, and a notebook, are shown with their stored pictures.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import tempfile
import textwrap
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from PIL import Image
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

from tests.support.example_scripts import run_example
from tests.support.gallery import SECTIONS, SHOWN, Example, example, examples, runs_alone, stored_picture, summary

FOLDER = "auto_examples"
CONFIGURATION = {
    "examples_dirs": "../examples",
    "gallery_dirs": FOLDER,
    "example_extensions": {".py", ".sh"},
    "nested_sections": False,  # a folder with a README is one example
    "plot_gallery": False,  # it would run Python only, and in its own process
    "copyfile_regex": r".*\.ipynb",
    "notebook_extensions": set(),
    "download_all_examples": False,
    "min_reported_time": 1e9,
    "show_signature": False,
    "backreferences_dir": f"{FOLDER}/used",
    "doc_module": ("pointshade_gl",),
}
_printed: dict[str, str] = {}


def draw(app: Sphinx) -> None:
    """Run what is new since the last build, and lay each picture where sphinx-gallery looks for it."""
    images = Path(app.srcdir) / FOLDER / "images"
    images.mkdir(parents=True, exist_ok=True)
    os.environ.setdefault("MESA_SHADER_CACHE_DIR", str(Path(app.doctreedir) / "compiled-shaders"))
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        list(threads.map(lambda one: _draw(one, images), examples()))
    for one in examples():
        if one.path.suffix == ".ipynb":
            _, *cells = json.loads(one.path.read_text(encoding="utf-8"))["cells"]
            _by_hand(one, images.parent, [(cell["cell_type"] == "code", "".join(cell["source"])) for cell in cells])
        elif one.path.name == "__init__.py":
            code = one.path.read_text(encoding="utf-8").split('"""', 2)[2].strip()
            _by_hand(one, images.parent, [(True, code)])


def _draw(one: Example, images: Path) -> None:
    picture = images / f"sphx_glr_{one.name}_001.png"
    if not runs_alone(one):
        Image.fromarray(stored_picture(one.name)).save(picture)
        return
    printed = picture.with_suffix(".txt")
    if not picture.exists() or picture.stat().st_mtime < one.path.stat().st_mtime:
        with tempfile.TemporaryDirectory() as folder:
            try:
                text = run_example(Path(folder), one.name)
            except AssertionError as error:
                raise ExtensionError(f"{one.path.name} failed:\n{error}") from error
            printed.write_text(text, encoding="utf-8")
            shutil.copyfile(Path(folder) / f"{one.name}.png", picture)
        if one.name in SHOWN:  # recordings of others, which may not be here
            Image.fromarray(stored_picture(one.name)).save(picture)
    _printed[one.name] = printed.read_text(encoding="utf-8")


def _by_hand(one: Example, folder: Path, cells: list[tuple[bool, str]]) -> None:
    """Write the page of a notebook or a folder: its title, and code and text. sphinx-gallery reads scripts only."""
    parts = [f".. _sphx_glr_{FOLDER}_{one.path.name}:\n\n{one.title}.\n\n"]
    for is_code, text in cells:
        shown = ".. code-block:: python\n\n" + textwrap.indent(text, "    ") if is_code else text
        parts.append(f"{shown}\n\n")
    shutil.copyfile(one.path, folder / one.path.name)
    parts.append(f".. _sphx_glr_download_{one.name}:\n")  # where the cells end, as in pages of scripts
    (folder / f"{one.name}.rst").write_text("".join(parts), encoding="utf-8")
    thumbnail = folder / "images" / "thumb" / f"sphx_glr_{one.name}_thumb.png"
    thumbnail.parent.mkdir(exist_ok=True)
    Image.fromarray(stored_picture(one.name)).save(thumbnail)


def dress(app: Sphinx, document: str, source: list[str]) -> None:
    """Put title, picture and output into the page of an example, and sections into the page of all of them."""
    folder, _, name = document.rpartition("/")
    if document == f"{FOLDER}/index":
        source[0] = _index()
    elif folder == FOLDER and name in {one.name for one in examples()}:
        source[0] = _page(example(name), source[0])


def _page(one: Example, text: str) -> str:
    start = re.search(rf"^{re.escape(one.title)}\.?\n", text, re.MULTILINE)
    code = re.search(r"^\.\. (_sphx_glr_download|GENERATED FROM|code-block)", text[start.end() :], re.MULTILINE)
    end = start.end() + code.start()
    words = re.sub(r"(?<!`)`([^`]+)`(?!`)", r"``\1``", one.text)
    picture = f".. image:: images/sphx_glr_{one.name}_001.png\n   :alt: {one.title}\n   :class: sphx-glr-single-img"
    output = _printed.get(one.name, "").strip() if one.path.suffix == ".py" else ""
    shown = f"It prints:\n\n.. code-block:: text\n\n{textwrap.indent(output, '    ')}" if output else ""
    body = text[end : text.find(".. _sphx_glr_download")]
    label = f".. _sphx_glr_{FOLDER}_{one.path.name}:"
    download = f":download:`Download {one.path.name} <{one.path.name}>`"
    heading = f"{one.title}\n{'=' * len(one.title)}"
    return "\n\n".join([label, heading, words, picture, body, shown, download, ""])


def _index() -> str:
    parts = ["Gallery\n=======\n", "Each picture leads to the script, or the command line, that made it.\n"]
    for section, names in SECTIONS.items():
        parts += [f"{section}\n{'-' * len(section)}\n", ".. raw:: html\n\n    <div class='sphx-glr-thumbnails'>\n"]
        parts += [_thumbnail(example(name)) for name in names]
        parts.append(".. raw:: html\n\n    </div>\n")
    pages = "\n".join(f"   {one.name}" for one in examples())
    return "\n".join([*parts, f".. toctree::\n   :hidden:\n\n{pages}\n"])


def _thumbnail(one: Example) -> str:
    name = one.name
    tip = summary(one).replace("`", "").replace("'", "&#39;")
    return (
        f".. raw:: html\n\n    <div class='sphx-glr-thumbcontainer' tooltip='{tip}'>\n\n"
        f".. image:: images/thumb/sphx_glr_{name}_thumb.png\n   :alt: {one.title}\n\n"
        f":doc:`{one.title} <{name}>`\n\n"
        f".. raw:: html\n\n    <div class='sphx-glr-thumbnail-title'>{one.title}</div>\n    </div>\n"
    )


def setup(app: Sphinx) -> dict[str, bool]:
    """Run before sphinx-gallery writes the pages, and change them as they are read."""
    app.connect("builder-inited", draw, priority=400)
    app.connect("source-read", dress)
    return {"parallel_read_safe": True}
