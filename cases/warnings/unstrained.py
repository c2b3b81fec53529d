"""Notes on parts of a finished run that could be rigid: they stayed elastic, with small strain and small energy."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ..checks.checks import check
from ..model.rigid import Rigid
from ..model.schema import Case

STRAIN = 1e-3
"""Largest strain of a part that could be rigid: half of the yield strain of a hard steel (chosen value). The surface of
a part with this strain moves by a thousandth of the size of the part; if the part were rigid, this motion would be
missing."""
SHARE = 0.05
"""Largest energy of a part that could be rigid, divided by the sum of the energies of all parts. In an impact, the
stiffer of two bodies has this fraction of the energy at the ratio STIFF of their impedances (module ``stiff``; chosen
value)."""


@dataclass(frozen=True)
class Strained:
    """Largest strain and largest energy of a part during a run."""

    elements: int
    strain: float
    """Upper bound of the root mean square of the strain: sqrt(2 U / (E V)), with the largest energy U of the part,
    Young's modulus E and the volume V."""
    share: float
    """Largest energy of the part divided by the sum of the energies of all parts."""
    plastic: bool
    """Whether a tet of the part has yielded or was deleted."""


def could_be_rigid(case: Case, found: Sequence[Strained], limiter: str) -> Iterator[str]:
    """Yields a note for each part that could be rigid, with the saving. ``limiter``: what limits the time step."""
    if case.contact is None or len(case.parts) < 2:
        return
    every = sum(part.elements for part in found)
    for i, (part, each) in enumerate(zip(case.parts, found, strict=True)):
        little = not each.plastic and each.strain < STRAIN and each.share < SHARE
        if part.rigid is None and each.elements and little and _allowed(case, i):
            way = "rigid = true" if part.erosion is None else "rigid = true in place of erosion"
            held = limiter.endswith(f" of {part.name}")
            yield (
                f"parts[{i}].rigid: {part.name!r} stayed elastic, with strains of {each.strain:.1g} or less (root of "
                f"the mean square) and {100.0 * each.share:.1g} % of the energy of deformation; {way} would save "
                f"{100.0 * each.elements / every:.0f} % of the tets{', which limit the time step' if held else ''}"
            )


def _allowed(case: Case, i: int) -> bool:
    """Whether the case would be valid if part ``i`` were rigid."""
    stiff = case.parts[i].model_copy(update={"rigid": Rigid(), "erosion": None})
    parts = (*case.parts[:i], stiff, *case.parts[i + 1 :])
    return not check(case.model_copy(update={"parts": parts}))
