"""The contact sheet of `pointshade info INPUT -o sheet.png`: four pictures, each in its place."""

import numpy as np

from pointshade_gl.files.pictures.picture_files import normals_to_rgb
from pointshade_gl.renderer.series import contact_sheet

from ..support import frames


def test_colours_and_depth_lie_above_normals_and_the_lit_frame(renderer):
    frame = frames.sphere_before_wall()
    height, width = frame.depth.shape
    sheet = contact_sheet(renderer, frame)
    top, bottom, left, right = sheet[:height], sheet[-height:], slice(width), slice(-width, None)
    np.testing.assert_array_equal(top[:, left], renderer.render(frame, shading="none"))
    np.testing.assert_array_equal(bottom[:, left], normals_to_rgb(renderer.estimate_normals(frame)))
    np.testing.assert_array_equal(bottom[:, right], renderer.render(frame, exposure="sensor"))
    shades, near = top[:, right].astype(int), frame.depth < np.median(frame.depth[frame.depth > 0])
    assert (shades[..., 0] == shades[..., 2]).all()  # grey: near is bright
    assert shades[near & (frame.depth > 0), 0].mean() > shades[~near, 0].mean()
