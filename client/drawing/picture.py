"""Input and result of ``render``. A ``Picture`` describes a drawing of one frame, of several frames side by side, or
of several frames one after the other (a film).
"""

import msgspec

from .planes import Mirror, Vector, Wall
from .view_options import FILMS, Look


class Picture(msgspec.Struct, kw_only=True, frozen=True):
    """Input of ``render`` for one picture file. All frames have the same camera and the same colours."""

    frames: list[str]
    out: str
    field: str
    look: Look
    camera: Vector | None = None
    up: Vector | None = None
    mirrors: list[Mirror] = []
    sections: list[Mirror] = []
    cuts: list[Mirror] = []
    """Planes of symmetry that are not mirrored; the camera faces these planes."""
    walls: list[Wall] = []
    parts: list[str] = []
    whole: list[int] = []
    hidden: list[int] = []
    focus: list[int] = []
    """Numbers of parts, like ``whole`` and ``hidden``. Sections do not cut the parts in ``whole``; the parts in
    ``hidden`` are not drawn; the parts in ``focus`` fill the picture."""
    opacity: dict[int, float] = {}
    range_of: list[str] = []
    """Frames whose values set the ends of the colour bar; if empty, the drawn frames set them."""
    title: str = ""

    @property
    def film(self) -> bool:
        """True for a film, False for frames side by side."""
        return self.out.lower().endswith(FILMS)


class Drawn(msgspec.Struct, kw_only=True, frozen=True):
    """Result of ``render``: the file, the extremes of the field on the drawn surfaces, the number of faces, the ends
    of the colour bar, and the times of the frames in s. The ends of the colour bar are None for a uniform field and
    for a field of names.
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
