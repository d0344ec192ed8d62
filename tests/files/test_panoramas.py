"""Panoramas: how they are known, the six frames that they become, and what is none."""

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

from ..support import bent_rooms

WIDTH = 512


@pytest.fixture(scope="module")
def seen():
    """Distances and colours of the room's panorama."""
    return bent_rooms.panorama(WIDTH)


def opened(folder, **options):
    notes = []
    return ps.open_source(folder, notes=notes.append, **options), notes


def millimetres(folder, distance, color, name="depth.png"):
    folder.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.round(distance * 1000).astype(np.uint16)).save(folder / name)
    Image.fromarray(color).save(folder / "color.png")
    return folder


def write_exr(folder, distance):
    OpenEXR = pytest.importorskip("OpenEXR")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"Z": distance.astype(np.float32)}) as file:
        file.write(str(folder / "depth.exr"))


def jpeg_with_xmp(folder, color):
    xmp = (
        b'<x:xmpmeta xmlns:x="adobe:ns:meta/"><GPano:ProjectionType>equirectangular</GPano:ProjectionType></x:xmpmeta>'
    )
    Image.fromarray(color).save(folder / "color.jpg", quality=98, subsampling=0, xmp=xmp)


def check_six(frames, share=0.01):
    assert len(frames) == 6
    points = []
    for frame in frames:
        assert frame.camera.fx == frame.camera.fy == frame.camera.width / 2 == frame.camera.height / 2
        bent_rooms.check_frame(frame, share)
        points.append(frame.camera.unproject(np.where(frame.depth > 0, frame.depth, np.nan), pose=frame.pose))
    return np.concatenate([one.reshape(-1, 3) for one in points])


def test_a_panorama_becomes_six_frames_of_one_place(tmp_path, seen):
    frames, notes = opened(millimetres(tmp_path, *seen))
    points = check_six(frames)
    assert sum("taken as a panorama (equirectangular" in note for note in notes) == 1
    assert np.isfinite(points).all()
    turned = points @ bent_rooms.TURN.T
    for normal, far in bent_rooms.WALLS:  # each wall within 0.3 degrees
        on_wall = turned[abs(turned @ normal - far) < 0.004]
        direction = np.linalg.svd(on_wall - on_wall.mean(0), full_matrices=False)[2][2]
        assert np.degrees(np.arccos(min(1, abs(direction @ normal)))) < 0.3


def test_the_first_frame_looks_ahead_and_the_note_says_how_to_see_the_rest(tmp_path, seen):
    notes = []
    frame = ps.load_frame(millimetres(tmp_path, *seen), notes=notes.append)
    assert np.array_equal(frame.pose, np.eye(4))
    assert any("render takes a list of them as one object" in note for note in notes)
    middle = frame.camera.unproject([1.0], pixels=[(frame.camera.cx, frame.camera.cy)])[0]
    np.testing.assert_allclose(middle, (0, 0, 1))


def floats(folder, distance, color):
    bent_rooms.put(folder, distance, color)


def exr(folder, distance, color):
    floats(folder, distance, color)
    (folder / "depth.npy").unlink()
    write_exr(folder, distance)


def npz(folder, distance, color):
    folder.mkdir(exist_ok=True)
    np.savez(folder / "panorama.npz", depth=distance.astype(np.float32), image=color)


def depth_alone(folder, distance, color):
    bent_rooms.put(folder, distance)


def holes_at_the_poles(folder, distance, color):
    lost, dark = distance.copy(), color.copy()
    for part in (lost, dark):
        part[:30] = part[-30:] = 0
    bent_rooms.put(folder, lost, dark)


def xmp(folder, distance, color):
    bent_rooms.put(folder, distance)
    jpeg_with_xmp(folder, color)


