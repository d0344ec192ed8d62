"""Where the project's files lie, wherever this file lies in it."""

import os
import tempfile
from pathlib import Path

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "pyproject.toml").is_file())
TESTS = ROOT / "tests"
GOLDEN = TESTS / "golden"
_WRITTEN = TESTS if os.access(TESTS, os.W_OK) else Path(tempfile.gettempdir())  # a checkout may be read-only
FAILURES = _WRITTEN / "failures"  # pictures of tests that failed, for the eye
README = ROOT / "README.md"
REAL_FRAMES = Path(os.environ.get("POINTSHADE_DATA", ROOT.parent / "shared" / "data")).absolute()
