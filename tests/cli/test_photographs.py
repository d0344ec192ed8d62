"""`--depth-model` as a newcomer types it: a photograph, a film, a batch, a page."""

import json

import numpy as np
import pytest
from PIL import Image

from ..support.networks import node, save_constant, save_mean, save_network

pytestmark = pytest.mark.usefixtures("renderer")


@pytest.fixture
def place(tmp_path):
    """A photograph, a folder of three, and small networks: relative, in metres with a camera, and one that is none."""
    v, u = np.mgrid[:48, :64]
    photo = np.stack([60 + 2 * u, 100 + v, 90 + u], axis=2).astype(np.uint8)
    Image.fromarray(photo).save(tmp_path / "photo.jpg")
    (tmp_path / "photos").mkdir()
    for k in range(3):
        Image.fromarray(np.roll(photo, 3 * k, axis=1)).save(tmp_path / f"photos/{k}.jpg")
    save_mean(tmp_path / "depth_anything_v2.onnx")
    outputs = {"predicted_depth": (2 + u / 64)[None], "focallength_px": [50]}
    save_constant(tmp_path / "pro.onnx", outputs, (1, 3, 48, 64))
    (tmp_path / "broken.onnx").write_bytes(b"no network")
    return tmp_path


MODEL = "--depth-model depth_anything_v2.onnx"


def test_a_photograph_is_drawn_at_its_own_size(typed, place):
    code, output, errors = typed(f"render photo.jpg {MODEL} -o out.png")
    assert code == 0 and "64x48 pixels" in output
    assert "depth_anything_v2.onnx is taken as Depth Anything, by its names: input 686x518 with imagenet" in errors
    assert "pass --model-size WxH, --model-pixels imagenet or symmetric or unit or bytes or --depth-kind" in errors


def test_info_tells_what_the_network_made(typed, place):
    code, output, _ = typed("info photo.jpg --depth-model pro.onnx --json")
    facts = json.loads(output)
    assert code == 0 and facts["depth"]["file"] == "pro.onnx" and facts["camera"]["fx"] == 50
    assert facts["depth"]["range"] == pytest.approx([2, 2.984375], rel=1e-4)


@pytest.mark.parametrize("output", ["film.mp4", "%02d.png", "film.gif"])
def test_a_folder_of_photographs_is_a_film(typed, place, output):
    code, out, _ = typed(f"render photos {MODEL} -o {output}")
    assert code == 0 and "3 pictures of 64x48 pixels" in out


@pytest.mark.system
def test_what_a_video_shows_is_drawn(typed, place):
    assert typed("render vase -o film.mp4 --turntable light --frames 3 --picture-size 64x48")[0] == 0
    code, out, _ = typed(f"render film.mp4 {MODEL} -o again%d.png --cache")
    assert code == 0 and "3 pictures of 64x48" in out and len(list((place / ".pointshade").iterdir())) == 3


@pytest.mark.parametrize("command", ["normals photo.jpg", "depth photo.jpg"])
def test_other_commands_take_it_too(typed, place, command):
    assert typed(f"{command} {MODEL} -o out.png" if "depth" not in command else f"{command} {MODEL} -o out.npy")[0] == 0


def test_a_page_holds_the_photograph_as_an_object(typed, place):
    code, out, _ = typed("render photo.jpg --depth-model pro.onnx -o out.html")
    assert code == 0 and "a page of" in out and (place / "out.html").stat().st_size > 10_000


@pytest.mark.system
def test_a_batch_of_photographs(typed, place):
    code, out, errors = typed(f"batch photo.jpg photos {MODEL} -o out")
    assert code == 0 and "4 written" in out, errors
    assert sorted(path.name for path in (place / "out").rglob("*.png")) == [
        "0000.png",
        "0001.png",
        "0002.png",
        "photo.png",
    ]
    code, out, _ = typed(f"batch photo.jpg photos {MODEL} -o out")
    assert code == 0 and "4 there" in out
    save_network(
        place / "depth_anything_v2.onnx", [node("ReduceMax", "image", "depth", axes=[1], keepdims=0)], ["depth"]
    )
    code, _, errors = typed(f"batch photo.jpg photos {MODEL} -o out")
    assert code == 2 and "were made from other input" in errors, "another network makes other depth"


WRONG = [
    ("render photo.jpg --depth-model broken.onnx -o out.png", "broken.onnx is no network that ONNX Runtime can read"),
    ("render photo.jpg --depth-model none.onnx -o out.png", "--depth-model: none.onnx does not exist"),
    ("render photo.jpg --depth-model photo.jpg -o out.png", "--depth-model must be an .onnx file"),
    (f"render photo.jpg {MODEL} --model-size large -o out.png", "--model-size must be WIDTHxHEIGHT in pixels"),
    (f"render photo.jpg {MODEL} --model-pixels rgb -o out.png", "unknown --model-pixels 'rgb': known are imagenet"),
    (f"render photo.jpg {MODEL} --scale-frames none -o out.png", "unknown --scale-frames 'none': known are auto, keep"),
    ("render photo.jpg --cache -o out.png", "--cache is about a network: pass it as --depth-model FILE"),
    (f"render depth_anything_v2.onnx {MODEL} -o out.png", "depth_anything_v2.onnx is not a picture"),
    (
        f"render demo {MODEL} -o out.png",
        "demo is a scene, which names the files of its frames: leave out --depth-model",
    ),
    ("render photo.jpg -o out.png", "photo.jpg is a photograph: a network makes its depth: download model.onnx of"),
    ("render photos -o out.png", "0.jpg is a photograph: a network makes its depth: download model.onnx of"),
]


@pytest.mark.parametrize(("line", "says"), WRONG, ids=[says for _, says in WRONG])
def test_what_cannot_be_is_one_sentence(typed, place, line, says):
    code, _, errors = typed(line)
    assert code == 2 and says in errors.splitlines()[-1], errors
    assert errors.splitlines()[-1].startswith("pointshade: ")


def test_the_sentence_about_a_photograph_leads_to_a_command_that_works(typed, place):
    errors = typed("render photo.jpg -o out.png")[2]
    (place / "depth_anything_v2.onnx").rename(place / "model.onnx")
    words = errors.partition("and pass ")[2].partition(";")[0]
    assert words == "--depth-model model.onnx" and typed(f"render photo.jpg {words} -o out.png")[0] == 0
