"""Chromium as people use it: pages, with the browser's own mouse, keys and fingers. No page may ask for anything."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

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
        self.page, self.requests, self.complaints, self.errors = page, [], [], []
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("console", self._listen)
        page.on("pageerror", lambda error: self.errors.append(str(error)))

    def _listen(self, message) -> None:
        if message.type in ("warning", "error") and "GL Driver Message" not in message.text:  # of SwiftShader's speed
            self.complaints.append(message.text)

    def wait_until_drawn(self) -> None:
        """Until a page of this project shows its picture."""
        self.wait_for("document.body.classList.contains('live')")

    def wait_for(self, condition: str) -> None:
        """Until an expression holds. Playwright's own way would need `eval`, which pages forbid."""
        end = time.monotonic() + 60
        while not self.page.evaluate(condition):
            assert time.monotonic() < end and not self.errors, f"{condition}: {self.errors or self.complaints}"
            self.page.wait_for_timeout(20)

    @property
    def state(self) -> dict[str, Any]:
        """What the page shows, after all events."""
        return self.page.evaluate("new Promise(requestAnimationFrame).then(() => pointshade.state)")

    def fingers(self, *paths, steps: int = 3) -> None:
        """Fingers that go down one after the other, along straight lines ((x, y), (x, y)) at once, and leave."""
        session = self.page.context.new_cdp_session(self.page)

        def send(kind, places):
            points = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(places)]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        for count in range(1, len(paths) + 1):
            send("touchStart", [start for start, _ in paths[:count]])
        for k in range(1, steps + 1):
            send("touchMove", [[a + (b - a) * k / steps for a, b in zip(*path, strict=True)] for path in paths])
        for count in range(len(paths) - 1, 0, -1):
            send("touchEnd", [end for _, end in paths[:count]])
        send("touchEnd", [])

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
    def opened(self, html: str | Path, before: str = "", **options) -> Iterator[Opened]:
        """A page, its text or its file, in a new context with these options. It must not ask for anything outside.

        before  a script that runs before those of the page
        """
        path = html if isinstance(html, Path) else self._written(html)
        context = self.chromium.new_context(**({"viewport": {"width": WIDTH, "height": HEIGHT}} | options))
        try:
            context.add_init_script(before)
            opened = Opened(context.new_page())
            opened.page.goto(path.as_uri())
            yield opened
            assert opened.outside == [] and opened.errors == []
        finally:
            context.close()

    def _written(self, html: str) -> Path:
        self._count += 1
        path = self.folder / f"{self._count}.html"
        path.write_text(html, encoding="utf-8")
        return path
