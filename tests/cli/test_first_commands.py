"""What a newcomer types first, and next: each sentence leads on to a command that works.

The folders of real frames are the ones beside the repository; for the rest small files are made.
"""

import json
import re
import shutil

import numpy as np
import pytest
from PIL import Image

QUICK = "--samples 1 --picture-size 160x120"  # of a picture that only has to be there
FOLDERS = {  # points, median depth in metres, and what must be said; nothing else is
    "d2nt_3f2n_gt_normals": (102989, 167.041, []),
    "d435_table_exr_halffloat": (728943, 0.582, []),
    "icl_livingroom_23views": (300304, 1.845, ["poses are read from poses_tum.txt", "000.png is taken; `pointshade"]),
    "iphone_lidar_promptda": (49152, 2.654, ["intrinsics.json is for the color of 1920x1440, scaled to the depth's"]),
    "odd_android_depth16": (35997, 11.71, ["are spaced like TUM's: pass --depth-scale 5000"]),
    "odd_color_16bit_rgba": (65536, 2.0, ["disparity_like.exr is taken as disparity, by its name: without --baseline"]),
    "odd_colorised_depth_png": (305687, 2.056, ["depth_true.png is taken as the depth, not depth.png"]),
    "odd_pgm_wrong_endian_kinect2": (51130, 1.071, ["has no colour picture", "wrong byte order, read byte-swapped"]),
    "realsense_box_2": (298949, 0.832, []),
    "realsense_box_6": (296598, 1.282, []),
    "stereo_glass_reflections": (266860, 0.859, []),
    "stereo_metal_floor": (296359, 1.099, []),
    "stereo_skatepark_65520": (259766, None, ["14492 depth values from 65400 to 65535 are taken as missing"]),
    "tum_fr3_kinect1": (248250, 2.415, []),
}


@pytest.mark.data
@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize(
    "name", [name if k % 2 else pytest.param(name, marks=pytest.mark.system) for k, name in enumerate(FOLDERS)]
)
def test_every_folder_of_real_frames_is_drawn_by_its_name_alone(typed, shared_data, name):
    points, median, sentences = FOLDERS[name]
    code, output, errors = typed(f"render '{shared_data / name}' {QUICK} -o out.png")
    assert code == 0 and f" from {points} points" in output
    brighter = " stops, to be as bright as the photograph: "  # for frames with noise; tests/pipeline/test_exposure.py
    usual = "software renderer", brighter, " of the pixels have no depth and are completed"
    notes = [note for note in errors.splitlines() if not any(one in note for one in usual)]
    assert len(notes) == len(sentences) and all(map(str.__contains__, notes, sentences)), notes
    facts = json.loads(typed(f"info '{shared_data / name}' --json")[1])
    assert median is None or facts["depth"]["median"] == pytest.approx(median, abs=0.005)


@pytest.mark.data
def test_the_folder_without_its_file_says_how_to_get_it(typed, shared_data):
    code, _, errors = typed(f"render '{shared_data}/odd_lfs_pointer' -o out.png")
    assert code == 2 and "is a git-LFS pointer, not the file itself: run `git lfs pull` in its" in errors


@pytest.mark.system
@pytest.mark.data
@pytest.mark.usefixtures("renderer")
def test_every_single_file_of_real_frames_is_drawn_or_refused_in_one_sentence(typed, shared_data):
    """A depth picture is drawn, with what lies beside it; photographs, normals, masks and texts never are."""
    for path in sorted(path for path in shared_data.glob("[!i]*/*") if path.is_file()):
        code, output, errors = typed(f"render '{path}' {QUICK} -o out.png")
        is_depth = re.match(r"depth(?!_rgba)|disparity", path.name) and "lfs" not in path.parent.name
        assert code == (0 if is_depth else 2), (path, errors)
        last = errors.splitlines()[-1]
        assert output if is_depth else last.startswith("pointshade: ") and path.name in last and ": " in last[12:]


@pytest.fixture
def place(tmp_path):
    """bare/ with depth and colour and no camera, sequence/ with two frames, and a photograph."""
    v, u = np.mgrid[:48, :64]
    depth = (800 + 10 * u + 20 * v + 150 * (u > 40)).astype(np.uint16)
    photo = np.random.default_rng(7).integers(0, 256, (48, 64, 3)).astype(np.uint8)
    for name, count in (("bare", 1), ("sequence", 2)):
        (tmp_path / name).mkdir()
        for k in range(count):
            number = k if count > 1 else ""
            Image.fromarray(depth).save(tmp_path / name / f"depth{number}.png")
            Image.fromarray(photo).save(tmp_path / name / f"color{number}.png")
    camera = {"width": 64, "height": 48, "fx": 60, "fy": 60, "cx": 31.5, "cy": 23.5, "depth_scale": 1000}
    (tmp_path / "sequence" / "intrinsics.json").write_text(json.dumps(camera))
    Image.fromarray(photo).save(tmp_path / "photo.png")
    shutil.copytree(tmp_path / "bare", tmp_path / "broken")
    (tmp_path / "broken" / "intrinsics.json").write_text("{fx: 60}")


