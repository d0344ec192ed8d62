"""The help of a command: what everybody needs, examples, and all options in groups with `--help-all`."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator
from typing import Any

from ..scene.option_fields import OPTIONS, PANELS
from .help_words import EXAMPLES, FIRST

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
    first, everything = FIRST.get(name, ()), everything or name not in FIRST
    yield "Usage: ", "bold"
    yield f"{_filled(_usage(command, context, shown), width, 7).lstrip()}\n", ""
    for paragraph in _paragraphs(command.help, everything):
        yield f"\n{_filled(paragraph, width)}\n", ""
    arguments = [one for one in shown if one.param_type_name == "argument"]
    groups = _groups(shown)
    if name == "":
        yield from _section("Commands", [(one, _first(sub.help)) for one, sub in command.commands.items()], width)
    yield from _section("", [(one.metavar or one.name, _said(one, everything)) for one in arguments], width)
    if everything:
        for title, found in groups.items():
            yield from _section(title, [_entry(one, True) for one in found], width)
    else:
        known = {name: one for one in shown for name in one.opts}
        yield from _section(OPTIONS, [_entry(known[one], False) for one in first], width)
        yield from _rest(groups, first, context, width)
    yield "\nExamples:\n", "bold"
    for told, line in EXAMPLES[name]:
        yield (f"{_filled(told, width, 2)}\n" if told else ""), ""
        yield f"    {line}\n", "cyan"
    if name == "":
        yield "\n`pointshade COMMAND --help` explains a command.\n", ""


def _usage(command: Any, context: Any, shown: Iterable[Any]) -> str:
    """Return how a command is typed; what it cannot go without is named."""
    needed = [f"{_names(one).split(', ')[0]} {one.metavar}" for one in shown if _is_option(one) and one.required]
    return " ".join([context.command_path, *needed, *command.collect_usage_pieces(context)])


def _groups(shown: Iterable[Any]) -> dict[str, list[Any]]:
    """Return the options by their groups, in the order of the help."""
    options = [one for one in shown if _is_option(one)]
    of = {one.name: getattr(one, "rich_help_panel", None) or OPTIONS for one in options}
    titles = [title for title in PANELS if title in of.values()]
    return {title: [one for one in options if of[one.name] == title] for title in titles}


def _rest(groups: dict[str, list[Any]], first: Iterable[str], context: Any, width: int) -> Iterator[Entry]:
    """Say how many options there are beside the first ones, and where."""
    left = {title: sum(not {*one.opts} & {*first} for one in found) for title, found in groups.items()}
    told = ", ".join(f"{title} ({count})" for title, count in left.items() if count)
    text = f"`{context.command_path} --help-all` explains {sum(left.values())} more options: {told}."
    yield f"\n{_filled(text, width)}\n", ""


def _section(title: str, entries: Iterable[Entry], width: int) -> Iterator[Entry]:
    """Return a heading and its entries: names on the left, beside them what they mean."""
    entries = list(entries)
    if entries:
        yield f"\n{title}:\n" if title else "\n", "bold"
    for name, told in entries:
        lines = textwrap.wrap(told, width - LEFT - 4, break_on_hyphens=False) or [""]
        yield f"  {name:{LEFT}}", "cyan"
        yield (f"  {lines.pop(0)}\n" if len(name) <= LEFT else "\n"), ""
        yield "".join(f"{'':{LEFT + 4}}{line}\n" for line in lines), ""


def _entry(one: Any, everything: bool) -> Entry:
    """Return the names of an option with what follows them, and what it does."""
    value = "" if one.is_flag else f" {one.metavar or one.type.name.upper()}"
    return _names(one) + value, _said(one, everything)


def _names(one: Any) -> str:
    return ", ".join(sorted(one.opts, key=lambda name: name.startswith("--")))


def _said(one: Any, everything: bool) -> str:
    """Return what an option or argument does: all of it with its default, or the first sentence."""
    text = " ".join((one.help or "").split())
    if not everything:
        return _first(text)
    is_told = "efault" in text or one.default in (None, False, "") or not _is_option(one) or one.is_flag
    default = f"{one.default:g}" if isinstance(one.default, float) else one.default
    return text if is_told or callable(default) else f"{text} Default: {default}."


def _paragraphs(text: str | None, everything: bool) -> list[str]:
    """Return what a command does: the paragraphs of its help, or their first sentence."""
    found = [" ".join(one.split()) for one in (text or "").split("\n\n")]
    return found if everything else [_first(found[0])]


def _first(text: str | None) -> str:
    """Return the first sentence."""
    return _SENTENCE_END.split(" ".join((text or "").split()))[0]


def _is_option(one: Any) -> bool:
    return one.param_type_name == "option"


def _filled(text: str, width: int, indent: int = 0) -> str:
    blanks = " " * indent
    return textwrap.fill(text, width, initial_indent=blanks, subsequent_indent=blanks, break_on_hyphens=False)
