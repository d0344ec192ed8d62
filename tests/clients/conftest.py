"""Other programs: those that are large are marked "clients", and run where somebody asks for them (`-m clients`)."""

from __future__ import annotations

import importlib
import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pointshade_gl as ps

from ..support.compare import compare_images, difference_figures, difference_picture
from ..support.gallery import SHOWN, as_stored, has_recordings, save_stored, stored_picture
from ..support.places import FAILURES

MEAN_ELSEWHERE = 1.0  # steps of 255 by which stored pictures may differ on other drivers than llvmpipe
IN_BLENDER = Path(__file__).parent / "in_blender"


def pytest_collection_modifyitems(config, items):
    """Leave the marked ones out of a run that does not name the mark."""
    if "clients" in config.getoption("markexpr"):
        return
    left = [item for item in items if item.get_closest_marker("clients")]
    config.hook.pytest_deselected(items=left)
    items[:] = [item for item in items if item not in set(left)]


def missing(what: str) -> None:
    """Skip the test, or fail it where all clients must be there."""
    if os.environ.get("POINTSHADE_REQUIRE_CLIENTS") == "1":
        pytest.fail(f"{what}: see tests/clients/run")
    pytest.skip(what)


@pytest.fixture
def stored(request, renderer):
    """check(name, picture): it is the gallery's, which --update-golden rewrites; recordings are needed for some."""

    def check(name: str, picture: np.ndarray) -> None:
        if not has_recordings(name):
            assert picture.std() > 5
            return
        if request.config.getoption("--update-golden"):
            if "llvmpipe" not in renderer.context.renderer:
                pytest.fail(f"stored pictures come from llvmpipe, this is {renderer.context.renderer}")
            save_stored(name, picture)
            pytest.skip(f"rewrote {name}")
        picture, expected = as_stored(name, picture), stored_picture(name)
        if "llvmpipe" in renderer.context.renderer and name not in SHOWN:
            complaint = compare_images(picture, expected)
        else:  # what is stored with loss, and pixels at edges, which differ between drivers: goldens have neither
            figures = difference_figures(picture, expected)
            complaint = f"they differ by {figures}" if figures["mean"] > MEAN_ELSEWHERE else ""
        if complaint:
            FAILURES.mkdir(exist_ok=True)
            ps.save_image(FAILURES / f"{name}.actual.png", picture)
            ps.save_image(FAILURES / f"{name}.stored.difference.png", difference_picture(picture, expected))
            pytest.fail(f"{name}: {complaint}; see {FAILURES}")

    return check


@pytest.fixture
def client() -> Callable[[str], Any]:
    """client(name): a module of another program. Without it: skipped, or failed under POINTSHADE_REQUIRE_CLIENTS=1."""

    def load(name: str) -> Any:
        if importlib.util.find_spec(name) is None:
            missing(f"no {name}")
        return importlib.import_module(name)

    return load


def blender_python() -> str:
    """The Python named by POINTSHADE_BPY_PYTHON, or this one: that which has Blender as the module bpy."""
    named = os.environ.get("POINTSHADE_BPY_PYTHON")
    if named is None and importlib.util.find_spec("bpy") is None:
        missing("no bpy, and no POINTSHADE_BPY_PYTHON")
    return named or sys.executable


@pytest.fixture
def blender(tmp_path) -> Callable[..., dict[str, np.ndarray]]:
    """blender(script, *arguments): the arrays that a script of in_blender saves to the .npz named after them."""
    python = blender_python()

    def run(script: str, *arguments: object) -> dict[str, np.ndarray]:
        saved = tmp_path / "from_blender.npz"
        command = [python, IN_BLENDER / script, *map(str, arguments), saved]
        clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        done = subprocess.run(command, cwd=tmp_path, env=clean, capture_output=True, text=True, timeout=240)
        assert done.returncode == 0 and saved.exists(), f"{done.stdout}\n{done.stderr}"
        with np.load(saved) as arrays:
            return dict(arrays)

    return run
