"""Runs jobs that may misbehave, one after the other, as a program: its argument is a file, jobs.json.

Prints a line of JSON for each: what it raised, how long it took, how much memory, and which files it opened.
"""

from __future__ import annotations

import faulthandler
import json
import os
import re
import signal
import subprocess
import sys
import time
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import pointshade_gl as ps
from pointshade_gl.files.clouds.load_cloud import is_cloud
from pointshade_gl.files.frames.frame_files import examine, facts
from pointshade_gl.files.writing.film import Film
from pointshade_gl.notes.errors import is_expected

from .children import environment_with
from .damage import damaged
from .places import ROOT

MEMORY = 500 * 2**20
PATIENCE = 60  # seconds until a job counts as hanging: other processes may keep this one waiting


def quiet(_):
    pass


def load_source(path, **options):
    source = ps.open_source(path, notes=quiet, **options)
    return [frame.points_known for frame in source] if not isinstance(source, ps.Frame) else source


CALLS = {
    "frame": lambda *paths, **options: ps.load_frame(*paths, notes=quiet, **options),
    "source": load_source,
    "cloud": lambda path, **options: (is_cloud(path), ps.load_cloud(path, notes=quiet, **options)),
    "scene": lambda path, **options: sum(1 for _ in ps.load_scene(path, notes=quiet, **options).every_node()),
    "save": lambda path: ps.save_image(path, np.zeros((2, 2, 3), np.uint8)),
    "film": lambda path, **options: Film(path, **options),
    "info": lambda path, **options: facts(examine(path, **options)),
}
opened: list[str] | None = None  # while a job runs


def watch(event, arguments):
    if event == "open" and opened is not None and isinstance(arguments[0], str):
        opened.append(arguments[0])


def hang(*_):
    raise RuntimeError(f"still busy after {PATIENCE} s")


def limit_memory():
    """This process may take 500 MB more than it has (Linux knows how much that is)."""
    if sys.platform == "linux":
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MEMORY,) * 2)


@contextmanager
def damage(path: str | None, seed: int) -> Iterator[None]:
    """Inside, the file is damaged; afterwards as it was."""
    if path is None:
        yield
        return
    whole = Path(path).read_bytes()
    Path(path).write_bytes(damaged(whole, np.random.default_rng(seed)))
    try:
        yield
    finally:
        Path(path).write_bytes(whole)


def run(job):
    global opened
    os.chdir(job["folder"])
    error = where = ""
    is_told = True
    with damage(job.get("damaged"), job.get("seed", 0)):
        before, opened = time.process_time(), []  # other processes may keep this one waiting
        try:
            CALLS[job["call"]](*job["arguments"], **job["options"])
        except Exception as raised:
            error = f"{type(raised).__name__}: {raised}"
            places = traceback.extract_tb(raised.__traceback__)[::-1]
            where = " < ".join(f"{Path(at.filename).name}:{at.lineno}" for at in places)
            is_told = is_expected(raised) and "pointshade_gl" in places[0].filename
            is_told |= isinstance(raised, OSError) and bool(raised.filename)  # Python's own sentence names it
        found, opened = opened, None
        seconds = time.process_time() - before
    kind, _, sentence = error.partition(": ")
    return {"kind": kind, "sentence": sentence, "where": where, "is_told": is_told, "seconds": seconds, "opened": found}


def outcomes(jobs: list[dict], folder: Path) -> dict[str, dict]:
    """Runs jobs in a process of their own: what each ended in, by its name."""
    (folder / "jobs.json").write_text(json.dumps(jobs))
    temporary = folder / "temporary"
    temporary.mkdir()
    command = [sys.executable, "-m", __name__, folder / "jobs.json"]
    environment = environment_with(ROOT) | {"TMPDIR": str(temporary)}
    patience = 120 + 2 * len(jobs)  # seconds, for the slowest machine
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=patience)
    found = {one["name"]: one for one in map(json.loads, re.findall(r"^{.*}$", done.stdout, re.M))}
    missing = next((job["name"] for job in jobs if job["name"] not in found), "")
    assert done.returncode == 0, f"the process ended in {missing!r}: {done.stderr[-2000:]}"
    return {job["name"]: found[job["name"]] | {"folder": job["folder"], "temporary": temporary} for job in jobs}


def main():
    faulthandler.enable()
    warnings.simplefilter("error")
    CALLS["frame"]("vase")  # what is imported late is there, and counts for no job
    CALLS["scene"]("demo")
    sys.addaudithook(watch)
    limit_memory()
    if hasattr(signal, "SIGALRM"):
        signal.signal(signal.SIGALRM, hang)
    for job in json.loads(Path(sys.argv[1]).read_text()):
        if hasattr(signal, "SIGALRM"):
            signal.alarm(PATIENCE)
        print(json.dumps({"name": job["name"]} | run(job)), flush=True)


if __name__ == "__main__":
    main()
