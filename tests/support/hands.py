"""A user's hands on a window of this process: real events of an X server, made by XTest and by the drop protocol."""

import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from Xlib import XK, X
from Xlib.display import Display
from Xlib.ext import xtest
from Xlib.protocol.event import ClientMessage, SelectionNotify

PATIENCE = 30  # seconds, for a machine that is busy
BUTTONS = {"left": 1, "middle": 2, "right": 3, "up": 4, "down": 5}  # the last two are the wheel's
VERSION = 5  # of XDND, by which files are dropped


class Hands:
    """Moves the pointer, presses buttons and keys, drops files. The viewer sees nothing of it before `look`.

    Places are pixels of the window. Its events are told the time of `clock`, which only goes on while hands move or
    rest: how busy the machine is decides nothing.
    """

    def __init__(self, viewer):
        self.viewer, self.server, self.clock = viewer, Display(), time.perf_counter()
        glfw = viewer.window.glfw
        self.window = self.server.create_resource_object("window", glfw.get_x11_window(viewer.window.handle))
        glfw.set_window_pos(viewer.window.handle, 100, 100)
        self.window.configure(stack_mode=X.Above)
        self.window.set_input_focus(X.RevertToParent, X.CurrentTime)
        self.server.sync()
        self.look()

    def look(self, turns=3):
        """The viewer sees what has happened, and draws."""
        self.server.sync()
        for _ in range(turns):
            self.viewer.step(wait=False)

    def until(self, happens):
        """Looks until it happens, or fails."""
        end = time.monotonic() + PATIENCE
        while not happens():
            assert time.monotonic() < end, "it does not happen"
            self.look(1)

    def rest(self, seconds=0.35):
        """The viewer goes on, the hands do nothing."""
        self.look()
        self.clock += seconds
        self.look()

    def point(self, x, y):
        """The pointer is elsewhere at once."""
        at = self.window.translate_coords(self.server.screen().root, 0, 0)
        xtest.fake_input(self.server, X.MotionNotify, x=round(x) - at.x, y=round(y) - at.y)

    def travel(self, *places, seconds=0.2, steps=12):
        """The pointer moves through places, and the viewer looks all the time."""
        for start, end in pairwise(places):
            for share in np.linspace(0, 1, steps + 1):
                self.point(*(np.array(start) * (1 - share) + np.array(end) * share))
                self.look(1)
                self.clock += seconds / steps

    def button(self, name, *kinds):
        """kinds: "press", "release"."""
        for kind in kinds or ("press", "release"):
            number = X.ButtonPress if kind == "press" else X.ButtonRelease
            xtest.fake_input(self.server, number, BUTTONS[name])

    def click(self, x, y):
        self.point(x, y)
        self.button("left")
        self.look()

    def double_click(self, x, y):
        self.point(x, y)
        self.button("left")
        self.button("left")
        self.look()

    def key(self, name, *held):
        """name as X calls it: "z", "Escape"; held: "Control_L", "Shift_L"."""
        codes = [self.server.keysym_to_keycode(XK.string_to_keysym(one)) for one in (*held, name)]
        for code in codes:
            xtest.fake_input(self.server, X.KeyPress, code)
        for code in reversed(codes):
            xtest.fake_input(self.server, X.KeyRelease, code)
        self.look()

    def drop(self, *paths):
        """Files are dropped onto the middle of the window, as file managers do (XDND)."""
        uris = "".join(f"{Path(path).absolute().as_uri()}\r\n" for path in paths).encode()
        server, size = self.server, self.window.get_geometry()
        at = server.screen().root.translate_coords(self.window, size.width // 2, size.height // 2)
        atom = server.intern_atom
        source = server.screen().root.create_window(0, 0, 1, 1, 0, X.CopyFromParent)
        source.set_selection_owner(atom("XdndSelection"), X.CurrentTime)
        self._send(source, "XdndEnter", VERSION << 24, atom("text/uri-list"), 0, 0)
        self._send(source, "XdndPosition", 0, at.x << 16 | at.y, X.CurrentTime, atom("XdndActionCopy"))
        self._send(source, "XdndDrop", 0, X.CurrentTime, 0, 0)
        finished = []

        def serve():
            while server.pending_events():
                event = server.next_event()
                if event.type == X.SelectionRequest:
                    event.requestor.change_property(event.property, event.target, 8, uris)
                    event.requestor.send_event(
                        SelectionNotify(
                            time=event.time,
                            requestor=event.requestor,
                            selection=event.selection,
                            target=event.target,
                            property=event.property,
                        )
                    )
                finished.append(event.type == X.ClientMessage and event.client_type == atom("XdndFinished"))
            return any(finished)

        self.until(serve)
        source.destroy()
        self.look()

    def _send(self, source, kind, *data):
        message = ClientMessage(
            window=self.window, client_type=self.server.intern_atom(kind), data=(32, [source.id, *data])
        )
        self.window.send_event(message)
        self.server.sync()

    def close(self):
        """The pointer stands on no other window afterwards."""
        screen = self.server.screen()
        xtest.fake_input(self.server, X.MotionNotify, x=screen.width_in_pixels - 1, y=screen.height_in_pixels - 1)
        self.server.sync()
        self.server.close()
