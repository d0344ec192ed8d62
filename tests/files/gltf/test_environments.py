"""Image-based lights of glTF: they come back, stand where their faces say, and each defect is one sentence."""

import json
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.estimation.environment_light import lobe_map, radiance_bands
from pointshade_gl.files.gltf.cameras_and_lights import (
    are_mirrored,
    face_directions,
    from_rgbd,
    irradiance_coefficients,
    rough,
    seen_in_cube,
    seen_on_sphere,
    sphere_directions,
    to_rgbd,
)
from pointshade_gl.notes.notes import taken
from pointshade_gl.scene.environment import NAMES, Environment
from pointshade_gl.scene.values import srgb_to_linear

from ...support.damage import in_json
from ...support.gltf_files import data_uri, document, write_gltf

EXTENSION = "EXT_lights_image_based"
RNG = np.random.default_rng(12)
RAYS = RNG.normal(size=(300, 3))
RAYS /= np.linalg.norm(RAYS, axis=1)[:, None]
PLAIN = [(0.9, 0.1, 0.1), (0.1, 0.9, 0.9), (0.1, 0.9, 0.1), (0.9, 0.1, 0.9), (0.1, 0.1, 0.9), (0.9, 0.9, 0.1)]


def smooth(directions):
    """(..., 3) some light of order 2."""
    x, y, z = np.moveaxis(directions, -1, 0)
    return np.stack([2 + x + y * z, 2 + y - x * x, 2 + z + x * y], -1)


def image(array):
    file = BytesIO()
    Image.fromarray(array).save(file, "PNG")
    return {"uri": data_uri(file.getvalue(), "image/png")}


def lit_by(faces, **light):
    """A document that is lit by these faces, (h, w, 3|4) uint8 each."""
    known = {
        "irradianceCoefficients": np.zeros((9, 3)).tolist(),
        "specularImageSize": 4,
        "specularImages": [[0, 1, 2, 3, 4, 5]],
    }
    return document(
        extensionsUsed=[EXTENSION],
        extensions={EXTENSION: {"lights": [known | light]}},
        scenes=[{"nodes": [0], "extensions": {EXTENSION: {"light": 0}}}],
        images=[image(face) for face in faces],
    )


def colored(size=4):
    """Six faces of one colour each."""
    return [np.full((size, size, 3), np.rint(255 * np.array(color)), np.uint8) for color in PLAIN]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_an_environment_comes_back(tmp_path, name, suffix):
    path, before = tmp_path / f"a{suffix}", Environment.of(name).picture
    ps.save_scene(path, ps.Scene([ps.Node(ps.Light())], environment=name))
    with taken() as notes:
        after = ps.load_scene(path).environment.picture
    assert notes == [] and after.shape == (256, 512, 3)
    np.testing.assert_allclose(radiance_bands(after), radiance_bands(before), atol=0.015)
    for exponent in (8, 60):
        lobes = lobe_map(before, exponent)
        assert abs(lobe_map(after, exponent) - lobes).max() < 0.03 * lobes.max()


def test_very_bright_light_comes_back(tmp_path):
    picture = np.full((32, 64, 3), 0.5)
    picture[10:14, 20:28] = 50_000, 20_000, 10_000
    ps.save_scene(tmp_path / "a.glb", ps.Scene(environment=picture))
    after = ps.load_scene(tmp_path / "a.glb").environment.picture
    np.testing.assert_allclose(radiance_bands(after)[0], radiance_bands(picture)[0], rtol=0.03)


