"""`pointshade view` as a user runs it: a process of its own, real events from the X server, pixels of its window."""

import os
import shlex
import signal
import subprocess
import sys
import time
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

from ..support import frames
from ..support.view_sets import pose_at, replaced, seen_from, write_views

if not sys.platform.startswith("linux"):
    pytest.skip("speaks to an X server", allow_module_level=True)

from Xlib import XK, X, error
from Xlib.display import Display
from Xlib.ext import xtest
from Xlib.protocol.event import ClientMessage

pytestmark = pytest.mark.system

COMMAND = [sys.executable, "-m", "pointshade_gl", "view"]
PATIENCE = 60  # seconds, for a machine that is busy


@pytest.fixture
def folder(tmp_path):
    """A grey ball as files."""
    place = tmp_path / "ball"
    place.mkdir()
    Image.fromarray((frames.sphere().depth * 1000).astype(np.uint16)).save(place / "depth.png")
    c = frames.CAMERA
    numbers = f'"fx": {c.fx}, "fy": {c.fy}, "cx": {c.cx}, "cy": {c.cy}, "width": 160, "height": 120'
    (place / "intrinsics.json").write_text(f'{{{numbers}, "depth_scale": 1000}}')
    return place


class User:
    """Starts the command, sees its window, moves the mouse, presses keys."""

    def __init__(self, *arguments, cwd):
        self.process = subprocess.Popen(
            [*COMMAND, *map(str, arguments)], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.server = Display()
        self.window = self.wait_for(self.find)

    def wait_for(self, look):
        """What look() gives as soon as it is not None."""
        end = time.monotonic() + PATIENCE
        while (found := look()) is None:
            assert self.process.poll() is None, self.process.communicate()
            assert time.monotonic() < end, "it does not happen"
            time.sleep(0.02)
        return found

    def find(self):
        for window in self.server.screen().root.query_tree().children:
            try:
                if "pointshade" in str(window.get_wm_name()) and window.get_attributes().map_state == X.IsViewable:
                    return window
            except error.BadWindow:  # gone since
                continue
        return None

    def see(self):
        """The window's grey levels, (h, w)."""
        size = self.window.get_geometry()
        data = self.window.get_image(0, 0, size.width, size.height, X.ZPixmap, 0xFFFFFFFF).data
        return np.frombuffer(data, np.uint8).reshape(size.height, size.width, 4)[..., :3].mean(-1)

    def shows(self):
        """Whether there is a picture, not only the words before it."""
        grey = self.see()
        return grey[len(grey) // 4 : len(grey) // 2].max() > 100

    def move(self, *places):
        """Through places given as shares of the window, in small steps."""
        size = self.window.get_geometry()
        for start, end in pairwise(places):
            for share in np.linspace(0, 1, 25):
                x, y = (np.array(start) * (1 - share) + np.array(end) * share) * (size.width, size.height)
                xtest.fake_input(self.server, X.MotionNotify, x=size.x + int(x), y=size.y + int(y))
                self.server.sync()

    def press(self, name):
        self.window.set_input_focus(X.RevertToParent, X.CurrentTime)
        code = self.server.keysym_to_keycode(XK.string_to_keysym(name))
        for kind in (X.KeyPress, X.KeyRelease):
            xtest.fake_input(self.server, kind, code)
        self.server.sync()

    def button(self, number, kind):
        xtest.fake_input(self.server, kind, number)
        self.server.sync()

    def click(self, place):
        """The left button, at pixels of the window."""
        size = self.window.get_geometry()
        self.move(*[np.array(place) / (size.width, size.height) + d for d in ((0.02, -0.02), (0.001, 0.001))])
        self.button(1, X.ButtonPress)
        self.button(1, X.ButtonRelease)

    def leave(self):
        """Exit code, output and errors without the notes."""
        out, err = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, out, [line for line in err.splitlines() if not line.startswith("note: ")]

    def close(self):
        self.server.close()
        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()


@pytest.fixture
def user(display, tmp_path):
    if not display:
        pytest.skip("moves the mouse: not on anybody's own screen, needs Xvfb")
    users = []

    def start(*arguments):
        users.append(User(*arguments, cwd=tmp_path))
        return users[-1]

    yield start
    for one in users:
        one.close()


def halves(picture):
    """Mean grey of the ball's left and right half."""
    h, w = picture.shape
    ball = picture[h // 4 : -h // 4, w // 3 : -w // 3]
    return ball[:, : ball.shape[1] // 2].mean(), ball[:, ball.shape[1] // 2 :].mean()


def test_a_session_with_mouse_and_keys(user, folder, tmp_path):
    someone = user(folder)
    assert str(folder) in someone.window.get_wm_name()
    someone.wait_for(lambda: someone.shows() or None)

    someone.move((0.5, 0.5), (0.2, 0.5))
    someone.wait_for(lambda: halves(someone.see())[0] > 1.3 * halves(someone.see())[1] or None)
    someone.move((0.2, 0.5), (0.8, 0.5))
    someone.wait_for(lambda: halves(someone.see())[1] > 1.3 * halves(someone.see())[0] or None)

    before = someone.see()
    someone.press("h")
    someone.wait_for(lambda: np.abs(someone.see() - before).mean() > 10 or None)
    someone.press("h")
    someone.wait_for(lambda: np.abs(someone.see() - before).mean() < 3 or None)

    someone.move((0.8, 0.5), (0.5, 0.5))
    someone.button(1, X.ButtonPress)
    someone.move((0.5, 0.5), (0.6, 0.5))
    someone.button(1, X.ButtonRelease)
    someone.button(4, X.ButtonPress)
    someone.button(4, X.ButtonRelease)
    someone.press("1")
    someone.press("p")
    picture = tmp_path / "pointshade_0001.png"
    someone.wait_for(lambda: picture.exists() or None)
    someone.press("q")
    code, out, errors = someone.leave()
    saved, line = out.splitlines()
    assert (code, saved, errors) == (0, str(picture), []) and "--shading none" in line
    again = [*shlex.split(line)[1:-1], "again.png"]
    subprocess.run([sys.executable, "-m", "pointshade_gl", *again], check=True, cwd=tmp_path, timeout=PATIENCE)
    with Image.open(picture) as image, Image.open(tmp_path / "again.png") as other:
        assert np.abs(np.asarray(image).astype(int) - np.asarray(other)).max() <= 1
        unmoved = ps.render(frames.sphere(), camera=frames.CAMERA.fitted(*image.size), shading="none")[..., 3]
        assert np.count_nonzero(np.asarray(image)[..., 3] != unmoved) > 1000


@pytest.mark.parametrize("ending", ["SIGTERM", "SIGINT", "SIGHUP"])
def test_a_film_of_a_window_that_a_signal_ends_can_be_played(user, folder, tmp_path, ending):
    someone = user(folder, "--record", "film.gif")
    someone.wait_for(lambda: someone.shows() or None)
    someone.press("u")  # something may run in the background
    someone.move((0.2, 0.5), (0.8, 0.5))
    time.sleep(0.5)
    someone.process.send_signal(getattr(signal, ending))
    code, _, _ = someone.leave()
    with Image.open(tmp_path / "film.gif") as film:
        film.load()
        assert code == 130 and film.n_frames > 1


def test_a_sequence_is_put_to_a_frame_by_its_bar(user, tmp_path):
    walk = write_views(tmp_path / "walk", [seen_from(pose_at(yaw)) for yaw in (-8, -4, 0, 4, 8)])
    someone = user(walk, "--depth-scale", "1000", "--fps", "1", "--window-size", "640x480")
    someone.wait_for(lambda: someone.shows() or None)
    someone.press("space")
    someone.click((300, 475))
    someone.press("p")
    someone.wait_for(lambda: (tmp_path / "pointshade_0001.png").exists() or None)
    someone.press("q")
    code, out, errors = someone.leave()
    assert (code, errors) == (0, []) and "--frame 2 " in out


def test_a_software_renderer_is_announced_as_render_announces_it(user, folder, tmp_path):
    someone = user(folder)
    someone.wait_for(lambda: someone.shows() or None)
    someone.press("q")
    errors = someone.process.communicate(timeout=PATIENCE)[1]
    command = [sys.executable, "-m", "pointshade_gl", "render", str(folder), "-o", str(tmp_path / "out.png")]
    rendered = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE).stderr
    told = [[line for line in text.splitlines() if "software renderer" in line] for text in (errors, rendered)]
    assert told[0] == told[1]


def test_the_window_s_own_button_closes_it(user, folder):
    someone = user(folder, "--window-size", "300x200", "--shading", "flat", "--light=-1,0,0")
    size = someone.window.get_geometry()
    assert (size.width, size.height) == (300, 200)
    atom = someone.server.intern_atom
    wish = (32, [atom("WM_DELETE_WINDOW"), X.CurrentTime, 0, 0, 0])
    someone.window.send_event(ClientMessage(window=someone.window, client_type=atom("WM_PROTOCOLS"), data=wish))
    someone.server.sync()
    assert someone.leave() == (0, "", [])


def test_ctrl_c_in_the_terminal_ends_it(user, folder):
    someone = user(folder)
    someone.wait_for(lambda: someone.shows() or None)
    someone.process.send_signal(signal.SIGINT)
    code, _, errors = someone.leave()
    assert code == 130 and "Traceback" not in " ".join(errors)


def test_views_are_merged_and_m_plays_the_frames(user, tmp_path):
    walk = write_views(tmp_path / "walk", [seen_from(pose_at(yaw)) for yaw in (-8, 0, 8)])
    someone = user(walk, "--views", "all", "--depth-scale", "1000", "--fps", "3", "--shading", "none")
    someone.wait_for(lambda: someone.shows() or None)
    someone.press("m")

    def changes():
        before = someone.see()
        time.sleep(0.5)
        return np.abs(someone.see() - before).mean() > 3 or None

    someone.wait_for(changes)
    someone.press("m")
    someone.wait_for(lambda: changes() is None or None)
    someone.press("q")
    assert someone.leave() == (0, "", [])


def test_several_folders_play_at_once_as_one_object(user, tmp_path):
    """Unlit, both cameras' pictures get darker and brighter again, out of step with how fast it draws."""
    folders = []
    for name, yaw in (("left", -8), ("right", 8)):
        view = seen_from(pose_at(yaw))
        film = [replaced(view, color=(view.color * share).astype(np.uint8)) for share in (1, 0.3)]
        folders.append(write_views(tmp_path / name, film))
    someone = user(*folders, "--fps", "2,1.3", "--depth-scale", "1000", "--shading", "none")
    assert f"{folders[0]} and {folders[1]}" in someone.window.get_wm_name()
    someone.wait_for(lambda: someone.shows() or None)
    greys = set()
    someone.wait_for(lambda: greys.add(round(someone.see().mean() / 8)) or (len(greys) > 2 or None))
    someone.press("q")
    assert someone.leave() == (0, "", [])


def run_without_display(*arguments):
    gone = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return subprocess.run([*COMMAND, *map(str, arguments)], env=gone, capture_output=True, text=True, timeout=PATIENCE)


def test_no_display_is_exit_code_1_and_one_sentence_that_names_render(folder):
    done = run_without_display(folder)
    assert done.returncode == 1 and not done.stdout
    lines = [line for line in done.stderr.splitlines() if not line.startswith("note: ")]
    assert len(lines) == 1 and "no display" in lines[0] and "`pointshade render`" in lines[0]


def test_a_scene_takes_a_shading_for_all_its_objects_and_no_other_look():
    done = run_without_display("demo", "--shading", "flat", "--specular", "0.9")
    assert done.returncode == 2 and done.stderr.endswith("leave out --specular\n")
    done = run_without_display("demo", "--shading", "flat")
    assert done.returncode == 1 and "no display" in done.stderr


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--shading", "toon"], "known are none, flat"),
        (["--normals", "magic"], "known are auto"),
        (["--splat", "star"], "known are footprint"),
        (["--max-depth-step", "wide"], "--max-depth-step must be metres"),
        (["--window-size", "big"], "--window-size takes WIDTHxHEIGHT"),
        (["--light", "1,2"], "--light '1,2': light position must be three finite numbers"),
        (["--record", "no/film.gif"], "create it first"),
        (["--views", "1"], "--views takes a whole number of 2 or more, or 'all', or frames such as 0,5,9, got '1'"),
        (["--views", "3"], "--views merges the frames of a sequence, and this is a single frame: leave it out"),
    ],
)
def test_a_wrong_option_is_one_sentence_before_any_window(folder, options, complaint):
    done = run_without_display(folder, *options)
    lines = [line for line in done.stderr.splitlines() if not line.startswith("note: ")]
    assert done.returncode == 2 and len(lines) == 1 and complaint in lines[0]
