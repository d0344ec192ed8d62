"""The page's state.js is scene/orbit.py again: the same actions give the same view and the same light."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene import orbit as viewer_state
from pointshade_gl.scene.orbit import OrbitStage, State, marker_place, rims_from

from ..support.page_functions import run_script

CAMERA = ps.Camera(500, -510, 300.5, 239.5, 640, 480)
STAGE = OrbitStage(np.array([0.2, -0.1, 2.0]), 1.3, np.diag([1.0, -1.0, 1.0]))
UP = 0.36, 0.8, -0.48  # of a stage whose orbits turn about an axis of its own, as those of clouds do
PLACE = ps.orbit_pose(None, (0.3, 0.1, 1.5), 25, -40)
LIGHTS = {
    "point": ps.Light(position=(0, 0, 0)),
    "directional": ps.Light(direction=(0, 0, 1)),
    "spot": ps.Light(position=(0, 0, 0), direction=(0, 0, 1)),
}
OTHERS = ps.Light(position=(1, -0.5, 0.2)), ps.Light(direction=(0.3, 0.9, -0.2))
ACTIONS = {  # arguments of each, drawn at random
    "orbited": lambda draw: [*draw.uniform(-900, 900, 2), 480],
    "panned": lambda draw: [*draw.uniform(-300, 300, 2), 500],
    "zoomed": lambda draw: [draw.uniform(-9, 9)],
    "light_reached": lambda draw: [draw.uniform(-9, 9)],
    "with_light_direction": lambda draw: [draw.normal(size=3).tolist()],
    "light_mode": lambda draw: [bool(draw.integers(2))],
    "light_at": lambda draw: [draw.uniform(-2, 2, 2).tolist()],
    "with_pivot": lambda draw: [np.add(draw.normal(size=3), (0, 0, 3)).tolist()],
    "reset_view": lambda _: [],
}
SCRIPT = """
const { stage, camera, place, kinds } = value;
const names = { orbited: (state, ...given) => orbited(state, ...given, stage),
  panned, zoomed, light_reached: lightReached, with_light_direction: withLightDirection,
  with_pivot: (state, point) => withPivot(state, point, stage),
  reset_view: (state) => resetView(state, START),
  light_mode: (state, lightMode) => ({ ...state, lightMode }), light_at: (state, lightAt) => ({ ...state, lightAt }) };
let state = START;
return value.actions.map(([name, given]) => {
  state = names[name](state, ...given);
  const lights = kinds.map((kind) => light(state, stage, place, kind)).map((l) => [l.position, l.direction]);
  return [state.yaw, state.pitch, state.distance, state.pan, state.lightAt, state.lightReach, towards(state),
    seenPivot(state, stage), seenMiddle(state, stage), pose(state, stage), middle(state, stage, camera),
    markerPlace(state, stage, camera),
    rimsFrom(middle(state, stage, camera), 17, 400, camera), isBehind(state), lights,
    value.others.map((one) => withLight(state, one, stage, product(place, pose(state, stage))).lightAt)];
});
"""


def plain(value):
    """Tuples and arrays as the lists that JSON has."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [plain(part) for part in value] if isinstance(value, list | tuple) else value


def after(state, name, given, stage):
    if name == "reset_view":
        return state.reset_view(State())
    if name == "with_pivot":
        return state.with_pivot(*given, stage)
    if name in ("light_mode", "light_at"):
        return replace(state, **{name: given[0] if name == "light_mode" else tuple(given[0])})
    return getattr(state, name)(*given, *[stage] * (name == "orbited"))


def seen(state, stage):
    """What SCRIPT gives for a state."""
    lights = [(one.position, one.direction) for one in (state.light(stage, PLACE, kind) for kind in LIGHTS.values())]
    middle = state.middle(stage, CAMERA)
    return [
        *(state.yaw, state.pitch, state.distance, state.pan, state.light_at, state.light_reach, state.towards),
        *(state.seen_pivot(stage), state.seen_middle(stage), state.pose(stage), middle),
        marker_place(state, stage, CAMERA),
        *(rims_from(middle, 17, 400, CAMERA), state.is_behind, lights),
        [state.with_light(other, stage, PLACE).light_at for other in OTHERS],
    ]


def flat(value):
    """Its numbers in order, None as NaN."""
    if isinstance(value, list):
        return [number for part in value for number in flat(part)]
    return [math.nan if value is None else float(value)]


@pytest.mark.parametrize(
    ("seed", "axis", "one_sided"),
    [(0, (0.0, 1.0, 0.0), False), (1, UP, False), (2, UP, False), (5, (0.0, 1.0, 0.0), True), (4, UP, True)],
)
def test_the_same_actions_lead_to_the_same_view_and_light(seed, axis, one_sided):
    stage_of = replace(STAGE, axis=axis, one_sided=one_sided)
    draw = np.random.default_rng(seed)
    actions = [(name, plain(ACTIONS[name](draw))) for name in draw.choice(list(ACTIONS), 400).tolist()]
    kinds = [{"position": plain(one.position), "direction": plain(one.direction)} for one in LIGHTS.values()]
    stage = {"pivot": plain(STAGE.pivot), "radius": STAGE.radius, "upright": plain(STAGE.upright), "axis": axis}
    stage |= {"oneSided": one_sided}
    camera = {field.name: getattr(CAMERA, field.name) for field in fields(CAMERA)}
    given = {"actions": actions, "stage": stage, "camera": camera, "place": plain(PLACE), "kinds": kinds}
    given["others"] = [{"position": plain(one.position), "direction": plain(one.direction)} for one in OTHERS]
    state = State()
    for (name, values), found in zip(actions, run_script(SCRIPT, given), strict=True):
        state = after(state, name, values, stage_of)
        expected = flat(plain(seen(state, stage_of)))
        np.testing.assert_allclose(flat(found), expected, rtol=1e-12, atol=1e-12, err_msg=name)


def test_it_starts_as_the_window_does_and_its_numbers_are_the_window_s():
    script = "return [START, RIM, FARTHEST, DEGREES, WHEEL, SLOWS, NEAR_END, ENDS, END_TEXT];"
    start, *numbers = run_script(script, None)
    state = State()
    names = {"lightAt": "light_at", "lightReach": "light_reach", "lightMode": "light_mode"}
    names |= {"lightColor": "light_color", "lightIntensity": "light_intensity"}
    assert start.pop("shading") == state.look.shading
    assert start == {name: plain(getattr(state, names.get(name, name))) for name in start}
    names = "RIM", "FARTHEST", "DEGREES", "WHEEL", "SLOWS", "NEAR_END", "ENDS", "END_TEXT"
    assert numbers == [getattr(viewer_state, name) for name in names]


def test_a_picture_of_another_size_has_the_camera_that_the_window_gives_it():
    sizes = [(300, 900), (1999, 480), (64, 48), (1, 7)]
    camera = {field.name: getattr(CAMERA, field.name) for field in fields(CAMERA)}
    script = "return value.sizes.map(([w, h]) => fitted(value.camera, w, h));"
    found = run_script(script, {"camera": camera, "sizes": sizes})
    for (width, height), each in zip(sizes, found, strict=True):
        assert ps.Camera(**each).intrinsics == pytest.approx(CAMERA.fitted(width, height).intrinsics, rel=1e-13)
        assert (each["width"], each["height"]) == (width, height)