def test_each_face_lies_where_viewers_of_gltf_put_it(tmp_path):
    """Those show the faces of OpenGL's left-handed cube maps: their x is glTF's -x."""
    picture = ps.load_scene(write_gltf(tmp_path, lit_by(colored()))).environment.picture
    ways = [(-1, 0, 0), (1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    for way, color in zip(ways, PLAIN, strict=True):
        found = seen_on_sphere(picture, np.array([way], float))[0]
        np.testing.assert_allclose(found, srgb_to_linear(np.rint(255 * np.array(color)) / 255), atol=1e-3)


def test_a_rotation_turns_the_light_and_intensity_is_a_factor(tmp_path):
    """A quarter about y brings what was seen along z to x."""
    plain = ps.load_scene(write_gltf(tmp_path, lit_by(colored()))).environment.picture
    turned = lit_by(colored(), rotation=[0, 0.5**0.5, 0, 0.5**0.5], intensity=3)
    turned["scenes"][0]["extras"] = {"pointshade": {"exposure": 2}}
    picture = ps.load_scene(write_gltf(tmp_path, turned)).environment.picture
    for there, here in (((0, 0, 1), (1, 0, 0)), ((1, 0, 0), (0, 0, -1)), ((0, 1, 0), (0, 1, 0))):
        before, after = (
            seen_on_sphere(plain, np.array([there], float)),
            seen_on_sphere(picture, np.array([here], float)),
        )
        np.testing.assert_allclose(after, 6 * before, rtol=1e-3)


def test_faces_that_are_mirrored_for_themselves_are_known_by_their_sides(tmp_path):
    light = smooth(face_directions(16)) / 4
    faces = (light * 255).astype(np.uint8)
    assert not are_mirrored(light) and are_mirrored(light[[1, 0, 2, 3, 4, 5]])
    assert not are_mirrored(np.ones((6, 8, 8, 3)))
    one = ps.load_scene(write_gltf(tmp_path, lit_by(faces))).environment.picture
    other = ps.load_scene(write_gltf(tmp_path, lit_by(faces[[1, 0, 2, 3, 4, 5]]))).environment.picture
    np.testing.assert_array_equal(one, other)


def test_images_with_alpha_are_rgbd_and_others_srgb(tmp_path):
    light = RNG.random((50, 3)) ** 4 * 250
    np.testing.assert_allclose(from_rgbd(to_rgbd(light)), light, atol=light.max() / 100)
    np.testing.assert_allclose(from_rgbd(to_rgbd(light / 300)), light / 300, atol=0.01)
    faces = [np.full((4, 4, 4), (255, 186, 0, 51), np.uint8)] * 6
    picture = ps.load_scene(write_gltf(tmp_path, lit_by(faces))).environment.picture
    np.testing.assert_allclose(picture[0, 0], [5, 5 * (186 / 255) ** 2.2, 0], rtol=1e-5)


def test_directions_of_cube_and_sphere_agree():
    np.testing.assert_allclose(seen_in_cube(smooth(face_directions(64)), RAYS), smooth(RAYS), atol=0.03)
    np.testing.assert_allclose(seen_on_sphere(smooth(sphere_directions(128)), RAYS), smooth(RAYS), atol=0.02)


def test_irradiance_coefficients_are_those_of_the_picture():
    """In axes of the cube map, whose x is mirrored; constants of the real spherical harmonics of order 2."""
    picture = smooth(sphere_directions(128))
    x, y, z = RAYS.T * [[-1], [1], [1]]
    basis = np.stack([
        0.282095 + 0 * x, 0.488603 * y, 0.488603 * z, 0.488603 * x, 1.092548 * x * y, 1.092548 * y * z,
        0.315392 * (3 * z * z - 1), 1.092548 * x * z, 0.546274 * (x * x - y * y),
    ], 1)  # fmt: skip
    x, y, z = RAYS.T
    ours = np.stack([
        1 + 0 * x, 2 / 3 * x, 2 / 3 * y, 2 / 3 * z, x * y / 4, y * z / 4, x * z / 4, (3 * z * z - 1) / 4,
        (x * x - y * y) / 4,
    ], 1)  # fmt: skip
    wanted = np.pi * ours @ radiance_bands(picture)
    np.testing.assert_allclose(basis @ np.array(irradiance_coefficients(picture)), wanted, atol=0.01)


def test_rough_levels_blur_and_keep_the_mean(tmp_path):
    picture = Environment.of("sky").picture
    spread = [rough(picture, 8, roughness).std((0, 1, 2)).mean() for roughness in (0.2, 0.6, 1.0)]
    assert spread[0] > 1.1 * spread[1] > 1.21 * spread[2] > 0
    np.testing.assert_allclose(rough(np.ones((8, 16, 3)), 4, 0.7), 1)
    ps.save_scene(tmp_path / "a.gltf", ps.Scene(environment="sky"))
    light = json.loads((tmp_path / "a.gltf").read_text())["extensions"][EXTENSION]["lights"][0]
    assert [len(level) for level in light["specularImages"]] == [6] * 4 and light["specularImageSize"] == 128


@pytest.mark.parametrize(
    ("light", "says"),
    [
        ({"rotation": [0, 0, 0, 0]}, "image-based light 0: rotation must be a quaternion of unit length"),
        ({"rotation": "up"}, "image-based light 0: rotation must be 4 numbers"),
        ({"intensity": -1}, "image-based light 0: intensity must be 0 or above, got -1"),
        ({"intensity": None}, "image-based light 0: intensity must be"),
        ({"intensity": 1e29}, "image-based light 0: .*above 1e"),
        ({"irradianceCoefficients": [1, 2]}, "irradianceCoefficients must be 27 numbers"),
        ({"specularImages": None}, "specularImages must be levels of 6 images, the faces of a cube"),
        ({"specularImages": [[0, 1, 2]]}, "specularImages must be levels of 6 images"),
        ({"specularImages": [[0, 1, 2, 3, 4, 9]]}, "there is no image 9, the file has 7"),
        ({"specularImages": [[0, 1, 2, 3, 4, "a"]]}, "image must be named by its number"),
        ({"specularImages": [[0, 1, 2, 3, 4, 6]]}, "the faces of a cube must be squares of one size, got 4x4, 8x4"),
    ],
)
def test_a_damaged_light_is_told_in_one_sentence(tmp_path, light, says):
    path = write_gltf(tmp_path, lit_by([*colored(), np.zeros((4, 8, 3), np.uint8)], **light))
    with pytest.raises(ValueError, match=says) as found:
        ps.load_scene(path)
    assert str(found.value).startswith(f"{path}: ") and "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("extensions", "says"),
    [
        ({}, "there is no image-based light 0, the file has 0"),
        ({EXTENSION: []}, "there is no image-based light 0, the file has 0"),
        ({EXTENSION: {"lights": [7]}}, "image-based light 0 must be an object, got 7"),
        ({EXTENSION: {"lights": [None]}}, "image-based light 0 is null"),
    ],
)
def test_a_light_that_is_not_there_is_told(tmp_path, extensions, says):
    path = write_gltf(tmp_path, lit_by(colored()) | {"extensions": extensions})
    with pytest.raises(ValueError, match=says):
        ps.load_scene(path)


def test_random_damage_never_crashes(tmp_path):
    whole, random = json.dumps(lit_by(colored())).encode(), np.random.default_rng(4)
    for _ in range(120):
        (tmp_path / "a.gltf").write_bytes(in_json(whole, random))
        try:
            with taken():
                ps.load_scene(tmp_path / "a.gltf")
        except (ValueError, OSError) as error:
            assert str(tmp_path) in str(error)


def test_a_scene_without_the_light_has_no_environment(tmp_path):
    data = lit_by(colored())
    del data["scenes"][0]["extensions"]
    assert ps.load_scene(write_gltf(tmp_path, data)).environment is None
    assert ps.load_scene("demo").environment is None
