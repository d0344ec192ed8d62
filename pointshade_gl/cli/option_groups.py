"""Options as fields, texts that become values, and what was typed wrong in one sentence with the way out.

Typer's own errors are boxes of five lines.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields, make_dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import typer
from numpy.typing import NDArray
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from ..checks.arguments import check_path
from ..files.access.content import split_numbers
from ..files.access.known_names import FRAMES, SCENES
from ..files.input_kinds import Kind
from ..notes.words import did_you_mean, listed_beside, meant_option, near_path, option, shown
from ..scene.appearance import Appearance, Material
from ..scene.light import Light
from ..scene.option_fields import CAMERA, LIGHT, SETS, SHADING, SURFACE, Cli, option_of
from ..scene.values import linear_color
from .help import one_of


def flag_of(name: str) -> str:
    """Return how a field is called on the command line."""
    return f"--{name.replace('_', '-')}"


def option_info(help: str, cli: Cli, *names: str, **more: Any) -> Any:
    """Return what Typer takes about an option. names: if its field's name does not say all. more: as `typer.Option`."""
    metavar, completed = cli.metavar or "|".join(cli.known) or None, one_of(cli.known) if cli.known else None
    panel = cli.panel or None
    return typer.Option(*names, help=help, metavar=metavar, autocompletion=completed, rich_help_panel=panel, **more)


def cli_option(help: str, cli: Cli, *names: str, default: Any = None, **more: Any) -> Any:
    """Return the field of an option of the command line alone. The others: as `option_info`."""
    return field(default=default, metadata={"typer": option_info(help, cli, *names, **more)})


TypedField = tuple[str, Any, Any]  # name, type and field, as `make_dataclass` takes them


def group_of(found: Iterable[TypedField]) -> Any:
    """Return a class for a group of options (see cli/options.py) to inherit from."""
    return make_dataclass("Fields", list(found), bases=(FieldOptions,), frozen=True)


def typed(group: type, *panels: str, is_needed: bool = True, **defaults: Any) -> list[TypedField]:
    """Return the options of a dataclass that stand in these panels of the help, panel by panel. is_needed: False: what
    is not typed is None, as the command decides about it. defaults: others than those of the fields."""
    found: list[TypedField] = []
    for panel, one in product(panels, fields(group)):
        option, cli, is_switch = option_of(one), option_of(one).cli, one.default is False
        if cli.panel == panel:
            kind = cli.kind if one.default is None or cli.read else type(one.default)
            names = [flag_of(one.name), cli.short] if cli.short else []
            default = defaults.get(one.name, one.default) if is_needed or is_switch else None
            how = cli_option(option.help, cli, *names, default=default)
            found.append((one.name, kind if is_switch else kind | None, how))
    return found


class FieldOptions:
    """The options that were typed, and the values that they stand for."""

    about, way_out = "picture", ""  # what has them, and how else to go on

    @property
    def changed(self) -> list[str]:
        """Return the names of those that differ from their defaults."""
        own: Any = self
        return [one.name for one in fields(own) if getattr(self, one.name) != one.default]

    def check_none(self, output: Path) -> None:
        """Raises ValueError if one was given for an output that is not what they are about."""
        if given := self.changed:
            raise ValueError(f"{output} is no {self.about}: leave out {', '.join(map(option, given))}{self.way_out}")

    def values_of(self, group: type) -> dict[str, Any]:
        """Return what was typed for a dataclass, by the names of its fields. Raises ValueError."""
        return {
            one.name: read(value) if isinstance(value, str) and (read := option_of(one).cli.read) else value
            for one in fields(group)
            if (value := getattr(self, one.name, None)) is not None
        }


FIELDS = inspect.signature(Light).parameters  # by name
_SWITCHED = {**dict.fromkeys(("", "yes", "true", "on", "1"), True), **dict.fromkeys(("no", "false", "off", "0"), False)}


