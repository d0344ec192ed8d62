"""A photograph with depth as phones write it: pillow-heif packs two pictures, the second is then declared a depth."""

import struct
from io import BytesIO

import numpy as np

DEPTH = b"urn:mpeg:hevc:2015:auxid:2\0"
APPLE = (
    '<x:xmpmeta xmlns:x="adobe:ns:meta/"><apdi:AuxiliaryImageType>disparity</apdi:AuxiliaryImageType>'
    "<apdi:FloatMinValue>{low}</apdi:FloatMinValue><apdi:FloatMaxValue>{high}</apdi:FloatMaxValue>"
    "<depthData:IntrinsicMatrixReferenceWidth>{width}</depthData:IntrinsicMatrixReferenceWidth>"
    "<depthData:IntrinsicMatrixReferenceHeight>{height}</depthData:IntrinsicMatrixReferenceHeight>"
    "<depthData:IntrinsicMatrix><rdf:Seq>{matrix}</rdf:Seq></depthData:IntrinsicMatrix></x:xmpmeta>"
)


def heic(color, depth=None, exif=b"", apple=None, is_turned=True, icc_profile=None):
    """The bytes of a file with (h, w, 3) colour and (h', w') depth codes, both uint8, and the values of Apple's XMP.

    is_turned  the file says of the depth, too, how the phone was held
    """
    import pillow_heif

    file = pillow_heif.HeifFile()
    for array in (color, depth):
        if array is not None:
            mode = "RGB" if array.ndim == 3 else "L"
            file.add_frombytes(mode, array.shape[1::-1], np.ascontiguousarray(array).tobytes())
    out = BytesIO()
    file[0].info["icc_profile"] = icc_profile
    file.save(out, quality=-1, chroma=444, exif=exif or None)
    data = out.getvalue()
    if depth is not None:
        data = declare_depth(data, is_turned)
    return data + (box(b"free", apple_xmp(**apple).encode()) if apple else b"")


def apple_xmp(low, high, width, height, camera):
    fx, fy, cx, cy = camera
    matrix = "".join(f"<rdf:li>{number}</rdf:li>" for number in (fx, 0, 0, 0, fy, 0, cx, cy, 1))
    return APPLE.format(low=low, high=high, width=width, height=height, matrix=matrix)


def box(kind, body):
    return struct.pack(">I4s", len(body) + 8, kind) + body


def boxes(data):
    """The boxes in a row of them, as lists of kind and body."""
    found, at = [], 0
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        found.append([kind, data[at + 8 : at + size]])
        at += size
    return found


def joined(parts):
    return b"".join(box(kind, body) for kind, body in parts)


def declare_depth(data, is_turned):
    """The second picture becomes the depth of the first."""
    parts = boxes(data)
    meta = dict_of(parts)[b"meta"]
    inside = boxes(meta[1][4:])
    places = dict_of(inside)
    pictures = picture_items(places[b"iinf"][1])
    properties = boxes(places[b"iprp"][1])
    store, links = dict_of(properties)[b"ipco"], dict_of(properties)[b"ipma"]
    store[1] += box(b"auxC", bytes(4) + DEPTH)
    kinds = [kind for kind, _ in boxes(store[1])]
    for kind in (b"auxC", b"irot") if is_turned else (b"auxC",):
        if kind in kinds:
            links[1] = with_property(links[1], pictures[1], kinds.index(kind) + 1)
    places[b"iprp"][1] = joined(properties)
    reference = box(b"auxl", struct.pack(">3H", pictures[1], 1, pictures[0]))
    if b"iref" in places:
        places[b"iref"][1] += reference
    else:
        inside.append([b"iref", bytes(4) + reference])
    longer = len(joined(inside)) + 4 - len(meta[1])
    places[b"iloc"][1] = moved(places[b"iloc"][1], longer)
    meta[1] = meta[1][:4] + joined(inside)
    return joined(parts)


def dict_of(parts):
    return {part[0]: part for part in parts}


def picture_items(body):
    """The numbers of the hvc1 items."""
    return [
        struct.unpack_from(">H", entry, 4)[0]
        for kind, entry in boxes(body[6:])
        if kind == b"infe" and entry[8:12] == b"hvc1"
    ]


def with_property(body, item, place):
    """A list of links between items and properties (8 bits each) with one more."""
    out, at = body[:8], 8
    for _ in range(struct.unpack_from(">I", body, 4)[0]):
        number, count = struct.unpack_from(">HB", body, at)
        entries = body[at + 3 : at + 3 + count]
        at += 3 + count
        if number == item:
            entries += bytes([0x80 | place])
        out += struct.pack(">HB", number, len(entries)) + entries
    return out


def moved(body, longer):
    """A list of where items lie in the file (version 0 or 1, offsets of 4 bytes), all further back."""
    version, sizes = body[0], struct.unpack_from(">H", body, 4)[0]
    offset, length, base = sizes >> 12, sizes >> 8 & 15, sizes >> 4 & 15
    assert version in (0, 1) and base in (0, 4) and offset in (0, 4), "another layout than pillow-heif's"
    data, at = bytearray(body), 8
    for _ in range(struct.unpack_from(">H", body, 6)[0]):
        in_file = version == 0 or not struct.unpack_from(">H", body, at + 2)[0] & 15
        at += 6 if version == 1 else 4
        if base and in_file:
            struct.pack_into(">I", data, at, struct.unpack_from(">I", body, at)[0] + longer)
        at += base + 2
        for _ in range(struct.unpack_from(">H", body, at - 2)[0]):
            if offset and not base and in_file:
                struct.pack_into(">I", data, at, struct.unpack_from(">I", body, at)[0] + longer)
            at += offset + length
    return bytes(data)
