"""PLY files with faces: drawn as meshes, with what their corners have."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.frame_sources import load_any
from pointshade_gl.files.input_kinds import Kind

from ..support import cloud_files as made

CUBE = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
XYZ = {name: CUBE[:, k] for k, name in enumerate("xyz")}
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
RED = {name: (40 * np.arange(8) + k).astype(np.uint8) for k, name in enumerate(("red", "green", "blue"))}
FORMS = ["ascii", "binary_little_endian", "binary_big_endian"]


def only(scene):
    (placed,) = scene.instances
    return placed.content


def load(folder, data, name="a.ply", **options):
    (folder / name).write_bytes(data)
    return ps.load_scene(folder / name, up="z", **options)


class TestFaces:
    @pytest.mark.parametrize("form", FORMS)
    @pytest.mark.parametrize(
        "faces", [QUADS, [*QUADS[:4], (0, 2, 6), (0, 6, 4), (1, 5, 7, 3)], [one[:3] for one in QUADS]]
    )
    def test_polygons_become_triangles(self, tmp_path, form, faces):
        mesh = only(load(tmp_path, made.ply_text(XYZ | RED, form=form, faces=faces)))
        a, b, c = mesh.positions[mesh.faces].transpose(1, 0, 2)
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
        assert area == pytest.approx(sum(0.5 * (len(one) - 2) for one in faces))
        numbers = (mesh.positions @ (4, 2, 1)).astype(int)
        assert (mesh.colors == np.stack([RED[one] for one in RED], -1)[numbers]).all()

    def test_strips(self, tmp_path):
        strip = [0, 1, 2, 3, 6, 7, 4, 5, 0, 1, -1, 0, 2, 4, 6, -1]
        text = made.ply_text(XYZ).replace(
            b"end_header", b"element tristrips 1\nproperty list int int vertex_indices\nend_header"
        )
        mesh = only(load(tmp_path, text + " ".join(map(str, [len(strip), *strip])).encode() + b"\n"))
        assert len(mesh.faces) == 10

    def test_a_corner_is_flat_and_a_bend_is_round(self, tmp_path):
        """Also where some faces are turned over."""
        cube = only(load(tmp_path, made.ply_text(XYZ, faces=QUADS)))
        assert np.allclose(np.sort(np.abs(cube.normals), 1)[cube.faces.ravel()], (0, 0, 1), atol=1e-6)
        u, v = (one.ravel() for one in np.meshgrid(np.linspace(0, 3, 40), np.linspace(0, 1, 9), indexing="ij"))
        bent = {"x": np.cos(u), "y": np.sin(u), "z": v}
        bent = {name: one.astype(np.float32) for name, one in bent.items()}
        faces = [(9 * k + j, 9 * k + j + 1, 9 * k + j + 10, 9 * k + j + 9) for k in range(39) for j in range(8)]
        mesh = only(load(tmp_path, made.ply_text(bent, faces=faces)))
        out = np.stack([mesh.positions[:, 0], mesh.positions[:, 1], 0 * mesh.positions[:, 0]], -1)
        assert len(mesh.positions) == 360 and np.abs((mesh.normals * out).sum(1)).min() > 0.998

    def test_colours_of_faces(self, tmp_path):
        head = b"property list uchar int vertex_index\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        text = made.ply_text(XYZ).replace(b"end_header\n", b"element face 6\n" + head + b"end_header\n")
        rows = "".join(f"4 {' '.join(map(str, one))} {40 * k} 7 {255 - k}\n" for k, one in enumerate(QUADS))
        mesh = only(load(tmp_path, text + rows.encode()))
        of_face = mesh.colors[mesh.faces]
        assert (of_face == of_face[:, :1]).all() and sorted({*of_face[:, 0, 0].tolist()}) == [0, 40, 80, 120, 160, 200]

    def test_quality_is_a_colour(self, tmp_path):
        told = []
        (tmp_path / "a.ply").write_bytes(made.ply_text(XYZ | {"quality": np.arange(8, dtype="f4")}, faces=QUADS))
        mesh = only(load_any(tmp_path / "a.ply", color_by="quality", up="z", notes=told.append))
        assert len(np.unique(mesh.colors, axis=0)) == 8 and any("coloured by quality" in one for one in told)

    def test_a_map_keeps_its_millimetres(self, tmp_path):
        place = np.array(made.MAP)
        columns = {name: XYZ[name].astype(float) * 0.01 + place[k] for k, name in enumerate("xyz")}
        (placed,) = load(tmp_path, made.ply_text(columns, faces=QUADS)).instances
        at = placed.content.positions + placed.world[:3, 3]
        assert np.ptp(at, 0) == pytest.approx([0.01] * 3, abs=1e-6) and (at.min(0) == place).all()


class TestTextures:
    def text(self, name="a.png"):
        head = b"property list uchar int vertex_indices\nproperty list uchar float texcoord\n"
        text = made.ply_text(XYZ, comments=[f"TextureFile {name}"])
        text = text.replace(b"end_header\n", b"element face 6\n" + head + b"end_header\n")
        rows = "".join(f"4 {' '.join(map(str, one))} 8 0 0 1 0 1 1 0 1\n" for one in QUADS)
        return text + rows.encode()

    def test_places_of_corners(self, tmp_path):
        picture = np.random.default_rng(0).integers(0, 255, (8, 8, 3), np.uint8)
        ps.save_image(tmp_path / "a.png", picture)
        mesh = only(load(tmp_path, self.text()))
        assert (mesh.texture == picture).all()
        assert mesh.uv[mesh.faces[0]].tolist() == [[0, 1], [1, 1], [1, 0]]  # v points up in the file

    @pytest.mark.parametrize(("name", "fact"), [("b.png", "b.png"), ("../a.png", "leaves the scene's folder")])
    def test_a_picture_that_is_not_there(self, tmp_path, name, fact):
        told = []
        mesh = only(load(tmp_path, self.text(name), notes=told.append))
        assert mesh.texture is None and any("its texture" in one and fact in one for one in told)


class TestKinds:
    def test_a_file_with_faces_is_a_scene_and_one_without_a_cloud(self, tmp_path):
        (tmp_path / "a.ply").write_bytes(made.ply_text(XYZ, faces=QUADS))
        (tmp_path / "b.ply").write_bytes(made.ply_text(XYZ).replace(b"end_header", b"element face 0\nend_header"))
        assert Kind.of(tmp_path / "a.ply") is Kind.SCENE and Kind.of(tmp_path / "b.ply") is Kind.CLOUD
        told = []
        assert len(ps.load_cloud(tmp_path / "a.ply", notes=told.append)) == 8
        assert "it is a mesh with faces, only its vertices are read" in told[0]

    @pytest.mark.parametrize(
        ("face", "fact"),
        [((0, 1, 8), "a face names the vertex 8, and there are 8"), ((0, 1), "none of its faces")],
    )
    def test_faces_that_are_none(self, tmp_path, face, fact):
        with pytest.raises(ValueError, match=f"a.ply cannot be read as a mesh: {fact}"):
            load(tmp_path, made.ply_text(XYZ, faces=[face]))

    def test_corners_that_are_nowhere(self, tmp_path):
        told = []
        holed = XYZ | {"x": np.where(np.arange(8) == 7, np.nan, XYZ["x"]).astype(np.float32)}
        mesh = only(load(tmp_path, made.ply_text(holed, faces=QUADS), notes=told.append))
        assert len(mesh.faces) == 6 and "6 triangles of 12 have a corner that lies nowhere" in told[0]

    def test_options_that_a_mesh_has_not(self, tmp_path):
        (tmp_path / "a.ply").write_bytes(made.ply_text(XYZ, faces=QUADS))
        with pytest.raises(ValueError, match=r"a\.ply is a mesh: leave out most"):
            load_any(tmp_path / "a.ply", most=4)


def test_colours_of_corners_are_drawn(tmp_path, renderer):
    """Between the corners they are mixed in linear light; without colours nothing changes."""
    at, faces = [(-1, -1, 3), (1, -1, 3), (1, 1, 3), (-1, 1, 3)], [(0, 1, 2), (0, 2, 3)]
    colors = np.array([(255, 0, 0), (0, 255, 0), (0, 255, 0), (255, 0, 0)], np.uint8)
    camera = ps.Camera(40, 40, 15.5, 11.5, 32, 24)
    plain, colored, white = (
        renderer.render(ps.Scene((ps.Node(ps.Mesh(at, faces, shading="none", colors=one)),), camera))
        for one in (None, colors, np.full((4, 3), 255, np.uint8))
    )
    assert (plain == white).all()
    middle = colored[12, 15:17, :3].astype(int).mean(0)
    assert np.abs(middle - (188, 188, 0)).max() <= 3  # sRGB of a half
    path = tmp_path / "a.glb"
    ps.save_scene(path, ps.Scene((ps.Node(ps.Mesh(at, faces, shading="none", colors=colors)),), camera))
    assert (only(ps.load_scene(path)).colors == colors).all()
