"""PLY: what is written is read again; files of other programs are read; broken ones are refused in a sentence."""

import io
import struct
import tracemalloc

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as some

from pointshade_gl.files.arrays.ply_and_pcd import read_ply, write_ply

KINDS = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"}
KINDS |= {"double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"}
KINDS |= {"float32": "f4", "float64": "f8"}
FORMATS = ("ascii", "binary_little_endian", "binary_big_endian")
XYZ = b"element vertex 2\nproperty float x\nproperty float y\nproperty uchar red\n"
ROWS = struct.pack("<2fB2fB", 1, 2, 3, -4, 0.5, 255)


def ply(header, body=b"", form="binary_little_endian", newline=b"\n"):
    lines = [b"ply", b"format %s 1.0" % form.encode(), *header.splitlines(), b"end_header", b""]
    return newline.join(lines) + body


def read(folder, data):
    (folder / "a.ply").write_bytes(data)
    return read_ply(folder / "a.ply").elements


def packed(rows, form):
    """Rows of (kind, number) as a file of that format holds them."""
    if form == "ascii":
        return "\n".join(" ".join(str(number) for _, number in row) for row in rows).encode()
    order = "<" if form == "binary_little_endian" else ">"
    return b"".join(np.array(number, order + kind).tobytes() for row in rows for kind, number in row)


@pytest.mark.parametrize("form", FORMATS)
def test_numbers_of_every_type_by_its_old_and_its_new_name(tmp_path, form):
    limits = {kind: np.iinfo(kind) if kind[0] in "iu" else np.finfo(kind) for kind in KINDS.values()}
    rows = [[(kind, getattr(limits[kind], end)) for kind in KINDS.values()] for end in ("min", "max")]
    header = b"element row 2\n" + b"".join(b"property %s %s_\n" % ((name.encode(),) * 2) for name in KINDS)
    found = read(tmp_path, ply(header, packed(rows, form), form))["row"]
    exact = {"f4": "f8"} if form == "ascii" else {}  # floats of a text keep all their digits
    assert found.dtype == [(f"{name}_", exact.get(kind, kind)) for name, kind in KINDS.items()]
    kept = [[(exact.get(kind, kind), float(str(n)) if exact.get(kind) else n) for kind, n in row] for row in rows]
    assert [row.tolist() for row in found] == [tuple(np.array(n, k).item() for k, n in row) for row in kept]


@pytest.mark.parametrize("form", FORMATS)
def test_lists_are_passed_over(tmp_path, form):
    """Before, between and behind the numbers of a row; of other lengths in each row, or of none."""
    u, f, i = "u1", "f4", "i4"
    faces = [
        [(u, 2), (f, 9), (f, 9), (i, -7), (u, 1), (i, 5), (f, 0.25)],
        [(u, 0), (i, 8), (u, 3), (i, 1), (i, 2), (i, 3), (f, -1)],
    ]
    header = (
        b"element face 2\nproperty list uchar float a\nproperty int b\nproperty list uint8 int32 c\nproperty float d\n"
    )
    points = [[(f, 1), (f, 2), (u, 3)], [(f, -4), (f, 0.5), (u, 255)]]
    lists = [[(u, 1), (u, 7)]]
    header += XYZ + b"element rest 1\nproperty list uchar uchar e\n"
    body = packed(faces, form) + b"\n" * (form == "ascii") + packed(points, form)
    body += b"\n" * (form == "ascii") + packed(lists, form)
    found = read(tmp_path, ply(header, body, form))
    assert [row.tolist() for row in found["face"]] == [(-7, 0.25), (8, -1)]
    assert [row.tolist() for row in found["vertex"]] == [(1, 2, 3), (-4, 0.5, 255)]
    assert len(found["rest"]) == 1 and not found["rest"].dtype.names


@pytest.mark.parametrize("newline", [b"\n", b"\r\n"])
@pytest.mark.parametrize("padding", [b"", b"\n", b"\r\n", b"\0\0"])
def test_comments_line_ends_and_what_follows_the_last_row(tmp_path, newline, padding):
    header = b"comment made by\nobj_info element vertex 7\n\n" + XYZ.replace(b"property", b"comment a b\nproperty")
    rows = b"\n" + ROWS[1:]  # it begins like one more line end
    found = read(tmp_path, ply(header, rows + padding, newline=newline))["vertex"]
    np.testing.assert_array_equal(found["red"], [3, 255])
    assert found["x"][0].tobytes() == rows[:4]


