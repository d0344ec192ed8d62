"""One HTML file that shows a frame or a scene: the light under the mouse, drawn in the browser."""

from ..shared_renderer import by_shared_renderer
from .write import draw_page, write_page

__all__ = ["draw_page", "page_of", "save_page", "write_page"]

page_of, save_page = by_shared_renderer(draw_page), by_shared_renderer(write_page)
page_of.__name__, save_page.__name__ = "page_of", "save_page"  # as help() shows them
