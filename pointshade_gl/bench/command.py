"""`pointshade bench`: measures, draws charts, writes files. It leaves no file half-written.

Its research lies in tests/benchmarks: lit pictures, several views, the comparison with other versions.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, cast

from rich.console import Console
from rich.progress import Progress

from ..files.access.atomic_write import check_place, naming_written, written_whole
from ..notes.notes import print_note
from ..notes.words import did_you_mean, option
from ..renderer.renderer import Renderer
from ..scene.noise import METHODS, Method
from .charts import bold, brief, check_matplotlib, error_chart, new_table, stability_chart, wide_console
from .measure import BROKEN, CONDITIONS, FULL, QUICK, STRESSES, Measurement, Plan

Names = tuple[list[Method], list[str], list[str]]  # of methods, conditions and stresses
RESEARCH = Path(__file__).resolve().parents[2] / "tests" / "benchmarks"  # where this is a clone of the repository


def bench(output: Path, quick: bool, only: Sequence[str], seed: int, device: int) -> str:
    """Writes results.json, chart.png and stability.png to a folder; prints tables.

    only  names of methods, conditions or stresses to measure; empty: all. With methods alone, all conditions and
          stresses are measured; with conditions alone no stresses, and with stresses alone no conditions

    Returns one line about what was written. Raises ValueError for unknown names, or without matplotlib.
    """
    methods, conditions, stresses = names = select(only)
    prepare(output)
    with Renderer(device=device) as renderer:
        results = measure(renderer, QUICK if quick else FULL, names, seed)
    results["quick"] = quick
    pictures = {}
    if conditions:
        pictures["chart.png"] = error_chart(results)
    if stresses:
        pictures["stability.png"] = stability_chart(results)
    write(output, pictures, results)
    show(results)
    where = results["gl"]["renderer"]
    return f"{output}: {', '.join([*pictures, 'results.json'])}: {len(methods)} methods on {where}"


def bench_speed(output: Path, quick: bool, device: int) -> str:
    """Writes speed.json and speed.png to a folder; prints tables. Returns one line about what was written. In a clone
    there are also what `--against` compares with and, of a software renderer, the merging of splats."""
    from .speed import QUICK_SIZES, SIZES, measure_speed, show_speed, speed_chart

    prepare(output)
    sizes, rounds = (SIZES[:QUICK_SIZES], 3) if quick else (SIZES, 9)
    merging = research("speed", "merging") if (RESEARCH / "merging.py").is_file() else None
    with progress(len(sizes) + 2) as advance:
        results = measure_speed(device, rounds, sizes, advance)
        if merging:
            results["merging"] = merging.measure_merging(device, rounds) if results["is_software"] else []  # GPUs: none
            results["jobs"] = research("against", "speed_against").measure_jobs(device, rounds)
    panels = [merging.panel_of(results["merging"])] if merging and results["merging"] else []
    write(output, {"speed.png": speed_chart(results, *panels)}, results, "speed.json")
    show_speed(results, wide_console())
    if merging and panels:
        merging.show_merging(results["merging"], wide_console())
    return f"{output}: speed.png, speed.json: {results['gl']['renderer']}"


def research(name: str, script: str) -> Any:
    """The module of tests/benchmarks that does what an option asks for. Raises ValueError where the package lies
    outside a clone of the repository."""
    if not (RESEARCH / f"{script}.py").is_file():
        place = f"tests/benchmarks/{script}.py"
        raise ValueError(f"{option(name)} is research: run it in a clone of the repository ({place})")
    sys.path.insert(0, str(RESEARCH))  # it imports its neighbours
    return import_module(script)


def prepare(output: Path) -> None:
    """Makes the folder, before the long work: it may be impossible. Raises ValueError, also without matplotlib."""
    check_matplotlib()
    if output.exists() and not output.is_dir():
        raise ValueError(f"cannot write to {output}: it is a file, expected a folder")
    with naming_written(output):
        output.mkdir(parents=True, exist_ok=True)
    check_place(output / "results.json")


@contextmanager
def progress(total: int | None = None) -> Iterator[Callable[[], None]]:
    """A bar on stderr, and what moves it."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("measuring", total=total)
        yield lambda: bar.advance(task)


def write(output: Path, pictures: dict[str, bytes], results: dict[str, Any], name: str = "results.json") -> None:
    """Writes each file completely, or not at all; results last, with five digits per number: others are noise."""
    short = json.loads(json.dumps(results), parse_float=lambda digits: float(f"{float(digits):.5g}"))
    for file, content in (pictures | {name: json.dumps(short, indent=1).encode() + b"\n"}).items():
        with written_whole(output / file) as temporary:
            temporary.write_bytes(content)


def select(only: Sequence[str]) -> Names:
    """The named methods, conditions and stresses, in their usual order."""
    known = {"methods": METHODS, "conditions": tuple(CONDITIONS), "stresses": tuple(STRESSES)}
    for name in only:
        if not any(name in names for names in known.values()):
            lists = "; ".join(f"{kind} {', '.join(names)}" for kind, names in known.items())
            near = did_you_mean(name, [name for names in known.values() for name in names])
            raise ValueError(f"unknown name {name!r} for {option('only')}{near}: known are {lists}")
    methods, conditions, stresses = ([name for name in names if name in only] for names in known.values())
    if not (conditions or stresses):
        conditions, stresses = list(CONDITIONS), list(STRESSES)
    return cast("list[Method]", methods) or list(METHODS), conditions, stresses


def measure(renderer: Renderer, plan: Plan, names: Names, seed: int) -> dict[str, Any]:
    methods, conditions, stresses = names
    if renderer.context.is_software:
        name = renderer.context.renderer
        print_note(f"{name} is a software renderer: errors are right, times are those of this CPU")
    with progress(plan.steps(len(methods), conditions, stresses)) as advance:
        return Measurement(renderer, plan, methods, seed, advance).results(conditions, stresses)


def show(results: dict[str, Any]) -> None:
    """Prints the tables: errors and times per condition, and the strength at which each estimator fails."""
    console = wide_console()
    methods, errors, clock = results["methods"], results["errors"], results["clock"]
    if results["conditions"]:
        title = "mean angular error in degrees: all pixels / near depth edges"
        table = new_table(title, "method", clock.replace("_", " "), *results["conditions"])
        for method in methods:
            times = [row[clock] for row in results["times"][method].values()]
            cells = [f"{brief(cell['all'])}/{brief(cell['edge'])}" for cell in errors[method].values()]
            table.add_row(method, f"{brief(min(times))}-{brief(max(times))}", *cells, style=bold(method))
        console.print(table)
    breaks = {name: found["breaks"] for name, found in results["stability"].items()}
    breaks = {name: row for name, row in breaks.items() if any(row.values())}
    if results["stability"]:
        title = f"strength at which the error exceeds {BROKEN:g} degrees; harmless stresses are left out"
        table = new_table(title, "method", *(f"{name}\n{STRESSES[name].axis}" for name in breaks))
        for method in methods:
            table.add_row(method, *(brief(row[method]) for row in breaks.values()), style=bold(method))
        console.print(table)
