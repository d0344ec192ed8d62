"""Text over the picture: messages, the help, and what the lower edge shows of the surface."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from ..files.clouds.cloud_columns import ColorLegend
from ..files.depth.depth_files import ramp
from ..notes.notes import print_warning
from ..scene.orbit import State
from ..scene.values import BLUE, ColorScale
from .events import Event
from .state import ShownPicture, frame_in

SECONDS = 4.0
CLOSES = "(a key or a click closes this)"
BACKDROP, BRIGHT, DIM = (16, 17, 20, 200), (238, 238, 238, 255), (170, 176, 186, 255)
Sections = Sequence[tuple[str, Sequence[tuple[str, str]]]]  # a title, and rows of two columns
KEY_COLOR = (255, 214, 140, 255)
MOST_STACKS = 3  # of the help, side by side
LONGEST = 32  # letters of a legend's title
POINTS = 14  # height of a letter's box, pixels at scale 1


class Messages:
    """Keeps the text that is shown. What threads skip waits until the window's own thread shows it."""

    kept: str  # what stays until the user has read it; "" if nothing does

    def __init__(self) -> None:
        self._skipped: deque[str] = deque()  # from the threads that read streams
        self._shown_lines: set[str] = set()
        self.clear()

    def clear(self) -> None:
        self.kept, self._message, self._until = "", "", math.inf

    @property
    def text(self) -> str:
        """All that is shown; "" if nothing is."""
        return "\n".join(filter(None, (self.kept and f"{self.kept}\n{CLOSES}", self._message)))

    def keep(self, text: str) -> None:
        """Shows why something failed until `clear`, in place of other messages, and prints it."""
        self.clear()
        self.kept = text
        print_warning(text)

    def say(self, text: str, seconds: float | None = None) -> None:
        self._message, self._until = text, time.perf_counter() + (SECONDS if seconds is None else seconds)

    def skip(self, text: str) -> None:
        """Shows later, and once, why a frame was skipped. For any thread."""
        self._skipped.append(text)

    def update(self, now: float) -> None:
        """Shows what was skipped, and takes the text away when its time is over."""
        while self._skipped:
            if (text := self._skipped.popleft()) not in self._shown_lines:  # a sequence that repeats meets it again
                self._shown_lines.add(text)
                self.say(f"skipped: {text}")
                print_warning(f"skipped: {text}")
        if self._until < now:
            self._message, self._until = "", math.inf

    def patience(self, now: float) -> float | None:
        """Seconds until `update` has something to do; None: not before there is a message."""
        if self._skipped:
            return 0.0
        return None if self._until == math.inf else max(self._until - now, 0.0)


def draw_message(text: str, scale: float, width: int) -> NDArray[np.uint8]:
    """A line on a dark strip, or several lines that are as wide as the window at most: (h, w, 4) uint8."""
    font, pad = ImageFont.load_default(POINTS * scale), round(7 * scale)
    most = width - 2 * pad
    broken = (line for part in text.split("\n") for line in _in_lines(part.split(" "), " ", font, most))
    lines = [_shortened(line, font, most) for line in broken]
    wide = min(round(max(map(font.getlength, lines))) + 2 * pad, width)
    return np.asarray(_boxed(lines, font, scale, pad, wide)[0])


def _boxed(lines: Sequence[str], font: Any, scale: float, pad: int, wide: int, above: int = 0) -> tuple[Any, int]:
    """A picture of lines, below room for others, and how high a line is."""
    high = round(1.3 * POINTS * scale)
    image = Image.new("RGBA", (max(wide, 1), (above + len(lines)) * high + pad), BACKDROP)
    for k, line in enumerate(lines, above):
        ImageDraw.Draw(image).text((pad, (pad + high) / 2 + k * high), line, BRIGHT, font, anchor="lm")
    return image, high


