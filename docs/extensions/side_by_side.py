"""Pictures side by side: on GitHub only HTML does that, `<p> <img src=... width=...> ... </p>`.

Sphinx does not look into HTML. Here these become images of one paragraph, which page.css puts beside each other.
"""

import re

from sphinx.application import Sphinx

PARAGRAPH = re.compile(r"^<p[^>]*>\s*((?:<img [^>]*>\s*)+)</p>$", re.MULTILINE)
PICTURE = re.compile(r"<img ([^>]*)>")


def as_markdown(match: re.Match[str]) -> str:
    pictures = [dict(re.findall(r'(\w+)="([^"]*)"', one)) for one in PICTURE.findall(match[1])]
    return "\n".join(f"![{one.get('alt', '')}]({one['src']})" for one in pictures)


def read(app: Sphinx, name: str, source: list[str]) -> None:
    source[0] = PARAGRAPH.sub(as_markdown, source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