def light_from(text: str, **defaults: Any) -> Light:
    """The light of a text: X,Y,Z for a point light, or words `name=value`, whose names are the arguments of Light.

    defaults  values of those that the text does not name

    Numbers of a colour are linear, as in Light; #rrggbb and names are sRGB, as on screens, and converted. A switch
    may stand without a value. Raises ValueError for anything else, and as Light.
    """
    found: dict[str, Any] = {}
    # no pattern: one that looks for spaces before a comma takes the square of their number
    closed = "=".join(part.strip() for part in text.split("="))
    for word in ",".join(part.strip() for part in closed.split(",")).split():
        name, _, value = word.partition("=")
        if "=" not in word and word[0] in "+-.0123456789":
            name, value = "position", word
        if name not in FIELDS:
            raise _refusal(text, f"{shown(name)} is unknown{did_you_mean(name, FIELDS)}")
        if name in found:
            commas = ", numbers need commas and no spaces between them" if name == "position" else ""
            raise _refusal(text, f"{name} is there twice{commas}", names=False)
        found[name] = _value(name, value, text)
    if not found:
        raise _refusal(text, "it is empty")
    try:
        return Light(**defaults | found)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{option('light', shown(text))}: {error}") from None


def _value(name: str, value: str, text: str) -> Any:
    """A number, several, a switch or a word, as the argument is declared."""
    kind = FIELDS[name].annotation
    if kind.startswith("Falloff"):
        return value
    if kind == "bool":
        if value.lower() not in _SWITCHED:
            raise _refusal(text, f"{name} must be yes or no, got {shown(value)}", names=False)
        return _SWITCHED[value.lower()]
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        if name == "color" and value:
            try:
                return linear_color(value)
            except ValueError as error:
                raise _refusal(text, str(error), names=False) from None
        wanted = "a number" if kind.startswith("float") else "numbers with commas between them"
        raise _refusal(text, f"{name} must be {wanted}, got {shown(value)}", names=False) from None
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


def _refusal(text: str, fact: str, names: bool = True) -> ValueError:
    known = f": it takes X,Y,Z in metres, or words such as 'position=X,Y,Z shadow'; known are {', '.join(FIELDS)}"
    return ValueError(f"{option('light', shown(text))}: {fact}{known if names else ''}")


_LIGHTS = cli_option(
    "Point light at X,Y,Z (metres, world axes), or words: 'position=-.5,-.7,.2 color=#ffcc99 shadow'. Known are "
    f"{', '.join(FIELDS)}. Repeatable. Replaces a scene's own lights, and casts shadows there unless shadow=no.",
    Cli(LIGHT, "X,Y,Z|WORDS"),
)
_SHADING, *_FORM = typed(Appearance, SHADING)
_REST = typed(Appearance, LIGHT, CAMERA, SETS)
_MISSING = [one for one in typed(Appearance, SURFACE, missing="complete") if one[0] == "missing"]  # for pictures


@dataclass(frozen=True)
class NormalOptions(group_of(typed(Appearance, SURFACE))):
    """How normals are estimated."""

    def look(self) -> Appearance:
        """The values as an Appearance. Raises ValueError for unknown names and impossible numbers."""
        return Appearance(Material(**self.values_of(Material)), **self.values_of(Appearance))


@dataclass(frozen=True)
class AppearanceGroup(
    group_of([_SHADING, ("light", list[str] | None, _LIGHTS), *typed(Material, SHADING), *_FORM, *_REST, *_MISSING]),
    NormalOptions,
):
    """How objects look, and under which lights."""

    @classmethod
    def of(cls, look: Appearance) -> AppearanceGroup:
        """What is typed for a look; its values need not be texts."""
        values = look.options | vars(look.material)
        return cls(**{one.name: values[one.name] for one in fields(cls) if one.name in values})

    def lights(self, shadow: bool = False) -> list[Light]:
        """The lights in the order given. Raises ValueError for a text that is not a light. shadow: whether those cast
        shadows whose words leave it open."""
        return [light_from(text, shadow=shadow) for text in self.light or []]


