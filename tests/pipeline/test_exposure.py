"""Exposure: stops by which all light is multiplied, and a picture that is as bright as its photograph."""

import shlex
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.estimation.light_fit import brightness, stops_to_match
from pointshade_gl.notes.notes import taken
from pointshade_gl.page import draw_page
from pointshade_gl.page.page_contents import Showing
from pointshade_gl.renderer.series import jobs_of, write_series
from pointshade_gl.scene.graph import shaded
from pointshade_gl.scene.settings import FILL
from pointshade_gl.scene.values import linear_to_srgb, srgb_to_linear

from ..support import frames
from ..support.viewing import drag

CAMERA = ps.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
DIM = ps.Light(direction=(1, 1, 2), intensity=0.3)
SIDE = ps.Light(position=(-1.5, -0.5, 0.3))
PLAIN = ps.Material(0.1, 0.6, 0, 32)


@pytest.fixture(scope="module")
def noisy():
    """A wavy wall in all greys, in the noise of a sensor."""
    random = np.random.default_rng(1)
    v, u = np.mgrid[0:240, 0:320] / 320.0
    depth = 1.5 + 0.1 * np.sin(9 * u) + 0.1 * v + random.normal(0, 0.006, u.shape)
    grey = 60 + 130 * u + random.uniform(0, 30, u.shape)
    return ps.Frame(np.repeat(grey.astype(np.uint8)[..., None], 3, 2), depth.astype(np.float32), CAMERA)


def middle(picture):
    """Median of the mean of the channels of what is drawn, 0 to 255."""
    return np.median(picture[picture[..., 3] > 0][:, :3].mean(-1))


@pytest.mark.parametrize("gain", [0.01, 0.3, 1, 40])
def test_stops_are_those_of_the_median(gain):
    photograph = np.ones((60, 80, 4), np.float32)
    photograph[..., :3] = srgb_to_linear(np.random.default_rng(1).uniform(0.1, 0.6, (60, 80, 3)))
    lit = photograph * np.float32([gain, gain, gain, 1])
    lit[:20, :, :3] = 0  # where no light falls
    stops = stops_to_match(lit, photograph)
    assert stops == pytest.approx(-np.log2(gain), abs=0.01) and stops == round(stops, 2)
    assert brightness(photograph[..., :3].reshape(-1, 3).T) == pytest.approx(
        np.median(linear_to_srgb(photograph[..., :3]).mean(-1))
    )
    assert stops_to_match(0 * lit, photograph) == stops_to_match(lit, 0 * photograph) == 0


SCENES = {
    "frame": lambda: frames.sphere(),
    "mesh of a frame": lambda: frames.sphere(),
    "scene": lambda: ps.load_scene("demo"),
}


@pytest.mark.parametrize(
    ("samples", "name"),
    [
        *((1, name) for name in SCENES),
        (3, "frame"),
        *(pytest.param(3, name, marks=pytest.mark.system) for name in SCENES if name != "frame"),
    ],
)
def test_a_stop_is_twice_the_light_of_lamps_and_of_the_surroundings(renderer, name, samples):
    """As lights and ambient light that are twice as strong; nothing is cut off before."""
    source = SCENES[name]()
    options = {"samples": samples}
    if isinstance(source, ps.Scene):
        lights = [replace(light, intensity=2 * light.intensity) for light in source.lights]
        stronger = replace(source, ambient=tuple(2 * a for a in source.ambient))
        one = renderer.render(source, exposure=1, **options)
        assert (one == renderer.render(stronger, light=lights, **options)).all() and len(lights) > 0
        return
    options |= {"splat": "mesh"} if name.startswith("mesh") else {}
    for shading in ("phong", "gouraud", "flat"):
        one = renderer.render(source, DIM, shading=shading, exposure=1, **options)
        stronger = replace(DIM, intensity=0.6), ps.Material(ambient=0.2)
        assert (renderer.render(source, *stronger, shading=shading, **options) == one).all(), shading
        assert middle(one) > middle(renderer.render(source, DIM, shading=shading, **options))
    photograph = renderer.render(source, shading="none", **options)
    assert (renderer.render(source, shading="none", exposure=2, **options) == photograph).all()


def test_shadows_on_a_ground_stay_as_dark(renderer):
    box = frames.sphere()
    pictures = [
        renderer.render(box, samples=4, ground=(0, -1, 0), ground_height=-0.6, exposure=stops) for stops in (0, 2)
    ]
    difference = pictures[0][..., 3].astype(int) - pictures[1][..., 3]
    assert np.abs(difference).max() <= 1 and (pictures[0][..., 3] > 0).any()


