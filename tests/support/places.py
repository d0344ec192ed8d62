"""Where the project's files lie, wherever this file lies in it."""

from pathlib import Path

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "pyproject.toml").is_file())
TESTS = ROOT / "tests"
GOLDEN = TESTS / "golden"
FAILURES = TESTS / "failures"  # pictures of tests that failed, for the eye
README = ROOT / "README.md"
