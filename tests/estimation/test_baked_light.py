"""Unlight: the light in a picture is found, and divided out of its colours where the picture tells it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import Hits, decode, encode, plane, sphere, trace
from pointshade_gl.estimation.light_fit import FoundLight, describe_light, fit_light
from pointshade_gl.estimation.photo_shading import find_gains
from pointshade_gl.gpu.surface.source_colors import gain_map

from ..benchmarks.traced_light import shade
from ..reference import lit_sample
from ..reference import unlighting as unlit
from ..reference.resolve_pass import surface_map_of
from ..support.frames import CAMERA, sphere_before_wall
from ..support.view_sets import three_views
from ..support.viewing import press

F = np.float32
LARGE = ps.Camera(262.0, 262.0, 159.5, 119.5, 320, 240)
TEXTURES = ("coloured", "grey", "mixed with white", "plain")
RIGHT = np.array((0.8, -0.3, -0.5)) / np.linalg.norm((0.8, -0.3, -0.5))  # towards the light that relights


def texture(kind, seed):
    chance = np.random.default_rng(seed)
    ways, phases = chance.normal(0, 14, (3, 6, 3)), chance.uniform(0, 6.3, (3, 6))

    def albedo(points):
        waves = [np.sin(points @ w.T + p).sum(-1) / 6 for w, p in zip(ways, phases, strict=True)]
        if kind == "coloured":
            return 0.5 + 0.2 * np.stack(waves, -1)
        if kind == "grey":
            return np.repeat(0.5 + 0.15 * waves[0][..., None], 3, -1)
        if kind == "plain":
            return np.full(points.shape, 0.5)
        return np.where(waves[0][..., None] > 0, (0.7, 0.35, 0.2), 0.8)

    return albedo


@cache
def scene(kind="grey", seed=0):
    """Two balls before a wall, as a camera sees them."""
    parts = [
        sphere((-0.25, 0.05, 1.3), 0.33, texture(kind, seed)),
        sphere((0.3, -0.1, 1.5), 0.28, texture(kind, seed + 1)),
    ]
    return trace([*parts, plane((0.2, -0.15, -1), (0, 0, 2.1), texture(kind, seed + 2))], LARGE)


@cache
def planes(kind="plain"):
    """Three grey planes of a room, each of another tone: under ambient light they look lit."""
    tones = (0.3, 0.55, 0.8)
    walls = ((1, 0, -0.4), (-0.6, 0, 2)), ((-0.8, 0, -0.7), (0.5, 0, 2)), ((0, -1, -0.2), (0, 0.5, 1.5))
    make = [lambda p, k=k: texture(kind, k)(p) * tones[k] * 2 for k in range(3)]
    return trace([plane(*walls[k], make[k]) for k in range(3)], LARGE)


@cache
def alone(kind):
    """A textured plane."""
    return trace([plane((0.5, 0.3, -1), (0, 0, 1.6), texture(kind, 3))], LARGE)


def balls_and_wall(seed):
    """Painted with slow grey waves, which a rounded surface cannot tell from light."""
    chance = np.random.default_rng(seed)
    ways, phases = chance.normal(0, 6, (3, 3)), chance.uniform(0, 6.3, 3)

    def albedo(points):
        return np.repeat(0.5 + 0.12 * np.sin(points @ ways.T + phases).sum(-1)[..., None], 3, -1)

    place = (*chance.uniform(-0.2, 0.2, 2), 1.5)
    return trace(
        [sphere(place, chance.uniform(0.25, 0.5), albedo), plane((0.15, -0.1, -1), (0, 0, 2.4), albedo)], LARGE
    )


def photographed(hits, linear, seed=5):
    """The frame of a Kinect (Nguyen, Izadi, Lovell 2012)."""
    noise = np.random.default_rng(seed).normal(size=hits.depth.shape) * (0.0012 + 0.0019 * (hits.depth - 0.4) ** 2)
    depth = np.where(hits.surface >= 0, hits.depth + noise, 0)
    return ps.Frame(np.round(encode(np.clip(linear, 0, 1))).astype(np.uint8), depth, LARGE)


def lit(hits, ambient, towards=(-0.7, -0.4, -0.6)):
    """Linear light under ambient light over that of one direction."""
    material = ps.Material(ambient / (1 + ambient), 1 / (1 + ambient), 0)
    return shade(hits, ps.Light(direction=tuple(-np.array(towards))), material, (0, 0, 0))


def arrays(hits: Hits, linear):
    """As the fit takes them."""
    known = (hits.surface >= 0)[..., None]
    colors = np.concatenate([linear, known], -1)[1::2, 1::2]
    return colors.astype(F), np.concatenate([hits.normals * known, hits.depth[..., None]], -1)[1::2, 1::2].astype(F)


class TestFit:
    @pytest.mark.parametrize("kind", TEXTURES)
    @pytest.mark.parametrize(
        ("ambient", "towards"), [(0.1, (-0.7, -0.4, -0.6)), (0.3, (0.9, 0.2, 0.1)), (0.15, (0.4, -0.5, -0.8))]
    )
    def test_direction_and_ambient_light_are_found(self, kind, ambient, towards):
        hits = scene(kind)
        found = fit_light(*arrays(hits, lit(hits, ambient, towards)))
        cosine = np.dot(found.direction, towards) / np.linalg.norm(towards)
        assert found.is_shown and cosine > np.cos(np.radians(8)) and abs(found.ambient - ambient) < 0.3 * ambient, found

    @pytest.mark.parametrize("kind", TEXTURES)
    @pytest.mark.parametrize("make", [scene, planes, alone])
    def test_ambient_light_does_not_tell(self, kind, make):
        hits = make(kind)
        found = fit_light(*arrays(hits, 0.8 * hits.albedo))
        assert not found.is_shown and found.why

    @pytest.mark.parametrize("seed", range(8))
    def test_slow_texture_is_not_light(self, seed):
        hits = balls_and_wall(seed)
        assert not fit_light(*arrays(hits, hits.albedo)).is_shown

    def test_planes_never_tell(self):
        """As well as lit they may be painted."""
        hits = planes()
        assert not fit_light(*arrays(hits, lit(hits, 0.2))).is_shown

    @pytest.mark.parametrize("shape", [(1, 1), (3, 200), (60, 80)])
    def test_without_anything_to_see_it_does_not_tell(self, shape):
        nothing = np.zeros((*shape, 4), F)
        assert fit_light(nothing, nothing).why == "it shows too little of rounded surfaces"
        flat = np.broadcast_to(np.array((0, 0, -1, 1), F), (*shape, 4))
        assert not fit_light(np.full((*shape, 4), 0.5, F), flat).is_shown

    def test_seeds_agree(self):
        hits = scene("mixed with white", 7)
        found = [fit_light(*arrays(hits, lit(hits, 0.25)), seed) for seed in range(3)]
        assert np.ptp([one.ambient for one in found]) < 0.03
        assert np.ptp([one.direction for one in found], axis=0).max() < 0.05

    def test_a_light_is_told_by_its_sides(self):
        light = FoundLight((-0.8, -0.6, 0.0), 0.25, 1.0)
        told = "unlight: its light comes from left and above, 20 % of it is ambient"
        assert describe_light(light) == told
        doubted = replace(light, strength=0.4, why="its surfaces do not agree on the light")
        assert describe_light(doubted) == f"{told}; divided out by 40 %: its surfaces do not agree on the light"


class TestFunctions:
    def test_gains_agree_with_the_mirror(self, gpu):
        chance = np.random.default_rng(2)
        normal = chance.normal(size=(500, 3)).astype(F)
        normal /= -np.linalg.norm(normal, axis=1, keepdims=True) * np.sign(normal[:, 2:])
        linear = (chance.uniform(0, 1, (500, 3)) ** 6).astype(F)
        at = chance.uniform(-0.5, 11.5, (500, 2)).astype(F)
        gain_map = np.concatenate([chance.uniform(-0.7, 0.7, (12, 12, 2)), chance.uniform(-6, 3, (12, 12, 2))], -1)
        gain_map = gain_map.astype(F)
        gain_map[2:6, 3:8, 2] = 1e4  # without a surface
        hue_map = chance.uniform(0, 1, (12, 12, 4)).astype(F)
        values = {"a": at, "n": normal, "c": linear, "gain_map": gain_map, "hue_map": hue_map}
        answer = gpu("unlighting.glsl", "unlit(gain_map, hue_map, a, n, c), 0", **values)[:, :3]
        expected = unlit.unlit(gain_map, hue_map, at, normal, linear)
        np.testing.assert_allclose(answer, expected, atol=2e-5, rtol=1e-3)
        raised = unlit.luminance_of(expected) / unlit.luminance_of(linear)
        assert (raised > 3).sum() > 20 and (raised < 0.5).sum() > 50 and (expected == linear).all(-1).sum() > 10
        off_hue = np.abs(expected / expected.sum(-1, keepdims=True) - linear / linear.sum(-1, keepdims=True)).max(-1)
        assert ((off_hue > 0.05) == (off_hue > 1e-3)).mean() > 0.9 and 5 < (off_hue > 0.05).sum() < 250

    def test_normals_between_pixels_agree_with_the_mirror(self, gpu):
        hits = trace([sphere((0.05, 0.02, 1.5), 0.4, texture("grey", 1))], CAMERA)
        normals = np.where(hits.surface[..., None] >= 0, hits.normals, 0).astype(F)
        surface_map = surface_map_of(normals, hits.depth.astype(F))
        at = np.random.default_rng(3).uniform((0, 0), (159, 119), (2000, 2)).astype(F)
        source = np.array(CAMERA.intrinsics, F)
        values = {"at": at, "k": source[None], "surface_map": surface_map}
        answer = gpu("unlighting.glsl", "normal_between(surface_map, at, k), 0", **values)[:, :3]
        np.testing.assert_allclose(answer, unlit.normal_between(surface_map, at, source), atol=1e-4)
        pixels = gpu("unlighting.glsl", "vec2(see_nearest(surface_map, at).pixel), 0, 0", **values)[:, :2]
        assert (pixels == unlit.see_nearest(surface_map, at).pixel).all()
        assert 100 < (answer == 0).all(-1).sum() < 1900

    @pytest.mark.parametrize("aligned", [False, True])
    def test_samples_agree_with_the_mirror(self, gpu, aligned):
        frame = sphere_before_wall()
        hits = trace([sphere((0.05, 0.02, 1.5), 0.4, texture("grey", 1))], CAMERA)
        normals = np.where(hits.surface[..., None] >= 0, hits.normals, 0).astype(F)
        surface_map = surface_map_of(normals, hits.depth.astype(F))
        picture = np.concatenate([frame.color, np.full((120, 160, 1), 255)], -1).astype(F) / F(255)
        pixel = np.random.default_rng(4).integers((0, 0), (160, 120), (1000, 2))
        call = f"mean_lit_color(color_map, surface_map, ivec2(at), 4.0, {str(aligned).lower()})"
        answer = gpu("lit_sample.glsl", call, at=pixel.astype(F), color_map=picture, surface_map=surface_map)
        mirror = lit_sample.mean_lit_color(picture, surface_map, pixel, 4.0, aligned)
        np.testing.assert_allclose(answer, mirror, atol=1e-5)
        assert (mirror[:, 3] == 1).sum() > 150


def psnr(picture, truth, where):
    return 10 * np.log10(255**2 / np.square(encode(picture) - encode(truth))[where].mean())


def relit(albedo, hits, scaled):
    """How near colours come to the truth when they are relit, dB: where the light falls, or as a whole."""
    shading = 0.1 + 0.9 * np.maximum(hits.normals @ RIGHT, 0)[..., None]
    truth, found = hits.albedo * shading, albedo * shading
    where = (hits.surface >= 0) & ((hits.normals @ RIGHT > 0) | (not scaled))
    scale = (found * truth)[where].sum() / np.square(found)[where].sum() if scaled else 1
    return psnr(np.clip(found * scale, 0, 1), truth, where)


class TestPictures:
    @pytest.mark.parametrize("kind", TEXTURES)
    def test_relit_from_the_other_side_it_is_nearer_to_the_truth(self, renderer, kind):
        hits = scene(kind, 11)
        frame = photographed(hits, lit(hits, 0.2))
        before, after = (decode(frame.color.astype(float)), self.unlit(renderer, frame))
        gain = {scaled: relit(after, hits, scaled) - relit(before, hits, scaled) for scaled in (True, False)}
        assert gain[True] > 8 and gain[False] > 4, gain

    def unlit(self, renderer, frame):
        return decode(renderer.render(frame, shading="none", unlight=True)[..., :3].astype(float))

    @pytest.mark.parametrize("make", [scene, planes])
    def test_ambient_light_changes_nothing_and_a_note_says_so(self, renderer, capsys, make):
        hits = make("plain")
        frame = photographed(hits, 0.7 * hits.albedo, seed=int(make is planes))
        for shading in ("none", "phong"):
            pictures = [renderer.render(frame, shading=shading, unlight=on) for on in (False, True)]
            assert (pictures[0] == pictures[1]).all()
        assert capsys.readouterr().err.count("note: unlight: the picture does not tell its light") == 1
        assert renderer.explain()[-1].endswith("its colours stay as they are")

    def test_the_albedo_agrees_with_the_mirror(self, renderer):
        hits = scene("mixed with white")
        frame = ps.Frame(np.round(encode(lit(hits, 0.2))).astype(np.uint8), hits.depth, LARGE)
        normals = np.where(hits.surface[..., None] >= 0, hits.normals, 0)
        renderer.render(frame, normals=normals, unlight=True)
        with renderer._in_use():
            (textures,) = renderer._pipeline.gpu_scene.frames._kept
            albedo = textures.albedo.read() / 65535
            photo = renderer._pipeline.gpu_scene.frames.colors._albedo.sample(textures, textures.surface, LARGE)
            gains = gain_map(photo, find_gains(photo, textures.light))
        surface_map = surface_map_of(normals.astype(F), frame.depth)
        picture = np.concatenate([frame.color, np.full((240, 320, 1), 255)], -1).astype(F) / F(255)
        source, samples = np.array(LARGE.intrinsics, F), np.array(photo.size, F)
        mirror = unlit.albedo_of(picture, surface_map, source, gains, photo.surroundings, samples)
        np.testing.assert_allclose(albedo, mirror, atol=2e-4)

    def test_it_costs_nothing_unless_it_is_asked_for_and_runs_once_for_a_frame(self, renderer):
        hits = scene("plain", 3)
        frame = photographed(hits, lit(hits, 0.3))
        counts = renderer.steps.counts.copy()
        first = renderer.render(frame)
        assert "find light" not in renderer.steps.counts - counts
        for yaw in (0, 10, 20):
            renderer.render(frame, unlight=True, yaw=yaw)
        ran = renderer.steps.counts - counts
        assert ran["find light"] == ran["albedo"] == ran["surface"] == ran["upload"] == 1
        assert (renderer.render(frame) == first).all()

    @pytest.mark.parametrize(
        "options", [{"splat": "mesh"}, {"shading": "flat"}, {"shading": "gouraud"}, {"point_size": 2.0}]
    )
    def test_every_form_and_shading_is_drawn_with_it(self, renderer, options):
        """As a frame is whose picture shows the albedo."""
        hits = scene("plain", 3)
        frame = ps.Frame(np.round(encode(lit(hits, 0.3))).astype(np.uint8), hits.depth, LARGE)
        albedo = renderer.render(frame, shading="none", unlight=True)[..., :3]
        drawn = renderer.render(frame, unlight=True, **options).astype(int)
        expected = renderer.render(ps.Frame(albedo, frame.depth, LARGE), **options).astype(int)
        assert np.abs(drawn - expected).max() <= 2 and np.abs(drawn - renderer.render(frame, **options)).max() > 30

    def test_a_larger_colour_picture_is_unlit_at_its_size(self, renderer):
        hits = scene("plain", 3)
        color = np.round(encode(lit(hits, 0.3))).astype(np.uint8)
        small = LARGE.resized(160, 120)
        frame = ps.Frame(color, trace_depth(small), small)
        for upsample in ("vote", "none"):
            found = decode(
                renderer.render(frame, shading="none", unlight=True, upsample=upsample)[..., :3].astype(float)
            )
            inside = hits.surface >= 0
            change = relit(found, hits, True) - relit(decode(color.astype(float)), hits, True)
            assert found.shape == color.shape and inside.all() and change > (8 if upsample == "vote" else 4)

    def test_frames_of_a_set_and_points_are_unlit(self, renderer):
        views = three_views()
        plain = renderer.render(views, shading="none")
        assert np.abs(renderer.render(views, shading="none", unlight=True).astype(int) - plain).max() <= 1  # albedo
        hits = scene("plain", 3)
        frame = photographed(hits, lit(hits, 0.3))
        twice = renderer.render([frame, frame], unlight=True, shading="none").astype(int)
        assert np.abs(twice - renderer.render(frame, unlight=True, shading="none", upsample="none"))[..., :3].mean() < 1
        cloud = renderer.render_points(frame, shading="none", unlight=True)
        assert np.abs(cloud.colors.mean() - twice[hits.surface >= 0][:, :3].mean()) < 1


def trace_depth(camera):
    parts = [sphere((-0.25, 0.05, 1.3), 0.33, texture("plain", 0)), sphere((0.3, -0.1, 1.5), 0.28, texture("plain", 0))]
    return trace([*parts, plane((0.2, -0.15, -1), (0, 0, 2.1), texture("plain", 0))], camera).depth


class TestChoice:
    def test_a_wrong_value_is_named(self):
        with pytest.raises(TypeError, match="unlight must be True or False, got 'yes'"):
            ps.Appearance(unlight="yes")

    def test_typed(self, typed, tmp_path):
        hits = scene("plain", 3)
        frame = photographed(hits, lit(hits, 0.3))
        ps.save_image(tmp_path / "color.png", frame.color)
        ps.save_image(tmp_path / "depth.npy", frame.depth)
        line = "render --color color.png --depth depth.npy --intrinsics 262,262,159.5,119.5 --samples 1 --explain"
        code, said, err = typed(f"{line} --unlight -o on.png")
        assert code == 0, err
        assert "unlight: its light comes from left and above and the camera, 2" in said
        assert "unlight" not in typed(f"{line} -o off.png")[1]
        assert (
            "does not tell its light" in typed("render vase --unlight -o vase.png --picture-size 64x48 --samples 1")[2]
        )

    def test_a_scene_file_keeps_it(self, tmp_path):
        node = ps.Node(ps.PointObject(sphere_before_wall(), unlight=True), "ball")
        ps.save_scene(tmp_path / "out.gltf", ps.Scene((node,)))
        text = (tmp_path / "out.gltf").read_text()
        assert ps.load_scene(tmp_path / "out.gltf").nodes[0].content.look.unlight
        (tmp_path / "out.gltf").write_text(
            text.replace('"unlight": true', '"unlight": "yes"').replace('"unlight":true', '"unlight":"yes"')
        )
        with pytest.raises(ValueError, match="unlight must be true or false, got 'yes'"):
            ps.load_scene(tmp_path / "out.gltf")

    def test_the_viewer_has_a_key_for_it(self, open_viewer):
        viewer = open_viewer()
        press(viewer, "U")
        assert viewer.state.look.unlight
        press(viewer, "U")
        assert not viewer.state.look.unlight
