"""What was typed wrong, in one sentence with the way out: Typer's own errors are boxes of five lines."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from ..checks.arguments import check_path
from ..files.access.content import split_numbers
from ..files.access.known_names import FRAMES, SCENES
from ..notes.words import did_you_mean, listed_beside, meant_option, near_path, option
from .light_words import FIELDS

# click's UsageError. Newer versions of Typer have click inside, older ones beside them; all of them export this child.
UsageError: Any = typer.BadParameter.__base__
_LIGHT_WORD = re.compile(rf"\b(?:{'|'.join(FIELDS)})\b(?:=|$)")
_NO_NUMBER = re.compile(r"('.*') is not a valid (float|int\w*)(?: range)?", re.DOTALL)
_EXTRA = re.compile(r"extra argument\S* \((.*)\)", re.DOTALL)
_QUOTES = 'put the words of a light in quotes, as in --light "position=-.5,-.7,.2 shadow"'


class Command(TyperCommand):
    """One of the commands: its help is ours."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        from .help_page import show_help

        show_help(self, ctx)


class Commands(TyperGroup):
    """The commands by name. A wrong name gets the near one; an input without a command, the commands for it."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        from .help_page import show_help

        show_help(self, ctx)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name = args[0]
        if name in self.commands or name.startswith("-"):
            return super().resolve_command(ctx, args)
        if name in (*FRAMES, *SCENES) or Path(name).exists():
            raise ValueError(
                f"{name} is not a command: pass `pointshade render {name} -o out.png` or `pointshade view {name}`"
            )
        near = did_you_mean(name, self.commands)
        known = f"known are {', '.join(self.commands)}; `pointshade --help` explains them"
        raise ValueError(f"unknown command {name!r}{near}: {known}")


def check_input(text: str | None) -> str | None:
    """INPUT. Raises ValueError for a word of a light that the shell took for it."""
    if text and _LIGHT_WORD.match(text) and not Path(text).exists():
        raise ValueError(f"{text} is not an input: {_QUOTES}")
    return text


def check_exist(folder: str | None = None, **given: str | Path | None) -> None:
    """Raises FileNotFoundError for an option whose value is a path to nothing. Numbers of a camera pass.

    The error says by which option it was given, and a near name or else what there is.

    folder  in which the file may have been meant to lie
    """
    for name, value in given.items():
        if value is None or (name == "intrinsics" and split_numbers(str(value)) is not None):
            continue
        path = check_path(value)
        if not path.exists():
            inside = Path(folder or "", path)
            told = f" (did you mean {inside}?)" if inside.exists() else near_path(path) or listed_beside(path)
            raise FileNotFoundError(f"{option(name)}: {path} does not exist{told}")


def check_folders(inputs: Sequence[str]) -> None:
    """Raises ValueError for an INPUT after the first that is no folder and no cloud: it was meant for an option.

    FileNotFoundError if it does not exist.
    """
    from ..files.frame_sources import is_cloud

    for path in inputs:
        is_path = split_numbers(path) is None and not _LIGHT_WORD.search(path) and path not in (*FRAMES, *SCENES)
        if is_path and not Path(path).exists():
            raise FileNotFoundError(f"{path} does not exist{near_path(Path(path)) or listed_beside(Path(path))}")
        if not (Path(path).is_dir() or is_cloud(path)):
            raise ValueError(f"more INPUTs must be folders of frames, or point clouds, got {path}: {_way_out(path)}")


def sentence_of(error: Any, every: Callable[[], Mapping[str, Any]]) -> str:
    """What a UsageError says, and which command explains more; empty if all the help was printed already.

    every  returns all commands by their names: an option may be another's
    """
    message, parameter = error.format_message().strip().rstrip("."), getattr(error, "param", None)
    if parameter and error.message:
        message = f"{parameter.opts[-1]} {_fact(error)} ({parameter.help.rstrip('.')})"
    elif parameter:
        message = f"{parameter.opts[0]} is missing: {parameter.help[:1].lower()}{parameter.help[1:].rstrip('.')}"
    elif hasattr(error, "possibilities"):  # an option that does not exist
        message = _no_option(error.option_name, error.ctx.command, every())
    elif (extra := _EXTRA.search(message)) and "input" in _options(error.ctx.command):
        message = f"there is one INPUT, got also {extra[1]}: {_way_out(extra[1])}"
    more = f"; `{error.ctx.command_path} --help` lists the options" if message and error.ctx else ""
    return f"{message[:1].lower()}{message[1:]}{more}"


def _fact(error: Any) -> str:
    """What is wrong with the value of an option."""
    message = error.message.rstrip(".")
    if found := _NO_NUMBER.fullmatch(message):
        return f"must be a {'whole ' if found[2].startswith('int') else ''}number, got {found[1]}"
    return message


def _no_option(name: str, command: Any, every: Mapping[str, Any]) -> str:
    near = meant_option(name, _options(command))
    others = [f"`pointshade {other}`" for other, one in every.items() if not near and name in _options(one)]
    return f"there is no option {name}{near}" + (f", only in {' and '.join(others)}" if others else "")


def _options(command: Any) -> list[str]:
    return [name for parameter in command.params for name in parameter.opts]


def _way_out(extra: str) -> str:
    if _LIGHT_WORD.search(extra):
        return _QUOTES
    if (near := near_path(Path(extra))) and not Path(extra).exists():
        return f"it does not exist{near}"
    if split_numbers(extra) is not None:
        return "write numbers with commas and no spaces, as in --light 1,2,3"
    return "pass files as --depth FILE, --color FILE and -o FILE"
