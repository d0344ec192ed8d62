"""Fixtures: an OpenGL context, a display, the real frames (without them a test is skipped), golden pictures."""

from __future__ import annotations

import json
import os
import random
import select
import shlex
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # idle ones spin: CPU seconds would be those of a busy machine

import numpy as np
import pytest
from hypothesis import settings

import pointshade_gl as ps

from .support.browser import Browser, find_chromium
from .support.children import default_signals
from .support.command import run
from .support.compare import compare_images, difference_figures, difference_picture
from .support.durations import LIMIT, Durations
from .support.places import FAILURES, GOLDEN, REAL_FRAMES
from .support.shader_function import evaluate

LONG = "test_docs_build.py", "test_signals.py"  # a minute and more each: at the very end other cores would wait
SYSTEM_TIMEOUT = 600  # seconds for a test marked "system"; for all others: timeout in pyproject.toml

# Properties: the same examples in each run, no clock. For many others: --hypothesis-profile=long.
settings.register_profile("same", derandomize=True, deadline=None, max_examples=40, database=None)
settings.register_profile("long", deadline=None, max_examples=2000, database=None, print_blob=True)
settings.load_profile("same")


def pytest_addoption(parser):
    parser.addoption("--update-golden", action="store_true", help="rewrite the stored pictures with today's pictures")
    parser.addoption("--differences", metavar="FILE", help="append how stored pictures differ, a line of JSON for each")
    parser.addoption("--cpu-limit", type=float, default=LIMIT, help="CPU seconds of a test that is not of the system")
    parser.addoption("--shuffle", metavar="SEED", help="run files in random order, and the tests of each file, too")


def pytest_configure(config):
    config.pluginmanager.register(Durations(limit=config.getoption("cpu_limit")))


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    """Tests of the system may take longer than others, unless --timeout says how long any test may take."""
    if seed := config.getoption("shuffle"):
        rng = random.Random(seed)
        files = defaultdict(rng.random)
        items.sort(key=lambda item: (files[item.path], rng.random()))
    else:
        items.sort(key=lambda item: item.path.name not in LONG)
    if config.getoption("timeout", None) is None:
        for item in items:
            if item.get_closest_marker("system"):
                item.add_marker(pytest.mark.timeout(SYSTEM_TIMEOUT))


@pytest.fixture(scope="session", autouse=True)
def signals_reach_children():
    """Processes of tests get the default handlers of signals, also in a run that ignores them (`nohup`, `&`)."""
    with default_signals():
        yield


@pytest.fixture(scope="session", autouse=True)
def compiled_shaders(tmp_path_factory):
    """Mesa keeps compiled shaders for all workers and runs beside pytest's temporary folders.

    Its own place is the user's home. Where that cannot be written, the tests take four times as long.
    """
    runs = tmp_path_factory.getbasetemp().parent
    runs = runs.parent if "PYTEST_XDIST_WORKER" in os.environ else runs
    os.environ.setdefault("MESA_SHADER_CACHE_DIR", str(runs / "compiled-shaders"))


@pytest.fixture(scope="session")
def renderer():
    """One Renderer for the whole run. Without GL the test is skipped, unless POINTSHADE_REQUIRE_GL=1.

    POINTSHADE_DRIVER is a part of the driver's name for which the run is meant: on another one it fails.
    """
    try:
        made = ps.Renderer()
    except ps.ContextError as error:
        if os.environ.get("POINTSHADE_REQUIRE_GL") == "1":
            raise
        pytest.skip(str(error))
    wanted = os.environ.get("POINTSHADE_DRIVER", "")
    assert wanted in made.context.renderer, f"this run is meant for {wanted}, {made.context.renderer} draws"
    yield made
    made.release()


@pytest.fixture
def gpu(renderer, tmp_path):
    """gpu(file of shaders/common, expression, **inputs): the result of `evaluate`."""

    def call(include, expression, **inputs):
        with renderer.context.gl:
            return evaluate(renderer.context.gl, tmp_path, include, expression, **inputs)

    return call


@pytest.fixture
def typed(monkeypatch, tmp_path):
    """typed("render vase -o out.png") in a folder of the test's own: exit code, stdout, stderr of `pointshade`."""
    monkeypatch.chdir(tmp_path)
    return lambda line: run(*shlex.split(line))


