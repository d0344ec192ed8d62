"""The layers of a picture: light adds up to the beauty, and what is seen where agrees with all else that says so."""

import json

import numpy as np
import OpenEXR
import pytest

import pointshade_gl as ps
from pointshade_gl.renderer.requests import RenderRequest
from pointshade_gl.scene.passes import PASSES
from pointshade_gl.scene.values import linear_to_bytes

from ..support import frames
from ..support.cloud_ball import ball

WARM = ps.Light(position=(0.5, -0.8, 0.2), color=(1, 0.7, 0.4), shadow=True)
COLD = ps.Light(direction=(1, 1, 1), color=(0.3, 0.4, 0.8), intensity=0.7, shadow=True)
PLAIN = ps.Light(position=(-0.6, -0.3, 0), intensity=0.5)
SOFT = ps.Light(position=(0.5, -0.8, 0.2), radius=0.1, shadow=True)
SPOT = ps.Light(position=(0, -0.5, 0), direction=(0, 0.4, 1), cone=(10, 20))
SIZE = ps.Camera(131.0, 131.0, 79.5, 59.5, 160, 120)


def vase():
    frame = ps.load_frame("vase")
    return frame, {"camera": frame.camera.resized(160, 120)}


def room():
    """Two copies of a mesh, and a cloud, before a frame of a wall."""
    triangle = ps.Mesh([(-0.3, 0.3, 0), (0.3, 0.3, 0), (0, -0.3, 0)], [(0, 1, 2)])
    places = [np.eye(4), np.eye(4)]
    places[0][:3, 3], places[1][:3, 3] = (-0.5, 0, 1.2), (0.5, 0, 1.2)
    nodes = [ps.Node(triangle, name, place) for name, place in zip(("left", "right"), places, strict=True)]
    points = ps.Node(ball(radius=0.2, at=(0, 0, 1.3)).styled(shading="phong"), "ball")
    return ps.Scene([*nodes, points, ps.Node(ps.PointObject(frames.tilted_plane()), "wall")], SIZE)


SMALL = {"camera": ps.Camera.from_fov(45, 160, 120)}
SCENES = {  # a source, lights and options of each
    "vase": lambda: (vase()[0], [WARM, PLAIN], vase()[1]),
    "ball on a ground": lambda: (frames.sphere(), [WARM, COLD], {"ground": True, "samples": 2}),
    "cloud": lambda: (ball(), [ps.Light((2, -3, 2), shadow=True), ps.Light()], SMALL | {"samples": 2}),
    "meshes, cloud and frame": lambda: (room(), [WARM, COLD, SPOT], {"ambient_occlusion": True}),
    "environment": lambda: (frames.sphere_before_wall(), [WARM, COLD], {"environment": "studio", "samples": 2}),
    "soft shadows": lambda: (frames.sphere_before_wall(), [SOFT, COLD], {"samples": 2}),
    "flat and turned": lambda: (frames.sphere_before_wall(), [WARM, COLD], {"shading": "flat", "yaw": 15}),
    "several frames": lambda: ([frames.sphere_before_wall(), frames.noisy()], [WARM, COLD], {}),
}


@pytest.fixture(scope="module")
def drawn(renderer):
    """drawn(name): the passes of one of the scenes, once, and its source, lights and options."""
    kept = {}

    def draw(name):
        if name not in kept:
            source, lights, options = SCENES[name]()
            kept[name] = renderer.render_passes(source, lights, **options), source, lights, options
        return kept[name]

    return draw


def total(passes):
    return sum(
        layer for name, layer in passes.items() if name in ("ambient", "environment", "unlit") or "light_" in name
    )


@pytest.mark.parametrize("name", SCENES)
def test_light_adds_up_to_the_beauty(drawn, name):
    passes, _, lights, _ = drawn(name)
    beauty = passes["beauty"][..., :3]
    assert [f"light_{k + 1}" in passes for k in range(len(lights))] == [True] * len(lights)
    assert np.abs(total(passes) - beauty).max() < 1e-5 and beauty.max() > 0.3
    assert all(passes[f"light_{k + 1}"].max() > 0.05 for k in range(len(lights)))


@pytest.mark.parametrize("name", SCENES)
def test_the_beauty_is_the_picture_in_linear_light(drawn, renderer, name):
    passes, source, lights, options = drawn(name)
    picture, beauty = renderer.render(source, lights, **options).astype(int), passes["beauty"]
    alpha = beauty[..., 3:]
    color = linear_to_bytes((beauty[..., :3] / np.maximum(alpha, 1e-6)).clip(0, 1)).astype(int)
    is_seen = picture[..., 3] > 0
    assert np.abs(color - picture[..., :3])[is_seen].max() <= 1
    assert np.abs(255 * alpha[..., 0] - picture[..., 3]).max() <= 0.51


