"""Texts beside the drawn bodies: title, colour bar or legend, axes and scale bar."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from PIL import ImageDraw, ImageFont

from conoid.cases.figures import exacts

from . import camera, part_colours
from .fields import Field
from .picture_layout import Box, Sheet
from .scales import Scale

_AXES = "#d1495b", "#2f9e60", "#3f74d8"
_MOST_NAMES = 24
"""Largest number of text lines of a legend (chosen value)."""


@dataclass(frozen=True)
class Ink:
    """Colours of texts and of the background."""

    ink: str
    soft: str
    paper: str


LIGHT, DARK = Ink("#1d2733", "#5a6775", "#ffffff"), Ink("#e6ebf0", "#9aa7b4", "#14191f")
NEUTRAL = Ink("#7d8894", "#7d8894", "#ffffff")
"""Colours that are readable on a light and on a dark background."""


@cache
def face(size: int) -> Any:
    """Returns the font DejaVu Sans of matplotlib; without matplotlib, the font of Pillow."""
    found = find_spec("matplotlib")
    if found is not None and found.origin is not None:
        path = Path(found.origin).parent / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf"
        if path.is_file():
            return ImageFont.truetype(str(path), size)
    return ImageFont.load_default(size)


def width(text: str, size: int) -> int:
    """Returns the width of a text line, pixels."""
    return int(face(size).getlength(text) + 1.0)


def fitted(text: str, size: int, room: float) -> str:
    """Returns a text that is at most ``room`` pixels wide; the end of a longer text is replaced by dots."""
    if width(text, size) <= room:
        return text
    while text and width(f"{text}…", size) > room:
        text = text[:-1]
    return f"{text.rstrip()}…" if text else ""


def folded(text: str, size: int, room: float) -> list[str]:
    """Breaks a text into lines of at most ``room`` pixels. Each line has at least one word."""
    lines: list[str] = []
    for word in text.split():
        if lines and width(f"{lines[-1]} {word}", size) <= room:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return lines


class Painter:
    """Writes texts on a picture, in colours that suit the background."""

    def __init__(self, image: Any, laid: Sheet, ink: Ink) -> None:
        self._draw, self._laid, self._ink = ImageDraw.Draw(image), laid, ink
        self._font = laid.font

    def _text(
        self, place: tuple[float, float], text: str, anchor: str = "la", size: int = 0, soft: bool = False
    ) -> None:
        colour = self._ink.soft if soft else self._ink.ink
        self._draw.text(place, text, fill=colour, font=face(size or self._font), anchor=anchor)

    def title(self, title: str, when: str) -> None:
        """Writes the title at the left and the time at the right, above all panels."""
        left, _, across, down = self._laid.head
        margin = self._font
        taken = width(when, self._font) + 2 * margin if when else 0
        self._text((left + margin, 0.55 * down), fitted(title, self._font, across - 2 * margin - taken), "lm")
        if when:
            self._text((across - margin, 0.55 * down), when, "rm", soft=True)

    def bar(self, field: Field, scale: Scale, extremes: tuple[float, float]) -> None:
        """Draws the colour bar with its values, and writes extremes of the field that lie beyond the ends of the
        bar.
        """
        left, top, across, down = self._laid.side
        lines = heading(field, across - self._font, self._font)
        step = round(1.35 * self._font)
        y = top + round(0.08 * down)
        for line in lines:
            self._text((left, y), line)
            y += step
        y += round(0.6 * step)
        if scale.uniform is not None:
            self._swatch((left, y), scale.colours[0], exacts([scale.uniform], field.unit, 5)[0])
            self._text((left, y + 1.2 * step), "everywhere", soft=True)
            return
        small = max(8, round(0.85 * self._font))
        height = max(4 * step, down - (y - top) - 6 * step)
        self._gradient((left, y, round(1.1 * self._font), height), scale)
        for tick, text in zip(scale.ticks, exacts(scale.ticks, "", 5), strict=True):
            at = y + height * (1.0 - (tick - scale.low) / (scale.high - scale.low))
            self._draw.line([(left + 1.1 * self._font, at), (left + 1.4 * self._font, at)], fill=self._ink.soft)
            self._text((left + 1.7 * self._font, at), text, "lm", small)
        if extremes[0] < scale.low or extremes[1] > scale.high:
            first, last = exacts(extremes, "", 4)
            for n, line in enumerate(folded(f"values from {first} to {last}", small, across - self._font)):
                self._text((left, y + height + step * (0.8 + 0.9 * n)), line, size=small, soft=True)

    def _gradient(self, box: Box, scale: Scale) -> None:
        left, top, across, down = box
        n = len(scale.colours)
        for row in range(down):
            colour = scale.colours[min(n - 1, int((1.0 - (row + 0.5) / down) * n))]
            self._draw.line([(left, top + row), (left + across - 1, top + row)], fill=colour)
        self._draw.rectangle([left, top, left + across - 1, top + down - 1], outline=self._ink.soft)

    def _swatch(self, place: tuple[float, float], colour: str, text: str) -> None:
        size = round(0.8 * self._font)
        (x, y), room = place, self._laid.side[2] - 2.3 * self._font
        self._draw.rectangle([x, y, x + size, y + size], fill=colour, outline=self._ink.soft)
        for n, line in enumerate(folded(text, self._font, room) or [""]):
            self._text(
                (x + 1.4 * self._font, y + 0.5 * size + 1.35 * self._font * n), fitted(line, self._font, room), "lm"
            )

    def legend(self, entries: Sequence[tuple[str, str]], note: str) -> None:
        """Draws a legend of names and their colours, with as many lines as fit."""
        left, top, _, down = self._laid.side
        step = round(1.6 * self._font)
        room = max(1, min(_MOST_NAMES, int((0.84 * down) / step) - 2 - (1 if note else 0)))
        shown = entries if len(entries) <= room else entries[: room - 1]
        y = top + round(0.08 * down)
        for name, colour in shown:
            self._swatch((left, y), colour, name)
            y += step
        if len(shown) < len(entries):
            self._text((left, y), f"and {len(entries) - len(shown)} more", soft=True)
            y += step
        if note:
            for line in folded(note, self._font, self._laid.side[2] - self._font):
                self._text((left, y + 0.4 * step), line, soft=True)
                y += round(1.35 * self._font)

    def when(self, panel: Box, text: str) -> None:
        """Writes the time of a panel; only pictures with several panels call this function."""
        self._text((panel[0] + self._font, panel[1] + 0.6 * self._font), text)

    def notes(self, panel: Box, lines: Sequence[str]) -> None:
        """Writes notes below the body, for example about pieces of debris outside of the picture."""
        small = max(8, round(0.85 * self._font))
        room = panel[2] - 14 * self._font
        for n, line in enumerate(reversed(lines)):
            y = panel[1] + panel[3] - self._font * (0.9 + 1.2 * n)
            self._text((panel[0] + 7 * self._font, y), fitted(line, small, room), "ls", small, soft=True)

    def triad(self, panel: Box) -> None:
        """Draws the coordinate axes. Axes that point away from the camera are drawn first."""
        eye = self._laid.eye
        seen = np.stack([eye.right, -eye.above, eye.towards])
        ends = 2.1 * self._font * seen[:2]
        letters = ends * (1.0 + 0.42 / np.maximum(0.35, np.hypot(*seen[:2])))
        room = 1.3 * self._font
        x0 = panel[0] + room - min(0.0, float(letters[0].min()))
        y0 = panel[1] + panel[3] - room - max(0.0, float(letters[1].max()))
        for axis in np.argsort(seen[2]).tolist():
            end, place = ((x0 + at[0, axis], y0 + at[1, axis]) for at in (ends, letters))
            self._draw.line([(x0, y0), end], fill=_AXES[axis], width=max(2, round(0.14 * self._font)))
            self._draw.text(place, "xyz"[axis], fill=_AXES[axis], font=face(self._font), anchor="mm")

    def length(self, panel: Box) -> None:
        """Draws the scale bar, a line of a round length, below the colour bar or at the lower right of the panel."""
        room = self._laid.pixel * (self._laid.side[2] - 1.6 * self._font) if self._laid.side[2] else np.inf
        length, text = camera.scale_bar(self._laid.eye, self._laid.aspect, room)
        panel = self._laid.side if self._laid.side[2] else panel
        x = panel[0] + panel[2] - 1.2 * self._font
        y, long, tick = panel[1] + panel[3] - 1.2 * self._font, length / self._laid.pixel, 0.3 * self._font
        wide = max(1, round(0.09 * self._font))
        for line in ([(x - long, y), (x, y)], [(x - long, y - tick), (x - long, y)], [(x, y - tick), (x, y)]):
            self._draw.line(line, fill=self._ink.ink, width=wide)
        self._text((x - 0.5 * long, y - 1.3 * tick), text, "ms")


def heading(field: Field, room: float, size: int) -> list[str]:
    """Returns the label of a field with its unit, broken into text lines."""
    return folded(f"{field.label}, {field.unit}" if field.unit else field.label, size, room)


def beside_bar(field: Field, scale: Scale, size: int) -> int:
    """Returns the width of a colour bar together with its texts, pixels."""
    small = max(8, round(0.85 * size))
    uniform = scale.uniform is not None
    texts = exacts([scale.uniform], field.unit, 5) if uniform else exacts(scale.ticks, "", 5)
    values = 1.7 * size + max(width(text, size if uniform else small) for text in texts)
    words = max(width(word, size) for word in f"{field.label}, {field.unit}".split())
    return round(max(values, words, 6.0 * size) + 1.5 * size)


def beside_legend(entries: Sequence[tuple[str, str]], note: str, size: int) -> int:
    """Returns the width of a legend, pixels."""
    names = max((width(name, size) for name, _ in entries), default=0)
    words = max((width(word, size) for word in note.split()), default=0)
    return round(max(1.4 * size + names, words) + 1.5 * size)


def entries(field: str, present: Sequence[int], parts: Sequence[str]) -> list[tuple[str, str]]:
    """Returns the names and colours of the parts or ranks that the picture shows."""
    names = parts if field in ("part", "fragment") else []
    colours = part_colours.of_names(present)
    kind = "part" if field == "fragment" else field
    return [
        (names[i] if i < len(names) else f"{kind} {i}", part_colours.css(colour))
        for i, colour in zip(present, colours, strict=True)
    ]
