"""The panel's section about light from all around. It returns what the user made of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..scene.environment import NAMES
from ..scene.orbit import State
from ..scene.settings import OCCLUSION, SIMPLE
from .panel_widgets import Widgets

_NONE, _OWN = "none", "own"
_BRIGHTEST = 10.0


def show_environment(ui: Widgets, state: State, opened: bool) -> State:
    """Show which environment there is, how bright it is and how it stands, and whether what is near hides it."""
    if not ui.section("light from all around", opened):
        return state
    imgui, finish = ui.imgui, state.finish
    changes: dict[str, Any] = {}
    imgui.begin_disabled(not state.is_lit)
    before = _name_of(finish.environment)
    name = ui.choose("environment", before, _name_of(SIMPLE.environment), (_NONE, *NAMES),
                     "Takes the place of the ambient light (E). own: that of "
                     "the scene or of a file.")  # fmt: skip
    if name != before:
        changes["environment"] = None if name == _NONE else name
    imgui.begin_disabled(name == _NONE)
    usual = SIMPLE.environment_intensity
    changes["environment_intensity"] = ui.slide(
        "brightness", finish.environment_intensity, usual, 0.0, _BRIGHTEST, "", True
    )
    if isinstance(finish.environment_rotation, float):
        why = "Degrees about up (Shift and left or right; or drag with the right button)."
        changes["environment_rotation"] = ui.slide("turned", finish.environment_rotation, 0.0, 0.0, 360.0, why)
    imgui.end_disabled()
    changes |= _occlusion(ui, finish.ambient_occlusion)
    imgui.end_disabled()
    return replace(state, finish=replace(finish, **changes))


def _name_of(environment: Any) -> str:
    if environment is None:
        return _NONE
    return environment.name if environment.name in NAMES else _OWN


def _occlusion(ui: Widgets, before: Any) -> dict[str, Any]:
    """A radius stays as long as nothing is chosen."""
    words = {value: word for word, value in OCCLUSION.items()}
    word = f"{before:g}" if isinstance(before, float) else words[before]
    chosen = ui.choose("occlusion", word, words[None], tuple(OCCLUSION),
                       "Whether what is near hides ambient light and environment "
                       "(A). auto: where they are more than a tenth of the light.")  # fmt: skip
    return {} if chosen == word else {"ambient_occlusion": OCCLUSION[chosen]}