def said_by_json(folder, distance, color):
    told = {"camera_model": "EQUIRECTANGULAR", "w": WIDTH, "h": WIDTH // 2, "depth_scale": 2.0}
    bent_rooms.put(folder, distance * 2, color, camera_json=told)


def said_by_colmap(folder, distance, color):
    line = f"1 EQUIRECTANGULAR {WIDTH} {WIDTH // 2} {WIDTH} {WIDTH // 2}\n"
    bent_rooms.put(folder, distance, color, cameras_txt=line)


def larger_colours(folder, distance, color):
    bent_rooms.put(folder, distance, bent_rooms.panorama(2 * WIDTH)[1])


@pytest.mark.parametrize(
    "write", [floats, exr, npz, depth_alone, holes_at_the_poles, xmp, said_by_json, said_by_colmap, larger_colours]
)
def test_a_panorama_is_known_however_it_is_stored(tmp_path, seen, write):
    write(tmp_path, *seen)
    frames, notes = opened(tmp_path / "panorama.npz" if write is npz else tmp_path)
    assert any("panorama" in note for note in notes)
    assert len(frames) == 6
    for frame in (frames[0], frames[1], frames[4]):
        known = frame.depth > 0
        points = frame.camera.unproject(np.where(known, frame.depth, np.nan))[known] @ frame.pose[:3, :3].T
        assert (bent_rooms.off_surface(points) < 0.005).mean() > 0.99
        assert (frame.color is None) == (write is depth_alone)
    if write is larger_colours:
        assert frames[0].color.shape[0] == pytest.approx(2 * frames[0].camera.height, abs=1)


def test_given_files_and_arrays_are_panoramas_as_well(tmp_path, seen):
    distance, color = seen
    folder = millimetres(tmp_path, distance, color)
    for depth, colors in (
        (folder / "depth.png", folder / "color.png"),
        (distance.astype(np.float32), color),
    ):
        frames, notes = opened(None, depth=depth, color=colors)
        assert len(frames) == 6 and any("panorama" in note for note in notes)
        bent_rooms.check_frame(frames[2], 0.01)


def test_panoramas_with_poses_keep_them(tmp_path, seen):
    distance, color = seen
    millimetres(tmp_path / "pano", distance, color)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], (1, 2, 3)
    frames, _ = opened(tmp_path / "pano", pose=pose)
    for frame in frames:
        np.testing.assert_allclose(frame.pose[:3, 3], (1, 2, 3))
    plain, _ = opened(tmp_path / "pano")
    np.testing.assert_allclose(frames[4].pose, pose @ plain[4].pose)


def test_inverse_depth_of_a_network_is_one_surface_over_all_six(tmp_path, seen):
    distance, color = seen
    folder = bent_rooms.put(tmp_path, 1 / distance, color)
    frames, _ = opened(folder, depth_kind="inverse")
    lengths = [frame.depth * np.linalg.norm(frame.camera.rays(), axis=-1) for frame in frames]
    assert np.concatenate([one.ravel() for one in lengths]).min() == pytest.approx(1, rel=0.02)  # the nearest of all
    right, ahead = lengths[1][:, 0], lengths[0][:, -1]
    assert np.median(abs(right / ahead - 1)) < 0.02


@pytest.mark.usefixtures("renderer")
def test_between_the_frames_there_is_no_seam(tmp_path, seen, renderer):
    frames, _ = opened(millimetres(tmp_path, *seen))
    camera = ps.Camera.from_fov(75, 200, 150)
    for yaw in (45, 135):
        a = np.radians(yaw)
        pose = np.eye(4)
        pose[:3, :3] = [[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]]
        picture = renderer.render(list(frames), camera=camera, pose=pose, shading="none")
        assert (picture[..., 3] == 0).mean() < 0.002
        rays = camera.rays() @ pose[:3, :3].T
        _, want = bent_rooms.trace(rays / np.linalg.norm(rays, axis=-1, keepdims=True))
        assert np.abs(picture[..., :3].astype(float) - want).mean() < 6


# --- what is none -----------------------------------------------------------------------------------------------------


def corridor():
    """z of a corridor seen along its axis: edges that are equal, a floor and a ceiling of one depth in a row."""
    u, v = np.meshgrid((np.arange(512) - 255.5) / 256, (np.arange(256) - 127.5) / 256)
    with np.errstate(divide="ignore"):
        return np.minimum.reduce([1.5 / abs(u), 0.6 / abs(v), np.full(u.shape, 9.0)])


def wall():
    return np.full((256, 512), 2.0) + np.linspace(0, 1e-4, 512)


def slope():
    return np.full((256, 512), 2.0) + np.linspace(0, 3, 512)


@pytest.mark.parametrize("make", [corridor, wall, slope])
@pytest.mark.parametrize("with_color", [True, False])
def test_pictures_of_a_pinhole_are_none(tmp_path, make, with_color):
    random = np.random.default_rng(0)
    color = random.integers(0, 255, (256, 512, 3)).astype(np.uint8) if with_color else None
    bent_rooms.put(tmp_path, make(), color)
    notes = []
    frame = ps.load_frame(tmp_path, notes=notes.append)
    assert frame.depth.shape == (256, 512)
    assert any("if it is a panorama" in note for note in notes), "the assumed camera names the way out"


