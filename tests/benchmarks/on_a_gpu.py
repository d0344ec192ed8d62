#!/usr/bin/env python3
"""Does in one command all that is owed on a machine with a GPU, and writes a report.

    python3 tests/benchmarks/on_a_gpu.py REPORT [--minutes 10] [--only PART ...] [--python PYTHON] [--wheels FOLDER]

REPORT is a folder: report.md to read, report.json, all output in log.txt, pictures that differ in failures.zip, and
speed.json. `--list` prints the parts. They run in order of importance, each in a process of its own that ends at its
limit; what fails or takes too long is told in the report, and the next part goes on. Exit status: 0 if all parts about
right pictures passed, 1 if not, 2 if nothing could run.

It runs with --python, else with .venv, else with the Python that runs this script, if it has what is needed. If none
has, it installs: from --wheels, else by README's line. Needed beforehand are a driver with EGL (libEGL.so.1) and Python
3.10; without a network also .venv, or wheels for that Python: `--list` prints the line that downloads them (60 MB).
VTK is measured beside it if it is installed, or if its wheel lies among the others.

Stored pictures come from llvmpipe: on a GPU they may differ a little. The report tells by how much, also of those that
pass. This script never rewrites them, and only llvmpipe may (`--update-golden`).
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[2]
NEEDED = {  # modules, and the packages that have them
    "moderngl": "moderngl", "numpy": "numpy", "glfw": "glfw", "PIL": "pillow", "typer": "typer", "rich": "rich",
    "pytest": "pytest", "pytest_timeout": "pytest-timeout", "hypothesis": "hypothesis",
}  # fmt: skip
USEFUL = {  # tests on all cores, films; later wheels of ffmpeg alone are larger than 64 MB
    "xdist": "pytest-xdist", "imageio_ffmpeg": "imageio-ffmpeg==0.6.0",
}  # fmt: skip
BESIDE = {"vtkmodules": "vtk"}
PLUGINS = {"pytest_timeout": "timeout", "hypothesis": "hypothesispytest", "xdist": "xdist"}  # of pytest, by module
INSTALLING = 200.0  # seconds at most
LAST_WORDS = 5.0  # seconds after the limit
MOST_LISTED = 40  # failures of a part in report.md; log.txt has all
DIFFERENCES = "differences.jsonl"
_WORD = "(PASSED|FAILED|ERROR|SKIPPED)"
OUTCOME = re.compile(rf"^tests/.* {_WORD} +\[ *\d+%\]|^\[gw\d+\] \[ *\d+%\] {_WORD} ", re.M)  # by pytest, pytest-xdist
PROBES = "tests/benchmarks/gpu_probes.py"
FILMS, VTK = "tests/benchmarks/film_beside_others.py", "tests/benchmarks/vtk_points.py"


class Part(NamedTuple):
    """A part of the work: tests, a script, or a probe of gpu_probes.py.

    seconds  its limit when all may take ten minutes
    decides  whether it is about right pictures, and so about the exit status
    needs    a module that may be missing
    """

    name: str
    title: str
    seconds: float
    tests: tuple[str, ...] = ()
    script: tuple[str, ...] = ()
    decides: bool = True
    needs: str = ""


PARTS = (
    Part("environment", "what draws, its limits, the first picture", 30),
    Part(
        "pictures",
        "whole pictures beside stored ones, the CPU mirror and the truth",
        130,
        tuple(
            f"pipeline/test_{name}"
            for name in (
                "pictures", "mesh_form", "scene_pictures", "sets", "samples", "certainty", "ground", "cloud_pictures",
                "eye_dome", "truth", "scene_truth", "cloud_truth", "soft_shadows", "render_depth", "flying_pixels",
            )
        ),
    ),
    Part("rasterizers", "points beside compute: pictures and times", 30),
    Part(
        "contexts",
        "contexts of callers: their state, ours, threads",
        60,
        ("gpu/test_callers_context", "renderer/test_threads"),
    ),
    Part(
        "functions",
        "functions of shaders and passes beside the CPU mirror",
        70,
        tuple(
            f"gpu/test_{name}"
            for name in (
                "shader_functions", "set_functions", "resolve_functions", "grid_functions", "temporal_functions",
                "upsample_functions", "visibility_functions", "rim_functions", "cloud_functions",
                "cloud_splat_functions", "splats", "surface", "rims", "lit_splats",
            )
        ),
    ),
    Part("limits", "extreme sizes, textures too small, tiles", 50, ("pipeline/test_extreme_sizes", "gpu/test_tiles")),
    Part("cuda", "CUDA's number of a GPU beside EGL's", 10),
    Part("cuda_tests", "the same, and what else was foreseen", 10, ("gpu/test_cuda_devices",)),
    Part("speed", "bench --speed: stages, what a small picture costs, points, jobs", 80, decides=False),
    Part("vtk", "points by VTK", 30, script=(VTK,), decides=False, needs="vtkmodules"),
    Part("clouds", "a cloud: normals, views, lights", 30, decides=False),
    Part("batch", "new frames by several processes", 30),
    Part("films", "frames a second to film", 40, script=(FILMS, "--frames", "60", "--rounds", "1"),
        decides=False, needs="imageio_ffmpeg"),
)  # fmt: skip


class Run(NamedTuple):
    """What became of a process: its status (None: out of time), its output, and how long it took."""

    status: int | None
    output: str
    seconds: float


def environment_of(paths: Sequence[str]) -> dict[str, str]:
    """The environment of every part: the package of this folder, pytest with our plugins alone, and no test may be
    skipped for want of OpenGL."""
    before = os.environ.get("PYTHONPATH")
    places = os.pathsep.join([str(ROOT), *paths, *([before] if before else [])])
    ours = {"POINTSHADE_REQUIRE_GL": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    return os.environ | ours | {"PYTHONPATH": places, "PYTHONUNBUFFERED": "1", "COLUMNS": "140"}


def run(command: Sequence[str], limit: float, environment: dict[str, str], log: Path) -> Run:
    """Run a command until its limit; then it and its children are ended."""
    begin = time.monotonic()
    with log.open("a+b") as file:
        file.write(f"\n$ {' '.join(command)}\n".encode())
        file.flush()
        start = file.tell()
        try:
            child = subprocess.Popen(
                command, stdout=file, stderr=subprocess.STDOUT, cwd=ROOT, env=environment, start_new_session=True
            )
        except OSError as error:
            return Run(127, str(error), 0.0)
        try:
            status: int | None = child.wait(max(limit, 1.0))
        except subprocess.TimeoutExpired:
            status = None
            os.killpg(child.pid, signal.SIGINT)  # pytest then says what has failed so far
            with suppress(subprocess.TimeoutExpired):
                child.wait(LAST_WORDS)
        except BaseException:
            _end(child)
            raise
        _end(child)
        file.seek(start)
        return Run(status, file.read().decode(errors="replace"), time.monotonic() - begin)


def _end(child: subprocess.Popen[bytes]) -> None:
    """End a process and what it has started."""
    with suppress(ProcessLookupError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()


def command_of(part: Part, python: str, report: Path, has_workers: bool) -> list[str]:
    """The command line of a part."""
    if part.script:
        return [python, *part.script]
    if not part.tests:
        return [python, PROBES, part.name, str(report)]
    cores = os.cpu_count() or 1
    shared = ["-n", str(min(cores, 8)), "--dist", "worksteal"] if has_workers and cores > 4 else []
    files = [f"tests/{name}.py" for name in part.tests]
    plugins = [word for module, name in PLUGINS.items() if module != "xdist" or has_workers for word in ("-p", name)]
    asked = ["-v", "--timeout", "120", "-m", "not system", "--differences", str(report / DIFFERENCES), *plugins]
    return [python, "-m", "pytest", "-p", "no:cacheprovider", *asked, *shared, *files]


def judge(part: Part, done: Run) -> dict[str, Any]:
    """What a part came to: a verdict, and of tests their numbers and those that failed."""
    found: dict[str, Any] = {"name": part.name, "title": part.title, "decides": part.decides, "seconds": done.seconds}
    verdict = "out of time" if done.status is None else "passed" if done.status == 0 else "failed"
    if part.tests:
        counts = Counter(one or other for one, other in OUTCOME.findall(done.output))
        found["tests"] = {name.lower(): count for name, count in counts.items()}
        found["failures"] = sorted(set(re.findall(r"^(?:FAILED|ERROR) (tests/.*)", done.output, re.M)))
        found["skips"] = sorted(set(re.findall(r"^SKIPPED (\[.*)", done.output, re.M)))
        if verdict == "passed" and not counts["PASSED"]:
            verdict = "nothing ran"
    else:
        found["text"] = done.output.strip("\n")[-6000:]
    return found | {"verdict": verdict}


def missing(python: str, modules: Sequence[str], environment: dict[str, str]) -> list[str]:
    """Which of some modules a Python lacks; all of them if it does not run."""
    code = f"import importlib.util as u; print(*[m for m in {list(modules)!r} if u.find_spec(m) is None])"
    try:
        done = subprocess.run([python, "-c", code], capture_output=True, text=True, env=environment, timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return list(modules)
    return done.stdout.split() if done.returncode == 0 else list(modules)


def wheel_line() -> str:
    """The line that downloads wheels for a machine without a network."""
    return f"pip download --only-binary=:all: -d wheels {' '.join({**NEEDED, **USEFUL}.values())}"


def readme_line() -> str:
    """README's test command without the tests."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(r"<!-- test command -->\s*```sh\n(.*?)\n```", text, re.S)
    if not found:
        raise ValueError("README.md has no test command")
    return found[1].split(" && .venv/bin/pytest")[0]


