"""`--light`: X,Y,Z, or the arguments of a Light as words, such as "position=-.5,-.7,.2 color=#ffcc99 shadow"."""

from __future__ import annotations

import inspect
from typing import Any

from ..notes.words import did_you_mean, option, shown
from ..scene.light import Light
from ..scene.values import linear_color

FIELDS = inspect.signature(Light).parameters  # by name
_SWITCHED = {"yes": True, "true": True, "on": True, "1": True, "no": False, "false": False, "off": False, "0": False}


def light_from(text: str, **unless_said: Any) -> Light:
    """The light of a text: X,Y,Z for a point light, or words `name=value`, whose names are the arguments of Light.

    unless_said  values of those that the text does not name

    Numbers of a colour are linear, as in Light; #rrggbb and names are sRGB, as on screens, and converted. A switch
    may stand without a value. Raises ValueError for anything else, and as Light.
    """
    said: dict[str, Any] = {}
    for word in _joined(_joined(text, ","), "=").split():
        name, _, value = word.partition("=")
        if "=" not in word and word[0] in "+-.0123456789":
            name, value = "position", word
        if name not in FIELDS:
            raise _refusal(text, f"{shown(name)} is unknown{did_you_mean(name, FIELDS)}")
        if name in said:
            commas = ", numbers need commas and no spaces between them" if name == "position" else ""
            raise _refusal(text, f"{name} is there twice{commas}", names=False)
        said[name] = _value(name, value, text)
    if not said:
        raise _refusal(text, "it is empty")
    try:
        return Light(**{**unless_said, **said})
    except (ValueError, TypeError) as error:
        raise ValueError(f"{option('light', shown(text))}: {error}") from None


def _joined(text: str, separator: str) -> str:
    """The text without blanks around the separators."""
    return separator.join(part.strip() for part in text.split(separator))


def _value(name: str, value: str, text: str) -> Any:
    """A number, several, a switch or a word, as the argument is declared."""
    kind = FIELDS[name].annotation
    if kind.startswith("Falloff"):
        return value
    if kind == "bool":
        if value.lower() not in ("", *_SWITCHED):
            raise _refusal(text, f"{name} must be yes or no, got {shown(value)}", names=False)
        return _SWITCHED.get(value.lower(), True)
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
