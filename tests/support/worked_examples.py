"""The worked examples of docs/contributing.md: the files that they write and change, and the tests that they name."""

import re

from .places import ROOT

PAGE = ROOT / "docs" / "contributing.md"
_BLOCK = re.compile(r"```(\w+)\n(.*?)```\n", re.DOTALL)
_PATH = re.compile(r"`([\w/]+\.\w+)`")


def sections():
    """The text of each example by its title, such as "a pass"."""
    text = PAGE.read_text(encoding="utf-8")
    return dict(re.findall(r"^## Example: (.*?)\n(.*?)(?=^## )", text, re.DOTALL | re.MULTILINE))


def apply(text, root):
    """Make the changes of an example in a copy of the repository. Returns the lines of its commands.

    The path of a file is the last one named before its block. A new file is a whole block; a diff has parts between
    lines of `@@`, and each part's old lines must be there once.
    """
    commands, before = [], ""
    for block in _BLOCK.finditer(text):
        before, language, body = text[: block.start()], *block.groups()
        if language == "text":
            commands += body.splitlines()
        elif language != "python":  # which needs no changes
            path = root / _PATH.findall(before.rpartition("```\n")[2])[-1]
            if language == "diff":
                path.write_text(changed(path.read_text(encoding="utf-8"), body, path.name), encoding="utf-8")
            else:
                assert not path.exists(), path
                path.write_text(body, encoding="utf-8")
    return commands


def changed(text, diff, name):
    """A text with the changes of a diff. Raises AssertionError for a part whose old lines are not there once."""
    for part in re.split(r"^@@\n", diff, flags=re.MULTILINE):
        lines = part.splitlines(keepends=True)
        old = "".join(line[1:] for line in lines if line[0] != "+")
        new = "".join(line[1:] for line in lines if line[0] != "-")
        if old == new:  # only shows where the next part is
            continue
        assert text.count(f"\n{old}") == 1, f"{name}: these lines are there {text.count(old)} times:\n{old}"
        text = text.replace(f"\n{old}", f"\n{new}")
    return text
