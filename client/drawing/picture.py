"""Input and result of ``render``. A ``Picture`` is a drawing of one frame, of several frames side by side, or of
several frames one after the other (a film).
"""

import msgspec

from .planes import Mirror, Vector, Wall
from .view_options import FILMS, Look


class Picture(msgspec.Struct, kw_only=True, frozen=True):
    """Input of ``render`` for one file. All frames have the same camera and the same colours."""

    frames: list[str]
    out: str
    field: str
    look: Look
    camera: Vector | None = None
    up: Vector | None = None
    mirrors: list[Mirror] = []
    sections: list[Mirror] = []
    cuts: list[Mirror] = []
    """Planes of symmetry that are not mirrored. The camera faces these planes."""
    walls: list[Wall] = []
    parts: list[str] = []
    whole: list[int] = []
    hidden: list[int] = []
    focus: list[int] = []
    """Numbers of parts: ``whole`` parts are not cut by sections, ``hidden`` parts are not drawn, ``focus`` parts
    fill the picture."""
    opacity: dict[int, float] = {}
    range_of: list[str] = []
    """Frames whose values set the ends of the colour bar; empty: the drawn frames."""
    title: str = ""

    @property
    def film(self) -> bool:
        """True for a film, False for frames side by side."""
        return self.out.lower().endswith(FILMS)


class Drawn(msgspec.Struct, kw_only=True, frozen=True):
    """Result of ``render``: the file, the extremes of the field over the drawn surfaces, the number of faces, the
    ends of the colour bar and the times of the frames in s. The ends are None if colours are names or the field is
    uniform.
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
    """Number of pieces of debris outside of the picture."""