def test_what_is_written_is_read(tmp_path):
    kinds = [(kind, order + kind) for kind in dict.fromkeys(KINDS.values()) for order in "<>"]
    rows = np.zeros(3, [(f"{kind}{k}", stored) for k, (kind, stored) in enumerate(kinds)])
    for k, name in enumerate(rows.dtype.names):
        rows[name] = [k, 1, 100]
    with (tmp_path / "a.ply").open("wb") as file:
        write_ply(file, {"vertex": rows, "none": rows[:0]})
    found = read_ply(tmp_path / "a.ply").elements
    np.testing.assert_array_equal(found["vertex"], rows)
    assert found["none"].dtype == rows.dtype.newbyteorder("=") and not len(found["none"])


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_another_librarys_mesh(tmp_path, encoding):
    """Its text and binary files have faces; in the big-endian one the bytes of its own are turned around."""
    box = trimesh.creation.box()
    data = box.export(file_type="ply", encoding="ascii" if encoding == "ascii" else "binary")
    if encoding == "binary_big_endian":
        head, end, body = data.partition(b"end_header\n")
        vertices = np.frombuffer(body, "<f4", 24).astype(">f4").tobytes()
        faces = np.frombuffer(body, np.dtype([("n", "u1"), ("at", "<i4", 3)]), 12, 96)
        faces = faces.astype([("n", "u1"), ("at", ">i4", 3)]).tobytes()
        data = head.replace(b"little", b"big") + end + vertices + faces
    found = read(tmp_path, data)
    for k, name in enumerate("xyz"):
        np.testing.assert_array_equal(found["vertex"][name], box.vertices[:, k].astype(np.float32))
    assert len(found["face"]) == 12


def test_whole_numbers_may_be_written_as_others_in_a_text(tmp_path):
    header = XYZ.replace(b"2", b"1")
    assert read(tmp_path, ply(header, b"1e400 nan 255.0", "ascii"))["vertex"].tolist()[0][::2] == (np.inf, 255)


LIST = b"element face 1\nproperty list %s int a\n"