def find_python(asked: argparse.Namespace, report: Path) -> tuple[str, dict[str, str]] | str:
    """A Python that can run the parts, and its environment; or why there is none."""
    environment = environment_of([])
    venv = str(ROOT / ".venv/bin/python")
    for python in [asked.python] if asked.python else [venv, sys.executable]:
        lacks = missing(python, list(NEEDED), environment)
        if not lacks:
            return python, environment
    if asked.python:
        return f"{asked.python} lacks {', '.join(NEEDED[name] for name in lacks)}"
    if asked.wheels:
        site = tempfile.mkdtemp(prefix="pointshade_site_")
        names = [name.partition("==")[0] for name in USEFUL.values()]
        present = [path.name.lower().replace("_", "-") for path in asked.wheels.glob("*.whl")]
        useful = [name for name in names if any(one.startswith(f"{name}-") for one in present)]
        offline = ["-m", "pip", "install", "-q", "--no-index", "--target", site]
        command = [sys.executable, *offline, "--find-links", str(asked.wheels.resolve()), *NEEDED.values(), *useful]
        python, environment = sys.executable, environment_of([site])
        for wheel in asked.wheels.glob("vtk-*.whl"):  # what else it asks for, it does not need here
            run([python, *offline, "--no-deps", str(wheel.resolve())], INSTALLING, environment, report / "log.txt")
    else:
        command, python = ["bash", "-c", readme_line()], venv
    done = run(command, INSTALLING, environment, report / "log.txt")
    if not missing(python, list(NEEDED), environment):
        return python, environment
    how = "took too long" if done.status is None else f"failed ({done.output.strip()[-300:]})"
    return (
        f"installing {how}. Without a network bring .venv, or wheels made by `{wheel_line()}` and pass --wheels wheels"
    )


