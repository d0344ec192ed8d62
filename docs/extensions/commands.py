"""The page of the command line, from the commands themselves: it is never out of date.

In reference/command-line.md the line `% commands` becomes a section of each command: its help, examples, all options.
"""

import re
from importlib.util import find_spec
from itertools import groupby
from typing import Any

from sphinx.application import Sphinx
from typer.main import get_command

from pointshade_gl.cli.main import command_line
from pointshade_gl.scene import option_fields

PAGE, MARK = "reference/command-line", "% commands"
SIGNS = re.compile(r"([\\`*_{}\[\]<>#$|~^])")  # of Markdown
WORDS = re.compile(r"((?<![\w-])--?[a-z][\w-]*)")  # options in a text


def plain(text: str) -> str:
    """Return plain text as Markdown, options in it as code."""
    pieces = WORDS.split(" ".join(text.split()))
    return "".join(f"`{one}`" if k % 2 else SIGNS.sub(r"\\\1", one) for k, one in enumerate(pieces))


def entry(one: Any) -> str:
    """Return an option or an argument, with its names, values and default."""
    names = ", ".join(sorted(one.opts, key=lambda name: name.startswith("--")))
    is_option = one.param_type_name == "option"
    value = "" if is_option and one.is_flag else f" {one.metavar or one.name.upper()}"
    is_told = "efault" in (one.help or "") or one.default in (None, False, "", [], ()) or callable(one.default)
    default = f"{one.default:g}" if isinstance(one.default, float) else one.default
    text = plain(one.help or "") + ("" if is_told or one.is_flag else f" Default: `{default}`.")
    if not is_option:
        return f"`{one.metavar or one.name.upper()}`\n: {text}\n"
    return f":::{{option}} {names}{value}\n{text}\n:::\n"


def section(name: str, command: Any) -> str:
    """Return the section of a command."""
    shown = [one for one in command.params if not getattr(one, "hidden", False)]
    arguments = [one for one in shown if one.param_type_name != "option"]
    options = [one for one in shown if one.param_type_name == "option"]
    typed = " ".join(f"[{one.metavar or one.name.upper()}]{'...' * (one.nargs != 1)}" for one in arguments)
    about, *more = (command.help or "").split("\n\n")
    lines = [f"## pointshade {name}", plain(about), f"```text\npointshade {name} [OPTIONS] {typed}\n```"]
    lines += map(plain, more)
    lines += [examples(name), f"```{{program}} pointshade {name}\n```", *map(entry, arguments)]
    order = list(dict.fromkeys((*getattr(option_fields, "PANELS", ()), *map(panel, options))))
    for title, found in groupby(sorted(options, key=lambda one: order.index(panel(one))), panel):
        lines += [f"**{title}**", *map(entry, found)]
    return "\n\n".join(line for line in lines if line)


def panel(one: Any) -> str:
    return getattr(one, "rich_help_panel", None) or "Options"


def examples(name: str) -> str:
    """Return the examples that the command's help ends with."""
    if find_spec("pointshade_gl.cli.help") is None:
        return ""
    from pointshade_gl.cli.help import EXAMPLES

    return (
        "```sh\n"
        + "\n".join(f"{f'# {told}' + chr(10) if told else ''}{line}" for told, line in EXAMPLES[name])
        + "\n```"
    )


def fill(app: Sphinx, name: str, source: list[str]) -> None:
    if name == PAGE:
        commands = get_command(command_line()).commands  # type: ignore[attr-defined]
        sections = (section(one, command) for one, command in commands.items())
        source[0] = source[0].replace(MARK, "\n\n".join(sections))


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
