"""Lights for other programs: as strong as they mean candela and lux; for us what they were, whatever the units."""

import json
import math

import numpy as np
import pytest

import pointshade_gl as ps

from ...support.gltf_files import document, write_gltf
from .test_read import refuse
from .test_save import FLAT, FLIP, transform

UNITS = {"photometric": 683, "unitless": 1}  # lumens a watt
BOX = ps.Mesh([(-1, -1, 4), (1, -1, 4), (1, 1, 6), (-1, 1, 6)], [(0, 1, 2), (0, 2, 3)])  # its middle is (0, 0, 5)
LIGHTS = {
    "sun": ps.Light(direction=(1, 2, -1), color=(1, 0.5, 0.25), intensity=0.7, angle=0.53),
    "steady": ps.Light(position=(1, 2, 3), intensity=1.1, shadow=True),
    "bulb": ps.Light(position=(1, 2, 3), intensity=1 / 3, falloff="inverse-square", radius=0.05),
    "odd": ps.Light(position=(1, 2, 3), attenuation=(0.3, 0.1, 0.7)),
    "inside": ps.Light(position=(0, 0, 5)),  # in the middle of what is drawn
    "far": ps.Light(position=(1e17, 2e17, 0)),
    "spot": ps.Light(position=(1, 2, 3), direction=(0, 0, 1), cone=(10, 30), intensity=2),
    "hard spot": ps.Light(position=(1, 2, 3), direction=(0, 0, 1), cone=(45, 45), falloff="inverse-square"),
    "soft spot": ps.Light(position=(1, 2, 3), direction=(0, 0, 1), cone=(0, 90)),
    "thin spot": ps.Light(position=(1, 2, 3), direction=(0, 0, 1), cone=(1e-4, 2e-4)),
    "panel": ps.Light(position=(1, 2, 3), direction=(0, 0, 1), size=(1, 2), watts=20),
    "viewer": ps.Light(intensity=0.3),
    "dark": ps.Light(intensity=0),
}


def save(path, light, units, place=None, **scene):
    nodes = ps.Node(BOX), ps.Node(light, "lamp", np.eye(4) if place is None else place)
    whole = ps.Scene(nodes, **{"pose": FLIP} | scene)
    ps.save_scene(path, whole, light_units=units)
    return whole


def written(path):
    """The one light in a file, without extras as others see it."""
    (light,) = json.loads(path.read_text())["extensions"]["KHR_lights_punctual"]["lights"]
    return light


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("name", LIGHTS)
@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
def test_a_light_comes_back_to_the_digit(tmp_path, units, name, suffix):
    whole = save(tmp_path / f"a{suffix}", LIGHTS[name], units, transform(0.5, 2, (3, 0, 0)))
    before, after = (scene.lights[0] for scene in (whole, ps.load_scene(tmp_path / f"a{suffix}", notes=refuse)))
    for field in vars(before):
        a, b = getattr(before, field), getattr(after, field)
        if field in ("position", "direction") and a is not None:
            a, b = np.array(a), np.array(b)
            lengths = (1, 1) if field == "position" else (np.linalg.norm(a), np.linalg.norm(b))
            np.testing.assert_allclose(b / lengths[1], a / lengths[0], rtol=1e-12, atol=1e-12)
        else:
            assert b == pytest.approx(a, rel=2e-15) if field == "intensity" else b == a


@pytest.mark.parametrize("units", UNITS)
def test_others_get_lux_and_candela(tmp_path, units):
    for name in ("sun", "bulb"):
        save(tmp_path / "a.gltf", LIGHTS[name], units)
        light, ours = written(tmp_path / "a.gltf"), LIGHTS[name]
        expected = np.array(ours.color) * ours.intensity * math.pi * UNITS[units]
        np.testing.assert_allclose(np.array(light["color"]) * light["intensity"], expected)


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("name", ["steady", "odd", "spot"])
def test_other_falloff_is_as_bright_in_the_middle_of_what_is_drawn(tmp_path, units, name):
    place = transform(0.5, 2, (3, 0, 0))
    whole = save(tmp_path / "a.gltf", LIGHTS[name], units, place)
    middle, lamp = whole.bounds[0], whole.lights[0]
    distance = np.linalg.norm(middle - lamp.position)
    constant, linear, quadratic = lamp.attenuation
    ours = lamp.intensity / (constant + linear * distance + quadratic * distance**2)
    theirs = written(tmp_path / "a.gltf")["intensity"] / UNITS[units] / math.pi / distance**2
    assert theirs == pytest.approx(ours, rel=1e-9)


def test_a_light_without_falloff_in_the_middle_is_no_light_of_zero(tmp_path):
    save(tmp_path / "a.gltf", LIGHTS["inside"], "unitless")
    assert written(tmp_path / "a.gltf")["intensity"] > 0


def test_spots_for_blender_have_the_angles_that_become_its_blend(tmp_path):
    save(tmp_path / "a.gltf", LIGHTS["spot"], "photometric")
    spot = written(tmp_path / "a.gltf")["spot"]
    blend = 1 - spot["innerConeAngle"] / spot["outerConeAngle"]  # as its importer has it
    inner, outer = (math.cos(math.radians(angle)) for angle in (10, 30))
    assert blend == pytest.approx((inner - outer) / (1 - outer))
    save(tmp_path / "a.gltf", LIGHTS["spot"], "unitless")
    spot = written(tmp_path / "a.gltf")["spot"]
    assert np.degrees([spot["innerConeAngle"], spot["outerConeAngle"]]) == pytest.approx((10, 30))


