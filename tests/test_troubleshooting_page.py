"""The messages that docs/troubleshooting.md quotes are those of the package: what users see leads to the page."""

import ast
import re

import pytest

from .support.places import ROOT

PAGE = (ROOT / "docs/troubleshooting.md").read_text(encoding="utf-8")
# What begins as a message does, and what stands in the first column of a table of messages.
QUOTED = re.findall(r"`(?:pointshade|note): (.*?)`", PAGE) + [
    text
    for table in re.findall(r"^\| message \|.*?(?=\n\n|\Z)", PAGE, re.MULTILINE | re.DOTALL)
    for text in re.findall(r"^\| `(?:(?:pointshade|note): )?(.*?)`", table, re.MULTILINE)
]
SHORTEST = 4  # letters of a stretch that proves anything
KNOWN = 0.85  # of a quoted message's letters


def texts_of_the_package():
    """All texts in the code; `…` stands for what is filled in. Those that Python joins are one."""
    for path in (ROOT / "pointshade_gl").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                parts = [part.value if isinstance(part, ast.Constant) else "…" for part in node.values]
                yield "".join(map(str, parts))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value


ALL = "\n".join(texts_of_the_package()).replace("`", "")
PIECES = {piece.strip(" .:;,") for piece in re.split(r"…|\{\}|\n", ALL)}
PIECES = {piece for piece in PIECES if len(piece) >= SHORTEST}


def known_letters(message):
    """Return the share of a message's letters, options aside, that stand in texts of the package.

    As whole stretches between what is filled in, either there or here.
    """
    message = re.sub(r"--[a-z-]+", "…", message)
    found = [False] * len(message)
    stretches = [stretch.strip(" .:;,") for stretch in message.split("…")]
    stretches = [stretch for stretch in stretches if len(stretch) >= SHORTEST and stretch in ALL]
    for piece in [*(piece for piece in PIECES if piece in message), *stretches]:
        at = message.index(piece)
        found[at : at + len(piece)] = [True] * len(piece)
    letters = [k for k, letter in enumerate(message) if letter.isalpha()]
    return sum(found[k] for k in letters) / len(letters)


def test_there_are_messages():
    assert len(QUOTED) > 40


@pytest.mark.parametrize("message", sorted(set(QUOTED)))
def test_a_quoted_message_is_in_the_package(message):
    assert known_letters(message) >= KNOWN


def test_what_the_package_does_not_say_is_noticed():
    assert known_letters("the moon hides what this camera should have seen") < KNOWN