def test_a_camera_says_that_it_is_none(tmp_path, seen):
    distance, color = seen
    folder = bent_rooms.put(tmp_path, distance, color)
    assert ps.load_frame(folder, fov=60, notes=lambda _: None).depth.shape == distance.shape
    assert ps.load_frame(folder, projection="pinhole", notes=lambda _: None).depth.shape == distance.shape


@pytest.mark.parametrize(
    ("size", "options", "sentence"),
    [
        ((100, 150), {"projection": "equirectangular"}, "must be twice as wide as high, its depth is 150x100"),
        (
            (100, 200),
            {"projection": "equirectangular", "depth_kind": "disparity"},
            "measured along its rays: pass",
        ),
        ((100, 200), {"projection": "equirectangular", "depth_kind": "z"}, "measured along its rays: pass"),
        ((100, 200), {"projection": "sphere"}, "unknown projection 'sphere': known are pinhole, lens, fisheye, equi"),
    ],
)
def test_what_a_panorama_cannot_be_is_refused(tmp_path, size, options, sentence):
    bent_rooms.put(tmp_path, 1 + np.random.default_rng(0).random(size))
    with pytest.raises(ValueError, match=sentence):
        ps.load_frame(tmp_path, notes=lambda _: None, **options)


def test_a_network_is_not_asked_about_a_panorama(tmp_path, seen):
    jpeg_with_xmp(tmp_path, seen[1])
    with pytest.raises(ValueError, match=r"color\.jpg is a panorama, and networks are made for pictures of a pinhole"):
        ps.load_frame(tmp_path / "color.jpg", depth=lambda rgb: rgb[..., 0] * 1.0, notes=lambda _: None)


def test_the_command_line_draws_all_six_as_one(typed, tmp_path, seen):
    millimetres(tmp_path / "pano", *seen)
    line = "render pano -o out.png --views all --shading none --samples 1"
    code, _, errors = typed(f"{line} --projection equirectangular")
    assert code == 0, errors
    assert "--views all draws them as one, --projection pinhole takes it as it is" in errors
    assert np.asarray(Image.open("out.png"))[..., 3].min() == 255


def write_exr_with_colors(folder, distance, color):
    OpenEXR = pytest.importorskip("OpenEXR")
    values = color / 255
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4).astype(np.float32)
    channels = {"Z": distance.astype(np.float32), **{name: linear[..., k].copy() for k, name in enumerate("RGB")}}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, channels) as file:
        file.write(str(folder / "depth.exr"))


def test_colours_in_the_file_of_a_panoramas_depth_are_those_of_the_six(tmp_path, seen):
    write_exr_with_colors(tmp_path, *seen)
    frames, _ = opened(tmp_path)
    check_six(frames)
    assert all(frame.color is not None for frame in frames)


def test_a_channel_that_is_said_is_that_of_the_panorama(tmp_path, seen):
    distance, color = seen
    np.savez(tmp_path / "depth.npz", other=distance + 1, far=distance)
    Image.fromarray(color).save(tmp_path / "color.png")
    frames, _ = opened(tmp_path, channel="far", projection="equirectangular")
    check_six(frames)


def test_mirrored_colours_of_a_panorama_raise_a_doubt(tmp_path, seen):
    distance, color = seen
    _, notes = opened(millimetres(tmp_path, distance, color[:, ::-1]))
    assert any("look mirrored left to right" in note for note in notes)


def test_a_film_of_panoramas_becomes_six_frames_for_each_picture(tmp_path, seen):
    iio = pytest.importorskip("imageio_ffmpeg")
    distance, _ = seen
    how = {"fps": 10, "pix_fmt_in": "gray16le", "codec": "ffv1", "pix_fmt_out": "gray16le", "quality": None}
    writer = iio.write_frames(str(tmp_path / "clip_depth.mkv"), distance.shape[::-1], macro_block_size=1, **how)
    writer.send(None)
    for k in range(2):
        writer.send(np.rint((distance + k) * 1000).astype("<u2"))
    writer.close()
    frames, _ = opened(tmp_path, projection="equirectangular")
    assert len(frames) == 12
    middle = [float(frames[k].depth[81, 81]) for k in (0, 6)]
    assert middle[1] - middle[0] == pytest.approx(1, abs=0.01)


def test_points_are_no_panorama(tmp_path, seen):
    np.save(tmp_path / "depth.npy", (seen[0][..., None] * (1, 0.9, 0.8)).astype(np.float32))
    with pytest.raises(ValueError, match="holds points, expected the lengths of a panorama's rays"):
        ps.load_frame(tmp_path, projection="equirectangular", notes=lambda _: None)