@pytest.mark.parametrize("place", [None, transform(0.4, 2, (1, 2, 3)), np.diag([1, 2, -3, 1.0])])
def test_the_viewers_light_comes_from_the_cameras_upper_left(tmp_path, place):
    whole = save(tmp_path / "a.gltf", LIGHTS["viewer"], "unitless", place, pose=transform(2), camera=None)
    (ahead,) = beams(tmp_path / "a.gltf")
    direction = whole.pose[:3, :3] @ (1, 1, 2)
    np.testing.assert_allclose(ahead, direction / np.linalg.norm(direction), atol=1e-9)


def beams(path):
    """The world's direction of each light's node, as other programs have it."""
    data = json.loads(path.read_text())
    above = {child: k for k, node in enumerate(data["nodes"]) for child in node.get("children", ())}
    for k, node in enumerate(data["nodes"]):
        if "KHR_lights_punctual" in node.get("extensions", {}):
            ahead, at = np.array((0, 0, -1.0)), k
            while at is not None:
                ahead = local(data["nodes"][at]) @ ahead
                at = above.get(at)
            yield ahead / np.linalg.norm(ahead)


def local(node):
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    turn = np.array(
        [
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        ]
    )
    return turn * node.get("scale", (1, 1, 1))


def test_files_without_units_are_read_as_before(tmp_path):
    lamp = {"type": "point", "intensity": math.pi, "extras": {"pointshade": {"attenuation": [1, 0, 0]}}}
    data = document(extensions={"KHR_lights_punctual": {"lights": [lamp]}}, extensionsUsed=["KHR_lights_punctual"])
    data["nodes"][0]["extensions"] = {"KHR_lights_punctual": {"light": 0}}
    (lamp,) = ps.load_scene(write_gltf(tmp_path, data), notes=refuse).lights
    assert lamp.intensity == 1 and lamp.attenuation == (1, 0, 0)


@pytest.mark.parametrize(
    ("extras", "complaint"),
    [
        ({"units": "watts"}, "units must be 'photometric', got 'watts'"),
        ({"reach": 0, "attenuation": [1, 0, 0]}, "reach must be above 0, got 0"),
        ({"reach": "far"}, "reach must be a number"),
        ({"cone": [1]}, "cone must be 2 numbers"),
        ({"cone": [40, 30]}, "0 <= inner <= outer"),
    ],
)
def test_broken_extras_of_a_light_are_named(tmp_path, extras, complaint):
    lamp = {"type": "spot", "extras": {"pointshade": extras}}
    data = document(extensions={"KHR_lights_punctual": {"lights": [lamp]}}, extensionsUsed=["KHR_lights_punctual"])
    data["nodes"][0]["extensions"] = {"KHR_lights_punctual": {"light": 0}}
    with pytest.raises(ValueError, match=complaint):
        ps.load_scene(write_gltf(tmp_path, data))


def test_unknown_units_are_refused(tmp_path):
    with pytest.raises(ValueError, match="unknown light_units 'lumens'"):
        ps.save_scene(tmp_path / "a.glb", ps.Scene(), light_units="lumens")


def test_a_scene_whose_y_points_down_stands_upright_for_others(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    sky = np.zeros((16, 32, 3))
    sky[:8] = 1
    for pose, sign in ((FLIP, 1), (np.eye(4), -1)):
        ps.save_scene(tmp_path / "empty.glb", ps.Scene(pose=pose, environment=sky))
        assert ps.load_scene(tmp_path / "empty.glb", notes=refuse).environment.picture[:10].mean() > 0.9
        scene = ps.Scene((ps.Node(FLAT, "a", transform(1)),), pose=pose, environment=sky)
        ps.save_scene(tmp_path / "out.glb", scene)
        corners = (transform(1) @ np.column_stack([FLAT.positions, np.ones(5)]).T)[:3].T * (1, sign, sign)
        bounds = trimesh.load_scene(tmp_path / "out.glb").bounds
        np.testing.assert_allclose(bounds, [corners.min(0), corners.max(0)], atol=1e-6)
        again = ps.load_scene(tmp_path / "out.glb", notes=refuse)
        np.testing.assert_allclose(again.nodes[0].transform, transform(1), atol=1e-12)
        np.testing.assert_array_equal(again.pose, pose)
        assert again.environment.picture[:10].mean() > 0.9 > 0.1 > again.environment.picture[-10:].mean()


def test_a_sheared_or_mirrored_node_is_one_that_gltf_has(tmp_path):
    shear = transform(0.3, 2, (1, 2, 3))
    shear[0, 1] += 1
    child = ps.Node(FLAT, "below", transform(1))
    for matrix in (shear, np.diag([1, 2, -3, 1.0]), np.diag([-1, -2, -3, 1.0]) @ shear):
        scene = ps.Scene((ps.Node(FLAT, "a", matrix, (child,)),), pose=FLIP)
        ps.save_scene(tmp_path / "a.gltf", scene)
        assert not any("matrix" in node for node in json.loads((tmp_path / "a.gltf").read_text())["nodes"])
        (again,) = ps.load_scene(tmp_path / "a.gltf", notes=refuse).nodes
        np.testing.assert_allclose(again.transform, matrix, atol=1e-12)
        assert [node.name for node in again.children] == ["below"] and again.name == "a"