def picture_rows(report: Path) -> list[dict[str, Any]]:
    """How whole pictures differ from what was expected, the worst first."""
    file = report / DIFFERENCES
    rows = [json.loads(line) for line in file.read_text().splitlines()] if file.is_file() else []
    file.unlink(missing_ok=True)
    return sorted(rows, key=lambda row: -row["share"])


def keep_failures(report: Path, since: float) -> int:
    """Put the pictures of tests that failed into a ZIP, and return how many there are."""
    pictures = [path for path in sorted((ROOT / "tests/failures").glob("*.png")) if path.stat().st_mtime >= since]
    if pictures:
        with zipfile.ZipFile(report / "failures.zip", "w") as archive:
            for path in pictures:
                archive.write(path, path.name)
    return len(pictures)


def markdown(results: dict[str, Any]) -> str:
    """The report for people."""
    lines = [f"# pointshade_gl on {results['machine'].get('renderer') or platform.node()}: {results['verdict']}", ""]
    lines += [f"{results['when']}, {results['seconds']:.0f} s. {results['note']}".strip(), ""]
    lines += ["| part | verdict | s | tests | |", "|---|---|---|---|---|"]
    for part in results["parts"]:
        tests = ", ".join(f"{count} {name}" for name, count in part.get("tests", {}).items())
        kind = "" if part["decides"] else " (measured only)"
        lines.append(
            f"| {part['name']} | {part['verdict']} | {part['seconds']:.0f} | {tests} | {part['title']}{kind} |"
        )
    lines += ["", "## The machine", ""]
    lines += [f"- {name}: {value}" for name, value in results["machine"].items()]
    for part in results["parts"]:
        lines += _details(part)
    if results["pictures"]:
        lines += ["", "## Pictures: how far from what was expected", ""]
        lines += [
            "A picture agrees if at most 0.1 % of its pixels differ by more than 2 steps and the mean is 0.05.",
            "",
        ]
        lines += ["| picture | beside | more than 2 steps, % | mean | most | dB |", "|---|---|---|---|---|---|"]
        differing = [row for row in results["pictures"] if row["most"]]
        for row in differing:
            name = f"{row['name']} **differs**" if row["complaint"] else row["name"]
            numbers = f"{100 * row['share']:.3f} | {row['mean']:.4f} | {row['most']} | {row['decibels']}"
            lines.append(f"| {name} | {row['kind']} | {numbers} |")
        lines += ["", f"{len(results['pictures']) - len(differing)} others are equal, bit by bit."]
    return "\n".join(lines) + "\n"


