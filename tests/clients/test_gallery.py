"""The gallery: each example runs as a user types it and makes its stored picture; the page shows them all."""

import ast
import io
import re
import sys

import numpy as np
import pytest
from PIL import Image

from ..support.example_scripts import EXAMPLES, PICTURES, run_example
from ..support.gallery import (
    ELSEWHERE,
    SHOWN,
    arguments,
    examples,
    gallery_page,
    has_recordings,
    runs_alone,
    save_stored,
)

SHORT = {  # about a second each
    "lit_frame", "unlight", "normal_maps", "view_depth", "estimators", "own_normals", "holes",
    "own_context",
}  # fmt: skip
README = EXAMPLES / "README.md"
named = {"argvalues": examples(), "ids": [one.name for one in examples()]}


@pytest.mark.parametrize("one", **named)
class TestEach:
    def test_it_says_what_it_shows(self, one):
        assert 5 < len(one.title) < 50 and one.text.split("\n\n")[0].endswith(".")

    def test_its_picture_is_stored_and_small(self, one):
        assert one.picture.stat().st_size < 150_000

    def test_a_recording_is_its_argument(self, one):
        """So that the picture can be made again by whoever has the recording, and the example runs without it."""
        takes = "sys.argv" in (text := one.path.read_text(encoding="utf-8")) or "${1:-" in text
        assert one.name not in SHOWN or takes or one.name == "fastapi_upload"

    def test_other_programs_are_installed_by_one_line(self, one):
        lines = re.findall(r"pip install [^\n\"\\]+", one.path.read_text(encoding="utf-8"))
        assert len(lines) == (one.name in ELSEWHERE - {"page"})

    def test_it_uses_nothing_but_public_names(self, one):
        if one.path.suffix == ".py":
            imported = [node for node in ast.walk(ast.parse(one.path.read_text())) if isinstance(node, ast.ImportFrom)]
            assert not [node.module for node in imported if (node.module or "").startswith("pointshade_gl")]


def test_the_page_is_that_of_today(request):
    if request.config.getoption("--update-golden"):
        README.write_text(gallery_page(), encoding="utf-8")
        pytest.skip("rewrote README.md")
    assert README.read_text(encoding="utf-8") == gallery_page(), "pytest --update-golden writes it"


def test_most_pictures_show_what_somebody_recorded():
    assert sum(one.name not in SHOWN for one in examples()) <= -(-len(examples()) // 3)


def test_nothing_lies_there_that_the_page_does_not_show():
    shown = {one.path for one in examples()} | {README, PICTURES}
    shown = {EXAMPLES / path.relative_to(EXAMPLES).parts[0] for path in shown}
    assert {path for path in EXAMPLES.iterdir() if path.name != "__pycache__"} == shown
    assert {path.name for path in PICTURES.iterdir()} == {one.picture.name for one in examples()}
    assert sum(path.stat().st_size for path in PICTURES.iterdir()) < 3_000_000


@pytest.mark.gl
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(one.name, marks=() if one.name in SHORT else pytest.mark.system)
        for one in examples()
        if runs_alone(one)
    ],
)
def test_it_makes_its_picture(renderer, tmp_path, stored, name):
    if sys.platform == "win32" and (EXAMPLES / f"{name}.sh").exists():
        pytest.skip("no sh")
    run_example(tmp_path, name, *arguments(name))
    with Image.open(tmp_path / f"{name}.png") as image:
        stored(name, np.asarray(image))


@pytest.mark.system
@pytest.mark.gl
@pytest.mark.parametrize(
    "one", [one for one in examples() if one.name in SHOWN and runs_alone(one)], ids=lambda one: one.name
)
def test_without_a_recording_it_shows_what_is_built_in(renderer, tmp_path, one):
    if not has_recordings(one.name):
        pytest.skip("the test above ran it so")
    if sys.platform == "win32" and one.path.suffix == ".sh":
        pytest.skip("no sh")
    run_example(tmp_path, one.name)
    with Image.open(tmp_path / f"{one.name}.png") as image:
        assert np.asarray(image).std() > 5


@pytest.mark.system
@pytest.mark.gl
@pytest.mark.browser
def test_the_page_to_send_is_lit(renderer, request, browser, tmp_path):
    run_example(tmp_path, "page", *arguments("page"))
    page = browser.chromium.new_page(viewport={"width": 480, "height": 360})
    page.goto((tmp_path / "page.html").as_uri())
    page.locator("body.live").wait_for(timeout=60_000)
    page.mouse.move(150, 60)
    page.wait_for_timeout(2000)  # at rest it becomes smooth
    picture = np.asarray(Image.open(io.BytesIO(page.screenshot())))[..., :3]
    page.close()
    if request.config.getoption("--update-golden") and has_recordings("page"):
        save_stored("page", picture)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 5000