@pytest.mark.parametrize(
    ("data", "fact"),
    [
        (b"", r"is empty"),
        (b"solid ascii\n", "its first line is not 'ply'"),
        (b"ply", "its first line is not 'ply'"),
        (b"ply\n", "its header has no end"),
        (b"ply\rformat ascii 1.0\rend_header\r", "its header has no end"),
        (b"ply\nformat ascii 1.0\ncomment " + b"a" * 300_000, "its header has no end"),
        (b"ply\nend_header\n", "the line 'end_header'"),
        (ply(b"", form="ascii2"), "the line 'format ascii2 1.0'"),
        (ply(b"").replace(b"1.0", b"2.0"), "the line 'format binary_little_endian 2.0'"),
        (ply(b"format ascii 1.0"), "the line 'format ascii 1.0'"),
        (ply(b"property float x"), "the line 'property float x'"),
        (ply(XYZ + b"property float x"), "the line 'property float x'"),
        (ply(XYZ + XYZ, ROWS * 2), "the line 'element vertex 2'"),
        (ply(XYZ + b"property half z"), "the line 'property half z'"),
        (ply(LIST % b"float"), "the line 'property list float int a'"),
        (ply(b"element vertex -1"), "the line 'element vertex -1'"),
        (ply(b"element vertex 1e3"), "the line 'element vertex 1e3'"),
        (ply(b"element vertex " + b"9" * 5000), "the line 'element vertex 999"),
        (ply(b"element vertex 0"), "its element 'vertex' has no properties"),
        (ply(b"element vertex " + b"9" * 18), "its element 'vertex' has no properties"),
        (ply(XYZ.replace(b"2", b"9" * 18), ROWS), "it ends before the last of 999999999999999999 rows of its element"),
        (ply(XYZ, ROWS[:-1]), "it ends before the last of 2 rows of its element 'vertex'"),
        (ply(XYZ, ROWS + ROWS), "it goes on after the rows that its header counts"),
        (ply(XYZ, b"1 2 3 4 5", "ascii"), "it ends before the last of 2 rows of its element 'vertex'"),
        (ply(XYZ, b"1 2 3\n4 5 6\n7", "ascii"), "it goes on after the rows that its header counts"),
        (ply(XYZ, b"1 2 3\n4 5 six\n", "ascii"), "after its header it holds something other than numbers"),
        (ply(XYZ, b"1 2 3\n4 5 \xff\n", "ascii"), "after its header it holds something other than numbers"),
        (ply(XYZ, b"1 2 3\n4 5 256\n", "ascii"), "its property 'red' must be whole numbers from 0 to 255"),
        (ply(XYZ, b"1 2 3\n4 5 nan\n", "ascii"), "its property 'red' must be whole numbers from 0 to 255"),
        (ply(XYZ, b"1 2 3\n4 5 inf\n", "ascii"), "its property 'red' must be whole numbers from 0 to 255"),
        (
            ply(LIST % b"uint", b"\xff\xff\xff\xff" + bytes(9)),
            "it ends before the last of 1 rows of its element 'face'",
        ),
        (ply(LIST % b"int", b"\xff\xff\xff\xff"), "a list of its element 'face' has the length -1"),
        (ply(LIST % b"uchar", b"nan 1", "ascii"), "a list of its element 'face' has the length nan"),
        (ply(LIST % b"uchar", b"1.5 1 2", "ascii"), "a list of its element 'face' has the length 1.5"),
        (ply(LIST % b"uchar", b"1e300 1 2", "ascii"), "it ends before the last of 1 rows of its element 'face'"),
        (ply((LIST % b"uchar").replace(b"1", b"3"), b"\0\0\1"), "it ends before the last of 3 rows of its element"),
    ],
)
def test_a_broken_file_is_refused_in_one_sentence(tmp_path, data, fact):
    with pytest.raises(ValueError) as caught:
        read(tmp_path, data)
    sentence = str(caught.value)
    assert fact in sentence and sentence.startswith(str(tmp_path / "a.ply"))
    assert "\n" not in sentence and len(sentence) < 500


def test_a_header_asks_for_no_memory(tmp_path):
    header = b"".join(b"element e%d 99999999999999999\nproperty list uchar double a\n" % k for k in range(100))
    tracemalloc.start()
    with pytest.raises(ValueError, match="it ends before the last of 99999999999999999 rows"):
        read(tmp_path, ply(header, bytes(1000)))
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 3e6


def test_more_text_than_the_limit_is_told_with_its_option(tmp_path, monkeypatch):
    monkeypatch.setattr("pointshade_gl.files.arrays.ply_and_pcd.CLOUD_TEXT", 2**-20)
    with pytest.raises(
        ValueError, match=r"a\.ply has 135 bytes of text, the limit is 128: pass max_pixels=\d+ to allow"
    ):
        read(tmp_path, ply(XYZ, b"1 2 3\n4 5 6".ljust(33), "ascii"))


WHOLE = [ply(LIST % b"uchar" + XYZ, b"\1\0\0\0\0" + ROWS), ply(LIST % b"uchar" + XYZ, b"1 7 1 2 3 4 5 6", "ascii")]


@given(some.sampled_from(WHOLE), some.data())
def test_whatever_happened_to_its_bytes_it_is_read_or_refused(tmp_path_factory, whole, data):
    at = data.draw(some.integers(0, len(whole)))
    kept = data.draw(some.integers(0, 20))
    damaged = whole[:at] + data.draw(some.binary(max_size=8)) + whole[at + kept :]
    path = tmp_path_factory.mktemp("damaged") / "a.ply"
    path.write_bytes(damaged)
    try:
        found = read_ply(path).elements
    except ValueError as error:
        assert str(error).startswith(str(path)) and "\n" not in str(error)
    else:
        assert all(isinstance(rows, np.ndarray) for rows in found.values())


def test_an_empty_cloud_is_written_in_the_same_form():
    file = io.BytesIO()
    write_ply(file, {"vertex": np.empty(0, [("x", "f4")])})
    assert file.getvalue() == ply(b"element vertex 0\nproperty float x\n")
