"""The gallery: which examples there are, in which order, what they say about themselves, and what their pictures show.

`examples/README.md` and the documentation show what is listed here; `pytest --update-golden
tests/clients/test_gallery.py` rewrites the pictures and that page. Pictures of what others recorded are drawn and
compared where REAL_FRAMES, of places.py, has those recordings.
"""

from __future__ import annotations

import ast
import io
import json
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from .example_scripts import EXAMPLES, PICTURES
from .places import REAL_FRAMES

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

Short scripts and command lines, each with a picture that it makes. They run from any folder, without a network, with
what is built in. Most take your own recording as their argument: those whose pictures show [recordings of
others](#what-the-pictures-show) were given one. Copy what you need. Those in other programs say at their top what to
install.
"""


class Recording(NamedTuple):
    """What somebody made and lets others show: its folder or file, who, under which licence, and where it is from."""

    path: str
    what: str
    who: str
    licence: str
    where: str

    @property
    def found(self) -> Path:
        """Where it lies on this machine, if it does."""
        return REAL_FRAMES / self.path


RECORDINGS = {
    "office": Recording(
        "tum_fr3_kinect1", "an office, by a Kinect", "TUM RGB-D benchmark, Sturm et al. 2012", "CC BY 4.0",
        "https://cvg.cit.tum.de/data/datasets/rgbd-dataset",
    ),
    "room": Recording(
        "icl_livingroom_23views", "a living room, 23 views", "ICL-NUIM, Handa et al. 2014, and Choi et al. 2015",
        "CC BY 3.0", "https://github.com/isl-org/open3d_downloads",
    ),
    "chair": Recording(
        "realsense_box_6", "a rocking chair, by a RealSense", "Feiyu Chen 2019", "MIT",
        "https://github.com/felixchenfy/ros_detect_planes_from_depth_img",
    ),
    "box": Recording(
        "realsense_box_2", "a box, by a RealSense", "Feiyu Chen 2019", "MIT",
        "https://github.com/felixchenfy/ros_detect_planes_from_depth_img",
    ),
    "cups": Recording(
        "d435_table_exr_halffloat", "cups on a table, by a RealSense", "ClearGrasp, Sajjan et al. 2020", "CC BY 4.0",
        "https://github.com/Shreeyak/cleargrasp",
    ),
    "shelves": Recording(
        "iphone_lidar_promptda", "a library, by an iPhone", "PromptDA, Lin et al. 2024", "Apache 2.0",
        "https://github.com/DepthAnything/PromptDA",
    ),
    "skatepark": Recording(
        "stereo_skatepark_65520", "a skate park, by a stereo camera", "LingBot-Depth", "Apache 2.0",
        "https://github.com/Robbyant/lingbot-depth",
    ),
    "bowls": Recording(
        "stereo_metal_floor", "bowls on a floor, by a stereo camera", "LingBot-Depth", "Apache 2.0",
        "https://github.com/Robbyant/lingbot-depth",
    ),
    "knot": Recording(
        "d2nt_3f2n_gt_normals", "a torus knot, a CAD model", "3F2N, Fan et al. 2021, and D2NT, Feng et al. 2023", "MIT",
        "https://github.com/fengyi233/depth-to-normal-translator",
    ),
    "park": Recording(
        "lidar_autzen/autzen_trim.laz", "a park in Oregon, by an aircraft's LiDAR", "PDAL contributors", "BSD 3-clause",
        "https://github.com/PDAL/PDAL/tree/master/test/data/laz",
    ),
}  # fmt: skip
SHOWN: dict[str, list[str]] = {  # what an example is given for its stored picture
    "lit_frame": ["room"], "photograph": ["shelves"], "realsense_folder": ["chair"],
    "page": ["chair"], "environments": ["knot"], "unlight": ["shelves"], "shared_albedo": ["shelves"],
    "lit_cloud": ["park"], "export_points": ["shelves"], "normal_maps": ["office"], "view_depth": ["room"],
    "estimators": ["knot"], "own_normals": ["office"], "holes": ["cups"], "three_cameras": ["room"],
    "align_views": ["room"], "temporal_film": ["room"], "render_pool": ["room"], "own_context": ["knot"],
    "batch_folders": ["office", "room", "chair", "box", "cups", "shelves", "skatepark", "bowls"],
    "canvas_server": ["room"], "gradio_light": ["room"], "fastapi_upload": ["room"], "rerun_log": ["room"],
    "open3d_roundtrip": ["room"], "trimesh_roundtrip": ["knot"],
}  # fmt: skip
QUALITY = 90  # of their pictures, which are photographs: without loss they would be five times as large


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


def has_recordings(name: str) -> bool:
    """Whether all that the stored picture of an example shows is on this machine."""
    return all(RECORDINGS[one].found.exists() for one in SHOWN.get(name, ()))


def arguments(name: str) -> list[str]:
    """What an example is given for its stored picture; nothing where the recordings are not on this machine."""
    return [str(RECORDINGS[one].found) for one in SHOWN.get(name, ()) if has_recordings(name)]


def stored_picture(name: str) -> np.ndarray:
    """The stored picture of an example, (h, w, 4) uint8."""
    with Image.open(PICTURES / f"{name}.webp") as image:
        return np.asarray(image.convert("RGBA"))


def save_stored(name: str, picture: np.ndarray) -> None:
    """Store a picture in as few bytes as can be: photographs with a little loss, others without."""
    (PICTURES / f"{name}.webp").write_bytes(_encoded(name, picture))


def as_stored(name: str, picture: np.ndarray) -> np.ndarray:
    """What reading a picture would give after storing it, (h, w, 4) uint8."""
    if name not in SHOWN:  # which is stored without loss, and slowly
        return np.asarray(Image.fromarray(picture).convert("RGBA"))
    with Image.open(io.BytesIO(_encoded(name, picture))) as image:
        return np.asarray(image.convert("RGBA"))


def _encoded(name: str, picture: np.ndarray) -> bytes:
    loss = {"quality": QUALITY} if name in SHOWN else {"lossless": True, "quality": 100, "exact": True}
    data = io.BytesIO()
    Image.fromarray(picture).save(data, "WEBP", method=6, **loss)
    return data.getvalue()


def gallery_page() -> str:
    """examples/README.md: a table of pictures for each section, and whose recordings they show."""
    parts = [INTRODUCTION]
    for section, names in SECTIONS.items():
        cells = [_cell(example(name)) for name in names]
        cells += [""] * (-len(cells) % COLUMNS)
        rows = [cells[start : start + COLUMNS] for start in range(0, len(cells), COLUMNS)]
        table = ["| " * COLUMNS + "|", "|---" * COLUMNS + "|", *(f"| {' | '.join(row)} |" for row in rows)]
        parts.append("\n".join([f"## {section}", "", *table, ""]))
    credits = ["## What the pictures show", "", "| what | by | licence | examples |", "|---|---|---|---|"]
    for name, one in RECORDINGS.items():
        shown = ", ".join(f"[{other}]({example(other).link})" for other, given in SHOWN.items() if name in given)
        credits.append(f"| [{one.what}]({one.where}) | {one.who} | {one.licence} | {shown} |")
    others = "The other pictures show what is built in, which has the licence of this repository."
    return "\n".join([*parts, *credits, "", others, ""])


def _cell(one: Example) -> str:
    shown = f"[![{one.title}](pictures/{one.picture.name})]({one.link})"
    return f"{shown}<br>**[{one.title}]({one.link})**<br>{summary(one)}"


def summary(one: Example) -> str:
    """The first sentence below the title."""
    return re.split(r"(?<=\.)\s", re.sub(r"\s+", " ", one.text.split("\n\n")[0]))[0]
