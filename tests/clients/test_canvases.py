"""The examples on rendercanvas' canvases: in Qt, in a notebook, and for several browsers at once."""

import importlib.util
import io
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from ..support.example_scripts import EXAMPLES
from ..support.places import ROOT
from .conftest import missing

pytestmark = [pytest.mark.clients, pytest.mark.gl]
IN_QT = """
import json, sys
from PySide6 import QtCore, QtTest, QtWidgets

sys.path.insert(0, sys.argv[1])
import qt_views
import pointshade_gl as ps

app = QtWidgets.QApplication([])
window = qt_views.Views(ps.load_frame("vase"))
window.resize(700, 340)
window.show()
left, right = (view.canvas for view in window.views)
told = {}


def turn(until):
    for _ in range(600):
        QtTest.QTest.qWait(20)
        if until():
            return
    raise SystemExit("nothing comes")


def picture(name):
    window.grab().save(name)


turn(lambda: all(view.drawn for view in window.views))
left_light, right_light = (view.state.light_at for view in window.views)
QtTest.QTest.mouseMove(left, QtCore.QPoint(100, 100))
turn(lambda: window.views[0].control.mouse.last is not None)
QtTest.QTest.mouseMove(left, QtCore.QPoint(200, 150))
turn(lambda: window.views[0].state.light_at != left_light)
told["the other's light stays"] = window.views[1].state.light_at == right_light
picture("before.png")

QtTest.QTest.mousePress(right, QtCore.Qt.LeftButton, pos=QtCore.QPoint(100, 100))
QtTest.QTest.mouseMove(right, QtCore.QPoint(160, 100))
QtTest.QTest.mouseRelease(right, QtCore.Qt.LeftButton, pos=QtCore.QPoint(160, 100))
turn(lambda: window.views[1].state.yaw != 0)
told["yaws"] = [view.state.yaw for view in window.views]

QtTest.QTest.keyClick(left, QtCore.Qt.Key_B)
turn(lambda: not window.views[0].state.lit)
QtTest.QTest.keyClick(left, QtCore.Qt.Key_Z, QtCore.Qt.ControlModifier)
turn(lambda: window.views[0].state.lit)
for act in (QtTest.QTest.mouseClick, QtTest.QTest.mouseDClick, QtTest.QTest.mouseRelease):  # as of a real mouse
    act(left, QtCore.Qt.LeftButton, pos=QtCore.QPoint(150, 150))
turn(lambda: window.views[0].state.pivot != (0.0, 0.0, 0.0))

drawn = [view.drawn for view in window.views]
window.slider.setValue(0)
turn(lambda: all(view.drawn > before for view, before in zip(window.views, drawn)))
picture("dark.png")
window.resize(900, 400)
turn(lambda: all(view.picture.camera.width > 400 for view in window.views))
told["sizes"] = [list(view.window.picture_size) for view in window.views]
turn(lambda: all(view.redrawing.samples > 1 for view in window.views))
left.close()
turn(lambda: window.views[0].window.renderer.context.is_released)
print(json.dumps(told))
"""


def need(*modules: str) -> None:
    for name in modules:
        if importlib.util.find_spec(name) is None:
            missing(f"no {name}")


def opened(path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB")).astype(int)


class TestQt:
    def test_two_views_a_slider_and_qts_own_mouse_and_keys(self, tmp_path):
        need("PySide6", "rendercanvas")
        environment = os.environ | {"QT_QPA_PLATFORM": "offscreen", "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-c", IN_QT, EXAMPLES],
            cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=240,
        )  # fmt: skip
        assert done.returncode == 0 and "Error" not in done.stderr, done.stdout + done.stderr
        told = json.loads(done.stdout)
        assert told["the other's light stays"]
        assert told["yaws"][0] == 0 and told["yaws"][1] != 0
        (width, height), other = told["sizes"]
        assert width > 400 and height > 300 and abs(other[0] - width) <= 1
        before, dark = opened(tmp_path / "before.png"), opened(tmp_path / "dark.png")
        half = before.shape[1] // 2
        for side in (slice(0, half), slice(half, None)):
            assert dark[40:260, side].mean() < before[40:260, side].mean() - 5


