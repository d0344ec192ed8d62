"""One HTML file that shows a frame, a scene or a point cloud: the light under the mouse, drawn in the browser."""

from ..renderer.functions import by_shared_renderer
from .page_file import Cell, draw_cell, draw_page, write_page

__all__ = ["Cell", "draw_cell", "draw_page", "page_of", "save_page", "show", "write_page"]

page_of = by_shared_renderer(draw_page, "page_of")
save_page, show = by_shared_renderer(write_page, "save_page"), by_shared_renderer(draw_cell, "show")
