"""What the driver of this run can do."""

from __future__ import annotations

import os

import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.context.software_driver import wants_software
from pointshade_gl.scene.visible import MERGE


def need_compute(renderer: ps.Renderer) -> None:
    """Skips a test of the compute rasteriser where there is none. llvmpipe has it: without, a run of CI fails."""
    if renderer.context.gl.version_code >= 430:
        return
    if os.environ.get("POINTSHADE_REQUIRE_GL") == "1" and renderer.context.renderer.startswith("llvmpipe"):
        pytest.fail("llvmpipe has OpenGL 4.3, and hides it here: unset MESA_GL_VERSION_OVERRIDE")
    pytest.skip("the compute rasteriser needs OpenGL 4.3")


def places_of_a_vertex(renderer: ps.Renderer) -> int:
    """How many places between two pixels a vertex can have. GL promises 16; drivers give 256, and all say 16."""
    return 16 if "SwiftShader" in renderer.context.renderer else 256


def merging(renderer: ps.Renderer) -> float:
    """The tolerance with which a renderer merges splats: GPUs merge none."""
    with renderer.context.gl:
        return MERGE if wants_software(renderer.context.gl) else 0
