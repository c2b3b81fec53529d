"""Fracture specifications and constants of a case, for the facets within each part and for the facets of bonds."""

from conoid.cases.model.joined import shared_bonds
from conoid.cases.model.schema import Case, Fracture
from conoid.cases.reading.library import material as find_material

from ..materials.elementary import power
from ..model.state import Model
from . import facets, resolution
from .strength import UNBREAKABLE, Toughness, of_bond, terms, toughness

_LAST = 2**28
"""Number that is larger than all global ids of tets."""


class Terms:
    """Fracture specifications and constants of one case, and warnings about its mesh."""

    def __init__(self, case: Case, model: Model) -> None:
        self._case, self._model = case, model
        self._made = [find_material(case, part.material) for part in case.parts]
        self._found: dict[str, list[str]] = {}
        self.work = 0.0
        """Order of magnitude of the work on a facet, J."""
        self._own = [self._of_part(index) for index in range(len(case.parts))]
        self._bonds = [self._of_bond(number) for number in range(len(case.bond))]

    def own(self, index: int) -> facets.Terms:
        """Returns the specification and the constants of the facets within a part."""
        return *self._own[index], self._ids(index)

    def bonds(self, index: int) -> list[facets.Terms]:
        """Returns the specifications and constants of the facets between a part and other parts. Only bonds that can
        break are included.
        """
        found = []
        for number, bond, i, j in shared_bonds(self._case):
            if bond.breaks and index in (i, j):
                spec, tough = self._bonds[number]
                found.append((spec, tough, self._ids(i + j - index)))
        return found

    def warnings(self) -> list[str]:
        """Returns one line for each warning."""
        return resolution.merged(self._found)

    def _ids(self, index: int) -> tuple[int, int]:
        """Returns the range of the global ids of the tets of a part: its first id, and its last id plus 1."""
        ends = [*self._model.part_starts.tolist(), _LAST]
        return ends[index], ends[index + 1]

    def _of_part(self, index: int) -> tuple[Fracture, Toughness]:
        part, safety = self._case.parts[index], self._case.numerics.dt_safety
        if part.fracture is None:
            return Fracture(), UNBREAKABLE
        volume = float(self._model.mean_volumes[index])
        size = resolution.edge(volume)
        tough = toughness(self._made[index], part.fracture, size)
        self.work = max(self.work, tough.energy * power(volume, 2.0 / 3.0))
        for text in resolution.warnings(part, tough, size, safety):
            self._found.setdefault(text, []).append(part.name)
        return part.fracture, tough

    def _of_bond(self, number: int) -> tuple[Fracture, Toughness]:
        found = {k: (bond, i, j) for k, bond, i, j in shared_bonds(self._case) if bond.breaks}
        if number not in found:
            return Fracture(), UNBREAKABLE
        bond, i, j = found[number]
        volume = max(float(self._model.mean_volumes[k]) for k in (i, j))
        tough, size = of_bond(bond, [self._made[i], self._made[j]]), resolution.edge(volume)
        self.work = max(self.work, max(bond.energies) * power(volume, 2.0 / 3.0))
        if bond.cohesive and (text := resolution.unresolved(tough, size)):
            line = f"{text}; smaller elements, or a lower strength with the same energy, resolve it"
            self._found.setdefault(line, []).append(f"bond[{number}]")
        return terms(bond), tough