def _details(part: dict[str, Any]) -> list[str]:
    """What a part says beyond its row: failures, skipped tests, or its own text."""
    failures, skips = part.get("failures", []), part.get("skips", [])
    lines = [f"- {text[:300]}" for text in failures[:MOST_LISTED]]
    lines += [f"- and {len(failures) - MOST_LISTED} more, see log.txt"] if len(failures) > MOST_LISTED else []
    lines += [f"- skipped {text[:200]}" for text in skips]
    lines += ["```", part["text"], "```"] if part.get("text") else []
    return ["", f"## {part['name']}: {part['verdict']}", "", *lines] if lines else []


def write_report(report: Path, results: dict[str, Any]) -> None:
    """Write both files; after each part, so that they are there if the machine goes away."""
    (report / "report.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    (report / "report.md").write_text(markdown(results), encoding="utf-8")


def machine() -> dict[str, Any]:
    """What the system says, before any OpenGL."""
    found: dict[str, Any] = {"system": platform.platform(), "cores": os.cpu_count()}
    if shutil.which("nvidia-smi"):
        asked = ["nvidia-smi", "--query-gpu=index,name,driver_version,memory.total", "--format=csv,noheader"]
        try:
            found["nvidia-smi"] = subprocess.run(asked, capture_output=True, text=True, timeout=30).stdout.strip()
        except (OSError, subprocess.TimeoutExpired) as error:
            found["nvidia-smi"] = f"does not answer: {error}"
    vendors = [Path("/usr/share/glvnd/egl_vendor.d"), Path("/etc/glvnd/egl_vendor.d")]
    found["EGL vendors"] = (
        ", ".join(path.name for folder in vendors for path in sorted(folder.glob("*.json"))) or "none"
    )
    variables = ("CUDA_VISIBLE_DEVICES", "__EGL_VENDOR_LIBRARY_FILENAMES", "GALLIUM_DRIVER", "POINTSHADE_PROGRAMS")
    return found | {name: os.environ[name] for name in variables if name in os.environ}


def work(asked: argparse.Namespace, parts: Sequence[Part]) -> int:
    """Run the parts and write the report. Returns the exit status."""
    begin, started = time.monotonic(), time.time()
    report = asked.report.resolve()
    report.mkdir(parents=True, exist_ok=True)
    for name in ("log.txt", DIFFERENCES, "failures.zip"):
        (report / name).unlink(missing_ok=True)
    results: dict[str, Any] = {
        "verdict": "not finished", "when": time.strftime("%Y-%m-%d %H:%M"), "seconds": 0.0, "note": "",
        "machine": machine(), "parts": [], "pictures": [],
    }  # fmt: skip
    found = find_python(asked, report)
    if isinstance(found, str):
        results |= {"verdict": "nothing ran", "note": found, "seconds": time.monotonic() - begin}
        write_report(report, results)
        print(f"nothing ran: {found}", file=sys.stderr)
        return 2
    python, environment = found
    lacks = missing(python, [*USEFUL, *BESIDE], environment)
    results["machine"]["Python"] = python
    for part in parts:
        left = 60 * asked.minutes - (time.monotonic() - begin)
        limit = min(part.seconds * asked.minutes / 10, left)
        if part.needs in lacks:
            row = {"verdict": f"left out: needs {(USEFUL | BESIDE)[part.needs]}", "seconds": 0.0}
            row |= {"name": part.name, "title": part.title, "decides": part.decides}
        else:
            command = command_of(part, python, report, "xdist" not in lacks)
            row = judge(part, run(command, limit, environment, report / "log.txt") if left > 1 else Run(None, "", 0.0))
        print(f"{part.name:12} {row['verdict']:12} {row['seconds']:6.1f} s  {row.get('tests') or ''}", flush=True)
        results["parts"].append(row)
        if part.name == "environment":
            _take_facts(results, row)
        results["seconds"] = time.monotonic() - begin
        write_report(report, results)
    results["pictures"] = picture_rows(report)
    results["failed pictures"] = keep_failures(report, started)
    is_right = all(row["verdict"] == "passed" for row in results["parts"] if row["decides"])
    results["verdict"] = "all right" if is_right else "not all right"
    write_report(report, results)
    print(f"{results['verdict']}: {report / 'report.md'}")
    return 0 if is_right else 1


def _take_facts(results: dict[str, Any], row: dict[str, Any]) -> None:
    """Move what the probe of the environment found to the machine, and warn of a software driver."""
    lines = [line for line in row["text"].splitlines() if line.startswith("{")]
    if row["verdict"] == "passed" and lines:
        results["machine"] |= json.loads(lines[-1])
        row["text"] = ""
        if results["machine"]["is software"]:
            results["note"] = "A software driver draws: this says nothing about a GPU."


def show_parts(parts: Sequence[Part]) -> None:
    """Print what would run."""
    for part in parts:
        what = " ".join((*part.tests, *part.script)) or "a probe"
        print(f"{part.name:12}{part.seconds:4.0f} s  {part.title}: {what}")
    print(f"for a machine without a network: {wheel_line()}")


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("report", type=Path, nargs="?", default=Path("on_a_gpu"), help="a folder")
    parser.add_argument("--minutes", type=float, default=10.0, help="for all; each part's limit grows with it")
    parser.add_argument("--only", action="append", metavar="PART", choices=[part.name for part in PARTS])
    parser.add_argument("--python", help="a Python that has everything")
    parser.add_argument("--wheels", type=Path, help="a folder of wheels: nothing is asked of the network")
    parser.add_argument("--list", action="store_true", help="print the parts and end")
    asked = parser.parse_args()
    parts = [part for part in PARTS if not asked.only or part.name in asked.only]
    if asked.list:
        show_parts(parts)
        return 0
    return work(asked, parts)


if __name__ == "__main__":
    sys.exit(main())
