"""The system's own dialog for files and folders, which asks while the window goes on. Needs the extra `gui`."""

from __future__ import annotations

import shutil
import sys
from importlib.util import find_spec
from threading import Thread
from typing import Any

PROGRAMS = "zenity", "kdialog", "matedialog", "qarma"  # which of them Linux has
DROP = "drop files or a folder onto the window"
MISSING = f"an open dialog needs the extra 'gui': pip install 'pointshade-gl[gui]'; or {DROP}"
NO_PROGRAM = f"an open dialog needs {PROGRAMS[0]} or {PROGRAMS[1]}, install one of them; or {DROP}"
LOOK = 0.1  # seconds between two looks at whether the user has chosen


class OpenDialog:
    """A dialog that is shown until the user has chosen. Raises RuntimeError, in words for the user, without one."""

    def __init__(self, is_folder: bool):
        if find_spec("imgui_bundle") is None:
            raise RuntimeError(MISSING)
        if sys.platform.startswith("linux") and not any(map(shutil.which, PROGRAMS)):
            raise RuntimeError(NO_PROGRAM)
        self._is_folder = is_folder
        self._dialog: Any = None
        self._starting = Thread(target=self._start)  # which takes a moment, the first time
        self._starting.start()

    def _start(self) -> None:
        from imgui_bundle import portable_file_dialogs as dialogs  # pyright: ignore[reportMissingModuleSource]

        if self._is_folder:
            self._dialog = dialogs.select_folder("Open a folder")
        else:
            self._dialog = dialogs.open_file("Open files", options=dialogs.opt.multiselect)

    @property
    def is_done(self) -> bool:
        """Whether the user has chosen, or not."""
        return not self._starting.is_alive() and (self._dialog is None or self._dialog.ready(0))

    @property
    def chosen(self) -> tuple[str, ...]:
        """What the user chose; nothing if that was nothing."""
        found = self._dialog.result() if self._dialog else ()
        return tuple(filter(None, [found] if isinstance(found, str) else found))

    def close(self) -> None:
        """Take the dialog away."""
        self._starting.join()
        if not self.is_done:
            self._dialog.kill()
