"""Layout of a picture: title, panels, and the colour bar or legend beside the panels."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from conoid.cases.figures import exacts

from . import camera
from .camera import Camera
from .picture import Picture
from .view_options import Look

Box = tuple[int, int, int, int]
"""A rectangle: left, top, width and height, pixels."""
_FILL = 0.34
"""Largest width of the colour bar or legend, relative to the width of the picture. Chosen value."""
_ENLARGED = 1.6
"""Height of letters in a picture without captions, relative to a picture with captions. Chosen value."""
LEAST = 200
"""Shortest side of a picture that has captions, pixels (chosen value)."""


@dataclass(frozen=True)
class Sheet:
    """Rectangles of a picture. The rectangles ``panels`` have equal sizes and form rows; ``head`` and ``side`` may
    be empty.
    """

    panels: list[Box]
    head: Box
    side: Box
    columns: int
    font: int
    """Height of letters, pixels."""
    eye: Camera

    @property
    def aspect(self) -> float:
        """Width of a panel divided by its height."""
        return self.panels[0][2] / self.panels[0][3]

    @property
    def pixel(self) -> float:
        """Length on the body that one pixel shows, m."""
        return 2.0 * self.eye.half / self.panels[0][3]


def captioned(picture: Picture) -> bool:
    """True if the picture is large enough for texts."""
    return picture.look.captions and min(picture.look.size) >= LEAST


def font(look: Look) -> int:
    """Returns the height of letters in a picture, pixels. Pictures without captions stand in a page that shows them
    smaller than they are, so their letters are larger.
    """
    width, height = look.size
    height_of_letters = 0.0125 * math.sqrt(width * height) + 4.2
    return max(8, round(height_of_letters if look.captions else _ENLARGED * height_of_letters))


def lay(near: Sequence[Any], every: Sequence[Any], n: int, picture: Picture, head: int, side: int) -> Sheet:
    """Returns the layout of ``n`` panels. Each panel shows all points ``near``, with a camera outside of the points
    ``every``; arrays (., 3). ``head``: height of the title; ``side``: width of the captions at the right, pixels.
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
    return Sheet(boxes, (0, 0, width, head), beside, columns, font(picture.look), eye)


def when(times: Sequence[float | None]) -> list[str]:
    """Returns the times of frames as texts; the text of an unknown time is empty."""
    return ["" if time is None else f"t = {text}" for time, text in zip(times, exacts(times, "s", 4), strict=True)]
