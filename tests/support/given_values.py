"""What people pass, for hypothesis: cameras, depth of every kind, lights, looks, and arrays stored in every way."""

from __future__ import annotations

from tempfile import TemporaryFile

import numpy as np
from hypothesis import strategies as st

import pointshade_gl as ps

TINY = np.float32(1e-40)  # a denormal
PATTERNS = {  # of depths (h, w), from a random generator
    "plane": lambda random, h, w: 1 + 0.01 * np.arange(h)[:, None] + 0.02 * np.arange(w),
    "wall": lambda random, h, w: np.full((h, w), 2.0),
    "rough": lambda random, h, w: random.uniform(0.5, 3, (h, w)),
    "noisy": lambda random, h, w: 2 + random.normal(0, 0.01, (h, w)),
    "steps": lambda random, h, w: random.choice([1.0, 1.5, 4.0], (h, w)),
    "wide": lambda random, h, w: 10 ** random.uniform(-6, 6, (h, w)),
    "extreme": lambda random, h, w: random.choice([1e-38, TINY, 1e-10, 1, 1e10, 1e30, 3e38], (h, w)),
    "far": lambda random, h, w: random.uniform(1e5, 2e5, (h, w)),
}
HOLES = {  # where depth is known, (h, w)
    "none": lambda random, h, w: np.ones((h, w), bool),
    "all": lambda random, h, w: np.zeros((h, w), bool),
    "some": lambda random, h, w: random.random((h, w)) < 0.6,
    "most": lambda random, h, w: random.random((h, w)) < 0.05,
    "checkerboard": lambda random, h, w: np.indices((h, w)).sum(0) % 2 > 0,
    "stripes": lambda random, h, w: np.indices((h, w))[1] % 3 > 0,
    "one pixel": lambda random, h, w: np.arange(h * w).reshape(h, w) == random.integers(h * w),
    "a corner": lambda random, h, w: np.indices((h, w)).sum(0) < max(h, w) // 2,
}
MISSING = 0.0, -0.0, -1.0, np.nan, np.inf, -np.inf, -TINY

sides = st.sampled_from([1, 1, 2, 3, 4, 5, 7, 8, 9, 13, 16, 17, 23])
shapes = st.one_of(st.tuples(sides, sides), st.sampled_from([(1, 97), (131, 1), (2, 61), (37, 3)]))
seeds = st.integers(0, 2**32 - 1)
shares = st.floats(0, 1, width=32)


@st.composite
def cameras(draw, shape):
    """Of ordinary, tiny and huge focal lengths, with fy of either sign and the principal point anywhere."""
    h, w = shape
    focal = st.sampled_from([20.0, 100.0, 7.3, 1e-3, 1e5])
    fx, fy = draw(focal), draw(focal) * draw(st.sampled_from([1, 1, 1, -1]))
    middle = st.sampled_from([0.5, 0.5, 0.5, 0.1, -3.0, 40.0])
    return ps.Camera(fx, fy, (w - 1) * draw(middle), (h - 1) * draw(middle), w, h)


@st.composite
def plain_cameras(draw, shape):
    """A field of view that people have."""
    h, w = shape
    fx, fy = (draw(st.floats(0.625, 2.5, width=32)) * max(h, w) for _ in range(2))
    cx, cy = draw(shares) * (w - 1), draw(shares) * (h - 1)
    return ps.Camera(fx, fy, cx, cy, w, h)


@st.composite
def depths(draw, shape, patterns=tuple(PATTERNS), holes=tuple(HOLES)):
    """(h, w) float32 with missing values of one kind."""
    random = np.random.default_rng(draw(seeds))
    depth = PATTERNS[draw(st.sampled_from(patterns))](random, *shape)
    known = HOLES[draw(st.sampled_from(holes))](random, *shape)
    return np.where(known, depth, draw(st.sampled_from(MISSING))).astype(np.float32)


