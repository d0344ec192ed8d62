"""The contact sheet of `pointshade info INPUT -o sheet.png`: four pictures, each in its place."""

import numpy as np

from pointshade_gl.files.pictures.picture_files import normals_to_rgb
from pointshade_gl.renderer.series import CAPTION, contact_sheet

from ..support import frames


def test_colours_and_depth_lie_above_normals_and_the_lit_frame(renderer):
    frame = frames.sphere_before_wall()
    height, width = frame.depth.shape
    sheet = contact_sheet(renderer, frame)
    high = height - int(1.5 * CAPTION) - 1  # of what no caption covers
    pictures = (
        renderer.render(frame, shading="none"),
        renderer.render(frame, show="depth"),  # as the key V of the window
        normals_to_rgb(renderer.estimate_normals(frame)),
        renderer.render(frame, exposure="sensor"),
    )
    for k, expected in enumerate(pictures):
        top, left = k // 2 * (len(sheet) - height), k % 2 * (sheet.shape[1] - width)
        np.testing.assert_array_equal(sheet[top : top + high, left : left + width], expected[:high])
        caption = sheet[top + high + 2 : top + height, left : left + 40, 0]
        assert caption.min() < 30 and caption.max() > 200
