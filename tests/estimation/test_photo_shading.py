"""Photographs of generated scenes: what the light does not reach is filled, and what does not tell stays."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import plane, sphere, trace
from pointshade_gl.estimation.light_fit import FoundLight, fit_light, visible_light
from pointshade_gl.estimation.photo_shading import PATIENCE, PhotoSamples, StreamLights, ask, find_shading

from ..support.lit_photographs import SHAPES, TEXTURES, photograph, relit_psnr

F = np.float32
SYSTEM = pytest.mark.system
BUMPY = pytest.param("relief", marks=SYSTEM)  # takes longer to trace than the others
SMALL = ps.Camera(131.0, 131.0, 79.5, 59.5, 160, 120)
SUN = np.array((-0.7, -0.3, -0.65)) / np.linalg.norm((-0.7, -0.3, -0.65))


def grey(points):
    return np.full(points.shape, 0.5)


def ball_before_wall(albedo=grey):
    return trace([sphere((0.1, 0, 1.2), 0.22, albedo), plane((0, 0, -1), (0, 0, 1.6), albedo)], SMALL)


def shadow_of_the_ball(hits):
    way = np.array((0.1, 0, 1.2)) - hits.points
    along = way @ SUN
    return (hits.surface == 1) & (along > 0) & (np.square(way).sum(-1) - along**2 < 0.22**2)


def samples(hits, shading):
    colors = np.concatenate([hits.albedo * shading[..., None], np.ones((120, 160, 1))], -1).astype(F)
    surfaces = np.concatenate([hits.normals, hits.depth[..., None]], -1).astype(F)
    return PhotoSamples(colors, surfaces, SMALL.rays().astype(F), (160.0, 120.0))


def lit(hits, ambient=0.2):
    return ambient + np.maximum(hits.normals @ SUN, 0) * ~shadow_of_the_ball(hits)


class TestScenes:
    @pytest.mark.parametrize("shapes", [("blobs",), pytest.param(SHAPES, marks=SYSTEM)])
    def test_lit_ones_come_near_the_truth_and_none_gets_worse(self, renderer, shapes):
        found = []
        for shape in shapes:
            for texture in TEXTURES:
                shown = photograph(shape, texture, "sun", 0)
                found.append([relit_psnr(renderer, shown, unlight=on) for on in (False, True)])
        plain, freed = np.array(found).T
        assert freed.mean() > 27.5 and plain.mean() < 21 and (freed - plain).min() > -0.5, found

    @pytest.mark.parametrize(
        ("shape", "light"),
        [
            ("blobs", "ambient"),
            pytest.param("relief", "ambient", marks=SYSTEM),
            ("room", "ambient"),
            ("plane", "sun"),
        ],
    )
    def test_what_does_not_tell_its_light_stays_to_the_bit(self, renderer, shape, light):
        for texture in TEXTURES:
            shown = photograph(shape, texture, light, 0)
            pictures = [renderer.render(shown.frame, shading="none", unlight=on) for on in (False, True)]
            assert (pictures[0] == pictures[1]).all(), (texture, renderer.explain()[-1])

    @pytest.mark.parametrize("shape", ["blobs", BUMPY, "room"])
    def test_the_light_of_the_sky_does_no_harm(self, renderer, shape):
        for texture in TEXTURES:
            shown = photograph(shape, texture, "sky", 0)
            assert relit_psnr(renderer, shown, unlight=True) > relit_psnr(renderer, shown) - 2, texture


class TestShadows:
    def test_cast_shadows_are_found_in_perspective(self):
        hits = ball_before_wall()
        visible = visible_light(samples(hits, lit(hits)).surfaces, SMALL.rays().astype(F), tuple(SUN.tolist()))
        faces = hits.normals @ SUN > 0.2
        dark = shadow_of_the_ball(hits)
        assert dark.sum() > 1000 and (visible[dark] < 0.5).mean() > 0.98
        beyond = hits.points[..., 0] > 0.55  # nearer to the ball, light passes behind it, which no depth picture shows
        assert ((visible < 0.5) & faces & beyond & ~dark).sum() < 0.03 * dark.sum()

    @pytest.mark.parametrize("towards", [(0, 0, -1), (0.6, 0, -0.8), (0, -0.8, -0.6), (0, 0, 1)])
    def test_a_wall_and_a_single_sample_cast_none(self, towards):
        surfaces = np.broadcast_to(np.array((0, 0, -1, 1.5), F), (120, 160, 4))
        visible = visible_light(surfaces, SMALL.rays().astype(F), towards)
        assert visible.min() > 0.5 or towards[2] > 0  # from behind
        assert visible_light(surfaces[:1, :1], SMALL.rays()[:1, :1].astype(F), towards).shape == (1, 1)

    def test_what_lies_in_shadow_gets_the_albedo_of_what_is_lit(self):
        hits = ball_before_wall(lambda points: np.where(points[..., 1:2] > 0, (0.7, 0.4, 0.2), (0.2, 0.3, 0.6)))
        photo = samples(hits, 0.05 + 0.4 * lit(hits, 0.0) + 0.1 * shadow_of_the_ball(hits))  # shadows are uneven
        light = FoundLight(tuple(SUN.tolist()), 0.15, 1.0)
        shading, surely = find_shading(photo, light)
        albedo = photo.brightness - shading
        truth = np.log(hits.albedo @ (0.2126, 0.7152, 0.0722))
        off = albedo - truth - np.median((albedo - truth)[surely == 1])
        for shadow in (shadow_of_the_ball(hits), hits.normals @ SUN < -0.1):
            assert shadow.sum() > 100 and np.abs(off[shadow]).mean() < 0.12, np.abs(off[shadow]).mean()


class TestVotes:
    def test_like_colours_nearby_are_heard(self):
        chance = np.random.default_rng(1)
        is_red = chance.random((60, 80)) < 0.5
        red = np.where(is_red, 0.6, 0.3).astype(F)
        green = np.full((60, 80), 0.2, F)
        values = (np.where(is_red, -1.0, 1.0) + 0.2 * chance.normal(size=(60, 80))).astype(F)
        asked = chance.random((60, 80)) < 0.9
        mean, deviation = ask(values, chance.random((60, 80)) < 0.5, red, green, asked)
        np.testing.assert_allclose(mean[asked], np.where(is_red, -1, 1)[asked], atol=0.15)
        np.testing.assert_allclose(deviation[asked], 0.2, atol=0.08)
        assert not mean[~asked].any() and not deviation[~asked].any()

    def test_far_ones_count_less(self):
        values = np.repeat(np.linspace(-1, 1, 80, dtype=F)[None], 60, 0)
        same = np.full((60, 80), 0.3, F)
        mean, deviation = ask(values, np.ones((60, 80), bool), same, same, np.ones((60, 80), bool))
        assert mean[30, 0] < -0.3 < 0.3 < mean[30, -1] and (np.diff(mean[30]) > 0).all() and deviation.min() > 0.2

    def test_where_no_colour_is_alike_all_are_heard(self):
        same = np.full((20, 30), 0.3, F)
        other = same.copy()
        other[:, 15:] = 0.8
        mean, _ = ask(np.full((20, 30), 0.7, F), same == other, other, same, np.ones((20, 30), bool))
        np.testing.assert_allclose(mean, 0.7, atol=1e-3)


class TestStreams:
    def photo(self, towards=SUN):
        hits = ball_before_wall()
        return samples(hits, 0.2 + np.maximum(hits.normals @ towards, 0))

    def test_a_stream_keeps_its_light_in_the_world(self):
        photo, lights = self.photo(), StreamLights()
        turned = np.eye(4)
        turned[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
        found = lights.find(photo, "stream", np.eye(4))
        assert found.is_shown
        again = lights.find(self.photo(SUN * (-1, 1, 1)), "stream", turned)  # whatever this frame shows
        np.testing.assert_allclose(again.direction, turned[:3, :3].T @ found.direction, atol=1e-6)
        assert again.strength == found.strength

    def test_frames_of_their_own_are_looked_at_alone(self):
        lights, other = StreamLights(), self.photo(SUN * (-1, 1, 1))
        lights.find(self.photo(), None, np.eye(4))
        assert lights.find(other, None, np.eye(4)) == fit_light(other.unclipped, other.surfaces)

    def test_another_light_is_noticed_after_a_while(self):
        lights, other = StreamLights(), self.photo(SUN * (-1, 1, 1))
        lights.find(self.photo(), "stream", np.eye(4))
        directions = [lights.find(other, "stream", np.eye(4)).direction[0] for _ in range(PATIENCE + 1)]
        assert directions[0] < 0 < directions[-1] and sum(x < 0 for x in directions) == PATIENCE - 1
