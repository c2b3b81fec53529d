"""How a picture is divided: a title above, panels, a colour bar or a legend at the right; numpy only."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from conoid.cases.figures import exacts

from . import camera, hues
from .camera import Camera
from .pictures import Picture

_HEAD, _SIDE = 0.07, 0.15
"""Shares of the picture's height and width for the title and for the colour bar. Chosen."""
_NAMES = 16
"""Lines of a legend, at most. Chosen: more are not told apart."""


@dataclass(frozen=True)
class Sheet:
    """``head`` and ``side`` are shares of the height and width of the picture, 0 where there is none; ``aspect`` is
    width over height of a panel, ``height`` its pixels.
    """

    rows: int
    columns: int
    head: float
    side: float
    aspect: float
    height: float
    eye: Camera

    def panel(self, place: int) -> tuple[int, int]:
        """Row and column, in the grid of the whole picture."""
        return int(self.head > 0) + place // self.columns, place % self.columns

    @property
    def beside(self) -> tuple[int, int]:
        """Row and column of the colour bar."""
        return int(self.head > 0), self.columns

    def groups(self) -> list[tuple[Any, Any]]:
        """Cells of the grid that are one."""
        top = int(self.head > 0)
        return [(0, np.s_[:])] * top + [(np.s_[top:], self.columns)] * int(self.side > 0)

    def weights(self) -> tuple[list[float], list[float]]:
        """Shares of the rows and of the columns of the grid."""
        rows = [self.head] * int(self.head > 0) + [(1.0 - self.head) / self.rows] * self.rows
        columns = [(1.0 - self.side) / self.columns] * self.columns + [self.side] * int(self.side > 0)
        return rows, columns


def lay(points: Sequence[Any], n: int, picture: Picture, titled: bool, barred: bool) -> Sheet:
    """A sheet of ``n`` panels, each of which shows all of ``points``, arrays (., 3), by a camera that is settled."""
    head, side, (width, height) = _HEAD * titled, _SIDE * barred, picture.look.size
    room = (width * (1.0 - side), height * (1.0 - head))
    _, right, above = camera.axes(picture.camera or camera.FROM, picture.up)
    columns = camera.panels(n, camera.reach(points, right, above)[:2], room)
    rows = math.ceil(n / columns)
    aspect = (room[0] / columns) / (room[1] / rows)
    return Sheet(rows, columns, head, side, aspect, room[1] / rows, camera.place(points, picture, aspect))


def when(times: Sequence[float | None]) -> list[str]:
    """How the times of frames are written; nothing of one that is not known."""
    return ["" if time is None else f"t = {text}" for time, text in zip(times, exacts(times, "s", 4), strict=True)]


def title(picture: Picture, times: Sequence[float | None]) -> str:
    """Of the whole picture; with the time where there is one frame."""
    return "   ".join(filter(None, [picture.title, when(times)[0] if len(times) == 1 else ""]))


def font(size: float, height: float) -> int:
    """A font size that is ``size`` in a picture of 1200 lines."""
    return max(6, round(size * height / 1200))


def legend(values: Sequence[Any], picture: Picture) -> list[list[str]]:
    """Names and colours of the parts or ranks that there are."""
    present = np.unique(np.concatenate([np.asarray(each).astype(int) for each in values]))[:_NAMES]
    names = picture.parts if picture.field == "part" else []
    return [[names[i] if i < len(names) else f"{picture.field} {i}", hues.css(hues.of_names(i)[0])] for i in present]