BARE = "render bare -o out.png"
VASE = f"render vase -o out.png {QUICK}"
NEXT = [  # typed, what is said, and what that makes one type next
    (
        BARE,
        "across the longer side is assumed; pass --intrinsics (fx,fy,cx,cy or a file)",
        f"{BARE} --fov 50",
    ),
    (
        f"{BARE} --intrinsics 1,1,31,23",
        "sees 175 degrees: if that is wrong, pass --intrinsics fx,fy",
        f"{BARE} --fov 50",
    ),
    (
        f"{BARE} --fov 50 --depth-scale .001",
        " m: pass --depth-scale 1000",
        f"{BARE} --fov 50 --depth-scale 1000",
    ),
    (f"{BARE} --fov 50 --depth-scale mm", "must be a number, got 'mm' (Depth units per metre", f"{BARE} --fov 50"),
    (f"{BARE} --fov 50 --depth-kind kinect", "beyond 2047; leave out --depth-kind kinect", f"{BARE} --fov 50"),
    (
        f"{BARE} --fov 50 --depth depth.png",
        "(did you mean bare/depth.png?)",
        f"{BARE} --fov 50 --depth bare/depth.png",
    ),
    (
        "render photo.png --fov 50 -o out.png",
        "pass it as --color FILE and its depth as --depth FILE",
        "render --depth bare/depth.png --color photo.png --fov 50 -o out.png",
    ),
    ("render --color photo.png --fov 50 -o out.png", "or --depth FILE", f"{BARE} --color photo.png --fov 50"),
    ("render sequence/intrinsics.json -o out.png", "or the folder that holds it", "render sequence -o out.png"),
    ("render broken -o out.png", "intrinsics.json is not valid JSON", "render broken -o out.png --fov 50"),
    ("render sequence -o out.png", "`pointshade render INPUT -o %04d.png` draws all", "render sequence -o %04d.png"),
    (
        "render sequence -o out.png --frames 2",
        "write an .mp4, a .gif or %04d.png",
        "render sequence -o %04d.png --frames 2",
    ),
    ("render vase out.png -o", "requires an argument", VASE),
    ("render vase -o out.obj", "its suffix must be one of .png, ", VASE),
    (
        "render vase -o out.gif",
        "pass --turntable light or camera",
        "render vase -o out.gif --turntable light --frames 2",
    ),
    (
        f"{VASE} photo.png",
        "got photo.png: pass files as --depth FILE, --color FILE and",
        f"{VASE} --color photo.png",
    ),
    (f"{VASE} --light 1 2 3", "commas and no spaces, as in --light 1,2,3", f"{VASE} --light 1,2,3"),
    (f"{VASE} --shadow", '(did you mean --light "X,Y,Z shadow"?)', f'{VASE} --light "1,2,3 shadow"'),
    (f"{VASE} --lite 1,2,3", "(did you mean --light?)", f"{VASE} --light 1,2,3"),
    (f"{VASE} --yaw ten", "--yaw must be a number, got 'ten'", f"{VASE} --yaw 3"),
    (f"{VASE} --light 1,2", "light position must be three finite numbers", f"{VASE} --light 1,2,3"),
    (f"{VASE} --light 1,2,3,4", "got 4 numbers: (1.0, 2.0, 3.0, 4.0)", f"{VASE} --light 1,2,3"),
    (f"{VASE} --method star", "(did you mean --normals?)", f"{VASE} --normals star"),
    ("info vase --yaw 3", "only in `pointshade render`, `pointshade normals`,", f"{VASE} --yaw 3"),
    ("normals vase -o n.txt", ".npy, .exr", "normals vase -o n.npy"),
    ("info -o sheet.png", "as in `pointshade info vase -o sheet.png`", "info vase -o sheet.png"),
    ("help", "`pointshade --help` explains them", "--help"),
]


@pytest.mark.usefixtures("place", "renderer")
def test_the_picture_of_one_command_is_not_the_colour_of_the_next(typed, tmp_path):
    (tmp_path / "bare" / "color.png").unlink()
    for what in ("bare", "bare/depth.png"):
        for name in ("out.png", "out2.png"):
            assert typed(f"render {what} --fov 50 -o bare/{name}")[0] == 0
        first, second = ((tmp_path / "bare" / name).read_bytes() for name in ("out.png", "out2.png"))
        assert first == second


@pytest.mark.usefixtures("place", "renderer")
@pytest.mark.parametrize(("first", "sentence", "second"), NEXT)
def test_what_is_said_leads_to_the_next_command(typed, first, sentence, second):
    code, _, errors = typed(first)
    (line,) = [line for line in errors.splitlines() if sentence in line]
    assert line.startswith("pointshade: " if code else "note: ")
    code, output, errors = typed(second)
    assert code == 0 and output and sentence not in errors, errors