@pytest.fixture(scope="session")
def display():
    """A display to open windows on: Xvfb (True), so that no screen flickers; without it the user's own (False).

    Without both the test is skipped, unless POINTSHADE_REQUIRE_GL=1.
    """
    if shutil.which("Xvfb") is None:
        if not sys.platform.startswith("linux") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
            yield False
            return
        if os.environ.get("POINTSHADE_REQUIRE_GL") == "1":
            pytest.fail("neither a display nor Xvfb: apt-get install -y xvfb")
        pytest.skip("neither a display nor Xvfb")
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x1024x24", "-nolisten", "tcp"]
    server = subprocess.Popen(command, pass_fds=[writing], stderr=subprocess.DEVNULL)
    os.close(writing)
    try:
        assert select.select([reading], [], [], 30)[0], "Xvfb does not start"
        with pytest.MonkeyPatch.context() as environment:
            environment.setenv("DISPLAY", f":{os.read(reading, 20).decode().strip()}")
            for name in ("WAYLAND_DISPLAY", "XDG_SESSION_TYPE"):
                environment.delenv(name, raising=False)
            yield True
    finally:
        os.close(reading)
        if "glfw" in sys.modules:
            sys.modules["glfw"].terminate()  # before the server ends: Xlib ends a process that loses its server
        server.terminate()
        server.wait()


@pytest.fixture
def open_viewer(display):
    """open_viewer(source, ..., kind=Viewer) opens a window and draws it. At the end GL must have no error."""
    from pointshade_gl.viewer import Viewer

    from .support import frames

    made = []

    def open_it(source=None, kind=Viewer, **options):
        viewer = kind(source or frames.sphere(), **({"window_size": (320, 240)} | options))
        viewer.samples = 1  # it rests at once
        viewer.background.grace = 60.0  # a turn waits for what runs in the background
        made.append(viewer)
        viewer.step(wait=False)
        return viewer

    yield open_it
    for viewer in made:
        with viewer.window:
            error = viewer.screen.gl.error
        viewer.release()
        assert error == "GL_NO_ERROR"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """Chromium without a window, as a `Browser`. Without it the test is skipped, unless POINTSHADE_REQUIRE_BROWSER=1.

    It ends with the file's tests: while it runs, no other event loop can run in this thread.
    """
    if find_chromium() is None:
        if os.environ.get("POINTSHADE_REQUIRE_BROWSER") == "1":
            pytest.fail("no Chromium: apt-get install -y chromium")
        pytest.skip("no Chromium")
    with Browser.launched(tmp_path_factory.mktemp("browser")) as launched:
        yield launched


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real frames beside the repository. Without it the test is skipped, except in CI."""
    if not REAL_FRAMES.is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"no real frames at {REAL_FRAMES}: set POINTSHADE_DATA")
        pytest.skip(f"no real frames at {REAL_FRAMES}")
    return REAL_FRAMES


@pytest.fixture
def golden(request, renderer):
    """check(name, actual, mirror, stored): the picture agrees with its CPU mirror and the stored one, as asked."""

    def check(name: str, actual: np.ndarray, mirror: np.ndarray | None = None, stored: bool = True) -> None:
        path = GOLDEN / f"{name}.png"
        if stored and request.config.getoption("--update-golden"):
            if "llvmpipe" not in renderer.context.renderer:
                pytest.fail(f"golden pictures come from llvmpipe, this is {renderer.context.renderer}")
            ps.save_image(path, actual)
            pytest.skip(f"rewrote {path.name}")
        from PIL import Image

        expected = {} if mirror is None else {"mirror": mirror}
        if stored:
            with Image.open(path) as image:
                expected["stored"] = np.asarray(image)
        for kind, picture in expected.items():
            complaint = compare_images(actual, picture)
            if file := request.config.getoption("--differences"):
                with Path(file).open("a") as lines:
                    row = {"name": name, "kind": kind, "complaint": complaint} | difference_figures(actual, picture)
                    lines.write(json.dumps(row) + "\n")
            if complaint:
                FAILURES.mkdir(exist_ok=True)
                ps.save_image(FAILURES / f"{name}.actual.png", actual)
                ps.save_image(FAILURES / f"{name}.{kind}.png", picture)
                ps.save_image(FAILURES / f"{name}.{kind}.difference.png", difference_picture(actual, picture))
                pytest.fail(f"{name} against {kind}: {complaint}; see {FAILURES}")

    return check
