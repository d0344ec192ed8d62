"""Qt window with two views.

One object on two canvases of rendercanvas in a Qt window: the light is under the mouse in each, drags turn them one by
one, and a slider makes the light of both stronger or weaker.

Install::

    pip install 'pointshade-gl[canvas]' PySide6

`python qt_views.py` shows the built-in vase, or the frame that is its argument.
"""

import sys
from dataclasses import replace

from PySide6 import QtCore, QtWidgets  # before rendercanvas, which takes the Qt that is there
from rendercanvas.qt import QRenderWidget

import pointshade_gl as ps


class Views(QtWidgets.QWidget):
    """Two views of a frame above a slider."""

    def __init__(self, path: str):
        super().__init__()
        self.setWindowTitle("two views")
        places = ps.View(), ps.View(yaw=40, pitch=10)
        self.views = [ps.canvas(path, QRenderWidget(max_fps=60), place=place) for place in places]
        self.slider = QtWidgets.QSlider(QtCore.Qt.Orientation.Horizontal, minimum=0, maximum=200, value=100)
        self.slider.valueChanged.connect(self.set_light)

        grid = QtWidgets.QGridLayout(self)
        for column, view in enumerate(self.views):
            grid.addWidget(view.canvas, 0, column)
            grid.setColumnStretch(column, 1)
        grid.addWidget(self.slider, 1, 0, 1, 2)
        grid.setRowStretch(0, 1)

    def set_light(self, percent: int) -> None:
        for view in self.views:
            view.state = replace(view.state, light_intensity=percent / 100)
            view.canvas.request_draw()  # it is asked for a new picture only where something changes


if __name__ == "__main__":
    app = QtWidgets.QApplication(sys.argv)
    window = Views(*sys.argv[1:2] or ["vase"])
    window.resize(1000, 460)
    window.show()
    sys.exit(app.exec())
