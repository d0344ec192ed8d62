"""P tells the command line that makes the same picture: each test runs that line, and compares the two."""

import shlex
from dataclasses import fields, replace
from functools import partial
from importlib.util import find_spec

import numpy as np
import pytest
from PIL import Image
from typer.main import get_command

import pointshade_gl as ps
from pointshade_gl.cli import main as cli
from pointshade_gl.cli.command_lines import Typed, render_line, words_of
from pointshade_gl.cli.option_groups import AppearanceGroup
from pointshade_gl.cli.options import FrameOptions, ViewOptions
from pointshade_gl.files.frame_sources import load_any, open_source
from pointshade_gl.scene.orbit import State
from pointshade_gl.viewer.controller import as_kind, placed
from pointshade_gl.viewer.events import Command, RemoveLight

from ..support.posed_views import corner, disturbed, views
from ..support.radiance_files import mantissas, radiance_file
from ..support.view_sets import pose_at, seen_from, write_views
from ..support.viewing import drag, move, press, quiet


@pytest.fixture
def reopened(typed, monkeypatch):
    """reopened(words) runs `pointshade view` with these words: the picture of its window, at rest."""
    seen = []

    def look(viewer):
        viewer.background.grace = 60.0
        while viewer.document.playback.is_merging:
            viewer.step()
        viewer.step(wait=False)
        picture = viewer.picture
        seen.append(viewer.screen.read(picture, picture.most_samples(viewer.samples)).astype(int))
        viewer.release()

    def run(words):
        monkeypatch.setattr("pointshade_gl.viewer.Viewer.run", look)
        code, _, errors = typed(shlex.join(["view", *words]))
        assert code == 0 and f"-o {words[-1]} is left out" in errors, errors
        return seen.pop()

    return run


@pytest.fixture
def again(typed, capsys, tmp_path, reopened):
    """again(viewer) presses P, runs the line that it prints, with `render` and with `view`, and compares the pictures:
    the words of the line.

    A window whose views changed keeps how far they were found to agree as long as that is nearly right
    (estimation/multi_view.py): `but` says how large a share of the pixels may then differ.
    """

    def run(viewer, but=0.0):
        capsys.readouterr()
        press(viewer, "P")
        saved, line = capsys.readouterr().out.splitlines()
        assert saved.startswith(str(tmp_path)) and viewer.window.pasted() == line
        words = shlex.split(line)
        assert words[:2] == ["pointshade", "render"] and words[-2:] == ["-o", saved.rpartition("/")[2]]
        code, _, errors = typed(shlex.join([*words[1:-1], "again.png"]))
        assert code == 0, errors
        with Image.open(saved) as one, Image.open(tmp_path / "again.png") as other:
            pictures = [np.asarray(picture).astype(int) for picture in (one, other)]
        assert pictures[0][..., 3].any() and pictures[0].shape == pictures[1].shape
        pictures.append(reopened(words[2:]))
        for other in pictures[1:]:
            assert pictures[0].shape == other.shape
            assert (np.abs(pictures[0] - other).max(-1) > 1).mean() <= but
        return words[2:-2]

    return run


def line_of(*inputs, options=()):
    """The command line of a window that was opened with these words."""
    return partial(render_line, Typed(inputs, options))


def open_vase(open_viewer, **options):
    return open_viewer(load_any("vase"), command_line=line_of("vase"), **options)


