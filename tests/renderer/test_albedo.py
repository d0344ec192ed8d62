"""Several photographs of one view under several lights give one albedo."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.bench.tracing import decode, encode

from ..support.lit_photographs import CAMERA, photograph

LIGHTS = [(-0.7, -0.2, -0.7), (0.6, -0.5, -0.6), (0.2, 0.6, -0.8)]


def photographs(exposures=(0.8, 0.5, 0.65), specular=0.0):
    """Photographs of blobs, each under its own light and with its own exposure; and their albedo, linear."""
    hits = photograph("blobs", "patches", "ambient", 1).hits
    to_eye = -hits.points / np.linalg.norm(hits.points, axis=-1, keepdims=True)
    depth = np.where(hits.surface >= 0, hits.depth, 0)
    frames = []
    for towards, exposure in zip(LIGHTS, exposures, strict=True):
        towards = np.array(towards) / np.linalg.norm(towards)
        facing = (hits.normals @ towards)[..., None]
        mirrored = 2 * facing * hits.normals - towards
        glint = np.maximum((mirrored * to_eye).sum(-1, keepdims=True), 0) ** 20 * (facing > 0)
        linear = exposure * (hits.albedo * (0.2 + np.maximum(facing, 0)) + specular * glint)
        frames.append(ps.Frame(np.round(encode(np.clip(linear, 0, 1))).astype(np.uint8), depth, CAMERA))
    return frames, hits.albedo


def error(picture, albedo):
    """Mean difference of log brightness, after one exposure."""
    off = np.log(np.maximum(decode(picture[..., :3].astype(float)).mean(-1), 1e-3)) - np.log(albedo.mean(-1))
    return np.abs(off - np.median(off)).mean()


class TestAlbedo:
    def test_it_is_nearer_to_the_truth_than_that_of_any_single_photograph(self, renderer):
        frames, truth = photographs()
        albedo = renderer.estimate_albedo(frames)
        assert albedo.shape == (240, 320, 3) and albedo.dtype == np.uint8
        single = [error(renderer.render(one, shading="none", unlight=True), truth) for one in frames]
        assert error(albedo, truth) < 0.8 * min(single) and error(albedo, truth) < 0.05, (error(albedo, truth), single)

    def test_their_lights_are_found_and_told(self, renderer):
        frames, _ = photographs()
        renderer.estimate_albedo(frames)
        found = renderer._pipeline.gpu_scene.photo_lights
        for light, towards in zip(found, LIGHTS, strict=True):
            assert np.dot(light.direction, towards) / np.linalg.norm(towards) > np.cos(np.radians(5)), light
        told = renderer.explain()
        assert len(told) == 3 and told[1].startswith("photograph 1: unlight: its light comes from right and above")
        renderer.render(frames[0])
        assert not any("photograph" in line for line in renderer.explain())

    def test_what_one_camera_has_cut_off_is_read_in_the_others(self, renderer):
        frames, truth = photographs((0.8, 1.8, 0.65))
        assert (frames[1].color == 255).mean() > 0.05
        assert error(renderer.estimate_albedo(frames), truth) < 0.05

    def test_highlights_move_with_the_light_and_do_not_count(self, renderer):
        (glossy, _), (matt, _) = photographs(specular=0.5), photographs()
        shown = (
            np.max(
                [np.abs(one.color.astype(int) - two.color).mean(-1) for one, two in zip(glossy, matt, strict=True)], 0
            )
            > 20
        )
        found, truth = (renderer.estimate_albedo(one).astype(int) for one in (glossy, matt))
        off = np.abs(found - truth * np.median(found[~shown] / np.maximum(truth[~shown], 1))).mean(-1)
        assert shown.sum() > 2000 and off[shown].mean() < 9, (shown.sum(), off[shown].mean())

    @pytest.mark.parametrize(
        ("change", "said"),
        [
            (lambda a, b: [a], "must be two or more, got 1"),
            (lambda a, b: [a, replace(b, color=None)], "must have colours, frame 1 has none"),
            (lambda a, b: [a, ps.Frame(b.color[:-1], b.depth, b.camera)], r"colours of the shape \(240, 320\) of the"),
            (lambda a, b: [a, ps.Frame(b.color, b.depth[:, ::2], CAMERA.resized(160, 240))], r"depth of the shape"),
            (lambda a, b: [a, ps.Frame(b.color, b.depth, replace(CAMERA, fx=300.0))], "the camera"),
            (lambda a, b: [a, replace(b, pose=np.diag([-1.0, 1, -1, 1]))], "one pose, that of frame 1"),
        ],
    )
    def test_photographs_of_different_views_are_refused(self, renderer, change, said):
        with pytest.raises(ValueError, match=said):
            renderer.estimate_albedo(change(*photographs()[0][:2]))


class TestTyped:
    @pytest.fixture
    def folder(self, tmp_path):
        frames, _ = photographs()
        for name in ("color", "depth"):
            (tmp_path / "lights" / name).mkdir(parents=True)
        for k, frame in enumerate(frames):
            ps.save_image(tmp_path / f"lights/color/{k}.png", frame.color)
            np.save(tmp_path / f"lights/depth/{k}.npy", frame.depth)
        return "lights --intrinsics {},{},{},{}".format(*CAMERA.intrinsics)

    def test_the_albedo_and_a_picture_of_it(self, typed, folder, tmp_path, renderer):
        code, said, err = typed(f"albedo {folder} -o albedo.png --explain")
        assert code == 0, err
        assert said.count("its light comes from") == 3 and "320x240 pixels of 3 photographs" in said
        code, _, err = typed(f"render {folder} --unlight-all -o relit.png --shading none")
        assert code == 0, err
        albedo, relit = (np.array(Image.open(tmp_path / name)) for name in ("albedo.png", "relit.png"))
        assert (albedo == relit[..., :3])[relit[..., 3] > 0].all()

    @pytest.mark.parametrize(
        ("line", "said"),
        [
            ("albedo vase -o out.png", "an albedo needs several photographs of one view: pass a folder"),
            ("albedo lights --frame 1 -o out.png", "leave out --frame"),
            ("albedo demo -o out.png", "demo is a scene, expected a frame"),
            ("albedo lights -o out.mp4", "cannot write out.mp4"),
            ("render lights --unlight-all -o %02d.png", "--unlight-all makes one frame of a folder"),
        ],
    )
    def test_what_cannot_be_done_is_said(self, typed, folder, line, said):
        code, _, err = typed(line)
        assert code == 2 and said in err, err
