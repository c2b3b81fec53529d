"""The surfaces of one frame that are drawn (a shot)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .planes import Wall
from .surfaces import Piece


@dataclass(frozen=True)
class Shot:
    """The surfaces of one frame that are drawn, and the ``time`` of the frame, s."""

    pieces: list[Piece]
    time: float | None
    bounds: Any
    """Lowest and highest coordinates (3, 2) of the whole body, m."""
    walls: Sequence[Wall] = ()
    """Rigid walls at the time of the frame."""

    @property
    def shown(self) -> Any:
        """Field values of all surfaces of the shot, as one array."""
        return np.concatenate([np.asarray(piece.surface["shown"]).reshape(-1) for piece in self.pieces])

    @property
    def points(self) -> Any:
        """Points (., 3) of all surfaces of the shot, m."""
        return np.concatenate([np.asarray(piece.surface.points, float) for piece in self.pieces])

    def near(self, focus: Sequence[int]) -> Any:
        """Returns the points (., 3) of the surfaces without debris. If parts in ``focus`` are drawn, only their
        points are returned.
        """
        some = [piece for piece in self.pieces if piece.part in focus] or self.pieces
        found = [_corners(piece.surface) for piece in some]
        return np.concatenate(found) if any(map(len, found)) else self.points

    def beyond(self, inside: Any) -> int:
        """Returns the number of pieces of debris that have no face in the picture. ``inside``: function that returns
        (n,) True for those of the points (n, 3) that lie in the picture.
        """
        seen: set[tuple[int, int]] = set()
        debris: set[tuple[int, int]] = set()
        for piece in self.pieces:
            far = np.asarray(piece.surface.cell_data["far"]) > 0
            if far.any():
                numbers = np.asarray(piece.surface.cell_data["fragment"])
                there = inside(np.asarray(piece.surface.cell_centers().points, float))
                debris |= {(piece.part, int(number)) for number in np.unique(numbers[far])}
                seen |= {(piece.part, int(number)) for number in np.unique(numbers[there])}
        return len(debris - seen)


def _corners(surface: Any) -> Any:
    """Returns the corners (., 3) of the cells of a surface that are not debris."""
    cells = np.flatnonzero(np.asarray(surface.cell_data["far"]) == 0)
    return np.asarray(surface.extract_cells(cells).points, float) if len(cells) else np.zeros((0, 3))
