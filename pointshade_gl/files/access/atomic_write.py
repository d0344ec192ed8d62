"""Writes files completely or not at all: under a hidden name beside the target, then renamed.

So nobody meets a half-written file. After an error or an interruption nothing is left; only a process that is killed
leaves its hidden `.part` file. The names of a process's hidden files begin alike, so that who killed it removes them.
"""

from __future__ import annotations

import errno
import os
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from ...notes.words import cut
from .content import FilePath, check_not_read, followed

OURS = f".{uuid4().hex[:12]}-"  # with this the hidden names of this process begin
_BLOCK = 1 << 20  # bytes that are read at once
_NOT_OURS = "its folder is read-only, or belongs to somebody else"
_FORBIDDEN = (errno.EACCES, errno.EPERM, errno.EROFS)
_FULL = tuple(getattr(errno, name) for name in ("ENOSPC", "EDQUOT", "EFBIG") if hasattr(errno, name))


def check_place(path: Path, only_read: bool = False) -> Path:
    """The path, if a file can be written there; a link's target counts. Raises OSError if it cannot. With only_read
    perhaps nothing is to be written: then the folder may be read-only."""
    target = followed(path) if path.is_symlink() else path
    if not target.parent.is_dir():
        raise FileNotFoundError(f"cannot write {path}: there is no folder {target.parent}, create it first")
    if target.is_dir():
        raise IsADirectoryError(f"cannot write {path}: it is a folder")
    if target.exists() and not target.is_file():
        raise OSError(f"cannot write {path}: it is a pipe or a device")
    if not only_read and not os.access(target.parent, os.W_OK | os.X_OK):
        raise PermissionError(f"cannot write {path}: {_NOT_OURS}")
    return path


@contextmanager
def naming_written(path: FilePath) -> Iterator[None]:
    """Every OSError inside names the file that cannot be written, and why: a full disk, a read-only folder."""
    try:
        yield
    except OSError as error:
        if str(error).startswith("cannot write "):
            raise
        origin = error  # the system's own error, if others have put it in their words since
        while origin.strerror is None and isinstance(origin.__context__, OSError):
            origin = origin.__context__
        reason = _NOT_OURS if origin.errno in _FORBIDDEN else origin.strerror or cut(error)
        named = type(error)(f"cannot write {path}: {reason}")
        named.errno = origin.errno
        raise named from error


def error_of(reason: str) -> OSError:
    """The system's error in the text that a program gives of a file that it could not write, else one of that text."""
    code = next((code for code in (*_FULL, *_FORBIDDEN) if os.strerror(code).lower() in reason.lower()), None)
    return OSError(reason) if code is None else OSError(code, os.strerror(code))


@contextmanager
def written_whole(path: FilePath) -> Iterator[Path]:
    """A path to write to, which at the end replaces the target, or a link's target; after an error it is removed."""
    target = followed(Path(path))
    check_not_read(target)
    temporary = hidden_beside(target)
    with naming_written(path):
        try:
            yield temporary
            with suppress(OSError):  # a new file has no mode to keep
                temporary.chmod(target.stat().st_mode & 0o7777)
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)


def hidden_beside(target: Path) -> Path:
    """A new hidden name in the target's folder."""
    return target.with_name(f"{OURS}{uuid4().hex[:12]}.part")


def name_key(name: str) -> str:
    """What two names have in common that are one file on Windows and macOS: case, and how accents are written."""
    return unicodedata.normalize("NFC", name).casefold()


def is_case_sensitive(folder: Path) -> bool:
    """Whether A.png and a.png are two files in a folder that can be written to."""
    path = hidden_beside(folder / "any")
    try:
        path.touch()
        return not path.with_name(path.name.upper()).exists()
    finally:
        path.unlink(missing_ok=True)


def remove_hidden(folder: Path, ours: str) -> None:
    """Removes what a process that was killed has left in a folder. ours: that process's OURS."""
    for path in folder.glob(f"{ours}*.part"):
        path.unlink(missing_ok=True)


def sha256_of(path: Path) -> tuple[int, str]:
    """How many bytes a file has, and their SHA-256, hexadecimal."""
    import hashlib  # only here: most programs check no file

    digest, size = hashlib.sha256(), 0
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
            size += len(block)
    return size, digest.hexdigest()


class FileSet:
    """Files of a folder, which appear there on `commit`, or not at all."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._hidden = hidden_beside(folder / "any")
        self._names: list[str] = []

    def __enter__(self) -> FileSet:
        self._hidden.mkdir()
        return self

    def __exit__(self, *_: object) -> None:
        import shutil  # which imports compression: not needed for single files

        shutil.rmtree(self._hidden, ignore_errors=True)

    def stage(self, name: str) -> Path:
        """Where to write a file for now; its name is relative to the folder."""
        self._names.append(name)
        path = self._hidden / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def holds(self, name: str) -> bool:
        """Whether a file of this name was staged."""
        return name in self._names

    def commit(self) -> None:
        """Moves the files into place, in the order of staging. Raises OSError, before the first, if one cannot move."""
        for name in self._names:
            target = self.folder / name
            if target.is_dir():
                raise IsADirectoryError(f"cannot write {target}: it is a folder")
            if target.parent.exists() and not target.parent.is_dir():
                raise NotADirectoryError(f"cannot write {target}: {target.parent} is a file")
            if target.parent != self.folder and target.parent.is_dir():
                # a frame's folder holds nothing else: a reader might take another depth picture that is there
                ours = {Path(one).name for one in self._names if (self.folder / one).parent == target.parent}
                others = sorted({path.name for path in target.parent.iterdir()} - ours)
                if others:
                    listed = f"{', '.join(others[:3])}, not of this scene: move it away"
                    raise FileExistsError(f"{target.parent} holds {listed}")
        for name in self._names:
            target = self.folder / name
            target.parent.mkdir(exist_ok=True)
            (self._hidden / name).replace(target)
