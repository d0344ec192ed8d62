"""An error that nobody raised on purpose is a bug: it is called so, with exit code 70, and is no user's mistake."""

import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.batch import jobs
from pointshade_gl.batch import processes as workers
from pointshade_gl.batch.jobs import Job
from pointshade_gl.batch.map import Drawing, _drawn
from pointshade_gl.checks.arguments import check_count, check_type
from pointshade_gl.cli import inputs as cli_inputs
from pointshade_gl.cli.commands import render_command  # noqa: F401 - so that it takes none of what is patched
from pointshade_gl.files.frames import sequences as frame_sequence
from pointshade_gl.notes.errors import Bug, error_text, is_expected

from ..support import frames, view_sets

ERRORS = {
    "of NumPy": lambda: np.zeros(3).reshape(2, 2),
    "of Python": lambda: int("x"),
    "of json": lambda: json.loads("{"),
    "a TypeError": lambda: len(3),
    "a key": lambda: {}["x"],
    "an attribute": lambda: None.x,
    "an index": lambda: [][1],
    "a division": lambda: 1 // 0,
}


def raised(call):
    with pytest.raises(Exception) as info:
        call()
    return info.value


@pytest.mark.parametrize("call", [*ERRORS.values(), lambda: check_count(len("x") / "y", "n")])
def test_what_nobody_raised_on_purpose_is_a_bug(call):
    error = raised(call)
    assert not is_expected(error)
    assert "this is a bug in pointshade_gl" in error_text(error) and "\n" not in error_text(error)
    assert error_text(error).startswith(type(error).__name__)


@pytest.mark.parametrize(
    "call",
    [
        lambda: check_count(-1, "n"),
        lambda: check_type(3, str, "n"),
        lambda: ps.Camera(0, 1, 1, 1, 2, 2),
        lambda: ps.load_frame("nowhere"),
        lambda: Path("nowhere").read_bytes(),
        lambda: ps.render(3),
        lambda: ps.Frame(None, np.zeros(3), None),
        lambda: ps.Light((1, 2)),
        lambda: ps.Appearance(normals="best"),
    ],
)
def test_what_was_raised_on_purpose_is_none(call):
    error = raised(call)
    assert is_expected(error) and "bug" not in error_text(error)
    assert is_expected(ValueError("from another process, without a traceback"))


def test_an_assertion_of_ours_is_a_bug(renderer):
    with ps.Renderer() as fresh:
        assert not is_expected(raised(fresh._pipeline.read))  # asserts that something was drawn


@pytest.mark.parametrize("name", ERRORS)
def test_a_command_says_that_it_is_a_bug(typed, monkeypatch, name):
    monkeypatch.setattr(cli_inputs, "load", lambda *_, **__: ERRORS[name]())
    code, _, errors = typed("render vase -o out.png")
    assert code == 70 and errors.count("\n") == 1 and "Traceback" not in errors
    assert "this is a bug in pointshade_gl" in errors and "please report it" in errors
    assert "(in cli/inputs.py:" in errors  # the last line of ours


@pytest.mark.parametrize("name", ["vase", "nowhere"])
def test_the_traceback_is_shown_when_asked_for(typed, monkeypatch, name):
    """Of a bug, and of an expected error, too."""
    if name == "vase":
        monkeypatch.setattr(cli_inputs, "load", lambda *_, **__: ERRORS["a key"]())
    for value, is_shown in (("1", True), ("0", False), ("", False)):
        monkeypatch.setenv("POINTSHADE_DEBUG", value)
        code, _, errors = typed(f"render {name} -o out.png")
        assert code == (70 if name == "vase" else 2)
        assert ("Traceback" in errors) == is_shown and errors.splitlines()[-1].startswith("pointshade: ")


def test_without_stderr_a_bug_is_a_sentence(monkeypatch):
    monkeypatch.setenv("POINTSHADE_DEBUG", "1")
    monkeypatch.setattr(sys, "stderr", None)
    assert "this is a bug" in error_text(raised(ERRORS["a key"]))


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("name", ERRORS)
def test_a_batch_goes_on_after_a_bug(monkeypatch, tmp_path, name):
    """In the item that it failed, the sentence says what it is."""
    job = Job("vase", tmp_path / "a.png", view=ps.View(picture_size=(8, 6)))
    monkeypatch.setattr(jobs, "read", lambda _: ERRORS[name]())
    outcome = workers.outcome_of(job)
    assert isinstance(outcome, workers.Failed) and outcome.kind == "failed"
    assert "this is a bug in pointshade_gl" in outcome.sentence
    monkeypatch.undo()
    assert isinstance(workers.outcome_of(job), jobs.Done)


@pytest.mark.usefixtures("renderer")
def test_map_tells_a_bug_from_a_frame_that_cannot_be_drawn(monkeypatch):
    assert isinstance(_drawn(Drawing("nowhere", ps.View()), 0), OSError)
    monkeypatch.setattr(sys.modules["pointshade_gl.batch.map"], "loaded", lambda _: ERRORS["of NumPy"]())
    error = _drawn(Drawing("vase", ps.View()), 0)
    assert type(error) is RuntimeError and "this is a bug in pointshade_gl" in str(error)


@pytest.mark.parametrize("name", ERRORS)
def test_a_bug_in_a_frame_of_a_sequence_fails_that_frame(monkeypatch, tmp_path, name):
    source = ps.open_source(view_sets.write_views(tmp_path / "set", view_sets.three_views()))
    usual = frame_sequence.assemble

    def assemble(parts, *rest):
        return ERRORS[name]() if parts.number == 1 else usual(parts, *rest)

    monkeypatch.setattr(frame_sequence, "assemble", assemble)
    skipped = []
    assert len(list(ps.prefetched(source, skipped.append))) == 2
    assert len(skipped) == 1 and skipped[0].startswith("frame 1: ") and "this is a bug" in skipped[0]
    error = raised(lambda: source[1])
    assert isinstance(error, Bug) and not is_expected(error) and error_text(error) == skipped[0]


@pytest.mark.usefixtures("renderer")
def test_a_renderer_starts_anew_after_a_bug_in_the_middle(monkeypatch):
    """A ValueError is no sign that nothing was begun."""
    from pointshade_gl.pipeline.accumulation import Accumulator

    with ps.Renderer() as renderer:
        expected = renderer.render(frames.sphere(), samples=3)
        monkeypatch.setattr(Accumulator, "_draw_ground", lambda *_: ERRORS["of NumPy"]())
        before = renderer._pipeline
        with pytest.raises(ValueError):
            renderer.render(frames.sphere(), samples=3, ground=True)
        assert renderer._pipeline is not before
        assert np.array_equal(renderer.render(frames.sphere(), samples=3), expected)
        before = renderer._pipeline
        with pytest.raises(ValueError):
            renderer.render(frames.sphere(), samples=0)
        assert renderer._pipeline is before


def test_the_window_stays_open_after_a_bug(open_viewer, monkeypatch):
    viewer = open_viewer()
    before = viewer.frame
    monkeypatch.setattr("pointshade_gl.viewer.document.read_dropped", lambda _: ERRORS["a key"]())
    viewer.open([os.devnull])
    assert viewer.frame is before
    assert viewer.messages.text.startswith("not opened: KeyError") and "this is a bug" in viewer.messages.text
