"""How a picture is divided: title, panels, and beside them the colour bar or the legend."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from conoid.cases.figures import exacts

from . import camera
from .camera import Camera
from .picture import Picture

Box = tuple[int, int, int, int]
"""Left, top, width, height, pixels."""
_FILL = 0.34
"""Share of the width that the colour bar or the legend takes up, at most. Chosen."""
LEAST = 200
"""Pixels of a side, below which a picture has no captions. Chosen."""


@dataclass(frozen=True)
class Sheet:
    """``panels`` are as large as each other, row by row; ``head`` and ``side`` may be empty."""

    panels: list[Box]
    head: Box
    side: Box
    columns: int
    font: int
    """Height of letters, pixels."""
    eye: Camera

    @property
    def aspect(self) -> float:
        """Width over height of a panel."""
        return self.panels[0][2] / self.panels[0][3]

    @property
    def pixel(self) -> float:
        """Size of a pixel in the body, m."""
        return 2.0 * self.eye.half / self.panels[0][3]


def captioned(picture: Picture) -> bool:
    """Whether there is a place for texts."""
    return picture.look.captions and min(picture.look.size) >= LEAST


def font(size: tuple[int, int]) -> int:
    """Pixels of letters in a picture of this size."""
    return max(8, round(0.0125 * math.sqrt(size[0] * size[1]) + 4.2))


def lay(near: Sequence[Any], every: Sequence[Any], n: int, picture: Picture, head: int, side: int) -> Sheet:
    """A sheet of ``n`` panels, each of which shows all of ``near`` and is before all of ``every``, arrays (., 3), by a
    camera that is settled; ``head`` and ``side``: pixels of the title and of what is at the right.
    """
    width, height = picture.look.size
    side = min(side, round(_FILL * width))
    room = (width - side, height - head)
    _, right, above = camera.axes(picture.camera or camera.FROM, picture.up)
    columns = camera.panels(n, camera.reach(near, right, above)[:2], room)
    rows = math.ceil(n / columns)
    across, down = room[0] // columns, room[1] // rows
    boxes = [(across * (k % columns), head + down * (k // columns), across, down) for k in range(n)]
    eye = camera.place(near, every, picture, across / down)
    beside = (width - side, head, side, height - head)
    return Sheet(boxes, (0, 0, width, head), beside, columns, font(picture.look.size), eye)


def when(times: Sequence[float | None]) -> list[str]:
    """How the times of frames are written; nothing of one that is not known."""
    return ["" if time is None else f"t = {text}" for time, text in zip(times, exacts(times, "s", 4), strict=True)]