@pytest.mark.parametrize("name", ["vase", "meshes, cloud and frame"])
def test_the_light_of_a_lamp_is_that_of_a_picture_which_has_no_other(drawn, renderer, name):
    passes, source, lights, options = drawn(name)
    for k, light in enumerate(lights):
        alone = renderer.render_passes(source, light, passes="light", **options)
        assert list(alone) == ["light_1"]
        np.testing.assert_allclose(alone["light_1"], passes[f"light_{k + 1}"], atol=1e-5)


def test_a_lamp_alone_is_the_whole_beauty_where_nothing_else_shines(renderer):
    passes = renderer.render_passes(frames.sphere(), COLD, ps.Material(0, 1, 0))
    np.testing.assert_array_equal(passes["light_1"], passes["beauty"][..., :3])
    assert not passes["ambient"].any() and not passes["unlit"].any()


@pytest.mark.parametrize("name", SCENES)
def test_a_shadow_is_the_share_that_it_takes(drawn, name):
    passes, _, lights, _ = drawn(name)
    for k, light in enumerate(lights, 1):
        lit, whole, shadow = (passes[f"{kind}_{k}"] for kind in ("light", "unshadowed", "shadow"))
        assert shadow.min() >= 0 and shadow.max() <= 1 and (shadow.any() or not light.shadow or name == "cloud")
        np.testing.assert_allclose(whole.sum(-1) * (1 - shadow), lit.sum(-1), atol=2e-5)
    if name == "soft shadows":
        assert ((passes["shadow_1"] > 0.2) & (passes["shadow_1"] < 0.8)).any()


def test_a_shadow_lies_where_the_ball_hides_the_lamp_from_the_wall(renderer):
    frame = frames.sphere_before_wall()
    passes = renderer.render_passes(frame, ps.Light(position=(0, 0, 0), shadow=True))
    assert (passes["shadow_1"] > 0.5).mean() < 0.01  # a lamp in the eye casts shadows that it does not see
    passes = renderer.render_passes(frame, ps.Light(position=(-1, 0, 0.5), shadow=True))
    _, columns = np.nonzero(passes["shadow_1"] > 0.5)
    assert len(columns) > 100 and np.median(columns) > 80  # from the left to the right


def test_light_from_all_around_has_one_name_or_the_other(drawn):
    passes = drawn("environment")[0]
    assert not passes["ambient"].any() and passes["environment"].max() > 0.1
    passes = drawn("vase")[0]
    assert not passes["environment"].any() and passes["ambient"].max() > 0.05


def test_ambient_light_is_albedo_times_what_near_things_leave_of_it(renderer):
    options = {"material": ps.Material(ambient=0.5), "ambient_occlusion": True}
    passes = renderer.render_passes(frames.sphere_before_wall(), **options)
    is_seen = passes["depth"] > 0
    expected = 0.5 * passes["albedo"] * passes["ao"][..., None]
    np.testing.assert_allclose(passes["ambient"][is_seen], expected[is_seen], atol=1e-4)
    assert passes["ao"].min() < 0.9 and (passes["ao"][~is_seen] == 1).all()


def test_what_is_shown_in_its_own_colours_is_unlit(renderer):
    frame = frames.sphere()
    passes = renderer.render_passes(frame, [WARM, COLD], shading="none")
    np.testing.assert_array_equal(passes["unlit"], passes["beauty"][..., :3])
    np.testing.assert_array_equal(passes["unlit"], passes["albedo"])
    is_seen = passes["depth"] > 0
    assert np.abs(linear_to_bytes(passes["albedo"])[is_seen].astype(int) - frame.color[is_seen]).max() <= 1
    assert not passes["light_1"].any() and not passes["ambient"].any()


def test_alpha_has_the_shadows_on_a_ground(drawn):
    passes = drawn("ball on a ground")[0]
    ground, alpha = passes["ground"], passes["beauty"][..., 3]
    assert ground.max() > 0.3 and (alpha >= ground - 1e-6).all()
    surface = alpha - ground
    assert np.abs(surface[passes["depth"] > 0]).min() > 0.2 and (ground[surface == 1] == 0).all()


