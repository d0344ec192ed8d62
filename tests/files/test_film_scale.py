"""Films of networks that stand still: one scale for all frames, however they are reached."""

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

from ..support.network_films import film


@pytest.fixture(scope="module")
def made():
    """A still room into which a hand comes, as a network that fills 0 to 1 sees it."""
    return film(31, "still", 10, noise=0.0, kind="minmax", size=(160, 120))


@pytest.fixture
def folder(made, tmp_path):
    for k, (color, raw) in enumerate(zip(made.colors, made.raw, strict=True)):
        Image.fromarray(color).save(tmp_path / f"color_{k:02d}.png")
        np.save(tmp_path / f"depth_{k:02d}.npy", raw)
    return tmp_path


def opened(folder, notes=None, **options):
    return ps.open_source(folder, depth_kind="inverse", notes=([] if notes is None else notes).append, **options)


def jump(made, frames):
    """How far the middle depth of what is never covered goes from that of the first frame, at most."""
    still = np.ptp(made.depth, axis=0) < 1e-6
    middles = [np.median(frame.depth[still]) for frame in frames]
    return np.abs(np.array(middles) / middles[0] - 1).max()


def test_a_hand_that_comes_in_moves_nothing_else(made, folder):
    notes = []
    assert jump(made, opened(folder, notes)) <= 0.02
    assert jump(made, opened(folder, scale_frames="keep")) > 0.2
    assert sum("pass scale_frames='keep' to leave each as it is" in one for one in notes) == 1


def test_the_first_frame_is_laid_as_it_is_alone(folder):
    first, alone = opened(folder)[0], ps.load_frame(folder / "depth_00.npy", depth_kind="inverse", notes=[].append)
    assert np.array_equal(first.depth, alone.depth)


def test_a_frame_is_the_same_however_it_is_reached(folder):
    in_order = [frame.depth for frame in opened(folder)]
    for reach in ([9, 4, 0], [5, 6, 5], [3]):
        frames = opened(folder)
        assert all(np.array_equal(frames[k].depth, in_order[k]) for k in reach)
    assert np.array_equal(opened(folder)[3:8][1].depth, in_order[4])
    assert np.array_equal(next(iter(opened(folder)[::-3])).depth, in_order[9])


def test_a_frame_that_cannot_be_read_does_not_stop_the_others(made, folder):
    (folder / "depth_03.npy").write_bytes(b"nothing")
    frames = opened(folder)
    assert jump(made, [frames[k] for k in (0, 7, 2)]) <= 0.02
    with pytest.raises(ValueError, match="frame 3"):
        frames[3]


def test_a_cut_is_told(tmp_path):
    made = film(32, "still", 8, cut=5, noise=0.0, size=(160, 120))
    for k, (color, raw) in enumerate(zip(made.colors, made.raw, strict=True)):
        Image.fromarray(color).save(tmp_path / f"color_{k:02d}.png")
        np.save(tmp_path / f"depth_{k:02d}.npy", raw)
    notes = []
    list(opened(tmp_path, notes))
    assert any("frame 5 begins another shot" in one for one in notes)


@pytest.mark.parametrize("suffix", ["npy", "png"])
def test_metres_are_as_they_are(made, tmp_path, suffix):
    for k, (color, z) in enumerate(zip(made.colors[:5], made.depth, strict=False)):
        Image.fromarray(color).save(tmp_path / f"color_{k:02d}.png")
        if suffix == "npy":
            np.save(tmp_path / f"depth_{k:02d}.npy", z.astype(np.float32))
        else:
            Image.fromarray((z * 1000).astype(np.uint16)).save(tmp_path / f"depth_{k:02d}.png")
    steadied, kept = (ps.open_source(tmp_path, fov=60, scale_frames=how, notes=[].append) for how in ("auto", "keep"))
    assert all(np.array_equal(one.depth, other.depth) for one, other in zip(steadied, kept, strict=True))


def test_nobody_waits_for_metres_that_do_not_breathe(made, tmp_path, monkeypatch):
    from pointshade_gl.files.frames import sequences as frame_sequence

    for k in range(20):
        np.save(tmp_path / f"depth_{k:02d}.npy", made.depth[k % 10].astype(np.float32))
    frames, read, usual = ps.open_source(tmp_path, fov=60, notes=[].append), [], frame_sequence.assemble

    def assemble(parts, *rest):
        read.append(parts.number)
        return usual(parts, *rest)

    monkeypatch.setattr(frame_sequence, "assemble", assemble)
    assert np.array_equal(frames[18].depth, made.depth[8].astype(np.float32))
    assert max(read[1:]) <= 9, "those that show that nothing breathes"
    del read[:]
    assert frames[15].depth.any() and read == [15]


def test_a_networks_metres_stop_breathing(made, tmp_path):
    for k, color in enumerate(made.colors):
        Image.fromarray(color).save(tmp_path / f"{k:02d}.png")
    breath = np.random.default_rng(3).uniform(0.93, 1.07, len(made.colors))

    def model(rgb):
        k = next(k for k, color in enumerate(made.colors) if np.array_equal(color, rgb))
        return (made.depth[k] * breath[k]).astype(np.float32)

    frames = ps.open_source(tmp_path, depth=model, fov=60, notes=[].append)
    assert (
        jump(made, frames)
        < 0.01
        < jump(made, ps.open_source(tmp_path, depth=model, fov=60, scale_frames="keep", notes=[].append))
    )


def test_an_unknown_way_is_one_sentence(folder):
    with pytest.raises(ValueError, match="unknown scale_frames 'none': known are auto, keep"):
        opened(folder, scale_frames="none")
