"""The documentation is complete and whole: every public name has its entry, and every link and picture is there."""

import re
import subprocess
import sys

import pytest

import pointshade_gl as ps
from pointshade_gl import viewer
from pointshade_gl.cli.main import COMMANDS

from .support.links import Markdown, Page, broken_links, html, markdown, pages
from .support.places import README, ROOT
from .test_user_types import public_names

DOCS = ROOT / "docs"
WRITTEN = [one for one in pages(DOCS, "md") if "auto_examples" not in one.parts]
WRITTEN += [README, ROOT / "CONTRIBUTING.md", *pages(ROOT / "examples", "md")]
SAME = {
    "ps.gltf.load_scene",
    "ps.gltf.save_scene",
    "ps.live.live_set",
    "ps.sources.open_source",
    "ps.sources.prefetched",
}


def named_by_module():
    """The public names at the tops of modules, as the reference spells them."""
    names = {name for name in public_names() if re.fullmatch(r"ps(\.[a-z_]+)?\.\w+", name)}
    names = {name for name in names - SAME if name.count(".") == 1 or name.split(".")[1] in ps._MODULES}
    names -= {f"ps.{name}" for name in ps._MODULES}
    return {name.replace("ps.", "pointshade_gl.", 1) for name in names} | {
        f"pointshade_gl.viewer.{name}" for name in viewer.__all__
    }


def test_each_public_name_has_its_entry_in_the_reference_and_its_line_in_the_index():
    texts = {one.stem: one.read_text(encoding="utf-8") for one in pages(DOCS / "reference", "md")}
    entries = re.findall(r"^\.\. auto(?!module)\w+:: (\S+)$", "\n".join(texts.values()), re.MULTILINE)
    lines = re.findall(r"^   ~(\S+)$", texts["index"], re.MULTILINE)
    assert sorted(entries) == sorted(named_by_module())
    assert sorted(lines) == sorted(entries)


def test_names_that_the_reference_leaves_out_are_those_that_it_has_elsewhere():
    for name in SAME:
        _, module, short = name.split(".")
        assert getattr(getattr(ps, module), short) is getattr(ps, short)


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_between_the_written_pages_lead_somewhere(path):
    """The gallery is there only once the site is built, which is followed as a whole below."""
    broken = broken_links([path], ROOT, markdown)
    assert [one for one in broken if one != "docs/index.md: auto_examples/index"] == []


@pytest.mark.system
def test_the_site_is_built_and_whole(tmp_path):
    """Every warning is an error; every link, anchor and picture is there, and nothing is fetched from elsewhere."""
    pytest.importorskip("sphinx")
    line = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d", tmp_path / "trees"]
    site = tmp_path / "site"
    done = subprocess.run([*line, DOCS, site], capture_output=True, text=True, timeout=400, cwd=ROOT)
    assert (done.returncode, done.stderr) == (0, "")
    assert broken_links(pages(site, "html"), site, html) == []
    assert fetched(site) == set()
    assert members() - set().union(*(html(path).anchors for path in pages(site / "reference", "html"))) == set()
    anchors = html(site / "reference" / "command-line.html").anchors
    assert {f"pointshade-{name}" for name in COMMANDS} <= anchors
    assert {"cmdoption-pointshade-render-light", "cmdoption-pointshade-batch-to"} <= anchors


def fetched(site):
    """What pages ask for from elsewhere: they are read without a network, except where a reader clicks on a link."""
    asked = re.compile(r"<(?:script|img|iframe|link)\b[^>]*\b(?:src|href)=\"(?:https?:)?//[^\"]*\"")
    return {one for path in pages(site, "html") for one in asked.findall(path.read_text(encoding="utf-8"))}


def members():
    """The anchors of all public methods and properties."""
    owners = {re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower(): name for name in ps.__all__ if name[0].isupper()}
    found = set()
    for name in public_names():
        made, _, member = name.partition(".")
        value = getattr(getattr(ps, owners.get(made, "")), member, None) if made in owners else None
        if isinstance(value, property) or callable(value):
            found.add(f"pointshade_gl.{owners[made]}.{member}")
    return found


def test_what_pages_fetch_and_the_members_are_found(tmp_path):
    (tmp_path / "a.html").write_text('<a href="https://b.c"></a><img alt="" src="//d.e/f.png"><script src="g.js">')
    assert fetched(tmp_path) == {'<img alt="" src="//d.e/f.png"'}
    assert {"pointshade_gl.Renderer.render", "pointshade_gl.Camera.rays"} <= members()


def test_broken_links_are_found(tmp_path):
    (tmp_path / "a.md").write_text("# A b\n[one](b.md#c-d) [two](b.md#x) ![three](c.png) `[four](d.md)`\n")
    (tmp_path / "b.md").write_text(
        '# C d\n```\n[five](e.md)\n```\n<img src="f.png"> [six](https://g.h) [seven](#c-d)\n'
    )
    found = broken_links(pages(tmp_path, "md"), tmp_path, markdown)
    assert found == ["a.md: b.md#x", "a.md: c.png", "b.md: f.png"]


def test_anchors_are_those_of_github():
    assert Markdown("# A `b` & c\n## A\n## A\n").anchors >= {"a-b--c", "a", "a-1"}
    assert Page('<a href="x#y"></a><p id="z">').anchors >= {"z"}
