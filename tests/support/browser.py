"""Chromium as people use it: pages, with the browser's own mouse, keys and fingers. No page may ask for anything."""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

FLAGS = (
    *("--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update"),
    *("--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
)
NO_SCREEN = "--disable-gpu-compositing"  # nobody looks at it: it starts faster, and so does each of its pages
WIDTH, HEIGHT = 640, 480  # CSS pixels of a page
SMALL = 200, 200  # of one whose own drawing is read
NEVER = 1_000_000_000  # milliseconds


def find_chromium() -> str | None:
    """The path of the system's Chromium."""
    return next((path for name in ("chromium", "chromium-browser") if (path := shutil.which(name))), None)


def altered(html: str, **constants: int) -> str:
    """A page with other values of constants in its scripts."""
    for name, value in constants.items():
        html, count = re.subn(rf"\b{name} = [0-9.e]+(?=[,;])", f"{name} = {value}", html)
        assert count == 1, name
    return html


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
    """Opens pages: each in a context of its own, or one after the other in a tab of which only the drawing is read."""

    def __init__(self, playwright, folder: Path):
        self.folder, self._playwright, self._count = folder, playwright, 0
        self._started: list[Any] = []
        self._tabs: list[Opened] = []  # that are free

    @classmethod
    @contextmanager
    def launched(cls, folder: Path) -> Iterator[Browser]:
        from playwright.sync_api import sync_playwright

        with sync_playwright() as playwright:
            browser = cls(playwright, folder)
            try:
                yield browser
            finally:
                for each in browser._started:
                    each.close()

    @cached_property
    def chromium(self):
        """Chromium as people use it."""
        return self._start(*FLAGS)

    @cached_property
    def unseen(self):
        """Chromium without a screen."""
        return self._start(*FLAGS, NO_SCREEN)

    def _start(self, *flags: str):
        path = find_chromium()
        launch = self._playwright.chromium.launch
        self._started.append(launch(executable_path=path, args=list(flags), chromium_sandbox=False))
        return self._started[-1]

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

    @contextmanager
    def shown(
        self, html: str, before: str = "", refines: bool = False, size: tuple[int, int] = SMALL
    ) -> Iterator[Opened]:
        """A page that has drawn its first picture, in a small tab that other pages had before. It must not ask for
        anything outside.

        before   a script that runs before those of the page
        refines  at rest it becomes finer by itself; otherwise only if `drawing` is told to
        size     of the tab, CSS pixels
        """
        html = (html if refines else altered(html, REST=NEVER)).replace(
            "<head>", f"<head><script>{{ {before} }}</script>", 1
        )
        tab = self._tabs.pop() if self._tabs else self._new_tab()
        tab.page.set_viewport_size({"width": size[0], "height": size[1]})
        for heard in (tab.requests, tab.complaints, tab.errors):
            heard.clear()
        try:
            tab.page.goto(self._written(html).as_uri())
            tab.wait_until_drawn()
            yield tab
            assert tab.outside == [] and tab.errors == []
        finally:
            self._tabs.append(tab)

    def _new_tab(self) -> Opened:
        contexts = self.unseen.contexts or [self.unseen.new_context()]
        return Opened(contexts[0].new_page())

    def _written(self, html: str) -> Path:
        self._count += 1
        path = self.folder / f"{self._count}.html"
        path.write_text(html, encoding="utf-8")
        return path
