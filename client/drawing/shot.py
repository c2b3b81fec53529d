"""Drawn surfaces of one frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .planes import Wall
from .surfaces import Piece


@dataclass(frozen=True)
class Shot:
    """Drawn surfaces of one frame; ``time`` in s."""

    pieces: list[Piece]
    time: float | None
    bounds: Any
    """(3, 2) lowest and highest coordinates of the whole body, m."""
    walls: Sequence[Wall] = ()
    """Rigid walls at the time of the frame."""

    @property
    def shown(self) -> Any:
        """Field values of all surfaces as one array."""
        return np.concatenate([np.asarray(piece.surface["shown"]).reshape(-1) for piece in self.pieces])

    @property
    def points(self) -> Any:
        """(., 3) points of all surfaces, m."""
        return np.concatenate([np.asarray(piece.surface.points, float) for piece in self.pieces])

    def near(self, focus: Sequence[int]) -> Any:
        """Returns (., 3) points of the surfaces without debris, of the parts in ``focus`` if any of these parts is
        drawn.
        """
        some = [piece for piece in self.pieces if piece.part in focus] or self.pieces
        found = [_corners(piece.surface) for piece in some]
        return np.concatenate(found) if any(map(len, found)) else self.points

    def beyond(self, inside: Any) -> int:
        """Returns the number of pieces of debris without a face in the picture; ``inside`` returns (n,) True for
        points (n, 3) in the picture.
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
    """Returns (., 3) corners of the cells that are not debris."""
    cells = np.flatnonzero(np.asarray(surface.cell_data["far"]) == 0)
    return np.asarray(surface.extract_cells(cells).points, float) if len(cells) else np.zeros((0, 3))