@pytest.mark.parametrize("light", [None, SIDE, DIM, ps.Light(position=(-0.5, -0.5, 0.2), shadow=True)])
@pytest.mark.parametrize("more", [{}, {"splat": "mesh"}, {"shading": "gouraud"}, {"material": PLAIN}])
def test_auto_is_as_bright_as_the_photograph(renderer, noisy, light, more):
    picture = renderer.render(noisy, light, exposure="auto", **more)
    found, fill = renderer.exposure, renderer.fill
    assert middle(picture) == pytest.approx(middle(renderer.render(noisy, shading="none")), rel=0.03)
    again = renderer.render(noisy, light, exposure=found, fill=fill, **more)  # by its light pass: the same to one step
    assert np.abs(again.astype(int) - picture).max() <= 1 and found


def test_auto_of_scenes_and_of_several_frames(renderer, noisy):
    demo = ps.load_scene("demo")
    picture = renderer.render(demo, exposure="auto")
    assert renderer.exposure
    unlit = renderer.render(shaded(demo, "none"))
    assert middle(picture) == pytest.approx(middle(unlit), rel=0.05)
    views = renderer.render([noisy, noisy], DIM, exposure="auto")
    assert middle(views) == pytest.approx(middle(renderer.render(noisy, shading="none")), rel=0.05)


def test_turning_keeps_it_and_another_light_finds_it_again(noisy):
    with ps.Renderer() as made:
        pose = ps.orbit_pose(None, (0, 0, 1.5), yaw=60)
        made.render(noisy, SIDE, pose=pose, exposure="auto")
        away = made.exposure
        made.render(noisy, SIDE, exposure="auto")
        assert made.exposure == away and made.steps.counts["exposure"] == 1
        made.render(noisy, DIM, exposure="auto")
        assert made.exposure > away and made.steps.counts["exposure"] == 2
        made.render(noisy, exposure="auto")
        from_front = made.exposure
        made.render(noisy, pose=pose, exposure="auto")  # the default light turns with who looks
        assert made.exposure == from_front
        made.render(noisy)
        assert made.exposure == 0 and made.steps.counts["exposure"] == 3


def test_nothing_runs_unless_it_is_asked_for(noisy):
    with ps.Renderer() as made:
        plain = made.render(noisy)
        assert made.steps.counts["exposure"] == 0
        assert (made.render(noisy, exposure=0.0) == plain).all()


def test_sensor_changes_nothing_of_a_frame_without_colours(renderer, noisy):
    bare = ps.Frame(None, noisy.depth, noisy.camera)
    with taken() as notes:
        picture = renderer.render(bare, exposure="sensor")
    assert not [note for note in notes if "photograph" in note]
    assert np.array_equal(picture, renderer.render(bare))


def test_sensor_is_auto_for_noise_and_0_without(renderer, noisy):
    with taken() as notes:
        picture = renderer.render(noisy, exposure="sensor")
        found = renderer.exposure
        again = renderer.render(noisy, exposure="auto")
        assert np.abs(again.astype(int) - picture).max() <= 1 and found == renderer.exposure
        for clean in (frames.sphere(), ps.load_scene("demo"), ps.Scene((ps.Node(ps.PointObject(noisy)),), CAMERA)):
            renderer.render(clean, exposure="sensor")
            assert renderer.exposure == 0
        renderer.render(noisy, exposure="sensor", shading="none")
        assert renderer.exposure == 0
    assert len(notes) == 1 and f"{found:+g} stops" in notes[0] and "exposure=0" in notes[0]


@pytest.mark.parametrize("wrong", ["bright", "", None, float("nan"), 33, True, [1]])
def test_other_exposures_are_refused(wrong):
    if wrong is None:
        with pytest.raises(TypeError, match="exposure must be stops"):
            ps.OutputSettings(exposure=wrong)  # type: ignore[arg-type]
        return
    with pytest.raises((ValueError, TypeError), match="exposure must be stops from -32 to 32, auto or sensor"):
        ps.render(frames.sphere(), exposure=wrong)


@pytest.fixture
def folder(noisy, tmp_path):
    """The noisy frame in files; its line of `typed` names it."""
    Image.fromarray(noisy.color).save(tmp_path / "color.png")
    np.save(tmp_path / "depth.npy", noisy.depth)
    (tmp_path / "intrinsics.txt").write_text("262.5 0 159.5\n0 262.5 119.5\n0 0 1\n")
    return tmp_path


def test_a_still_of_the_command_line_is_exposed_and_a_note_says_how(typed, folder, renderer, noisy):
    line = f"render {shlex.quote(str(folder))} --samples 1 --intrinsics 262.5,262.5,159.5,119.5 -o"
    code, _, errors = typed(f"{line} out.png")
    assert code == 0 and "--exposure 0 leaves the lights as given" in errors, errors
    assert typed(f"{line} off.png --exposure 0")[0] == 0
    code, _, errors = typed(f"{line} wrong.png --exposure bright")
    assert code == 2 and "--exposure must be stops" in errors
    with Image.open("out.png") as out, Image.open("off.png") as off:
        lit, plain = np.asarray(out), np.asarray(off)
    assert (plain == renderer.render(noisy)).all()
    assert middle(lit) == pytest.approx(middle(renderer.render(noisy, shading="none")), rel=0.05)