class TestVase:
    @pytest.mark.system
    def test_as_it_is_opened_with_the_panel_or_without(self, open_viewer, again):
        viewer = open_vase(open_viewer, window_size=(640, 480))
        words = again(viewer)
        assert words[:2] == ["vase", "--light"] and "--picture-size" not in words and "--pose" not in words
        if find_spec("imgui_bundle"):
            press(viewer, "G")
            assert viewer.panel_width and again(viewer) == words

    def test_turned_and_zoomed_it_is_named_by_yaw_pitch_and_dolly(self, open_viewer, again):
        viewer = open_vase(open_viewer)
        drag(viewer, (160, 120), (190, 100))
        viewer.state = viewer.state.zoomed(2.5)
        words = again(viewer)
        assert {"--yaw", "--pitch", "--dolly"} <= set(words) and words[words.index("--picture-size") + 1] == "320x240"

    @pytest.mark.system
    def test_panned_and_refined_it_is_named_by_its_pose(self, open_viewer, again):
        viewer = open_vase(open_viewer)
        viewer.samples = 5
        drag(viewer, (160, 120), (150, 100))
        drag(viewer, (160, 120), (190, 130), ctrl=True)
        words = again(viewer)
        assert "--pose" in words and words[words.index("--samples") + 1] == "5"

    @pytest.mark.system
    def test_lit_by_another_light_with_a_shadow(self, open_viewer, again):
        viewer = open_vase(open_viewer)
        move(viewer, (160, 120), (250, 40))
        press(viewer, "S")
        viewer.state = replace(viewer.state, light_color=(1.0, 0.6, 0.3), light_intensity=1.3)
        viewer.held = replace(viewer.held, radius=0.05)
        viewer.samples = 3
        words = again(viewer)
        assert "shadow=yes" in words[words.index("--light") + 1]

    def test_with_an_unusual_look(self, open_viewer, again):
        look = ps.Appearance(
            ps.Material(0.3, 0.7, 0.5, 12.5), "central", "flat", 1.5, splat="round", max_depth_step="2%", noise=0.002,
            flying="snap", unlight=True, remove_highlights=True,
        )  # fmt: skip
        words = again(open_vase(open_viewer, state=State(look=look)))
        assert {"--splat", "--flying", "--unlight", "--remove-highlights", "--max-depth-step"} <= set(words)

    @pytest.mark.parametrize(
        "look", [ps.Appearance(splat="mesh", shading="gouraud"), ps.Appearance(point_size="fill", noise="kinect")]
    )
    def test_as_a_mesh_and_filled(self, open_viewer, again, look):
        again(open_vase(open_viewer, state=State(look=look)))

    def test_unlit(self, open_viewer, again):
        viewer = open_vase(open_viewer, state=State(look=ps.Appearance(unlight=True)))
        drag(viewer, (160, 120), (190, 100))
        press(viewer, "B")
        words = again(viewer)
        assert words[words.index("--shading") + 1] == "none" and not {"--light", "--unlight"} & set(words)

    @pytest.mark.system
    def test_with_eye_dome_lighting(self, open_viewer, again):
        viewer = open_vase(open_viewer)
        drag(viewer, (160, 120), (190, 100))
        press(viewer, "5")
        words = again(viewer)
        assert words[words.index("--shading") + 1] == "edl" and "--light" not in words

    @pytest.mark.parametrize("presses", [1, 2, 3])
    def test_where_colours_are_no_light(self, open_viewer, again, presses):
        viewer = open_vase(open_viewer, state=State(look=ps.Appearance(shading="gouraud", unlight=True)))
        drag(viewer, (160, 120), (190, 100))
        press(viewer, *["V"] * presses)
        words = again(viewer)
        assert words[words.index("--show") + 1] == ("normals", "depth", "certainty")[presses - 1]
        assert "--light" not in words

    @pytest.mark.system
    def test_under_an_environment(self, open_viewer, again, tmp_path):
        finish = ps.OutputSettings(
            environment="sky", environment_intensity=0.7, ambient_occlusion=False, tone="neutral"
        )
        viewer = open_vase(open_viewer, state=State(finish=finish))
        drag(viewer, (100, 100), (160, 100), "right")
        words = again(viewer)
        at = words.index("--environment")
        assert words[at + 1] == "sky" and {"--light", "--environment-intensity"} < set(words)
        assert words[words.index("--ambient-occlusion") + 1] == "no" and "30" in words
        assert words[words.index("--tone") + 1] == "neutral"
        (tmp_path / "a.hdr").write_bytes(radiance_file(mantissas(np.full((8, 16, 3), 0.5))))
        viewer.state = viewer.state.with_finish(environment=ps.load_environment("a.hdr"))
        words = again(viewer)
        assert words[words.index("--environment") + 1] == "a.hdr"

    def test_what_no_words_say_about_an_environment_is_told(self, open_viewer, typed):
        unnamed = ps.OutputSettings(environment=np.ones((4, 8, 3)), environment_rotation=np.eye(3))
        viewer = open_vase(open_viewer, state=State(finish=unnamed))
        press(viewer, "P")
        assert "it leaves out: its environment; how its environment is turned" in viewer.messages.text

    @pytest.mark.system
    def test_with_several_lights_of_all_kinds(self, open_viewer, again):
        lights = [
            ps.Light(position=(-0.5, -0.4, 0.2), attenuation=(1, 0.1, 0.2), radius=0.02, shadow=True),
            ps.Light(position=(0.4, -0.5, 0.2), direction=(-0.3, 0.3, 1), cone=(10, 40), color=(0.2, 0.5, 1)),
            ps.Light(direction=(1, 1, 2), angle=2, intensity=0.4),
            ps.Light((0.4, -0.5, 0.1), (-0.4, 0.5, 1), size=(0.3, 0.1), watts=2, shadow=True),
        ]
        viewer = open_vase(open_viewer, lights=lights)
        press(viewer, "TAB")
        words = again(viewer)
        assert words.count("--light") == 4