@pytest.mark.parametrize("name", ["flat and turned", "meshes, cloud and frame", "several frames"])
def test_depth_positions_and_normals_agree(drawn, renderer, name):
    passes, source, _, options = drawn(name)
    camera, pose, depth = passes.camera, passes.pose, passes["depth"]
    is_seen = depth > 0
    if name != "meshes, cloud and frame":
        np.testing.assert_array_equal(depth, renderer.render_depth(source, yaw=options.get("yaw", 0)))
    rows, columns = np.nonzero(is_seen)
    pixels = camera.project(passes["position"][is_seen].astype(float), pose)
    np.testing.assert_allclose(pixels, np.stack([columns, rows], -1), atol=1e-3)
    for layer in ("position", "normal", "normal_world"):
        assert np.isnan(passes[layer][~is_seen]).all()
    normal, in_world = passes["normal"][is_seen], passes["normal_world"][is_seen]
    has_one = np.isfinite(normal).all(-1)
    assert has_one.mean() > 0.95
    np.testing.assert_allclose(np.linalg.norm(normal[has_one], axis=-1), 1, atol=1e-4)
    np.testing.assert_allclose(normal[has_one] @ pose[:3, :3].T, in_world[has_one], atol=1e-5)


def test_each_object_has_a_number_copies_of_one_mesh_too(drawn):
    passes = drawn("meshes, cloud and frame")[0]
    numbers, (left, right) = passes["object_id"], (31, 128)  # columns of the two triangles
    assert passes.objects == ("left", "right", "ball", "wall")
    assert [numbers[60, left], numbers[60, right], numbers[60, 79], numbers[2, 79]] == [1, 2, 3, 4]
    assert set(np.unique(numbers)) <= {0, 1, 2, 3, 4}


def test_certainty_is_less_where_depth_is_noisy(renderer):
    clean, noisy = (
        renderer.render_passes(frame, passes="certainty,depth")
        for frame in (frames.sphere_before_wall(), frames.noisy())
    )
    assert np.median(clean["certainty"][clean["depth"] > 0]) == 1
    assert (noisy["certainty"][noisy["depth"] > 0] < 1).mean() > 0.9 and noisy["certainty"].min() >= 0


def test_passes_have_no_exposure_fill_tone_or_background(renderer):
    frame = frames.sphere()
    plain = renderer.render_passes(frame, WARM)
    finish = ps.OutputSettings(exposure=2.0, fill=0.3, tone="neutral", background="white", show="depth")
    request = RenderRequest.seen(frame, ps.View([WARM], finish=finish))
    changed = renderer.render_passes(request)
    for name, layer in plain.items():
        np.testing.assert_array_equal(layer, changed[name], name)
    for name in ("exposure", "fill", "tone", "background", "show"):
        with pytest.raises(TypeError, match=f"unexpected keyword argument '{name}'"):
            renderer.render_passes(frame, **{name: 1})


def test_pictures_before_and_after_are_the_same(renderer):
    frame = frames.sphere()
    for samples in (1, 2):
        before = renderer.render(frame, WARM, samples=samples)
        renderer.render_passes(frame, [WARM, COLD], samples=samples)
        np.testing.assert_array_equal(renderer.render(frame, WARM, samples=samples), before)


def test_only_what_is_asked_for_is_drawn(renderer):
    frame = frames.sphere()
    every = renderer.render_passes(frame, [WARM, PLAIN])
    order = [*PASSES[:5], "light_1", "light_2", "unshadowed_1", "unshadowed_2", "shadow_1", "shadow_2", *PASSES[8:]]
    assert list(every) == order and all(layer.dtype == np.float32 for layer in every.values())
    for asked in ("depth", ["beauty"], "normal, ao", ("light", "shadow"), ["ambient", "albedo"]):
        some = renderer.render_passes(frame, [WARM, PLAIN], passes=asked)
        assert set(some) < set(every)
        for name, layer in some.items():
            np.testing.assert_array_equal(layer, every[name], name)
    assert list(ps.render_passes(frame, passes="depth,beauty")) == ["beauty", "depth"]


def test_lights_beyond_nine_keep_their_order(renderer):
    found = renderer.render_passes(frames.single_pixel(), [PLAIN] * 11, passes="light")
    assert list(found) == [f"light_{k}" for k in range(1, 12)]


@pytest.mark.parametrize(
    ("passes", "error", "says"),
    [
        ("nonsense", ValueError, "unknown passes 'nonsense': known are all, beauty, ambient, .* object_id"),
        (["normals"], ValueError, r"unknown passes 'normals' \(did you mean normal\?\)"),
        ([], TypeError, r"passes must be 'all' or names of passes, got \[\]"),
        (3, TypeError, "passes must be 'all' or names of passes, got 3"),
        ([3], ValueError, "unknown passes 3"),
    ],
)
def test_other_names_are_refused(renderer, passes, error, says):
    with pytest.raises(error, match=says):
        renderer.render_passes(frames.single_pixel(), passes=passes)


def test_progress_counts_the_samples_of_all_pictures(renderer):
    told = []
    renderer.render_passes(frames.sphere(), [WARM, PLAIN], samples=2, progress=lambda *step: told.append(step))
    assert [one[0] for one in told] == list(range(1, 13)) and {one[1] for one in told} == {12}  # 2 x 6 pictures
    with pytest.raises(ps.Cancelled):
        renderer.render_passes(frames.sphere(), [WARM, PLAIN], samples=2, progress=lambda done, _: done < 7)
    assert renderer.render(frames.sphere(), WARM).any()


