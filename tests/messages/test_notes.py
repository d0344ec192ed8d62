"""Notes on the command line: at most five, none with --quiet. In Python each is printed."""

import pytest

from pointshade_gl.cli.commands import render as cli_render
from pointshade_gl.messages.notes import few_notes, print_note, silence


def notes(capsys):
    return [line.removeprefix("note: ") for line in capsys.readouterr().err.splitlines()]


@pytest.mark.parametrize("count", [0, 5, 6, 8])
def test_the_sixth_and_later_notes_of_a_command_are_counted(capsys, count):
    with few_notes():
        for k in range(count):
            print_note(str(k))
    *told, last = notes(capsys) or [""]
    if count > 5:
        assert told == list("01234")
        many = {6: "1 more note", 8: "3 more notes"}[count]
        assert last == f"{many}: see all with pointshade info INPUT, none with --quiet"
    else:
        assert [*told, last] == (list("01234")[:count] or [""])


def test_the_same_note_is_printed_and_counted_once(capsys):
    with few_notes():
        for text in "aabbccddaabbee":
            print_note(text)
    assert notes(capsys) == list("abcde")


def test_python_prints_all_also_after_a_command(capsys):
    with few_notes():
        silence()
        print_note("not this")
    for k in range(9):
        print_note(str(k))
    assert notes(capsys) == list("012345678")


def test_an_error_comes_after_the_count(typed, monkeypatch):
    def load(*_, **__):
        for k in range(7):
            print_note(str(k))
        raise ValueError("no more")

    monkeypatch.setattr(cli_render, "load", load)
    code, _, errors = typed("render -o out.png")
    assert code == 2 and errors.splitlines()[5:] == [
        "note: 2 more notes: see all with pointshade info INPUT, none with --quiet",
        "pointshade: no more",
    ]
    assert typed("render -o out.png --quiet")[2] == "pointshade: no more\n"


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("line", ["render -o out.png", "normals -o out.png", "info"])
def test_quiet_leaves_the_result_alone(typed, line):
    code, output, errors = typed(f"{line} --quiet")
    assert (code, errors) == (0, "") and output
