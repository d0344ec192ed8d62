"""Plays several sources at once, each at its own rate, as the views of one thing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from ..files.frames.sequences import FrameSequence
from ..scene.frame import Frame
from .playback import Playback
from .views import Views


class MultiPlayback:
    """What Playback is for one source, for several: `advance` gives the Views to show, and never waits.

    sources  each a Frame, a Sequence of frames, which repeats, or any other iterable (a camera)
    fps      frames per second of each; None: as fast as they come
    skipped, wake  as for Playback
    """

    index, total = -1, None  # there is no common number

    def __init__(
        self,
        sources: Sequence[Frame | Iterable[Frame]],
        fps: Sequence[float | None],
        skipped: Callable[[str], None] = lambda _: None,
    ):
        self.wake: Callable[[], None] = lambda: None
        named = enumerate(sources)  # as the panel calls them
        self._names = tuple(s.folder.name if isinstance(s, FrameSequence) else f"source {k}" for k, s in named)
        self._players: list[Playback] = []
        self._views: Views | None = None
        for source, rate, name in zip(sources, fps, self._names, strict=True):
            stream = iter([source]) if isinstance(source, Frame) else source
            self._players.append(Playback(stream, rate, lambda sentence, name=name: skipped(f"{name}: {sentence}")))
            self._players[-1].wake = lambda: self.wake()

    @property
    def indices(self) -> list[int]:
        """Of each source its frame's, as for Playback."""
        return [player.index for player in self._players]

    def first(self) -> Views:
        """Waits for the first frame of each source. Raises ValueError for a source that has none."""
        frames = tuple(player.first() for player in self._players)
        self._views = Views(frames, self._names, frames[0], (True,) * len(frames), "")
        return self._views

    def advance(self, now: float) -> Views | None:
        """The views with every frame that is due, or None if none is. Raises what a source raised."""
        return self._with([player.advance(now) for player in self._players])

    def patience(self, now: float) -> float | None:
        """As Playback: of the source that is due first."""
        waits = [wait for player in self._players if (wait := player.patience(now)) is not None]
        return min(waits, default=None)

    @property
    def is_paused(self) -> bool:
        return self._players[0].is_paused

    def toggle(self) -> None:
        """Pauses all sources, or continues them."""
        for player in self._players:
            player.toggle()

    def change_rate(self, factor: float) -> None:
        """Plays all sources faster (a factor above 1) or slower."""
        for player in self._players:
            player.change_rate(factor)

    @property
    def rate(self) -> float | None:
        """Of the first source; None: as fast as its frames come."""
        return self._players[0].rate

    def step(self, direction: int) -> Views | None:
        """Pauses all sources, and steps each one frame forwards or back."""
        return self._with([player.step(direction) for player in self._players])

    def close(self) -> None:
        """Stops the threads."""
        for player in self._players:
            player.close()

    def _with(self, new: Sequence[Frame | None]) -> Views | None:
        if self._views is None or not any(new):
            return None
        self._views = self._views.with_frames(new)
        return self._views