class TestFile:
    @pytest.fixture
    def made(self, renderer, tmp_path):
        """Passes of a turned view, and the channels, their types and the header of their file."""
        passes = renderer.render_passes(frames.sphere_before_wall(), [WARM, COLD], yaw=20, pitch=-10)
        ps.save_passes(tmp_path / "passes.exr", passes)
        with OpenEXR.File(str(tmp_path / "passes.exr"), separate_channels=True) as file:
            return passes, {name: np.array(one.pixels) for name, one in file.channels().items()}, dict(file.header())

    def test_every_layer_has_channels_whose_names_nuke_and_blender_read(self, made):
        passes, channels, _ = made
        numbers, vectors = ("certainty", "ao", "object_id", "ground"), ("normal", "normal_world", "position")
        expected = {"R", "G", "B", "A", "Z"}
        for name in passes:
            letters = "X" if name in numbers or "shadow_" in name else "XYZ" if name in vectors else "RGB"
            expected |= {f"{name}.{one}" for one in letters if name not in ("beauty", "depth")}
        expected -= {f"unshadowed_{k}.X" for k in (1, 2)}
        expected |= {f"unshadowed_{k}.{one}" for k in (1, 2) for one in "RGB"}
        assert set(channels) == expected
        exact = {"Z", "object_id.X", "position.X", "position.Y", "position.Z"}
        assert {name for name, one in channels.items() if one.dtype == np.float32} == exact
        assert all(one.dtype in (np.float16, np.float32) and np.isfinite(one).all() for one in channels.values())

    def test_numbers_come_back(self, made):
        passes, channels, _ = made
        np.testing.assert_array_equal(channels["Z"], passes["depth"])
        np.testing.assert_array_equal(channels["position.Y"], np.nan_to_num(passes["position"][..., 1]))
        np.testing.assert_array_equal(channels["light_2.B"], passes["light_2"][..., 2].astype(np.float16))
        normal = np.nan_to_num(passes["normal"]) * (1, -1, -1)  # y up, z towards the viewer
        np.testing.assert_array_equal(channels["normal.Y"], normal[..., 1].astype(np.float16))
        np.testing.assert_array_equal(channels["normal.Z"], normal[..., 2].astype(np.float16))
        parts = "ambient", "environment", "unlit", "light_1", "light_2"
        for color in "RGB":
            added = sum(channels[f"{part}.{color}"].astype(np.float32) for part in parts)
            np.testing.assert_allclose(added, channels[color], atol=1e-3)

    def test_the_header_says_who_sees_it(self, made):
        passes, _, header = made
        is_seen, camera = passes["depth"] > 0, passes.camera
        points = np.append(passes["position"][is_seen], np.ones((is_seen.sum(), 1)), 1)
        x, y, z, _ = (points @ header["worldToCamera"]).T  # row vectors
        np.testing.assert_allclose(z, passes["depth"][is_seen], atol=1e-5)
        rows, columns = np.nonzero(is_seen)
        right, up = 2 * (columns + 0.5) / camera.width - 1, 1 - 2 * (rows + 0.5) / camera.height
        wide, centre = header["screenWindowWidth"], header["screenWindowCenter"]
        np.testing.assert_allclose(x / z, centre[0] + wide / 2 * right, atol=1e-5)
        np.testing.assert_allclose(y / z, centre[1] + wide / 2 * up * camera.height / camera.width, atol=1e-5)
        assert header["cameraIntrinsics"].tolist() == [[131, 0, 79.5], [0, 131, 59.5], [0, 0, 1]]
        assert json.loads(header["objects"]) == list(passes.objects)

    def test_it_is_a_frame_that_can_be_read(self, made, tmp_path):
        passes, _, _ = made
        frame = ps.load_frame(depth=tmp_path / "passes.exr", intrinsics="131,131,79.5,59.5")
        np.testing.assert_array_equal(frame.depth, passes["depth"])
        assert frame.color is not None and frame.color.max() > 60

    @pytest.mark.parametrize(
        ("name", "passes", "error", "says"),
        [
            ("a.png", ps.Frame, ValueError, "the suffix of passes must be .exr"),
            ("a.exr", {"beauty": 1}, TypeError, "passes must be a Passes, got"),
            ("no/a.exr", {}, FileNotFoundError, "no"),
        ],
    )
    def test_what_cannot_be_written_is_refused(self, tmp_path, name, passes, error, says):
        with pytest.raises(error, match=says):
            ps.save_passes(tmp_path / name, passes)
        assert not list(tmp_path.iterdir())
