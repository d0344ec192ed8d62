"""Links of written pages, and where they lead: of HTML as a browser takes it, of Markdown as GitHub shows it."""

import re
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

FENCE = re.compile(r"^ *(`{3,}|~{3,}|:{3,}).*?^ *\1 *$", re.DOTALL | re.MULTILINE)
MARKDOWN_LINK = re.compile(r"\]\(<?([^()\s>]+)>?(?: \"[^\"]*\")?\)")
ATTRIBUTES = {"href", "src", "poster", "data"}


class Page(HTMLParser):
    """What a page of HTML links to, and the anchors that it has."""

    def __init__(self, text):
        super().__init__()
        self.links, self.anchors = [], {"", "top"}
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in ATTRIBUTES and value:
                self.links.append(value)
            elif name == "srcset":
                self.links += [one.split()[0] for one in value.split(",")]
            elif name == "id" or (tag == "a" and name == "name"):
                self.anchors.add(value)


@cache
def html(path):
    return Page(path.read_text(encoding="utf-8"))


class Markdown:
    """The same of Markdown, with pieces of HTML in it."""

    def __init__(self, text):
        prose = re.sub(r"`[^`\n]+`", lambda code: code[0].replace("](", "] ("), FENCE.sub("", text))
        pieces = Page(prose)
        self.links = MARKDOWN_LINK.findall(prose) + pieces.links
        self.anchors = pieces.anchors | set(slugs(re.findall(r"^#+ +(.*?)#* *$", prose, re.MULTILINE)))


@cache
def markdown(path):
    return Markdown(path.read_text(encoding="utf-8"))


def slugs(headings):
    """The anchors that GitHub gives headings, of those that repeat with a number."""
    seen = {}
    for heading in headings:
        text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        slug = re.sub(r"[^\w\- ]", "", text).replace(" ", "-")
        seen[slug] = seen.get(slug, -1) + 1
        yield f"{slug}-{seen[slug]}" if seen[slug] else slug


def broken_links(files, root, read):
    """Lines `file: link` for each link of these files to a file or anchor that is not there, or outside the root.

    read  `html` or `markdown`, of which a page with this suffix is made
    Links to other sites are not followed.
    """
    suffix = f".{'md' if read is markdown else 'html'}"
    found = []
    for path in files:
        for link in dict.fromkeys(read(path).links):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            is_there = target.exists() and target.is_relative_to(root)
            is_page = is_there and target.suffix == suffix
            if not is_there or (is_page and unquote(parts.fragment) not in read(target).anchors):
                found.append(f"{path.relative_to(root)}: {link}")
    return found


def pages(folder, suffix):
    """Files below a folder, in order."""
    return sorted(Path(folder).rglob(f"*.{suffix}"))
