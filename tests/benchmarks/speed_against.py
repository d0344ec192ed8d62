"""Compares the speed of this version with another: a commit, run beside it, or figures stored by `bench --speed`.

Run by hand: pointshade bench --speed --against REV|FILE [--quick], in a clone.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from statistics import median, quantiles
from typing import Any

from rich.console import Console
from speed_jobs import JOBS

from pointshade_gl.bench import command
from pointshade_gl.bench.charts import new_table, wide_console
from pointshade_gl.notes.words import option

WARM_UP = 2  # rounds that are not counted: they compile shaders
HERE = Path(__file__).resolve().parents[2]  # the folder that holds the package
Times = dict[str, list[dict[str, float]]]  # by job: {"ms", "cpu_ms"} of every round; no round if it cannot be done


def bench_against(against: str, quick: bool, device: int) -> str:
    """Prints how long this version takes beside a commit, or beside figures stored by `bench_speed`; writes no file.

    Returns one line about it. Raises ValueError for what is neither.
    """
    rounds = 8 if quick else 20
    with command.progress() as advance:
        rows = compare(against, device, rounds, advance)
    show_comparison(rows, against, wide_console())
    return f"this version against {against}: medians of {rounds} rounds"


def show_comparison(rows: list[dict[str, Any]], against: str, console: Console) -> None:
    """Prints how long each job took before and now. Ratios above 1: it has become slower."""
    columns = "before", "now", "now/before", "half of the rounds", "CPU time now/before"
    table = new_table(f"milliseconds, {against} and this version", "job", *columns)
    for row in rows:
        ratio, cpu = (f"{row[key]:.2f}" if row[key] else "-" for key in ("ratio", "cpu_ratio"))
        spread = f"{row['spread'][0]:.2f} to {row['spread'][1]:.2f}" if row["spread"] else "-"
        before, now = (f"{row[key]:.3g}" if row[key] else "-" for key in ("before_ms", "now_ms"))
        table.add_row(row["job"], before, now, ratio, spread, cpu)
    console.print(table)


class Worker:
    """One version of the package, in a process of its own."""

    def __init__(self, folder: Path, device: int, name: str):
        """folder: that holds the package. Raises ValueError if it does not run."""
        self._name = name
        self._errors = tempfile.TemporaryFile(mode="w+")  # noqa: SIM115  # closed with the process
        jobs = Path(__file__).with_name("speed_jobs.py").read_text(encoding="utf-8")
        self._process = subprocess.Popen(
            [sys.executable, "-c", jobs, str(device)], cwd=folder, env=_environment(folder),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, text=True,
        )  # fmt: skip
        try:
            package = Path(self._answer())
            assert package.parent == folder.resolve(), f"{name} has run {package}"
        except BaseException:
            self.end()
            raise

    def time(self, job: str) -> dict[str, float] | None:
        """One lap of a job; None if this version cannot do it."""
        assert self._process.stdin is not None
        self._process.stdin.write(job + "\n")
        self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._process.wait()
            self._errors.seek(0)
            last = self._errors.read().strip().rpartition("\n")[2]
            raise ValueError(f"{self._name} does not run here: {last or 'its process has ended'}")
        return json.loads(line)

    def end(self) -> None:
        self._process.kill()
        self._process.communicate()
        self._errors.close()


def _environment(folder: Path) -> dict[str, str]:
    """This one's, in which the package of a folder comes first."""
    paths = [str(folder), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def race(folders: dict[str, Path], device: int, rounds: int, advance: Callable[[], None]) -> dict[str, Times]:
    """The times of the versions in these folders, by their names. They take turns: all meet the same machine."""
    with ExitStack() as stack:
        workers: dict[str, Worker] = {}
        for name, folder in folders.items():
            workers[name] = Worker(folder, device, name)
            stack.callback(workers[name].end)
        times: dict[str, Times] = {name: {job: [] for job in JOBS} for name in workers}
        for k in range(WARM_UP + rounds):
            for job in JOBS:
                for name, worker in list(workers.items())[:: 1 if k % 2 else -1]:
                    lap = worker.time(job)
                    if lap and k >= WARM_UP:
                        times[name][job].append(lap)
            advance()
        return times


def measure_jobs(device: int, rounds: int) -> dict[str, dict[str, float]]:
    """The medians of this version alone, as `bench --speed` stores them."""
    times = race({"this version": HERE}, device, rounds, lambda: None)["this version"]
    return {job: {key: median(lap[key] for lap in laps) for key in laps[0]} for job, laps in times.items() if laps}


def compare(against: str, device: int, rounds: int, advance: Callable[[], None]) -> list[dict[str, Any]]:
    """For each job medians before and now, and their ratios: {job, before_ms, now_ms, ratio, spread, cpu_ratio}.

    What a version cannot do is None. spread: between which ratios half of the rounds lie; None for stored figures

    against  a file of stored figures, or a commit. Raises ValueError for anything else.
    """
    if Path(against).is_file():
        stored = read_jobs(Path(against))
        before: Times = {job: [stored[job]] if job in stored else [] for job in JOBS}
        now = race({"this version": HERE}, device, rounds, advance)["this version"]
    else:
        with tempfile.TemporaryDirectory(prefix="pointshade_") as folder:
            check_out(against, Path(folder))
            before, now = race({against: Path(folder), "this version": HERE}, device, rounds, advance).values()
    return [_row(job, before[job], now[job]) for job in JOBS]


def _row(job: str, before: Sequence[dict[str, float]], now: Sequence[dict[str, float]]) -> dict[str, Any]:
    row: dict[str, Any] = dict.fromkeys(("before_ms", "now_ms", "ratio", "spread", "cpu_ratio")) | {"job": job}
    if before:
        row["before_ms"] = median(lap["ms"] for lap in before)
    if now:
        row["now_ms"] = median(lap["ms"] for lap in now)
    if before and now:
        row["ratio"] = row["now_ms"] / row["before_ms"]
        row["cpu_ratio"] = median(lap["cpu_ms"] for lap in now) / max(median(lap["cpu_ms"] for lap in before), 1e-9)
    if len(before) == len(now) > 1:
        ratios = quantiles((b["ms"] / a["ms"] for a, b in zip(before, now, strict=True)), n=4, method="inclusive")
        row["spread"] = ratios[0], ratios[2]
    return row


def read_jobs(path: Path) -> dict[str, dict[str, float]]:
    """The figures of a file that `bench --speed` has written. Raises ValueError for any other."""
    try:
        jobs = json.loads(path.read_text(encoding="utf-8"))["jobs"]
        return {name: {"ms": float(row["ms"]), "cpu_ms": float(row["cpu_ms"])} for name, row in jobs.items()}
    except (ValueError, TypeError, KeyError, AttributeError):
        expected = "expected the speed.json of an earlier `pointshade bench --speed`"
        raise ValueError(f"{option('against')}: {path} holds no speeds, {expected}") from None


def check_out(revision: str, folder: Path) -> None:
    """Unpacks a commit of the checkout that this package runs from. Raises ValueError if there is none."""
    top = _git(HERE, "rev-parse", "--show-toplevel")
    if top is None:
        raise ValueError(
            f"{option('against')} {revision} is no file, and without git and a checkout of pointshade_gl no commit can "
            "be found: run from a checkout, or pass the speed.json of an earlier `pointshade bench --speed`"
        )
    root = Path(os.fsdecode(top).strip())
    commit = _git(root, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}")
    if commit is None:
        raise ValueError(f"{option('against')} {revision} is neither a file nor a commit of {root}")
    archive = _git(root, "archive", "--format=zip", os.fsdecode(commit).strip())
    if archive is None:
        raise ValueError(f"{option('against')} {revision}: git cannot unpack this commit of {root}")
    with zipfile.ZipFile(io.BytesIO(archive)) as packed:
        packed.extractall(folder)
    if not (folder / "pointshade_gl").is_dir():
        raise ValueError(f"{option('against')} {revision}: this commit of {root} holds no pointshade_gl")


def _git(folder: Path, *arguments: str) -> bytes | None:
    """What git answers; None if it fails or is not there."""
    git = shutil.which("git")
    done = subprocess.run([git, "-C", str(folder), *arguments], capture_output=True) if git else None
    return done.stdout if done and done.returncode == 0 else None
