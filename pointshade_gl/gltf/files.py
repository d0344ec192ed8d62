"""Files on their way: written in a hidden folder, moved into place together."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import TracebackType
from uuid import uuid4


class Files:
    """Files of a folder, which appear there on `commit`, or never."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._hidden = folder / f".{uuid4().hex}.part"
        self._names: list[str] = []

    def __enter__(self) -> Files:
        self._hidden.mkdir()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        shutil.rmtree(self._hidden, ignore_errors=True)

    def stage(self, name: str) -> Path:
        """Where to write a file for now; its name is relative to the folder."""
        self._names.append(name)
        path = self._hidden / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def commit(self) -> None:
        """Moves the files into place, in the order of staging. Raises OSError, before the first, if one cannot be."""
        for name in self._names:
            target = self.folder / name
            if target.is_dir():
                raise IsADirectoryError(f"cannot write {target}: it is a folder")
            if target.parent.exists() and not target.parent.is_dir():
                raise NotADirectoryError(f"cannot write {target}: {target.parent} is a file")
            self._check_own(target.parent)
        for name in self._names:
            target = self.folder / name
            target.parent.mkdir(exist_ok=True)
            (self._hidden / name).replace(target)

    def _check_own(self, parent: Path) -> None:
        """A frame's folder must hold nothing else: a reader might take another depth picture that is there."""
        if parent == self.folder or not parent.is_dir():
            return
        ours = {Path(name).name for name in self._names if (self.folder / name).parent == parent}
        others = sorted({path.name for path in parent.iterdir()} - ours)
        if others:
            raise FileExistsError(f"{parent} holds {', '.join(others[:3])}, which is not of this scene: move it away")