def _in_lines(parts: Iterable[str], between: str, font: Any, width: float) -> list[str]:
    """The parts side by side, as many in a line as it has room for; only a part that is longer alone is wider."""
    lines: list[str] = []
    for part in parts:
        longer = f"{lines[-1]}{between}{part}" if lines and lines[-1] else part
        if lines and font.getlength(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(part)
    return lines


def _shortened(line: str, font: Any, width: float) -> str:
    """The line, or as much of its beginning and its end as is no wider."""
    if font.getlength(line) <= width:
        return line
    cuts = (f"{line[: n // 3]}…{line[len(line) - (n - n // 3) :]}" for n in range(len(line) - 1, 0, -1))
    return next((cut for cut in cuts if font.getlength(cut) <= width), f"…{line[-1:]}")


def draw_strip(text: str, share: float | None, scale: float, width: int, high: int) -> NDArray[np.uint8]:
    """A line of text, and below it a bar that is filled to a share (None: no bar): (high, width, 4) uint8."""
    font, bar = ImageFont.load_default(0.95 * POINTS * scale), round(5 * scale)
    pad = round(10 * scale)
    wide = width if share is not None else min(round(font.getlength(text)) + 2 * pad, width)
    image = Image.new("RGBA", (max(wide, 1), high), (*BACKDROP[:3], 150))
    draw = ImageDraw.Draw(image)
    draw.text((pad, (high - bar) / 2), _shortened(text, font, width - 2 * pad), BRIGHT, font, anchor="lm")
    if share is not None:
        draw.rectangle((0, high - bar, width, high), (90, 94, 102, 230))
        draw.rectangle((0, high - bar, round(share * width), high), (255, 214, 140, 255))
    return np.asarray(image)


BUTTONS = ("light", "L"), ("shadow", "S"), ("view", "V"), ("save", "P"), ("help", "H")  # words on the bar, and keys
GREETING_SECONDS = 12.0
LINGERS, FADES = 1.5, 0.6  # seconds that the bar stays after the mouse has left it; and of them in which it fades
SOFTWARE = "\nA software renderer draws: pictures are right, but slow"


def greeting(light_mode: bool, is_software: bool, opens: bool) -> str:
    """Return what the window shows first. opens: files that are dropped onto it."""
    first = "Move the mouse: the light follows" if light_mode else "The light stays where it was put: L lets it follow"
    drop = "   Drop files to open them." if opens else ""
    return f"{first}.   Drag to turn.{drop}   H for help" + SOFTWARE * is_software


SeenButtons = tuple[float, tuple[tuple[str, str, bool], ...], str]  # how opaque, word, key, is on; the mouse is over


class Buttons:
    """A bar at the upper edge, for those who know no keys yet. It is there at first, and while the mouse is near."""

    def __init__(self, until: float, saves: bool):  # saves: whether pictures can be saved
        self._until, self.over = until, ""
        self._words = tuple(pair for pair in BUTTONS if saves or pair[1] != "P")
        self._scale, self._fits = 1.0, False

    def handle(self, event: Event) -> str | None:
        """Return the key of the button that was pressed, "" for what else is the bar's, None for what is not."""
        if not self._fits or event.kind not in ("move", "press", "release", "leave"):
            return None
        boxes, high = button_boxes(self._scale, self._words), 2 * POINTS * self._scale
        left, right = boxes[0][0], boxes[-1][1]
        is_near = event.kind != "leave" and event.x < right + high and event.y < 3 * high
        if is_near and event.kind == "move":
            self._until = max(self._until, time.perf_counter() + LINGERS)
        over = [key for (start, end), (_, key) in zip(boxes, self._words, strict=True) if start <= event.x < end]
        is_on = bool(over) and left <= event.y < left + high and event.kind != "leave"
        before, self.over = self.over, over[0] if is_on else ""
        if event.kind == "press" and event.key == "left" and is_on:
            return self.over
        return "" if event.kind == "release" and before and event.key == "left" and is_on else None

    def seen(self, state: State, width: int, scale: float) -> SeenButtons | None:
        """Return what `draw_buttons` draws; None: the bar is not there, also where the picture is not as wide."""
        boxes = button_boxes(scale, self._words)
        self._scale, self._fits = scale, boxes[-1][1] + boxes[0][0] <= width
        left = self._until - time.perf_counter()
        if left <= 0 or not self._fits:
            return None
        is_on = {"L": state.light_mode, "S": state.shadows, "V": not state.finish.is_light, "P": False, "H": state.help}
        opaque = 1.0 if left > FADES else 0.25 + 0.25 * int(3 * left / FADES)
        return opaque, tuple((*pair, is_on[pair[1]]) for pair in self._words), self.over

    def patience(self, now: float) -> float | None:
        """Return the seconds until it looks otherwise by itself; None: not."""
        left = self._until - now
        return None if left <= -0.1 or not self._fits else max(left - FADES, 0.0) + 0.01 if left > FADES else FADES / 3


@cache
def button_boxes(scale: float, words: tuple[tuple[str, str], ...] = BUTTONS) -> list[tuple[float, float]]:
    """Return where each button begins and ends, pixels from the left."""
    font, at, boxes = ImageFont.load_default(POINTS * scale), 10 * scale, []
    for word, key in words:
        boxes.append((at, at + font.getlength(f"{word} {key}") + 20 * scale))
        at = boxes[-1][1] + 4 * scale
    return boxes


def draw_buttons(opaque: float, seen: tuple[tuple[str, str, bool], ...], over: str, scale: float) -> NDArray[np.uint8]:
    """Draw the bar: (h, w, 4) uint8."""
    boxes = button_boxes(scale, tuple((word, key) for word, key, _ in seen))
    high, font = 2 * POINTS * scale, ImageFont.load_default(POINTS * scale)
    left = boxes[0][0]
    image = Image.new("RGBA", (round(boxes[-1][1] - left), round(high)), (0, 0, 0, 0))
    draw = ImageDraw.Draw(image)
    for (start, end), (word, key, is_lit) in zip(boxes, seen, strict=True):
        fill = (84, 88, 98, 235) if key == over else (58, 62, 72, 225) if is_lit else BACKDROP
        draw.rounded_rectangle((start - left, 0, end - left - 1, high - 1), 5 * scale, fill)
        draw.text((start - left + 10 * scale, high / 2), f"{word} ", BRIGHT, font, anchor="lm")
        draw.text((end - left - 10 * scale, high / 2), key, KEY_COLOR, font, anchor="rm")
    pixels = np.array(image)
    pixels[..., 3] = np.rint(opaque * pixels[..., 3])
    return pixels


LUMINANCE = 0.2126, 0.7152, 0.0722  # of red, green and blue
OUTLINED_DARK = 64  # of 255: luminance above which a marker's outline is dark
FINER = 4  # how much larger a marker is drawn before it becomes smooth


def draw_marker(
    radius: float, color: tuple[float, float, float], degrees: float | None, is_behind: bool
) -> NDArray[np.uint8]:
    """A disc, or a ring if the light comes from behind, and an arrow: light goes that way. (side, side, 4) uint8.
    degrees: of the arrow, from the right to below; None: the light comes from the viewer, and goes straight ahead."""
    r, middle = radius * FINER, 4 * radius * FINER
    image = Image.new("RGBA", (round(2 * middle), round(2 * middle)), (0, 0, 0, 0))
    draw, fill = ImageDraw.Draw(image), tuple(round(255 * min(max(c, 0.0), 1.0)) for c in color)
    other = 0 if np.dot(fill, LUMINANCE) > OUTLINED_DARK else 255  # on grounds like itself the outline shows it
    for grown, paint in ((0.25 * r, (other, other, other, 210)), (0.0, (*fill, 255))):
        if degrees is not None:
            way = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
            aside = way[::-1] * (-1, 1)
            for far, near, half in ((2.4, 0.0, 0.18), (3.4, 2.2, 0.6)):  # shaft, tip
                base, width = middle + near * r * way, half * r + grown
                tip = [middle + (far * r + grown) * way] if near else [middle + far * r * way + side for side in (
                    width * aside, -width * aside)]  # fmt: skip
                draw.polygon([tuple(one) for one in (base - width * aside, base + width * aside, *tip)], paint)
        draw.ellipse((*[middle - r - grown] * 2, *[middle + r + grown] * 2), paint)
    if is_behind:
        draw.ellipse((*[middle - 0.7 * r] * 2, *[middle + 0.7 * r] * 2), (0, 0, 0, 110))
    return np.asarray(image.reduce(FINER))


def draw_legend(legend: ColorLegend, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A picture, (h, w, 4) uint8, with what its colours mean in its lower right corner."""
    height, width = image.shape[:2]
    scale = max(1.0, min(height, width) / 720)
    key = _legend(legend, scale)
    fits = min(1.0, 0.9 * height / key.height, 0.5 * width / key.width)
    if fits < 1:
        key = _legend(legend, max(fits * scale, 1 / POINTS))
    whole, gap = Image.fromarray(image), round(8 * scale)
    whole.alpha_composite(key, (max(width - key.width - gap, 0), max(height - key.height - gap, 0)))
    return np.asarray(whole)


def _legend(legend: ColorLegend, scale: float) -> Any:
    """A title, and below it a box for each label, or the row of colours upright between its two ends."""
    font, pad, high = ImageFont.load_default(POINTS * scale), round(7 * scale), round(1.3 * POINTS * scale)
    is_row = len(legend.colors) != len(legend.texts)
    box, rows = round(0.8 * POINTS * scale), 6 if is_row else len(legend.texts)
    title = legend.title if len(legend.title) <= LONGEST else f"{legend.title[: LONGEST - 1]}…"
    wide = max(font.getlength(title), *(2 * box + font.getlength(text) for text in legend.texts), 1)
    image = Image.new("RGBA", (round(wide) + 2 * pad, (rows + 1) * high + 2 * pad), BACKDROP)
    draw, left = ImageDraw.Draw(image), pad + 1.6 * box
    draw.text((pad, pad + high / 2), title, BRIGHT, font, anchor="lm")
    top = pad + high
    if is_row:
        upright = legend.colors[::-1][:, None].repeat(box, 1)
        image.paste(Image.fromarray(upright).resize((box, rows * high)), (pad, top))
        for text, y in zip(legend.texts, (rows - 0.5, 0.5), strict=True):
            draw.text((left, top + y * high), text, BRIGHT, font, anchor="lm")
        return image
    for k, (text, color) in enumerate(zip(legend.texts, legend.colors.tolist(), strict=True)):
        y = top + (k + 0.5) * high
        draw.rectangle((pad, y - box / 2, pad + box, y + box / 2), tuple(color))
        draw.text((left, y), text, BRIGHT, font, anchor="lm")
    return image


def draw_table(sections: Sections, scale: float, width: int, height: int) -> NDArray[np.uint8]:
    """Sections with a title and rows of two columns, in as few stacks side by side as fit the window, or in those that
    shrink least; if need be cut: (h, w, 4) uint8."""
    made = [_table(sections, scale, stacks) for stacks in range(1, MOST_STACKS + 1)]
    fits = [min(1.0, width / one.shape[1], height / one.shape[0]) for one in made]
    best = int(np.argmax(fits))
    table, smaller = made[best], scale * fits[best]
    while (table.shape[0] > height or table.shape[1] > width) and smaller > 1 / POINTS:  # letters shrink in steps
        table, smaller = _table(sections, smaller, best + 1), 0.96 * smaller
    return table[:height, :width]


def _table(sections: Sections, scale: float, stacks: int) -> NDArray[np.uint8]:
    font = ImageFont.load_default(POINTS * scale)
    pad, line, apart = round(16 * scale), round(1.4 * POINTS * scale), round(20 * scale)
    parts = _stacked(sections, stacks)
    seconds = [apart + max([font.getlength(left) for left, right in part if right], default=0) for part in parts]
    widths = [
        max(second + max(font.getlength(right) for _, right in part), max(font.getlength(left) for left, _ in part))
        for part, second in zip(parts, seconds, strict=True)
    ]
    size = round(sum(widths) + 2 * pad * len(parts)), round(2 * pad + max(map(len, parts)) * line)
    image = Image.new("RGBA", size, (*BACKDROP[:3], 232))
    draw, x = ImageDraw.Draw(image), float(pad)
    for part, second, wide in zip(parts, seconds, widths, strict=True):
        for k, (left, right) in enumerate(part):
            y = pad + (k + 0.5) * line
            draw.text((x, y), left, KEY_COLOR if right else DIM, font, anchor="lm")
            draw.text((x + second, y), right, BRIGHT, font, anchor="lm")
        x += wide + 2 * pad
    return np.asarray(image)


def _stacked(sections: Sections, stacks: int) -> list[list[tuple[str, str]]]:
    """All rows in stacks of the same height, each section after its title and a gap."""
    lines = [line for title, rows in sections for line in (("", ""), (title, ""), *rows)][1:]
    high = -(-len(lines) // stacks)
    parts = [lines[start : start + high] for start in range(0, len(lines), high)]
    return [part[1:] if part[0] == ("", "") else part for part in parts]


NOTHING = "no surface here"
BETWEEN = "   "
RAMP = 120.0  # width of the colours, pixels at scale 1


def values_of(picture: ShownPicture, column: int, row: int, surface: NDArray[np.float32] | None) -> tuple[str, ...]:
    """Return where a pixel's surface lies in the world, how far away, which way it faces; of a frame also its pixel.
    surface: as of `Renderer.read_surface`."""
    if surface is None:
        return (NOTHING,)
    camera, pose, shown = picture.camera, picture.pose, picture.shown
    normal, depth = pose[:3, :3] @ surface[:3], float(surface[3])
    x, y, z = point = camera.unproject(np.float64(depth), np.array([column, row], float), pose=pose)
    parts = [f"x {x:.3f}  y {y:.3f}  z {z:.3f} m", f"depth {depth:.3f} m"]
    if normal.any():
        parts.append("normal {:.2f} {:.2f} {:.2f}".format(*(normal + 0.0)))
    if frame := frame_in(shown):
        u, v = np.rint(frame.camera.project(point, pose=frame.pose)).astype(int).tolist()
        parts.append(f"pixel {u}, {v}")
    return tuple(parts)


def legend(scale: ColorScale | None) -> tuple[str, str, str] | None:
    """Return what stands before, on and after the colours of a scale; None where they have no range."""
    if scale is None or scale.show == "normals":
        return None
    if scale.show == "depth":
        return f"depth {scale.low:.3f} m", f"{scale.middle:.2f}", f"{scale.high:.3f} m"
    return f"normals off by {scale.low:.0f}°", f"{scale.middle:.0f}°", f"{scale.high:.0f}°+"


def draw_readout(
    ends: tuple[str, str, str] | None, values: tuple[str, ...], scale: float, width: int
) -> NDArray[np.uint8]:
    """Draw the colours of a scale between its ends, and values below, in lines of this width: (h, w, 4) uint8."""
    font, pad = ImageFont.load_default(0.95 * POINTS * scale), round(7 * scale)
    lines = _in_lines(values, BETWEEN, font, width - 2 * pad)
    wide = max(map(font.getlength, lines), default=0.0)
    first = font.getlength(ends[0]) + pad if ends else 0.0
    if ends:
        wide = max(wide, first + RAMP * scale + pad + font.getlength(ends[2]))
    image, line = _boxed(lines, font, scale, pad, min(round(wide) + 2 * pad, width), above=int(ends is not None))
    if ends:
        draw, left, middle = ImageDraw.Draw(image), round(pad + first), (pad + line) / 2
        box = round(RAMP * scale), round(0.7 * POINTS * scale)
        colors = Image.fromarray(ramp("turbo")[None, round(255 * BLUE) :]).resize(box)
        image.paste(colors, (left, round(middle - box[1] / 2)))
        small = ImageFont.load_default(0.75 * POINTS * scale)
        draw.text((pad, middle), ends[0], BRIGHT, font, anchor="lm")
        draw.text((left + box[0] / 2, middle), ends[1], BACKDROP[:3], small, anchor="mm")
        draw.text((left + box[0] + pad, middle), ends[2], BRIGHT, font, anchor="lm")
    return np.asarray(image)
