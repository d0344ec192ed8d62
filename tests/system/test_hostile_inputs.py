"""Files from strangers: each ends within 2 s and 500 MB in one sentence, and opens nothing outside its folder.

All are loaded by one process, which may not take more memory and watches what it opens.
"""

import os
import sys
from pathlib import Path

import pytest

import pointshade_gl as ps

from ..support import hostile_files as made
from ..support.durations import slowness
from ..support.hostile_child import outcomes as outcomes_of
from ..support.hostile_table import ALLOWED, AMOUNTS, FINE, NAMES, NUMBERS
from ..support.places import ROOT

pytestmark = [pytest.mark.system, pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs links and pipes")]
REFUSED = NAMES | AMOUNTS | NUMBERS


def job(place, name, call, build, options):
    """What the process is to load: a path, options, or both."""
    place.mkdir(parents=True)
    what = build(place)
    path, more = what if isinstance(what, tuple) else (None, what) if isinstance(what, dict) else (what, {})
    options = {key: value if isinstance(value, float | int) else str(value) for key, value in (more | options).items()}
    arguments = [] if path is None else [str(path)]
    return {"name": name, "call": call, "folder": str(place), "arguments": arguments, "options": options}


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")
    groups = {"refused": (REFUSED, {}), "fine": (FINE, {}), "allowed": (ALLOWED, {"allow_outside": True})}
    jobs = [
        job(folder / f"{group}{k}" / "in", f"{group}: {name}", *row[:2], options)
        for group, (rows, options) in groups.items()
        for k, (name, row) in enumerate(rows.items())
    ]
    return outcomes_of(jobs, folder)


def check_opened(outcome, secret):
    """Files that were opened lie in the job's folder, or belong to Python or to this package. Returns secret ones."""
    folder = Path(outcome["folder"])
    python = sys.prefix, sys.base_prefix, *filter(None, sys.path)
    places = folder, outcome["temporary"], ROOT, *python, "/proc", "/sys", os.devnull
    own = [Path(place).resolve() for place in places]
    opened = [(folder / path).resolve() for path in outcome["opened"]]
    others = [path for path in opened if not any(path.is_relative_to(place) for place in own)]
    secrets = [path for path in others if path.parent.name == "secret"]
    assert others == (secrets if secret else [])
    return secrets


def check_soon(outcome):
    """Within 2 s, on a slow machine within longer: how slow it is takes long to measure, and is rarely asked."""
    assert outcome["seconds"] < 2 or outcome["seconds"] < 2 * slowness()


@pytest.mark.parametrize("name", REFUSED)
def test_it_ends_soon_in_one_sentence_and_opens_nothing_else(outcomes, name):
    outcome = outcomes[f"refused: {name}"]
    sentence = REFUSED[name][2]
    assert outcome["kind"] in ("ValueError", "OSError", "FileNotFoundError", "IsADirectoryError"), outcome
    assert sentence in outcome["sentence"] and outcome["is_told"], outcome
    assert "\n" not in outcome["sentence"] and len(outcome["sentence"]) < 700
    check_soon(outcome)
    check_opened(outcome, secret=False)


@pytest.mark.parametrize("name", NAMES)
def test_a_name_that_leaves_is_answered_with_the_option(outcomes, name):
    sentence = outcomes[f"refused: {name}"]["sentence"]
    if "leaves" in sentence or "absolute" in sentence:
        assert sentence.endswith((": pass allow_outside=True to allow it", "and nothing is fetched"))


@pytest.mark.parametrize("name", FINE)
def test_it_loads_as_soon(outcomes, name):
    outcome = outcomes[f"fine: {name}"]
    assert not outcome["kind"], outcome
    check_soon(outcome)


@pytest.mark.parametrize("name", ALLOWED)
def test_the_option_lets_files_name_others(outcomes, name):
    """And the watch over opened files sees it."""
    outcome = outcomes[f"allowed: {name}"]
    assert not outcome["kind"], outcome
    assert check_opened(outcome, secret=True)


def test_the_limit_is_raised_by_its_option(tmp_path):
    path = made.frame(tmp_path)
    with pytest.raises(ValueError, match=r"depth.png has 8x6 pixels, the limit is 47: pass max_pixels=48 to allow it"):
        ps.load_frame(path, max_pixels=47)
    assert ps.load_frame(path, max_pixels=48).points_known == 48
    with pytest.raises(ValueError, match="max_pixels must be a finite number above 0, got -1"):
        ps.load_frame(path, max_pixels=-1)


def test_planned_frames_pass_the_limit():
    from pointshade_gl.files.access.content import MAX_PIXELS, check_pixels

    check_pixels(12_288, 8_192, "a frame", MAX_PIXELS)
