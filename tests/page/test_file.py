"""The file that save_page writes: one, complete, that asks for nothing, of what it was given and nothing else."""

import base64
import json
import re
import zlib
from html.parser import HTMLParser

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.page import draw_page, write_page
from pointshade_gl.page.parts import FOLDER, SCRIPTS, SCRIPTS_OF, shader_texts

from ..support import frames
from ..support.places import ROOT

pytestmark = pytest.mark.gl
EVIL = "</script><script>alert(1)</script>"


class Tags(HTMLParser):
    """The tags of a page with their attributes, and its title."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.title = [], ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        if self.tags and self.tags[-1][0] == "title" and not self.title:
            self.title = data


@pytest.fixture(scope="module")
def text(renderer):
    return draw_page(renderer, frames.sphere())


def test_it_asks_for_nothing_from_outside(text):
    tags = Tags(text).tags
    links = [attrs[name] for _, attrs in tags for name in ("src", "href", "action", "data") if attrs.get(name)]
    assert links and all(link.startswith("data:") for link in links)
    allowed = ("http://www.w3.org/2000/svg",)  # a name, not an address
    assert set(re.findall(r"https?://[^\s'\"<]+", text)) <= set(allowed)
    assert "import(" not in text and "@import" not in text


@pytest.mark.parametrize("name", ["title", "path"])
def test_no_name_becomes_a_part_of_the_page(renderer, name, tmp_path, text):
    if name == "title":
        page = draw_page(renderer, frames.sphere(), title=EVIL)
    else:
        folder = tmp_path / "a&amp;<b>"
        folder.mkdir()
        ps.save_image(folder / "color.png", np.full((8, 8, 3), 99, np.uint8))
        ps.save_depth(folder / "depth.png", np.full((8, 8), 1, np.float32))
        (folder / "intrinsics.json").write_text('{"fx": 9, "fy": 9, "cx": 4, "cy": 4, "width": 8, "height": 8}')
        page = draw_page(renderer, folder)
    expected = EVIL if name == "title" else "a&amp;<b>"
    assert Tags(page).title == expected
    assert [tag for tag, _ in Tags(page).tags] == [tag for tag, _ in Tags(text).tags]


def test_the_vase_is_small(renderer, tmp_path):
    write_page(renderer, tmp_path / "vase.html", "vase/front")
    write_page(renderer, tmp_path / "small.html", "vase/front", quality="small")
    size, small = ((tmp_path / name).stat().st_size for name in ("vase.html", "small.html"))
    assert size < 1_000_000
    assert small < 0.75 * size


@pytest.mark.parametrize("part", ["frame", "texture"])
def test_colours_of_pure_noise_become_a_small_page(renderer, part):
    """Their JPEG has more than a byte a pixel, for which Pillow has no room."""
    noise = np.random.default_rng(0).integers(0, 255, (240, 320, 3), np.uint8)
    frame = ps.Frame(noise, np.full(noise.shape[:2], 1.5), ps.Camera.from_fov(60, 320, 240))
    corners = np.array([(0, 0, 1), (1, 0, 1), (0, 1, 1)], np.float32)
    mesh = ps.Mesh(corners, np.array([(0, 1, 2)]), uv=corners[:, :2], texture=noise)
    source = frame if part == "frame" else ps.Scene([ps.Node(mesh)], camera=frame.camera)
    assert len(draw_page(renderer, source, quality="small")) > noise[..., 0].size


def test_the_largest_side_makes_it_smaller(renderer):
    sizes = [len(draw_page(renderer, frames.sphere(), largest=largest)) for largest in (2048, 20)]
    assert sizes[1] < sizes[0]


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"quality": "best"}, ValueError, "unknown quality 'best': known are exact, small"),
        ({"quality": 3}, ValueError, "unknown quality 3"),
        ({"title": 3}, TypeError, "title must be a text"),
        ({"largest": 0}, ValueError, "largest"),
        ({"shading": "toon"}, ValueError, "toon"),
        ({"colour": 1}, TypeError, "colour"),
        ({"yaw": 3, "pose": np.eye(4)}, ValueError, "not both"),
    ],
)
def test_what_does_not_fit_is_named_and_nothing_is_written(renderer, tmp_path, options, error, words):
    with pytest.raises(error, match=re.escape(words)):
        write_page(renderer, tmp_path / "a.html", frames.sphere(), **options)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "error", "words"),
    [
        ("a.png", ValueError, "suffix of a page must be .html or .htm"),
        ("no/a.html", FileNotFoundError, "create it first"),
    ],
)
def test_where_no_page_can_be_written_is_said_first(renderer, tmp_path, name, error, words):
    with pytest.raises(error, match=words):
        write_page(renderer, tmp_path / name, "no such file")


def test_shadows_of_noisy_depth_keep_as_far_from_what_they_touch_as_in_render(renderer):
    exact = frames.sphere_before_wall()
    depth = exact.depth + np.random.default_rng(2).normal(0, 0.01, exact.depth.shape).astype(np.float32)
    noisy = ps.Frame(exact.color, depth, exact.camera)
    fine, rough = (float(re.search(r'"contact":([\d.e-]+)', draw_page(renderer, one))[1]) for one in (exact, noisy))
    assert renderer.choice.noise.relative * noisy.scale == pytest.approx(0.01, rel=0.2)
    assert rough == pytest.approx(3 * renderer.choice.noise.relative * noisy.scale)
    assert rough > 1.4 * fine


def test_what_is_left_out_is_said(renderer, capsys):
    lamp = ps.Light(position=(0, -1, 0), radius=0.1, shadow=True)
    draw_page(renderer, frames.sphere(), light=lamp, ground=True, splat="mesh")
    told = capsys.readouterr().err
    assert [word in told for word in ("ground", "hard", "splats")] == [True, False, True]


def test_beside_an_environment_the_mouse_holds_a_lamp_that_is_dark(renderer):
    page = draw_page(renderer, frames.sphere(), environment="sky")
    assert '"intensity":0' in page and '"bands":' in page


def test_the_command_line_writes_it(typed, tmp_path):
    code, out, err = typed(
        "render vase/front -o a.html --picture-size 80x60 --quality small --title Tulips --light -1,-1,0"
    )
    assert (code, err.count("software")) == (0, err.count("note:"))
    assert re.match(r"a.html: a page of 0\.\d\d MB", out)
    assert Tags((tmp_path / "a.html").read_text(encoding="utf-8")).title == "Tulips"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("render -o a.html --quality best", "--quality 'best': known are exact, small"),
        ("render -o a.html --turntable light", "leave out --turntable"),
        ("render -o a.png --quality small", "leave out --quality"),
        ("render -o a.png --title A", "leave out --title"),
    ],
)
def test_the_command_line_says_what_makes_no_sense(typed, tmp_path, line, words):
    code, _, err = typed(line)
    assert code == 2 and words in err
    assert list(tmp_path.iterdir()) == []


def test_the_page_that_the_readme_shows_is_made_of_todays_scripts_and_shaders():
    """Otherwise the README's command makes it anew."""
    page = (ROOT / "assets/readme/vase.html").read_text(encoding="utf-8")
    assert all((FOLDER / name).read_text(encoding="utf-8") in page for name in SCRIPTS)
    packed = re.search(r'id="shaders">([^<]*)<', page)[1]
    assert (FOLDER / SCRIPTS_OF["set"]).read_text(encoding="utf-8") in page  # of all sides
    assert json.loads(zlib.decompress(base64.b64decode(packed))) == shader_texts(["set"])