class TestMoreLights:
    @pytest.mark.parametrize("kind", ["point", "area"])
    def test_that_were_added_and_placed(self, open_viewer, again, kind):
        viewer = open_vase(open_viewer)
        viewer.moment = viewer.moment._replace(held=as_kind(viewer.held, kind, 0.3))
        viewer.perform(Command.ADD_LIGHT)
        viewer.moment = placed(viewer.moment, (0.3, -0.4, 0.1), viewer.pose)
        words = again(viewer)
        assert words.count("--light") == 2 and any("0.3,-0.4,0.1" in word for word in words)

    @pytest.mark.system
    def test_of_a_scene_with_one_added_and_one_removed(self, open_viewer, again):
        viewer = open_viewer(load_any("demo"), command_line=line_of("demo"))
        viewer.perform(Command.ADD_LIGHT)
        viewer.perform(RemoveLight(0))
        assert again(viewer).count("--light") == len(viewer.frame.lights)


class TestScene:
    @pytest.mark.system
    def test_as_it_is_opened_with_its_own_lights(self, open_viewer, again, tmp_path):
        lamp = ps.Node(ps.Light(position=(-0.5, -0.4, 0.2), shadow=True), "lamp")
        ball = ps.Mesh([(-1, 0.5, 1), (1, 0.5, 1), (0, -1, 2)], [(0, 1, 2)])
        ps.save_scene(tmp_path / "lit.glb", ps.Scene((ps.Node(ball, "ball"), lamp)))
        viewer = open_viewer(load_any(tmp_path / "lit.glb"), command_line=line_of("lit.glb"))
        assert again(viewer) == ["lit.glb", "--picture-size", "320x240", "--samples", "1"]
        drag(viewer, (160, 120), (190, 110))
        assert "--light" in again(viewer)  # in light mode it goes with the viewer

    @pytest.mark.system
    def test_as_the_demo_is_opened(self, open_viewer, again):
        assert again(open_viewer(load_any("demo"), command_line=line_of("demo")))[0] == "demo"

    @pytest.mark.system
    def test_with_tab_lights_moved_and_shadows_off(self, open_viewer, again):
        viewer = open_viewer(load_any("demo"), command_line=line_of("demo"))
        press(viewer, "TAB")
        move(viewer, (160, 120), (250, 40))
        drag(viewer, (160, 120), (190, 110))
        assert again(viewer).count("--light") == 2
        press(viewer, "S", "2")
        words = again(viewer)
        assert "shadow=no" in words[words.index("--light") + 1] and words[words.index("--shading") + 1] == "flat"

    def test_hidden_nodes_are_said_to_be_missing(self, open_viewer, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        viewer = open_viewer(load_any("demo"), command_line=line_of("demo"))
        path = next(path for path, node in viewer.frame.every_node() if node.name == "column")
        viewer.frame = viewer.frame.with_node(path, visible=False)
        press(viewer, "P")
        assert "that these are hidden: column" in viewer.messages.text


@pytest.fixture
def walk(tmp_path):
    """Five frames with poses, in a folder whose name needs quotes."""
    return write_views(tmp_path / "a walk", [seen_from(pose_at(yaw)) for yaw in (-8, -4, 0, 4, 8)])


class TestFrames:
    OPTIONS = ("--depth-scale", "1000")

    def open(self, open_viewer, walk, **options):
        source = open_source(walk, depth_scale=1000)
        return open_viewer(source, command_line=line_of(str(walk), options=self.OPTIONS), fps=0.01, **options)

    def test_of_a_sequence(self, open_viewer, again, walk):
        viewer = self.open(open_viewer, walk)
        press(viewer, "RIGHT", "RIGHT", "RIGHT")
        drag(viewer, (160, 120), (180, 110))
        words = again(viewer)
        assert words[:5] == [str(walk), *self.OPTIONS, "--frame", str(viewer.document.playback.players[0].index)]

    def merged(self, open_viewer, walk):
        viewer = self.open(open_viewer, walk, views=4)
        while viewer.document.playback.is_merging:
            viewer.step()
        drag(viewer, (160, 120), (180, 110))
        return viewer

    @pytest.mark.system
    def test_merged(self, open_viewer, again, walk):
        viewer = self.merged(open_viewer, walk)
        assert again(viewer)[3:5] == ["--views", ",".join(viewer.frame.names)]

    @pytest.mark.system
    def test_merged_and_some_of_them_off(self, open_viewer, again, walk):
        viewer = self.merged(open_viewer, walk)
        viewer.frame = viewer.frame.switched(1, False)
        assert again(viewer, but=0.001)[3:5] == ["--views", ",".join(viewer.frame.shown_names)]

    @pytest.mark.system
    def test_merged_and_aligned(self, open_viewer, again, tmp_path):
        walk = write_views(tmp_path / "walk", disturbed(views(corner(), 3), 0.02, 0.5))
        state = State(look=ps.Appearance(align=True))
        viewer = self.open(open_viewer, walk, views=2, state=state)
        while viewer.document.playback.is_merging:
            viewer.step()
        assert "--align" in again(viewer, but=0.001) and len(viewer.renderer.aligned) == 2
        viewer.frame = viewer.frame.switched(1, False)
        assert "--align" not in again(viewer, but=0.001)

    @pytest.mark.system
    def test_with_poses_from_a_file(self, open_viewer, again, walk, tmp_path):
        ps.save_poses(tmp_path / "poses.txt", [seen_from(pose_at(yaw)) for yaw in (-7, -3, 1, 5, 9)])
        source, options = open_source(walk, poses=tmp_path / "poses.txt"), ("--poses", str(tmp_path / "poses.txt"))
        viewer = open_viewer(source, command_line=line_of(str(walk), options=options), fps=0.01)
        assert again(viewer)[:3] == [str(walk), *options]

    @pytest.mark.system
    def test_of_several_inputs(self, open_viewer, again, walk, tmp_path):
        other = write_views(tmp_path / "other", [seen_from(pose_at(yaw)) for yaw in (-3, 3)])
        sources = [open_source(folder, depth_scale=1000) for folder in (walk, other)]
        line = line_of(str(walk), str(other), options=self.OPTIONS)
        viewer = open_viewer(sources[0], others=sources[1:], command_line=line, fps=0.01)
        press(viewer, "RIGHT", "RIGHT", "RIGHT")
        words = again(viewer, but=0.005)
        numbers = ",".join(map(str, viewer.document.playback.numbers))
        assert words[:2] == [str(walk), str(other)] and words[words.index("--frame") + 1] == numbers

    @pytest.mark.system
    def test_that_were_dropped_since_are_named_by_their_paths(self, open_viewer, again, walk):
        viewer = open_vase(open_viewer)
        viewer.open([str(walk)])
        assert again(viewer)[:3] == [str(walk), "--frame", str(viewer.document.playback.players[0].index)]
        depth, camera = walk / "depth" / "1.png", walk / "intrinsics.txt"
        viewer.open([str(camera), str(depth)])
        words = again(viewer)
        assert words[0] == str(depth.parent) and words[words.index("--depth") + 1] == str(depth)

    def test_of_a_live_stream_have_no_line_and_that_is_said(self, open_viewer, walk, tmp_path, monkeypatch, capsys):
        monkeypatch.chdir(tmp_path)
        viewer = open_viewer((frame for frame in open_source(walk, depth_scale=1000)), command_line=line_of("live"))
        press(viewer, "SPACE", "P")
        assert len(capsys.readouterr().out.splitlines()) == 1 and "live stream" in viewer.messages.text


def test_a_program_that_names_no_input_gets_the_file_only(open_viewer, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    viewer = quiet(open_viewer())
    press(viewer, "P")
    assert capsys.readouterr().out == f"{tmp_path / 'pointshade_0001.png'}\n"
    assert viewer.messages.text == f"saved {tmp_path / 'pointshade_0001.png'}"


@pytest.mark.parametrize("group", [FrameOptions, AppearanceGroup, ViewOptions])
def test_words_of_options_are_options_of_render(group):
    known = {name for one in get_command(cli.command_line()).commands["render"].params for name in one.opts}
    for field in fields(group):
        value = field.default is False or (["a"] if field.name == "light" else 7.25)
        named = [word for word in words_of(replace(group(), **{field.name: value})) if word.startswith("--")]
        assert set(named) <= known and named == ([] if field.name == "input" else [f"--{field.name.replace('_', '-')}"])
    assert words_of(group()) == []
