"""Longer texts take longer in proportion, not by the square, whatever they hold: no small file stops a reader."""

import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from pointshade_gl.cli.option_groups import light_from
from pointshade_gl.files.access.folders import key_of, natural, numbers_in, words_of
from pointshade_gl.files.cameras.camera_files import read_intrinsics
from pointshade_gl.files.cameras.pose_files import read_poses
from pointshade_gl.files.containers.phones import _PACKET
from pointshade_gl.scene.noise import noise_words

ALLOWED = 2**29  # pixels: the limits of texts rise with them
PER_BYTE = 1e-5  # seconds of CPU time at most, and FREE for whatever does not depend on the length
FREE = 0.3
MEASURABLE = 0.005  # seconds: below, a ratio is noise
PIECES = [
    *("fx", "a", "K", "e", "1", "0", "-", "+", ".", "_", "/", "#", "!", "%", "\\", "\u00a0", "\u0663", "\u00e9"),
    *(
        " ",
        "  ",
        "\t",
        "\n",
        "\r\n",
        "\n  ",
        ":",
        "=",
        ",",
        ";",
        '"',
        "'",
        "[",
        "]",
        "(",
        ")",
        "{",
        "}",
        "[1,",
        "[[",
        "]]",
    ),
    *("- ", "a:\n ", "b: 1\n", "g", "m_depth", "x1\n", "640x480 p[", "f[1 2]", "1e5", "nan", "depth", "bits", ".png "),
    *(
        '{"a":',
        '"b":1,',
        "extrinsic\n",
        "1 2 3 4\n",
        "shadow ",
        "position=",
        "mm",
        "shared=",
        "<x:xmpmeta",
        "</x:xmpmeta>",
    ),
]


def of_a_file(read):
    def call(text, folder):
        (folder / "a.txt").write_bytes(text.encode())
        read(folder / "a.txt")

    return call


READERS = {
    "camera": of_a_file(lambda path: read_intrinsics(path, lambda _: None, ALLOWED)),
    "poses": of_a_file(lambda path: read_poses(path, ALLOWED)),
    "noise": lambda text, _: noise_words(text),
    "light": lambda text, _: light_from(text),
    "names": lambda text, _: (key_of(text), words_of(text), numbers_in(text), natural(text)),
    "heic": lambda text, _: _PACKET.findall(text.encode()),
}


def seconds(reader, text, folder):
    """CPU time of reading a text, well or not."""
    before = time.process_time()
    try:
        READERS[reader](text, folder)
    except ValueError as error:
        assert "\n" not in str(error)
    return time.process_time() - before


def check(reader, folder, sizes, start, middle, end=""):
    """No text of these sizes takes long, and the longest takes far less than the square of how often it is longer."""
    texts = [start + middle * (size // len(middle)) + end for size in sizes]
    for text in texts:
        taken = seconds(reader, text, folder)
        assert taken < FREE + PER_BYTE * len(text), f"{taken:.1f} s for {len(text)} characters {text[:40]!r}..."
    short, long = texts[0], texts[-1]
    longer = max(sizes[-1] // sizes[0], 2)
    limit = longer**1.5  # between in proportion and the square: far from both, whatever else the machine does
    for again in range(3):
        once = seconds(reader, short, folder)
        all = seconds(reader, long, folder) if again else taken
        if all < limit * max(once, MEASURABLE):
            return
    pytest.fail(f"{all:.2f} s for {len(long)} characters, {once:.2f} s for {len(short)}, {long[:40]!r}...")


@pytest.mark.parametrize(
    ("reader", "start", "middle", "end"),
    [
        ("camera", "fx", " ", ""),
        ("camera", "a:\n- ", " ", ":"),
        ("camera", "", "[", ""),
        ("camera", "fx=", "[ ", ""),
        ("poses", "fx", " ", ""),
        ("noise", "", "1", "x"),
        ("light", "shadow", " ", "x"),
        ("names", "", "1", ""),
        ("heic", "", "<x:xmpmeta", ""),
    ],
)
def test_what_once_took_the_square_of_its_length(tmp_path, reader, start, middle, end):
    check(reader, tmp_path, (2**13, 2**16, 2**18, 2**19), start, middle, end)


@pytest.mark.system
@pytest.mark.parametrize("reader", READERS)
@settings(max_examples=10)
@given(*[some.lists(some.sampled_from(PIECES), min_size=n, max_size=4).map("".join) for n in (0, 1, 0)])
def test_long_texts_take_no_square_of_time(reader, tmp_path_factory, start, middle, end):
    check(reader, tmp_path_factory.mktemp("text"), (2**13, 2**16, 2**20, 2**21), start, middle, end)


@pytest.mark.parametrize(
    ("start", "middle", "end"),
    [
        pytest.param("", "g{}:\n fx: 1\n", "", marks=pytest.mark.system),  # each name in a group of its own
        ("{", '"g{}": {{"fx": 1, "w{}": 2}}, ', '"a": 0}'),
        ("{", '"w{}": 1, "g{}": {{"fx": 1}}, ', '"a": 0}'),
        ("a" * 300_000 + ":\n", " b{}: 1\n", ""),  # in one with a long name
        ('{"' + "a" * 300_000 + '": {', '"b{}": 1, ', '"a": 0}}'),
        ('{"a": ' + "[" * 400, "{}, ", "1" + ', "x"]' * 400 + "}"),  # numbers in lists of other things
    ],
)
@pytest.mark.parametrize("reader", ["camera", "poses"])
def test_names_and_lists_that_lie_in_others(reader, tmp_path, start, middle, end):
    check(reader, tmp_path, (2**15, 2**17, 2**18), start, Repeated(middle), end)


class Repeated:
    """A piece of text that is another one each time: its {} is a number."""

    def __init__(self, text):
        self.text = text

    def __len__(self):
        return len(self.text)

    def __mul__(self, count):
        return "".join(self.text.format(k, k) for k in range(count))


@pytest.mark.system
@pytest.mark.parametrize("reader", READERS)
def test_ten_megabytes_take_seconds(reader, tmp_path):
    for middle in (" ", "[]", "1", "1 ", "a: 1\n", "\n", "- ", "<x:xmpmeta", "g{}:\n fx: 1\n"):
        text = "fx" + (Repeated(middle) if "{}" in middle else middle) * (10_000_000 // len(middle))
        taken = seconds(reader, text, tmp_path)
        assert taken < 30, f"{taken:.0f} s for {middle!r}"