@st.composite
def colors(draw, shape, channels=None):
    random = np.random.default_rng(draw(seeds))
    return random.integers(0, 256, (*shape, channels or draw(st.sampled_from([3, 4]))), np.uint8)


@st.composite
def poses(draw, reach=1.0):
    """A rotation by any angle, and a place that may be far away."""
    random = np.random.default_rng(draw(seeds))
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    pose = np.eye(4)
    pose[:3, :3] = turn * np.sign(np.linalg.det(turn))
    pose[:3, 3] = random.uniform(-reach, reach, 3)
    return pose


@st.composite
def frames(draw, shape=None, patterns=tuple(PATTERNS), holes=tuple(HOLES), camera=cameras, color=True):
    shape = shape or draw(shapes)
    pixels = draw(colors(shape)) if color and draw(st.booleans()) else None
    return ps.Frame(pixels, draw(depths(shape, patterns, holes)), draw(camera(shape)))


@st.composite
def lights(draw, soft=True, shadows=True):
    """One light of any kind."""
    place = st.tuples(*[st.sampled_from([-1e6, -2.0, -0.3, 0.0, 0.5, 1.0, 3.0, 1e6])] * 3)
    position, direction = draw(st.one_of(st.none(), place)), draw(st.one_of(st.none(), place.filter(any)))
    size = draw(st.sampled_from([0.0, 0.0, 0.1])) if soft else 0.0
    glowing = {} if not size else {"angle": 60 * size} if position is None else {"radius": size}
    if soft and position is not None and direction is not None and draw(st.booleans()):
        glowing = {"size": (0.5, 1e6)}
    return ps.Light(
        position,
        direction,
        color=draw(st.sampled_from([(1, 1, 1), (1, 0.2, 0), (0, 0, 0), (1e9, 1, 0)])),
        intensity=draw(st.sampled_from([1.0, 0.0, 0.3, 50.0, 1e18])),
        attenuation=draw(st.sampled_from([(1, 0, 0), (0, 0, 1), (0, 1e18, 0), (1, 0.1, 2)])),
        cone=draw(st.sampled_from([(0, 45), (0, 0.001), (30, 30), (0, 90), (90, 90)])),
        shadow=shadows and draw(st.booleans()),
        **glowing,
    )


materials = st.builds(
    ps.Material,
    st.sampled_from([0.0, 0.1, 1.0, 1e18]),
    st.sampled_from([0.0, 0.9, 1e18]),
    st.sampled_from([0.0, 0.3, 1e18]),
    st.sampled_from([0.001, 1.0, 32.0, 10_000.0]),
)

WAYS = (
    "as it is", "big-endian", "Fortran", "every second", "backwards", "read-only", "mapped", "unaligned", "a list",
    "wider", "own subclass",
)  # fmt: skip


class Subclass(np.ndarray):
    pass


def stored(array, way):
    """The same values, stored another way."""
    if way == "big-endian":
        return array.astype(array.dtype.newbyteorder(">"))
    if way == "Fortran":
        return np.asfortranarray(array)
    if way == "every second":
        large = np.repeat(np.repeat(array, 2, 0), 2, 1)
        large[1::2], large[:, 1::2] = 1, 1
        return large[::2, ::2]
    if way == "backwards":
        return np.ascontiguousarray(array[::-1, ::-1])[::-1, ::-1]
    if way == "read-only":
        copy = array.copy()
        copy.flags.writeable = False
        return copy
    if way == "mapped":
        with TemporaryFile() as file:
            file.write(array.tobytes())
            file.flush()
            return np.memmap(file, array.dtype, "r", shape=array.shape)
    if way == "unaligned":
        return np.frombuffer(b"x" + array.tobytes(), array.dtype, offset=1).reshape(array.shape)
    if way == "wider" and array.dtype.kind == "f":
        return array.astype(np.float64)
    if way == "own subclass":
        return array.view(Subclass)
    return array.tolist() if way == "a list" and array.dtype.kind == "f" else array