class TestNotebook:
    def test_its_cell_shows_the_canvas(self, tmp_path):
        need("nbclient", "ipykernel", "anywidget", "rendercanvas")
        import nbformat
        from nbclient import NotebookClient

        notebook = nbformat.read(EXAMPLES / "canvas_notebook.ipynb", as_version=4)
        NotebookClient(notebook, timeout=120, resources={"metadata": {"path": tmp_path}}).execute()
        data = {cell.id: cell.outputs[-1].data for cell in notebook.cells if cell.cell_type == "code"}
        assert "application/vnd.jupyter.widget-view+json" in data["view"]
        assert "image/png" in data["state"]
        assert not any(
            cell.get("outputs") for cell in json.loads((EXAMPLES / "canvas_notebook.ipynb").read_text())["cells"]
        )


class Visitor:
    """A browser, as the server sees it."""

    def __init__(self, socket):
        self.socket = socket
        self.tell("resize", width=160, height=120, pwidth=320, pheight=240, ratio=2.0)

    def tell(self, kind, **more):
        self.socket.send_json({"type": kind, "timestamp": 0.0, "modifiers": [], **more})

    def drag(self, pixels):
        self.tell("pointer_down", x=80, y=60, button=1)
        for k in range(1, 5):
            self.tell("pointer_move", x=80 + pixels * k / 4, y=60)
        self.tell("pointer_up", x=80 + pixels, y=60, button=1)

    def picture(self):
        """The next one."""
        about, data = self.socket.receive_json(), self.socket.receive_bytes()
        self.tell("_framefeedback", index=about["index"])
        return opened(io.BytesIO(data))

    def rested(self):
        """A picture after some: nothing moves any more."""
        return [self.picture() for _ in range(6)][-1]


class TestServer:
    @pytest.fixture
    def server(self, monkeypatch):
        need("fastapi", "httpx", "websockets", "rendercanvas")
        monkeypatch.syspath_prepend(EXAMPLES)
        import canvas_server

        yield canvas_server
        sys.modules.pop("canvas_server", None)

    @pytest.fixture
    def browser(self, server):
        import warnings

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # starlette's own, of the library that it tests with
            from starlette.testclient import TestClient
        with TestClient(server.app) as client:
            yield client

    def test_it_serves_the_page_and_nothing_else(self, browser):
        assert "renderview-client.js" in browser.get("/").text
        assert browser.get("/renderview.js").status_code == 200
        assert browser.get("/pyproject.toml").status_code == browser.get("/%2e%2e/canvas_server.py").status_code == 404

    def test_three_visitors_have_their_own_cameras(self, browser, server):
        with (
            browser.websocket_connect("/") as a,
            browser.websocket_connect("/") as b,
            browser.websocket_connect("/") as c,
        ):
            visitors = [Visitor(socket) for socket in (a, b, c)]
            for pixels, visitor in zip((0, 25, 50), visitors, strict=True):
                visitor.drag(pixels)
            pictures = [visitor.rested() for visitor in visitors]
            assert server.app.state.visitors == 3
            assert {picture.shape for picture in pictures} == {(240, 320, 3)}
            for one, other in ((0, 1), (1, 2), (0, 2)):
                assert np.abs(pictures[one] - pictures[other]).mean() > 3

    def test_who_leaves_frees_the_place(self, browser, server, monkeypatch):
        from starlette.websockets import WebSocketDisconnect

        monkeypatch.setattr(server, "MOST_VISITORS", 1)
        with browser.websocket_connect("/") as socket:
            Visitor(socket).picture()
            with browser.websocket_connect("/") as late, pytest.raises(WebSocketDisconnect):
                late.receive_json()
        with browser.websocket_connect("/") as socket:
            Visitor(socket).picture()

    def test_a_huge_window_gets_a_picture_of_the_largest_size(self, browser, server):
        with browser.websocket_connect("/") as socket:
            visitor = Visitor(socket)
            visitor.tell("resize", width=1, height=1, pwidth=100_000, pheight=100, ratio=1.0)
            widths = [visitor.picture().shape[1] for _ in range(3)]
            assert max(widths) == server.MOST_SIDE
