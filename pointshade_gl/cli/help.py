"""The help of a command: what everybody needs, examples, all options with `--help-all`; and shell completion."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..files.access.known_names import FRAMES, SCENES
from ..scene.option_fields import OPTIONS, PANELS

# A command that is not here has so few options that its help lists them all.
FIRST = {
    "render": "-o --light --yaw --pitch --zoom --shading --environment --picture-size --samples --background --ground "
    "--turntable --fov",
    "normals": "-o --normals --axes --bits --frame --fov --depth-scale --noise --missing",
    "depth": "-o --yaw --pitch --zoom --picture-size --frame --fov --depth-scale --missing",
    "albedo": "-o --explain --fov --intrinsics --depth-scale",
    "align": "-o --frame --fov --intrinsics --depth-scale",
    "view": "--light --yaw --pitch --shading --environment --views --window-size --panel --fps --record --fov",
    "info": "-o --json --fov --intrinsics --depth-scale --depth-kind",
    "batch": "-o --to --workers --resume --overwrite --shard --light --yaw --picture-size --samples --bits --axes "
    "--fov",
}  # fmt: skip

EXAMPLES = {
    "render": (
        ("A folder with depth and colour, lit from the upper left, seen from the side:",
         "pointshade render my_frame -o lit.png --light -.5,-.7,.2 --yaw 20"),
        ("For a paper: on white, with a soft shadow:",
         "pointshade render my_frame -o figure.png --ground --background white"),
        ("A photograph and its depth, lit from the front:",
         "pointshade render --color photo.jpg --depth photo_depth.png --fov 60"),
        ("A film in which the light goes around; a page in which it follows the mouse:",
         "pointshade render my_frame -o film.gif --turntable light"),
        ("", "pointshade render my_frame -o page.html"),
    ),
    "normals": (
        ("Normals as floats, in camera axes:", "pointshade normals my_frame -o normals.npy"),
        ("A picture of 16 bits for each frame of a sequence, green up as in OpenGL:",
         "pointshade normals my_sequence -o normals_%04d.png --bits 16 --axes opengl"),
        ("A point cloud with normals that point outwards:", "pointshade normals scan.ply -o with_normals.ply"),
    ),
    "depth": (
        ("Metres, seen from another side:", "pointshade depth my_frame -o depth.exr --yaw 15"),
        ("Millimetres of each frame of a sequence:", "pointshade depth my_sequence -o depth_%04d.png"),
        ("At half the size, as a NumPy array:", "pointshade depth my_frame -o depth.npy --picture-size half"),
    ),
    "albedo": (
        ("Photographs from one tripod, each under its own light:", "pointshade albedo my_lights -o albedo.png"),
        ("What was found about the lights:", "pointshade albedo my_lights -o albedo.png --explain"),
        ("Then light it anew:", "pointshade render my_lights --unlight-all -o relit.png"),
    ),
    "align": (
        ("Two folders that show the same thing:", "pointshade align left right -o poses.json"),
        ("Two frames of one sequence:", "pointshade align my_sequence my_sequence --frame 0,1 -o poses.json"),
        ("Then draw both as one object:", "pointshade render left right --poses poses.json -o merged.png"),
    ),
    "view": (
        ("The built-in vase, or your folder:", "pointshade view"),
        ("", "pointshade view my_frame"),
        ("All frames of a sequence as one object:", "pointshade view my_sequence --views all"),
        ("A shadow from a fixed lamp, and the panel with all controls:",
         'pointshade view my_frame --panel --light "position=-.5,-.7,.2 shadow"'),
    ),
    "info": (
        ("What this machine draws with:", "pointshade info"),
        ("What is in a folder, with a contact sheet:", "pointshade info my_frame -o sheet.png"),
        ("The same for a program:", "pointshade info my_frame --json"),
    ),
    "batch": (
        ("A picture of each frame of some folders:", "pointshade batch my_frame my_sequence -o lit"),
        ("Normals for a training set, then go on after an interruption:",
         "pointshade batch my_sequence -o training --to normals.png --bits 16"),
        ("", "pointshade batch my_sequence -o training --to normals.png --bits 16 --resume"),
        ("The second of eight parts, as on a cluster:", "pointshade batch my_sequence -o lit --shard 2/8"),
    ),
    "bench": (
        ("Every estimator against exact truth, in half a minute:", "pointshade bench --quick -o bench"),
        ("How fast each stage is:", "pointshade bench --speed --quick"),
        ("Whether a change cost something:", "pointshade bench --speed --quick --against HEAD~1"),
    ),
    "": (
        ("The built-in vase as a picture, and in a window:", "pointshade render -o vase.png"),
        ("", "pointshade view"),
        ("How your files are read, then your first picture:", "pointshade info my_frame"),
        ("", "pointshade render my_frame"),
    ),
}  # fmt: skip


NARROWEST, WIDEST = 40, 100  # columns of text
LEFT = 24  # of the names of options
_SENTENCE_END = re.compile(r"(?<=\.) (?=[A-Z])")

Entry = tuple[str, str]  # what is explained, and how


def show_help(command: Any, context: Any, everything: bool = False) -> None:
    """Print the help of a command, or of all commands; in colours only to a terminal, and not with NO_COLOR."""
    from rich.console import Console  # as late as Typer does

    console = Console(highlight=False, soft_wrap=True)
    width = min(max(console.width, NARROWEST), WIDEST)
    for text, style in _lines(command, context, everything, width):
        console.print(text, style=style, markup=False, end="")


def _lines(command: Any, context: Any, everything: bool, width: int) -> Iterator[Entry]:
    """Return texts and their styles."""
    name = "" if hasattr(command, "commands") else context.info_name
    shown = [one for one in command.get_params(context) if not getattr(one, "hidden", False)]
    first, everything = FIRST.get(name, "").split(), everything or name not in FIRST
    options = [one for one in shown if one.param_type_name == "option"]
    arguments = [one for one in shown if one.param_type_name == "argument"]
    of_panel: dict[str, list[Any]] = {title: [] for title in PANELS}
    for one in options:
        of_panel[getattr(one, "rich_help_panel", None) or OPTIONS].append(one)
    needed = [f"{_names(one).split(', ')[0]} {one.metavar}" for one in options if one.required]
    usage = " ".join([context.command_path, *needed, *command.collect_usage_pieces(context)])
    yield "Usage: ", "bold"
    yield f"{_filled(usage, width, 7).lstrip()}\n", ""
    paragraphs = (command.help or "").split("\n\n")
    for paragraph in paragraphs if everything else [_first(paragraphs[0])]:
        yield f"\n{_filled(paragraph, width)}\n", ""
    if name == "":
        yield from _section("Commands", [(one, _first(sub.help)) for one, sub in command.commands.items()], width)
    yield from _section("", [(one.metavar or one.name, _text_of(one, everything)) for one in arguments], width)
    if everything:
        for title, found in of_panel.items():
            yield from _section(title, [_entry(one, True) for one in found], width)
    else:
        known = {name: one for one in options for name in one.opts}
        yield from _section(OPTIONS, [_entry(known[one], False) for one in first], width)
        yield from _rest(of_panel, first, context, width)
    yield "\nExamples:\n", "bold"
    for texts, line in EXAMPLES[name]:
        yield (f"{_filled(texts, width, 2)}\n" if texts else ""), ""
        yield f"    {line}\n", "cyan"
    if name == "":
        yield "\n`pointshade COMMAND --help` explains a command.\n", ""


def _rest(of_panel: dict[str, list[Any]], first: Iterable[str], context: Any, width: int) -> Iterator[Entry]:
    """Return how many options there are beside the first ones, and where."""
    left = {title: sum(not {*one.opts} & {*first} for one in found) for title, found in of_panel.items()}
    texts = ", ".join(f"{title} ({count})" for title, count in left.items() if count)
    text = f"`{context.command_path} --help-all` explains {sum(left.values())} more options: {texts}."
    yield f"\n{_filled(text, width)}\n", ""


def _section(title: str, entries: Iterable[Entry], width: int) -> Iterator[Entry]:
    """Return a heading and its entries: names on the left, beside them what they mean."""
    entries = list(entries)
    if entries:
        yield f"\n{title}:\n" if title else "\n", "bold"
    for name, texts in entries:
        lines = textwrap.wrap(texts, width - LEFT - 4, break_on_hyphens=False) or [""]
        yield f"  {name:{LEFT}}", "cyan"
        yield (f"  {lines.pop(0)}\n" if len(name) <= LEFT else "\n"), ""
        yield "".join(f"{'':{LEFT + 4}}{line}\n" for line in lines), ""


def _entry(one: Any, everything: bool) -> Entry:
    """Return the names of an option with what follows them, and what it does."""
    value = "" if one.is_flag else f" {one.metavar or one.type.name.upper()}"
    return _names(one) + value, _text_of(one, everything)


def _names(one: Any) -> str:
    return ", ".join(sorted(one.opts, key=lambda name: name.startswith("--")))


def _text_of(one: Any, everything: bool) -> str:
    """Return what an option or argument does: all of it with its default, or the first sentence."""
    text = " ".join((one.help or "").split())
    if not everything:
        return _first(text)
    is_named = "efault" in text or one.default in (None, False, "") or one.param_type_name == "argument" or one.is_flag
    default = f"{one.default:g}" if isinstance(one.default, float) else one.default
    return text if is_named or callable(default) else f"{text} Default: {default}."


def _first(text: str | None) -> str:
    return _SENTENCE_END.split(" ".join((text or "").split()))[0]


def _filled(text: str, width: int, indent: int = 0) -> str:
    blanks = " " * indent
    return textwrap.fill(
        " ".join(text.split()), width, initial_indent=blanks, subsequent_indent=blanks, break_on_hyphens=False
    )


def one_of(known: Iterable[str]) -> Callable[[str], list[str]]:
    """Completes an option that takes one of these names."""
    names = tuple(known)

    def complete(incomplete: str) -> list[str]:
        return [name for name in names if name.startswith(incomplete)]

    return complete


def complete_input(incomplete: str) -> list[str]:
    """The built-in names that fit and, beside them, folders and files. Where no name fits the shell finds the files."""
    names = [name for name in (*FRAMES, *SCENES) if name.startswith(incomplete)]
    beside: list[str] = []
    with suppress(OSError):
        beside = [path.name for path in Path().iterdir() if path.name[0] != "." and path.name.startswith(incomplete)]
    return [*names, *sorted(set(beside) - set(names))] if names else []
