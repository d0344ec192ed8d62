"""What was typed wrong, in one sentence with the way out: Typer's own errors are boxes of five lines."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

from .checks import check_path
from .cli_light import FIELDS
from .files.builtin import FRAMES, SCENES
from .files.content import split_numbers
from .suggestions import did_you_mean, listed_beside, near_path
from .wording import option

# click's UsageError. Newer versions of Typer have click inside, older ones beside them; all of them export this child.
UsageError: Any = typer.BadParameter.__base__
_LIGHT_WORD = re.compile(rf"\b(?:{'|'.join(FIELDS)})\b(?:=|$)")
_QUOTES = 'put the words of a light in quotes, as in --light "position=-.5,-.7,.2 shadow"'


class Commands(TyperGroup):
    """The commands by name. A wrong name gets the near one; an input without a command, the commands for it."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name = args[0]
        if name in self.commands or name.startswith("-"):
            return super().resolve_command(ctx, args)
        if name in (*FRAMES, *SCENES) or Path(name).exists():
            raise ValueError(
                f"{name} is not a command: pass `pointshade render {name} -o out.png` or `pointshade view {name}`"
            )
        near = did_you_mean(name, self.commands)
        raise ValueError(f"unknown command {name!r}{near}: known are {', '.join(self.commands)}")


def check_input(text: str | None) -> str | None:
    """INPUT. Raises ValueError for a word of a light that the shell took for it."""
    if text and _LIGHT_WORD.match(text) and not Path(text).exists():
        raise ValueError(f"{text} is not an input: {_QUOTES}")
    return text


def check_exist(**given: str | Path | None) -> None:
    """Raises FileNotFoundError for an option whose value is a path to nothing. Numbers in a text pass.

    The error says by which option it was given, and a near name or else what there is.
    """
    for name, value in given.items():
        if value is None or split_numbers(str(value)) is not None:
            continue
        path = check_path(value)
        if not path.exists():
            told = near_path(path) or listed_beside(path)
            raise FileNotFoundError(f"{option(name)}: {path} does not exist{told}")


def sentence_of(error: Any) -> str:
    """What a UsageError says, and which command explains more; empty if all the help was printed already."""
    message, parameter = error.format_message().strip().rstrip("."), getattr(error, "param", None)
    if parameter:
        fact = f": {error.message}" if error.message else " is missing"
        message = f"{parameter.opts[-1]}{fact.rstrip('.')} ({parameter.help.rstrip('.')})"
    elif hasattr(error, "possibilities"):  # an option that does not exist
        known = [name for parameter in error.ctx.command.params for name in parameter.opts]
        message = f"there is no option {error.option_name}{did_you_mean(error.option_name, known)}"
    elif "extra argument" in message and _LIGHT_WORD.search(message):
        message += f": {_QUOTES}"
    more = f"; `{error.ctx.command_path} --help` lists the options" if message and error.ctx else ""
    return f"{message[:1].lower()}{message[1:]}{more}"
