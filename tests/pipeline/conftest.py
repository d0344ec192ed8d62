"""What several tests of pictures share."""

import pytest

import pointshade_gl as ps

from ..support.drivers import need_compute


@pytest.fixture(scope="module", params=["compute", "points"])
def rasterizer(request, renderer):
    """A renderer for each rasteriser, which has its name."""
    if request.param == "compute":
        need_compute(renderer)
    with ps.Renderer(rasterizer=request.param) as made:
        made.name = request.param
        yield made
