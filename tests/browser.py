"""Chromium as people use it: pages, with the browser's own mouse, keys and fingers. No page may ask for anything."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

FLAGS = (
    *("--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update"),
    *("--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
)
WIDTH, HEIGHT = 640, 480  # CSS pixels of a page


def find_chromium() -> str | None:
    """The path of the system's Chromium."""
    return next((path for name in ("chromium", "chromium-browser") if (path := shutil.which(name))), None)


class Opened:
    """A page that is open, and what it asked for and complained about since."""

    def __init__(self, page):
        self.page, self.requests, self.complaints = page, [], []
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("console", self._listen)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))

    def _listen(self, message) -> None:
        if message.type in ("warning", "error") and "GL Driver Message" not in message.text:  # of SwiftShader's speed
            self.complaints.append(message.text)

    @property
    def outside(self) -> list[str]:
        """Requests for anything but the page itself and what lies in it."""
        return [url for url in self.requests if not url.startswith(("file:", "data:", "blob:", "about:"))]


class Browser:
    """Opens pages, each in a context of its own."""

    def __init__(self, chromium, folder: Path):
        self.chromium, self.folder, self._count = chromium, folder, 0

    @classmethod
    @contextmanager
    def launched(cls, folder: Path, flags: tuple[str, ...] = FLAGS) -> Iterator[Browser]:
        from playwright.sync_api import sync_playwright

        with sync_playwright() as playwright:
            path = find_chromium()
            chromium = playwright.chromium.launch(executable_path=path, args=list(flags), chromium_sandbox=False)
            try:
                yield cls(chromium, folder)
            finally:
                chromium.close()

    @contextmanager
    def opened(self, html: str | Path, **options) -> Iterator[Opened]:
        """A page, its text or its file, in a new context with these options. It must not ask for anything outside."""
        path = html if isinstance(html, Path) else self._written(html)
        context = self.chromium.new_context(**({"viewport": {"width": WIDTH, "height": HEIGHT}} | options))
        try:
            opened = Opened(context.new_page())
            opened.page.goto(path.as_uri())
            yield opened
            assert opened.outside == []
        finally:
            context.close()

    def _written(self, html: str) -> Path:
        self._count += 1
        path = self.folder / f"{self._count}.html"
        path.write_text(html, encoding="utf-8")
        return path
