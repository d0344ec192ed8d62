"""Files of trained Gaussian splats: each format gives what was put into it."""

import gzip
import io
import json
import struct
import zipfile

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

from ..support import cloud_files

C0 = 0.28209479177387814
COUNT = 300


@pytest.fixture
def splats():
    """Positions, scales, quaternions x y z w, opacities, colours of degree 0, and harmonics of degree 2."""
    rng = np.random.default_rng(60)
    turns = rng.normal(size=(COUNT, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    values = rng.uniform(-2, 2, (COUNT, 3)), np.exp(rng.uniform(-6, -2, (COUNT, 3))), turns
    more = rng.uniform(0.05, 0.95, COUNT), rng.uniform(0.1, 0.9, (COUNT, 3)), rng.uniform(-0.9, 0.9, (COUNT, 8, 3))
    return *values, *more


def read(path, data, **options):
    path.write_bytes(data)
    assert ps.load_cloud(path, **{"notes": lambda _: None, **options}).gaussians is not None
    return ps.load_cloud(path, **{"notes": lambda _: None, **options})


def check(cloud, splats, place=1e-6, share=1e-5, angle=1e-3, degree=0, harmonics=2e-3):
    """place: how far positions may lie off; share: of scales, opacities and colours; angle: of the axes, radians."""
    at, scales, turns, opacities, base, rest = splats
    held = cloud.gaussians
    assert cloud.splat == "gaussian" and cloud.shading == "auto" and held.degree == degree
    np.testing.assert_allclose(cloud.positions, at, atol=place)
    np.testing.assert_allclose(np.log(held.scales), np.log(scales), atol=max(share * 10, 1e-4))
    np.testing.assert_allclose(held.opacities, opacities, atol=share)
    np.testing.assert_allclose(held.base, base, atol=share)
    unit = held.rotations / np.linalg.norm(held.rotations, axis=1, keepdims=True)
    assert 2 * np.arccos(np.abs((unit * turns).sum(1)).clip(0, 1)).max() < angle
    if degree:
        np.testing.assert_allclose(held.harmonics, rest, atol=harmonics)


def trained_ply(splats, axes=3, degree=2, comments=()):
    at, scales, turns, opacities, base, rest = splats
    columns = {name: at[:, k] for k, name in enumerate("xyz")} | dict.fromkeys(("nx", "ny", "nz"), np.zeros(COUNT))
    columns |= {f"f_dc_{k}": (base[:, k] - 0.5) / C0 for k in range(3)}
    if degree:
        columns |= {f"f_rest_{k}": column for k, column in enumerate(rest.transpose(0, 2, 1).reshape(COUNT, -1).T)}
    columns["opacity"] = np.log(opacities / (1 - opacities))
    columns |= {f"scale_{k}": np.log(scales[:, k]) for k in range(axes)}
    columns |= {f"rot_{k}": 3 * turns[:, (3, 0, 1, 2)[k]] for k in range(4)}  # of any length
    data = cloud_files.ply_text({k: v.astype(np.float32) for k, v in columns.items()}, form="binary_little_endian")
    return data.replace(b"\nelement", b"".join(b"\ncomment " + one for one in comments) + b"\nelement", 1)


def test_a_trained_ply(tmp_path, splats):
    told = []
    cloud = read(tmp_path / "a.ply", trained_ply(splats), notes=told.append)
    check(cloud, splats, degree=2)
    assert cloud.up == "-y" and any("up is taken as -y" in one for one in told)
    assert not cloud.gaussians.antialiased and cloud.normals is None


def test_colours_by_height_take_the_place_of_its_own(tmp_path, splats):
    cloud = read(tmp_path / "a.ply", trained_ply(splats), color_by="height")
    assert cloud.gaussians.degree == 0
    np.testing.assert_allclose(cloud.gaussians.base, cloud.colors / 255, atol=1e-6)


def test_the_flag_of_antialiasing_in_a_ply(tmp_path, splats):
    assert read(tmp_path / "a.ply", trained_ply(splats, comments=[b"SplatRenderMode: mip"])).gaussians.antialiased


def test_splats_of_two_axes(tmp_path, splats):
    held = read(tmp_path / "a.ply", trained_ply(splats, axes=2, degree=0)).gaussians
    np.testing.assert_allclose(held.scales[:, 2], 1e-3 * splats[1][:, :2].min(1), rtol=1e-4)


def test_faint_ones_and_those_that_are_not_finite_are_left_out(tmp_path, splats):
    at, scales, turns, opacities, base, rest = splats
    at, opacities = at.copy(), opacities.copy()
    opacities[:10], at[10] = 1 / 300, np.nan
    told = []
    cloud = read(tmp_path / "a.ply", trained_ply((at, scales, turns, opacities, base, rest)), notes=told.append)
    assert len(cloud) == len(cloud.gaussians) == COUNT - 11
    assert sum("1 of 300 splats have numbers that are not finite" in one for one in told) >= 1


def test_a_ply_that_was_written_is_read_again(tmp_path, splats):
    cloud = read(tmp_path / "a.ply", trained_ply(splats))
    ps.save_points(tmp_path / "b.ply", cloud)
    check(ps.load_cloud(tmp_path / "b.ply", notes=lambda _: None), splats, degree=2)


def smallest_three(turns, order, bits, signed=False):
    """The number of the largest, and the others as whole numbers."""
    ordered = turns[:, list(order)]
    largest = np.abs(ordered).argmax(1)
    ordered = ordered * np.sign(ordered[np.arange(COUNT), largest])[:, None]
    rest = np.stack([np.delete(row, k) for row, k in zip(ordered, largest, strict=True)])
    if signed:
        whole = np.rint(np.abs(rest) * 2**0.5 * ((1 << bits) - 1)).astype(np.uint32)
        return largest.astype(np.uint32), whole | (rest < 0).astype(np.uint32) << bits
    return largest.astype(np.uint32), np.rint((rest / 2**0.5 + 0.5) * ((1 << bits) - 1)).astype(np.uint32)


def test_a_compressed_ply(tmp_path, splats):
    at, scales, turns, opacities, base, rest = splats
    logs, chunks, packed = np.log(scales), [], np.zeros((COUNT, 4), np.uint32)
    largest, three = smallest_three(turns, (3, 0, 1, 2), 10)
    packed[:, 1] = largest << 30 | three[:, 0] << 20 | three[:, 1] << 10 | three[:, 2]
    for first in range(0, COUNT, 256):
        part = slice(first, first + 256)
        ends = [end(one[part], 0) for one in (at, logs, base) for end in (np.min, np.max)]
        chunks.append(np.concatenate(ends))
        for column, values, (low, high) in ((0, at, ends[:2]), (2, logs, ends[2:4])):
            x, y, z = ((values[part] - low) / (high - low)).T
            x, y, z = (np.rint(one * most).astype(np.uint32) for one, most in ((x, 2047), (y, 1023), (z, 2047)))
            packed[part, column] = x << 21 | y << 11 | z
        share = np.rint(255 * (base[part] - ends[4]) / (ends[5] - ends[4])).astype(np.uint32)
        alpha = np.rint(255 * opacities[part]).astype(np.uint32)
        packed[part, 3] = share[:, 0] << 24 | share[:, 1] << 16 | share[:, 2] << 8 | alpha
    limits = [f"{end}_{name}" for group in (("x", "y", "z"), ("scale_x", "scale_y", "scale_z"), "rgb")
              for end in ("min", "max") for name in group]  # fmt: skip
    whole = np.rint((rest.transpose(0, 2, 1).reshape(COUNT, -1) + 4) * 255 / 8).astype(np.uint8)
    head = ["ply", "format binary_little_endian 1.0", f"element chunk {len(chunks)}"]
    head += [f"property float {name}" for name in limits] + [f"element vertex {COUNT}"]
    head += [f"property uint packed_{name}" for name in ("position", "rotation", "scale", "color")]
    head += [f"element sh {COUNT}", *(f"property uchar f_rest_{k}" for k in range(24)), "end_header\n"]
    data = "\n".join(head).encode() + np.array(chunks, "<f4").tobytes() + packed.astype("<u4").tobytes()
    cloud = read(tmp_path / "a.ply", data + whole.tobytes())
    check(cloud, splats, 0.005, 0.006, 0.01, 2, 0.02)
    with pytest.raises(ValueError, match=r"a\.ply .*1 chunks for 300 splats"):
        start = data.index(b"end_header\n") + 11
        fewer = data[:start].replace(b"element chunk 2", b"element chunk 1") + data[start + 72 :]
        read(tmp_path / "a.ply", fewer + whole.tobytes())


def test_a_file_without_a_header(tmp_path, splats):
    at, scales, turns, opacities, base, _ = splats
    rows = np.zeros(COUNT, [("p", "<f4", 3), ("s", "<f4", 3), ("c", "u1", 4), ("q", "u1", 4)])
    rows["p"], rows["s"] = at, scales
    rows["c"] = np.rint(255 * np.concatenate([base, opacities[:, None]], 1))
    rows["q"] = np.rint(turns[:, [3, 0, 1, 2]] * 127 + 128)
    for name in ("a.splat", "a"):  # its name does not matter
        check(read(tmp_path / name, rows.tobytes()), splats, share=0.003, angle=0.05)
    with pytest.raises(ValueError, match=r"a\.splat is no \.splat of 9599 bytes"):
        read(tmp_path / "a.splat", rows.tobytes()[:-1])


@pytest.mark.parametrize("version", [2, 3])
def test_an_spz(tmp_path, splats, version):
    at, scales, turns, opacities, base, rest = splats
    places = np.rint(at * 4096).astype("<i4").view(np.uint8).reshape(COUNT, 3, 4)[..., :3]
    if version == 2:
        turned = turns * np.where(turns[:, 3:] < 0, -1, 1)
        stored = np.rint((turned[:, :3] + 1) * 127.5).astype(np.uint8).tobytes()
    else:
        largest, three = smallest_three(turns, range(4), 9, signed=True)
        stored = (largest << 30 | three[:, 0] << 20 | three[:, 1] << 10 | three[:, 2]).astype("<u4").tobytes()
    color = np.rint(255 * ((base - 0.5) / C0 * 0.15 + 0.5)).astype(np.uint8)
    parts = (
        places, np.rint(255 * opacities).astype(np.uint8), color,
        np.rint((np.log(scales) + 10) * 16).astype(np.uint8),
    )  # fmt: skip
    data = struct.pack("<4sII4B", b"NGSP", version, COUNT, 2, 12, 1, 0)
    data += b"".join(one.tobytes() for one in parts) + stored + np.rint(rest * 128 + 128).astype(np.uint8).tobytes()
    cloud = read(tmp_path / "a.spz", gzip.compress(data))
    check(cloud, splats, 2e-4, 0.006, 0.2 if version == 2 else 0.01, 2, 0.006)
    assert cloud.gaussians.antialiased and (cloud.up, cloud.front) == ("y", "z")
    with pytest.raises(ValueError, match=r"a\.spz is a broken \.spz file"):
        read(tmp_path / "a.spz", gzip.compress(data[:-100]))
    with pytest.raises(ValueError, match=r"a\.spz is a broken \.spz file"):
        read(tmp_path / "a.spz", gzip.compress(data)[:-100])


def webp(values):
    side = 20
    texels = np.zeros((side * side, 4), np.uint8)
    texels[:, 3] = 255
    texels[: len(values), : values.shape[1]] = values
    file = io.BytesIO()
    Image.fromarray(texels.reshape(side, side, 4)).save(file, "WEBP", lossless=True, exact=True)
    return file.getvalue()


def test_a_sog(tmp_path, splats):
    at, scales, turns, opacities, base, rest = splats
    packed = np.sign(at) * np.log1p(np.abs(at))
    low, high = packed.min(0), packed.max(0)
    whole = np.rint((packed - low) / (high - low) * 65535).astype(np.uint32)
    largest, three = smallest_three(turns, (3, 0, 1, 2), 8)
    books = np.linspace(-7, -1, 256), np.linspace(-2, 2, 256), np.linspace(-1, 1, 256)
    near = [
        np.abs(one[..., None] - book).argmin(-1)
        for one, book in zip((np.log(scales), (base - 0.5) / C0, rest), books, strict=True)
    ]
    palette = np.zeros((5, 64 * 8, 4), np.uint8)
    palette[..., 3] = 255
    for k in range(COUNT):
        palette[k // 64, k % 64 * 8 : k % 64 * 8 + 8, :3] = near[2][k]
    centroids = io.BytesIO()
    Image.fromarray(palette).save(centroids, "WEBP", lossless=True, exact=True)
    number = np.arange(COUNT)
    pictures = {
        "means_l.webp": webp(whole & 255), "means_u.webp": webp(whole >> 8), "scales.webp": webp(near[0]),
        "quats.webp": webp(np.concatenate([three, largest[:, None] + 252], 1)),
        "sh0.webp": webp(np.concatenate([near[1], np.rint(255 * opacities)[:, None]], 1)),
        "shN_labels.webp": webp(np.stack([number & 255, number >> 8], 1)), "shN_centroids.webp": centroids.getvalue(),
    }  # fmt: skip
    meta = {
        "version": 2, "count": COUNT, "sh0": {"codebook": books[1].tolist(), "files": ["sh0.webp"]},
        "means": {"mins": low.tolist(), "maxs": high.tolist(), "files": ["means_l.webp", "means_u.webp"]},
        "scales": {"codebook": books[0].tolist(), "files": ["scales.webp"]}, "quats": {"files": ["quats.webp"]},
        "shN": {"bands": 2, "codebook": books[2].tolist(), "files": ["shN_centroids.webp", "shN_labels.webp"]},
    }  # fmt: skip
    with zipfile.ZipFile(tmp_path / "a.sog", "w") as archive:
        archive.writestr("meta.json", json.dumps(meta))
        for name, data in pictures.items():
            archive.writestr(name, data)
            (tmp_path / name).write_bytes(data)
    for path, data in ((tmp_path / "a.sog", None), (tmp_path / "meta.json", json.dumps(meta).encode())):
        cloud = read(path, path.read_bytes() if data is None else data)
        check(cloud, splats, 2e-4, 0.006, 0.03, 2, 0.006)
    with pytest.raises(ValueError, match=r"meta\.json .*no sh0"):
        read(tmp_path / "meta.json", json.dumps({k: v for k, v in meta.items() if k != "sh0"}).encode())


def test_gltf_keeps_trained_splats(tmp_path, splats):
    at, scales, turns, opacities, base, rest = splats
    held = ps.Gaussians(scales, turns, opacities, base, rest)
    cloud = ps.PointCloud(at.astype(np.float32), gaussians=held, splat="gaussian", shading="auto", up="y")
    ps.save_scene(tmp_path / "a.glb", ps.Scene([ps.Node(cloud)]))
    (placed,) = ps.load_scene(tmp_path / "a.glb").instances
    check(placed.content, splats, degree=2)
    assert b"KHR_gaussian_splatting:SH_DEGREE_2_COEF_4" in (tmp_path / "a.glb").read_bytes()


def test_axes_turn_splats_with_their_harmonics(splats):
    from pointshade_gl.scene.cloud import turned
    from pointshade_gl.scene.gaussians import harmonics_at

    at, scales, turns, opacities, base, rest = splats
    held = ps.Gaussians(scales, turns, opacities, base, rest)
    cloud = ps.PointCloud(at, gaussians=held, splat="gaussian", front="-z")
    moved = turned(cloud, "blender")
    turn = np.linalg.lstsq(at, moved.positions, rcond=None)[0].T
    way = np.array([0.48, -0.6, 0.64])
    before, after = (
        harmonics_at(2, one[:, None])[:, 0] @ g.harmonics for one, g in ((way, held), (turn @ way, moved.gaussians))
    )
    np.testing.assert_allclose(after, before, atol=1e-4)
    np.testing.assert_allclose(_spread(moved.gaussians), turn @ _spread(held) @ turn.T, atol=1e-6)


def _spread(held):
    xx, xy, xz, yy, yz, zz = held.covariances
    return np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], -1).reshape(-1, 3, 3)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"scales": np.ones((COUNT, 2))}, "scales must have shape"),
        ({"scales": -np.ones((COUNT, 3))}, "scales must be at least 0"),
        ({"opacities": np.full(COUNT, 2.0)}, "opacities must be from 0 to 1"),
        ({"harmonics": np.ones((COUNT, 4, 3))}, "harmonics must be 3, 8 or 15"),
        ({"base": np.full((COUNT, 3), np.nan)}, "base must be finite"),
    ],
)
def test_splats_that_do_not_fit_are_refused(splats, change, complaint):
    at, scales, turns, opacities, base, rest = splats
    values = {"scales": scales, "rotations": turns, "opacities": opacities, "base": base, "harmonics": rest}
    with pytest.raises(ValueError, match=complaint):
        ps.Gaussians(**values | change)
    with pytest.raises(ValueError, match="gaussians must be 5, as many as the positions"):
        ps.PointCloud(at[:5], gaussians=ps.Gaussians(**values))
    with pytest.raises(ValueError, match=r"gaussian.* is of trained splats"):
        ps.PointCloud(at).styled(splat="gaussian")
