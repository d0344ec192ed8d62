"""Point clouds of every format, small ones, as other programs write them."""

from __future__ import annotations

import struct

import numpy as np

MAP = (4_800_000.0, 500_000.0, 300.0)  # where georeferenced clouds lie


def bumpy(count=400, seed=1):
    """Points (n, 3) float32 of a bumpy sheet, with normals and colours: nothing says which axis points up."""
    rng = np.random.default_rng(seed)
    v = rng.normal(size=(count, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    colors = rng.integers(0, 256, (count, 3), np.uint8)
    return (v * rng.uniform(0.9, 1.1, (count, 1))).astype(np.float32), v.astype(np.float32), colors


def on_map(count=300, seed=2):
    """Points (n, 3) float64 of a terrain, in whole millimetres."""
    rng = np.random.default_rng(seed)
    return np.round(rng.uniform((0, 0, 0), (100, 80, 5), (count, 3)) + MAP, 3)


def write_with_strays(path, count):
    """A PLY file of a ball of 2000 points and some far away, the last ones."""
    rng = np.random.default_rng(9)
    way = rng.normal(size=(2000 + count, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    way[2000:] *= np.geomspace(20, 2000, count)[:, None]
    path.write_bytes(ply_text({name: way[:, k].astype(np.float32) for k, name in enumerate("xyz")}))
    return way


def ply_text(columns, comments=(), form="ascii", faces=()):
    """A PLY file of float columns, written by hand; uchar where they are."""
    names = {"u1": "uchar", "f4": "float", "f8": "double", "i4": "int"}
    count = len(next(iter(columns.values())))
    lines = ["ply", f"format {form} 1.0", *(f"comment {one}" for one in comments), f"element vertex {count}"]
    lines += [f"property {names[column.dtype.str[1:]]} {name}" for name, column in columns.items()]
    if faces:
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    head = ("\n".join([*lines, "end_header"]) + "\n").encode()
    if form == "ascii":
        rows = [" ".join(repr(one.item()) for one in row) for row in zip(*columns.values(), strict=True)]
        return head + "\n".join([*rows, *(" ".join(map(str, (len(one), *one))) for one in faces), ""]).encode()
    order = "<" if "little" in form else ">"
    rows = np.empty(count, [(name, order + column.dtype.str[1:]) for name, column in columns.items()])
    for name, column in columns.items():
        rows[name] = column
    return head + rows.tobytes() + b"".join(struct.pack(f"{order}B{len(one)}i", len(one), *one) for one in faces)


def gaussians(count=300, seed=3):
    """Columns of a Gaussian .ply: discs on a sphere, whose thin axis is the first one before it is turned."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    half = np.concatenate([1 + normals[:, :1], np.cross([1.0, 0, 0], normals)], 1)  # turns x to the normal
    numbers = {
        "xyz": normals * 2, "f_dc_": rng.uniform(-1, 1, (count, 3)), "opacity": rng.uniform(1, 4, (count, 1)),
        "scale_": np.log(np.stack([np.full(count, 0.001), np.full(count, 0.03), np.full(count, 0.05)], -1)),
        "rot_": half * rng.uniform(0.5, 3, (count, 1)),  # of any length
    }  # fmt: skip
    columns = {name: numbers["xyz"][:, k] for k, name in enumerate("xyz")} | {"opacity": numbers["opacity"][:, 0]}
    for prefix in ("f_dc_", "scale_", "rot_"):
        columns |= {f"{prefix}{k}": numbers[prefix][:, k] for k in range(numbers[prefix].shape[1])}
    return {name: column.astype(np.float32) for name, column in columns.items()}, normals


def packed_colors(colors, kind="<f4"):
    """Colours (n, 3) as PCL packs them: four bytes that are called a float."""
    whole = colors.astype(np.uint32)
    return (whole[:, 0] << 16 | whole[:, 1] << 8 | whole[:, 2]).astype("<u4").view(kind)


def pcd(columns, coding="binary", width=None, height=1, viewpoint="0 0 0 1 0 0 0", counts=()):
    """A PCD file; columns (n,) or (n, c) by name."""
    count = len(next(iter(columns.values())))
    kinds = [column.dtype for column in columns.values()]
    many = [1 if column.ndim == 1 else column.shape[1] for column in columns.values()]
    head = "\n".join([
        "# .PCD v0.7 - Point Cloud Data file format", "VERSION 0.7", f"FIELDS {' '.join(columns)}",
        f"SIZE {' '.join(str(kind.itemsize) for kind in kinds)}",
        f"TYPE {' '.join(kind.kind.upper() for kind in kinds)}",
        f"COUNT {' '.join(map(str, many))}", f"WIDTH {width or count}", f"HEIGHT {height}", f"VIEWPOINT {viewpoint}",
        f"POINTS {count}", f"DATA {coding}", "",
    ]).encode()  # fmt: skip
    if coding == "ascii":
        rows = zip(*(column.reshape(count, -1) for column in columns.values()), strict=True)
        return head + "\n".join(" ".join(repr(one.item()) for part in row for one in part) for row in rows).encode()
    if coding == "binary":
        row = np.dtype([(name, column.dtype, column.shape[1:]) for name, column in columns.items()])
        rows = np.empty(count, row)
        for name, column in columns.items():
            rows[name] = column
        return head + rows.tobytes()
    whole = b"".join(np.ascontiguousarray(column).tobytes() for column in columns.values())
    packed = lzf(whole)
    return head + struct.pack("<II", len(packed), len(whole)) + packed


def lzf(data):
    """Packs bytes: what came before, up to 8 kB away, is copied; copies may overlap themselves."""
    seen, packed, run, at = {}, bytearray(), bytearray(), 0

    def end_run():
        for k in range(0, len(run), 32):
            packed.extend((len(run[k : k + 32]) - 1, *run[k : k + 32]))
        run.clear()

    while at < len(data):
        found = seen.get(data[at : at + 3], -1)
        seen[data[at : at + 3]] = at
        length = 0
        if 0 <= at - found - 1 < 8192 and found >= 0 and at + 3 <= len(data):
            while length < 264 and at + length < len(data) and data[found + length] == data[at + length]:
                length += 1
        if length < 3:
            run.append(data[at])
            at += 1
            continue
        end_run()
        back, rest = at - found - 1, length - 2
        packed.extend([min(rest, 7) << 5 | back >> 8, *([rest - 7] if rest >= 7 else []), back & 255])
        at += length
    end_run()
    return bytes(packed)


def las(path, positions, version="1.2", point_format=3, step=0.001, **columns):
    """A LAS or LAZ file of positions that are multiples of a step."""
    import laspy

    header = laspy.LasHeader(point_format=point_format, version=version)
    header.scales, header.offsets = [step] * 3, np.floor(positions.min(0)) if len(positions) else np.zeros(3)
    points = laspy.LasData(header)
    points.x, points.y, points.z = positions.T
    for name, column in columns.items():
        points[name] = column
    points.write(str(path))


def e57(path, scans):
    """An E57 file of scans: positions in the scanner's axes, where it stood, and its quaternion, w first."""
    import pye57

    with pye57.E57(str(path), "w") as file:
        for positions, place, turn, colors in scans:
            data = {f"cartesian{axis}": positions[:, k].astype(np.float64) for k, axis in enumerate("XYZ")}
            if colors is not None:
                data |= {f"color{name}": colors[:, k] for k, name in enumerate(("Red", "Green", "Blue"))}
            file.write_scan_raw(data, translation=np.array(place, float), rotation=np.array(turn, float))


def e57_with_normals(path, positions, normals):
    """An E57 file of one scan, with the fields of the extension for surface normals."""
    import pye57
    from pye57 import libe57

    with pye57.E57(str(path), "w") as file:
        image = file.image_file
        image.extensionsAdd("nor", "http://www.libe57.org/E57_EXT_surface_normals.txt")
        names = [f"{name}{axis}" for name in ("cartesian", "nor:normal") for axis in "XYZ"]
        columns = np.concatenate([positions, normals], 1).astype(np.float64).T.copy()
        row, buffers = libe57.StructureNode(image), libe57.VectorSourceDestBuffer()
        for name, column in zip(names, columns, strict=True):
            row.set(name, libe57.FloatNode(image, 0.0, libe57.E57_DOUBLE, -1e9, 1e9))
            buffers.append(libe57.SourceDestBuffer(image, name, column, len(column), True, True))
        points = libe57.CompressedVectorNode(image, row, libe57.VectorNode(image, True))
        scan = libe57.StructureNode(image)
        scan.set("guid", libe57.StringNode(image, "{1}"))
        scan.set("points", points)
        file.data3d.append(scan)
        writer = points.writer(buffers)
        writer.write(len(positions))
        writer.close()


def kitti(path, count=500, seed=4):
    """A scan of a lidar: (n, 4) float32, which is returned."""
    rng = np.random.default_rng(seed)
    table = np.concatenate([rng.uniform((-60, -30, -2), (60, 30, 3), (count, 3)), rng.random((count, 1))], 1)
    table.astype("<f4").tofile(path)
    return table.astype(np.float32)
