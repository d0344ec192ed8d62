"""README and docs/ are true: every block of Python and every `pointshade ...` line runs, in a folder of a reader's.

Each block runs alone, in a fresh copy of the folder that support/reader_folder.py makes. Lines that need what no test
has (PARSED, ABSENT) are only read by the command line's own parser; turntables have FRAMES pictures, and pictures are
SMALL; blocks of Python that another test runs are in ELSEWHERE. A block that is neither Python nor commands to type is
marked `text`, `json`, ... in its page.
"""

import ast
import dis
import re
import shutil
from contextlib import nullcontext
from pathlib import Path

import pytest
from typer.main import get_command

from pointshade_gl.cli.main import COMMANDS, command_line

from .support.command import run
from .support.places import ROOT
from .support.reader_folder import PAGES, blocks, commands, make_folder
from .support.small_ray import small_ray

PARSED = {  # words of commands that only the parser reads, and why
    "view": "opens a window",
    "bench": "measures for minutes",
    "--ray": "needs a cluster",
    "--shard": "needs a queue of jobs, which sets a variable",
    "--device": "needs a second GPU",
    "--install-completion": "changes the user's shell",
}
ABSENT = re.compile(  # inputs that no test has, and why
    r"still/"  # path-traced by a script of this repository
    r"|\.(e57|r3d|heic|mat|npz|pcd|gltf|glb)$"  # files of devices and programs, whose readers have tests
)
OTHERS = {  # commands that are not ours, and what is done with them
    **dict.fromkeys(
        ("pip", "pipx", "uvx", "sudo", "apt-get", "git", "sbatch", ".", "S=$(command", ":)", "$S"), "nothing"
    ),
    **dict.fromkeys(("cd", "export", "pytest", "ruff", "pyright", "sphinx-build"), "nothing"),
    **dict.fromkeys(("python", "python3"), "the files and modules of ours that they name are looked for"),
    "mkdir": "it is run",
}
ELSEWHERE = {  # words of blocks of Python that other tests run, or nobody can
    "Viewer)": "viewer/test_application.py runs it",
    "logging.basicConfig": "test_promises.py runs its lines in processes",
    "cuda.bindings": "it needs CUDA; test_promises.py compares its calls with ours",
    "RealSenseSource": "it needs a camera",
}
FRAMES = "2"
SMALL = {"--picture-size": "160x120", "--samples": "1"}  # of pictures, where a line does not ask for more
SLOW = re.compile(  # blocks that are left to the tests of the system
    r"import ray|--samples 64|--turntable|\.mp4\b|\.gif\b|\bbatch\b|--environment sky|--splat ball|render demo|1200x900"
    r"|--views|--poses|--align|align=|--ground\b|film\.html|scan\.laz|watts=25|search=True|samples=16|samples=64|unlight|readme/vase|depth=guess|model\.onnx"
)


def marked(found):
    slow = pytest.mark.system
    return [pytest.param(one, id=one.place, marks=[slow] * bool(SLOW.search(one.text))) for one in found]


PYTHON = [one for one in blocks("python") if not any(word in one.text for word in ELSEWHERE)]


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reader")
    make_folder(folder)
    return folder


@pytest.fixture
def folder(renderer, made, tmp_path, monkeypatch):
    """The reader's working directory."""
    monkeypatch.chdir(shutil.copytree(made, tmp_path / "reader"))
    return tmp_path / "reader"


@pytest.mark.parametrize("block", marked(PYTHON))
def test_a_block_of_python_runs_alone_and_writes_its_files(folder, block):
    if re.search(r"\.mp4|\.gif", block.text):
        pytest.importorskip("imageio_ffmpeg")
    for module in re.findall(r"^import (\w+)", block.text, re.MULTILINE):
        pytest.importorskip(module)
    with small_ray() if "import ray" in block.text else nullcontext():
        exec(block.text, {"__name__": "__main__"})
    written = re.findall(r'(?:save_\w+|Film)\("(.*?)"', block.text)
    assert all((folder / name).stat().st_size for name in written)


@pytest.mark.parametrize("block", marked(blocks("sh")))
def test_a_block_for_the_shell_runs_line_by_line(folder, block):
    for words in commands(block.text):
        while re.match(r"[A-Z_]{2,}=", words[0]):  # a variable for this command only
            words.pop(0)
        name = words[0].rpartition("/")[2]
        if name == "pointshade":
            try_command(words[1:])
        elif name == "mkdir":
            Path(words[-1]).mkdir()
        else:
            assert name in OTHERS, f"{name}: mark the block as text, or see OTHERS"
            look_for_files(words[1:])


def try_command(words):
    """Run it; or let the parser read it. The files that `-o` names are there afterwards."""
    parsed = command_line(words[:1]) if words[:1] and words[0] in COMMANDS else None
    if parsed and "--help" not in words:
        get_command(parsed).commands[words[0]].make_context(words[0], words[1:])
    is_parsed = any(word in PARSED for word in words) or any(ABSENT.search(word) for word in words[1:2])
    print("parsed:" if is_parsed else "run:", *words)  # seen if the test fails
    if is_parsed:
        return
    if "--turntable" in words:
        words = [*words, "--frames", FRAMES]
    if words[0] == "render" and "-o" in words and not words[words.index("-o") + 1].endswith((".ply", ".glb")):
        words = [*words, *(word for name, value in SMALL.items() if name not in words for word in (name, value))]
    done = run(*(path for word in words for path in (sorted(map(str, Path().glob(word))) if "*" in word else [word])))
    assert done.returncode == 0, f"pointshade {' '.join(words)}: {done.stderr}"
    if "-o" in words:
        output = words[words.index("-o") + 1]
        assert [*Path().glob(re.sub(r"%\d*d|\{.*?\}|#+", "*", output))], f"{output} is not there"


def look_for_files(words):
    for word in words:
        if re.fullmatch(r"(tests|examples|assets)[./][\w./]+", word):
            path = ROOT / (word if "/" in word else word.replace(".", "/") + ".py")
            assert path.exists(), f"there is no {word}"


@pytest.mark.parametrize("word", PARSED)
def test_what_is_only_parsed_is_in_a_page(word):
    assert any(word in words for block in blocks("sh") for words in commands(block.text))


def test_the_environment_variables_that_the_package_reads_are_in_the_table():
    read = set()
    for path in (ROOT / "pointshade_gl").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        texts = [one.value for one in ast.walk(ast.parse(text)) if isinstance(one, ast.Constant)]
        texts = [one for one in texts if isinstance(one, str) and re.fullmatch(r"[A-Z][A-Z0-9]*(_[A-Z0-9]+)+", one)]
        read |= {
            one
            for one in texts
            if re.search(r"\benviron\b", text) and not one.startswith("GL_") and one not in dis.opmap
        }
    (table,) = re.findall(
        r"\| environment variable \|(.*?)(?:\n\n|\Z)", "\n\n".join(map(Path.read_text, PAGES)), re.DOTALL
    )
    assert read == {name for row in table.splitlines()[2:] for name in re.findall(r"`(\w+)`", row.split("|")[1])}
