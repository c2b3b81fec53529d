"""What ``render`` is asked for, and what it answers.

A ``Picture`` is one drawing of one frame, of several side by side, or of several one after the other (a film).
"""

import msgspec

from .planes import Mirror, Vector, Wall
from .view_options import FILMS, Look


class Picture(msgspec.Struct, kw_only=True, frozen=True):
    """Everything that ``render`` needs for one file; all frames have the camera and the colours in common."""

    frames: list[str]
    out: str
    field: str
    look: Look
    camera: Vector | None = None
    up: Vector | None = None
    mirrors: list[Mirror] = []
    sections: list[Mirror] = []
    cuts: list[Mirror] = []
    """Planes of symmetry that are not mirrored: the camera looks at them."""
    walls: list[Wall] = []
    parts: list[str] = []
    whole: list[int] = []
    hidden: list[int] = []
    focus: list[int] = []
    """Numbers of parts: left whole by sections, not drawn, filling the picture."""
    opacity: dict[int, float] = {}
    range_of: list[str] = []
    """Frames whose values set the ends of the colour bar; empty: those that are drawn."""
    title: str = ""

    @property
    def film(self) -> bool:
        """Whether its frames come one after the other."""
        return self.out.lower().endswith(FILMS)


class Drawn(msgspec.Struct, kw_only=True, frozen=True):
    """What a picture shows: its file, the extremes of the field over the drawn surfaces, the number of faces, the ends
    of the colour bar (none where colours are names, or the field is uniform), the times of its frames in s.
    """

    out: str
    field: str
    unit: str
    low: float
    high: float
    faces: int
    limits: tuple[float, float] | None = None
    times: list[float | None] = []
    beyond: int = 0
    """Pieces that have flown out of the picture."""
