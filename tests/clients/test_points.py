"""Our .ply in other programs: where points lie, their normals and colours; and what they save of it, in ours."""

import numpy as np
import pytest
import trimesh

import pointshade_gl as ps

RNG = np.random.default_rng(36)
# before a camera, more of them below and to the right: x right, y down, z away
SEEN = RNG.uniform((-0.5, -1, 2), (1.5, 2, 4), (200, 3)).astype(np.float32)
NORMALS = RNG.normal(size=(200, 3))
NORMALS = (NORMALS / np.linalg.norm(NORMALS, axis=1, keepdims=True)).astype(np.float32)
COLORS = RNG.integers(0, 256, (200, 3), np.uint8)
CLOUD = ps.PointCloud(SEEN, NORMALS, COLORS, front="-z")
# what right, up and towards the viewer are in other axes, by hand
TURNED = {
    None: lambda at: at * np.float32((1, -1, -1)),
    "opencv": lambda at: at,
    "opengl": lambda at: at * np.float32((1, -1, -1)),
    "blender": lambda at: at[:, [0, 2, 1]] * np.float32((1, 1, -1)),
}
all_axes = pytest.mark.parametrize("axes", TURNED)


@pytest.fixture
def written(tmp_path):
    """written(axes): the cloud's .ply."""

    def write(axes):
        ps.save_points(tmp_path / "cloud.ply", CLOUD, axes)
        return tmp_path / "cloud.ply"

    return write


def check(axes, positions, normals, colors):
    """They are the cloud's in these axes."""
    np.testing.assert_array_equal(positions, TURNED[axes](SEEN))
    np.testing.assert_allclose(normals, TURNED[axes](NORMALS), atol=1e-6)
    np.testing.assert_array_equal(colors, COLORS)


def check_saved(axes, path):
    """What another program has saved is the same cloud to us."""
    cloud = ps.load_cloud(path, up="y")
    np.testing.assert_array_equal(cloud.positions, TURNED[axes](SEEN))
    np.testing.assert_allclose(cloud.normals, TURNED[axes](NORMALS), atol=1e-6)
    np.testing.assert_array_equal(cloud.colors, COLORS)


@all_axes
def test_trimesh(written, tmp_path, axes):
    cloud = trimesh.load(written(axes))
    stored = cloud.metadata["_ply_raw"]["vertex"]["data"]
    check(axes, cloud.vertices, np.stack([stored[name] for name in ("nx", "ny", "nz")], -1), cloud.colors[:, :3])
    cloud.export(tmp_path / "saved.ply")
    back = ps.load_cloud(tmp_path / "saved.ply", up="y")  # trimesh leaves the normals of points out
    np.testing.assert_array_equal(back.positions, TURNED[axes](SEEN))
    np.testing.assert_array_equal(back.colors, COLORS)


@pytest.mark.clients
@all_axes
def test_pymeshlab(client, written, tmp_path, axes):
    meshes = client("pymeshlab").MeshSet()
    meshes.load_new_mesh(str(written(axes)))
    mesh = meshes.current_mesh()
    check(axes, mesh.vertex_matrix(), mesh.vertex_normal_matrix(), np.rint(mesh.vertex_color_matrix()[:, :3] * 255))
    meshes.save_current_mesh(str(tmp_path / "saved.ply"), save_vertex_normal=True)
    check_saved(axes, tmp_path / "saved.ply")


@pytest.mark.clients
@all_axes
def test_open3d(client, written, tmp_path, axes):
    open3d = client("open3d")
    cloud = open3d.io.read_point_cloud(str(written(axes)))
    check(axes, cloud.points, cloud.normals, np.rint(np.asarray(cloud.colors) * 255))
    open3d.io.write_point_cloud(str(tmp_path / "saved.ply"), cloud)
    check_saved(axes, tmp_path / "saved.ply")
    tensors = open3d.t.io.read_point_cloud(str(written(axes))).point
    check(axes, *(tensors[name].numpy() for name in ("positions", "normals", "colors")))


@pytest.mark.clients
@pytest.mark.parametrize(
    ("axes", "forward", "up"),
    [("blender", "Y", "Z"), (None, "NEGATIVE_Z", "Y"), ("opengl", "NEGATIVE_Z", "Y"), ("opencv", "Z", "NEGATIVE_Y")],
)
def test_blender(blender, written, tmp_path, axes, forward, up):
    """Its importer's own axes are those of "blender"; with the right ones all files stand upright in its scene."""
    found = blender("read_points.py", written(axes), forward, up, tmp_path / "saved.ply")
    upright = TURNED["blender"]
    np.testing.assert_allclose(found["positions"], upright(SEEN), atol=1e-6)
    np.testing.assert_allclose(found["normals"], upright(NORMALS), atol=1e-6)
    np.testing.assert_array_equal(np.rint(found["colors"]), COLORS)
    cloud = ps.load_cloud(tmp_path / "saved.ply", up="y")  # Blender exports no normals of points, colours rounded down
    np.testing.assert_allclose(cloud.positions, TURNED[axes](SEEN), atol=1e-6)
    assert np.isin(COLORS - cloud.colors, (0, 1)).all()