# click's UsageError. Newer versions of Typer have click inside, older ones beside them; all of them export this child.
UsageError: Any = typer.BadParameter.__base__
_LIGHT_WORD = re.compile(rf"\b(?:{'|'.join(FIELDS)})\b(?:=|$)")
_NO_NUMBER = re.compile(r"('.*') is not a valid (float|int\w*)(?: range)?", re.DOTALL)
_OUTSIDE = re.compile(r"(\S+) is not in the range x([<>]=?)(\S+)")
_EXTRA = re.compile(r"extra argument\S* \((.*)\)", re.DOTALL)
_QUOTES = 'put the words of a light in quotes, as in --light "position=-.5,-.7,.2 shadow"'


class _OwnHelp:
    def format_help(self, ctx: Any, formatter: Any) -> None:
        from .help import show_help

        show_help(self, ctx)


class CliCommand(_OwnHelp, TyperCommand):
    """One of the commands: its help is ours."""


class CliCommands(_OwnHelp, TyperGroup):
    """The commands by name. A wrong name gets the near one; an input without a command, the commands for it."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name = args[0]
        if name in self.commands or name.startswith("-"):
            return super().resolve_command(ctx, args)
        if name in (*FRAMES, *SCENES) or Path(name).exists():
            way_out = f"pass `pointshade render {name} -o out.png` or `pointshade view {name}`"
            raise ValueError(f"{name} is not a command: {way_out}")
        near = did_you_mean(name, self.commands)
        known = f"known are {', '.join(self.commands)}; `pointshade --help` explains them"
        raise ValueError(f"unknown command {name!r}{near}: {known}")


def check_input(text: str | None) -> str | None:
    """Return INPUT. Raises ValueError for a word of a light that the shell took for it."""
    if text and _LIGHT_WORD.match(text) and not Path(text).exists():
        raise ValueError(f"{text} is not an input: {_QUOTES}")
    return text


def check_exist(folder: str | None = None, **given: str | Path | None) -> None:
    """Raises FileNotFoundError for an option whose value is a path to nothing. Numbers of a camera pass. The error
    names the option, and a near name or else what there is. folder: in which the file may have been meant to lie."""
    for name, value in given.items():
        if value is None or (name == "intrinsics" and split_numbers(str(value)) is not None):
            continue
        path = check_path(value)
        if not path.exists():
            inside = Path(folder or "", path)
            hint = f" (did you mean {inside}?)" if inside.exists() else near_path(path) or listed_beside(path)
            raise FileNotFoundError(f"{option(name)}: {path} does not exist{hint}")


def check_folders(inputs: Sequence[str]) -> None:
    """Raises ValueError for an INPUT after the first that is no folder, cloud or scene: it was meant for an option.
    FileNotFoundError if it does not exist."""
    for path in inputs:
        is_path = split_numbers(path) is None and not _LIGHT_WORD.search(path) and path not in (*FRAMES, *SCENES)
        if is_path and not Path(path).exists():
            raise FileNotFoundError(f"{path} does not exist{near_path(Path(path)) or listed_beside(Path(path))}")
        if not Path(path).is_dir() and Kind.of(path) is Kind.FRAMES:
            raise ValueError(f"more INPUTs must be folders of frames, clouds or scenes, got {path}: {_way_out(path)}")


def sentence_of(error: Any, every: Callable[[], typer.Typer]) -> str:
    """Return what was typed wrong, and which command explains more; empty if all the help was printed already. every:
    returns all commands: an option may be another's."""
    message, parameter = error.format_message().strip().rstrip("."), getattr(error, "param", None)
    if parameter and error.message:
        own = flag_of(parameter.name)  # other programs may have an option of the same name, too
        name = own if own in parameter.opts else parameter.opts[-1]
        message = f"{name} {_fact(error.message.rstrip('.'))} ({parameter.help.rstrip('.')})"
    elif parameter:
        message = f"{parameter.opts[0]} is missing: {parameter.help[:1].lower()}{parameter.help[1:].rstrip('.')}"
    elif hasattr(error, "possibilities"):  # an option that does not exist
        name, near = error.option_name, meant_option(error.option_name, _options(error.ctx.command))
        commands: Any = {} if near else get_command(every()).commands  # type: ignore[attr-defined]
        others = [f"`pointshade {other}`" for other, one in commands.items() if name in _options(one)]
        message = f"there is no option {name}{near}" + (f", only in {', '.join(others)}" if others else "")
    elif (extra := _EXTRA.search(message)) and "input" in _options(error.ctx.command):
        message = f"there is one INPUT, got also {extra[1]}: {_way_out(extra[1])}"
    more = f"; `{error.ctx.command_path} --help` lists the options" if message and error.ctx else ""
    return f"{message[:1].lower()}{message[1:]}{more}"