@pytest.mark.parametrize("turntable", ["light", "camera"])
def test_a_film_has_the_exposure_of_its_first_picture(renderer, noisy, tmp_path, turntable):
    view = ps.View(finish=ps.OutputSettings(exposure="auto"), picture_size=(80, 60))
    jobs, _ = jobs_of(noisy, view, turntable, 3, lambda _: None)
    requests = [request for _, request in jobs]
    renderer.render(requests[0])
    finish = ps.OutputSettings(exposure=renderer.exposure, fill=renderer.fill)
    expected = [renderer.render(replace(one, finish=finish)).astype(int) for one in requests]
    write_series(renderer, ((k, one) for k, one in enumerate(requests)), tmp_path / "%04d.png", 25)
    for k, picture in enumerate(expected):
        with Image.open(tmp_path / f"{k:04d}.png") as found:
            assert np.abs(np.asarray(found) - picture).max() <= 1


def test_a_window_begins_as_bright_and_stays_so_as_the_light_moves(open_viewer, noisy):
    viewer = open_viewer(noisy)
    viewer.step(wait=False)
    found = viewer.renderer.exposure
    assert found and viewer.document.metered == (found, FILL) == (found, viewer.renderer.fill)
    drag(viewer, (160, 120), (60, 40), "right")
    viewer.step(wait=False)
    assert viewer.renderer.exposure == found and viewer.renderer.fill == FILL


def linear(picture):
    return srgb_to_linear(picture[..., :3] / 255)


def test_a_photograph_stays_above_the_fill_and_white_does_not_burn(renderer, noisy):
    """Lit along the wall, whose waves turn away from the light."""
    photograph, along = linear(renderer.render(noisy, shading="none")), ps.Light(direction=(1, 0, 0.1))
    assert np.quantile(linear(renderer.render(noisy, along)) / photograph, 0.1) < 0.15
    for exposure in ("sensor", "auto"):
        lit = renderer.render(noisy, along, exposure=exposure)
        assert (linear(lit) > FILL * photograph).mean() > 0.999 and renderer.fill == FILL
        assert (lit[..., :3] == 255).mean() < 0.01
    for options in (
        {"exposure": 0.5},
        {"exposure": "auto", "unlight": True},
        {"exposure": "auto", "environment": "sky"},
    ):
        renderer.render(noisy, along, **options)
        assert renderer.fill == 0
    renderer.render(frames.sphere(), exposure="auto")
    assert renderer.fill == 0


def test_fill_mixes_a_share_of_the_own_colours_in(renderer):
    sphere = frames.sphere()
    shiny = {"material": ps.Material(specular=0.25)}
    own, plain = (linear(renderer.render(sphere, **more)) for more in ({"shading": "none"}, shiny))
    for fill in (0, 0.4, 1):
        found = linear(renderer.render(sphere, fill=fill, **shiny))
        assert np.abs(found - (fill * own + (1 - fill) * plain)).max() < 0.009  # two half steps of 8 bits, near white
    without = {"material": ps.Material(ambient=0)}
    assert (renderer.render(sphere, fill=0.5, **without) == renderer.render(sphere, **without)).all()
    with pytest.raises(ValueError, match="fill must be"):
        renderer.render(sphere, fill=1.5)


@pytest.mark.parametrize("shading", ["phong", "gouraud"])
def test_a_photograph_has_its_own_highlights_alone_unless_a_material_is_chosen(renderer, shading):
    sphere = frames.sphere()
    black = ps.Frame(np.full((*sphere.depth.shape, 3), 10, np.uint8), sphere.depth, sphere.camera)

    def brightest(**options):
        return renderer.render(black, shading=shading, **options)[..., :3].max()

    assert brightest() > 100 and brightest(fill=0.5, material=ps.Material(specular=0.2)) > 60
    assert brightest(fill=0.5) <= 11


def test_a_page_carries_the_factor_of_the_still(renderer, noisy, monkeypatch):
    written = []
    own = Showing.values
    monkeypatch.setattr(Showing, "values", lambda self, *points: written.append(own(self, *points)) or written[0])
    text = draw_page(renderer, noisy, title="", exposure="auto")
    assert f'"fill":{FILL}' in text and f'"material":[{(1 - FILL) * 0.1 + FILL:g},' in text
    assert renderer.exposure and f'"exposure":{2.0**renderer.exposure}' in text
    assert '"exposure":1.0' in draw_page(renderer, noisy, title="")