def _fact(message: str) -> str:
    """What is wrong with the value of an option."""
    if found := _NO_NUMBER.fullmatch(message):
        return f"must be a {'whole ' if found[2].startswith('int') else ''}number, got {found[1]}"
    if found := _OUTSIDE.fullmatch(message):
        return f"must be {found[3]} or {'more' if '>' in found[2] else 'less'}, got {found[1]}"
    return message


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


def size_from(text: str | None, name: str, names: Sequence[str] = ()) -> Any:
    """Width and height of WxH, or one of the names; None without a text. Errors name the option and what it takes."""
    if text is None or text in names:
        return text
    expected = f"{option(name)} takes WIDTHxHEIGHT in whole pixels above 0, such as 640x480"
    expected += f", or {', '.join(names)}" if names else ""
    width, height = _whole_numbers(text, 2, "x", 1, expected)
    return width, height


def views_from(text: str) -> int | tuple[int, ...] | None:
    """How many views are merged; None for all; or the numbers of the frames. Raises ValueError for anything but 'all',
    a number of 2 or more, and numbers with commas between them."""
    if text == "all":
        return None
    parts = text.split(",")
    if not all(part.isdecimal() for part in parts) or (len(parts) == 1 and int(text) < 2):
        expected = "a whole number of 2 or more, or 'all', or frames such as 0,5,9"
        raise ValueError(f"{option('views')} takes {expected}, got {text!r}")
    return int(text) if len(parts) == 1 else tuple(map(int, parts))


def frames_from(text: str, count: int) -> list[int]:
    """The number of a frame, or one for each of `count` inputs."""
    expected = f"{option('frame')} takes the number of a frame, counted from 0"
    expected += f", for each of {count} INPUTs" if count > 1 else ""
    return _whole_numbers(text, count, ",", 0, expected)


def range_from(text: str, name: str) -> tuple[float, float]:
    expected = f"{option(name)} takes two numbers, the lower first, such as 0,1"
    low, high = _numbers(text, 2, ",", expected)
    if not low < high:
        raise ValueError(f"{expected}, got {text!r}")
    return low, high


def pose_from(text: str) -> NDArray[np.float64]:
    """(4, 4) from numbers, or from a file that holds them. Raises OSError or ValueError."""
    from ..files.cameras.pose_files import load_pose, pose_of

    if (numbers := split_numbers(text)) is not None and not Path(text).exists():
        return pose_of(np.array(numbers), option("pose"))
    check_exist(pose=text)
    return load_pose(text)


def places_from(text: str | Sequence[str], name: str) -> Any:
    """The two corners of a text, or the place of each of several texts. Raises ValueError for other texts."""
    if isinstance(text, str):
        return _numbers(text, 6, ",", f"{option(name)} takes two corners, as in {option(name)} -1,-1,0,1,1,2")
    return [_numbers(one, 3, ",", f"{option(name)} takes X,Y,Z") for one in text]


def rates_from(text: str, count: int) -> list[float]:
    """Frames per second of each of `count` inputs: one number for all, or one for each."""
    expected = f"{option('fps')} must be a number of frames per second"
    expected += ", or one for each INPUT" if count > 1 else ""
    rates = _numbers(text, count if "," in text else 1, ",", expected)
    return rates * (count if len(rates) == 1 else 1)


def _whole_numbers(text: str, count: int, separator: str, least: int, expected: str) -> list[int]:
    numbers = _numbers(text, count, separator, expected)
    if any(number < least or number % 1 for number in numbers):
        raise ValueError(f"{expected}, got {text!r}")
    return list(map(int, numbers))


def _numbers(text: str, count: int, separator: str, expected: str) -> list[float]:
    try:
        numbers = [float(part) for part in text.lower().split(separator)]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{expected}, got {text!r}")
    return numbers
