"""Bodies of several parts: those that bonds by shared nodes hold together."""

from typing import Any, Protocol

from .bonds import Bonded, SharedBond


class Joined(Protocol):
    """What of a case says which bodies its parts make."""

    @property
    def parts(self) -> tuple[Any, ...]:
        """Its parts (schema.Part)."""

    @property
    def bond(self) -> tuple[Bonded, ...]:
        """Its bonds."""

    @property
    def self_contact(self) -> tuple[str, ...]:
        """The names of the parts that may meet themselves."""


def shared_bonds(case: Joined) -> list[tuple[int, SharedBond, int, int]]:
    """The bonds by shared nodes: the place of each in ``bond``, and the numbers of its parts, the lower one first."""
    numbers = {part.name: i for i, part in enumerate(case.parts)}
    found = [(k, bond, sorted(numbers[name] for name in bond.parts)) for k, bond in enumerate(case.bond)
             if isinstance(bond, SharedBond)]  # fmt: skip
    return [(k, bond, one, other) for k, bond, (one, other) in found]


def bodies(case: Joined) -> list[int]:
    """(parts,) the body of each part: the lowest number of the parts that shared nodes hold together with it."""
    of = list(range(len(case.parts)))
    for _, _, i, j in shared_bonds(case):
        low, high = sorted((of[i], of[j]))
        of = [low if body == high else body for body in of]
    return of


def breakable(case: Joined) -> list[bool]:
    """(parts,) whether facets of the body of each part may break: those of one of its parts, or a bond between two."""
    of = bodies(case)
    some = {of[i] for i, part in enumerate(case.parts) if part.fracture is not None}
    some |= {of[i] for _, bond, i, _ in shared_bonds(case) if bond.breaks}
    return [body in some for body in of]


def cohesive(case: Joined) -> set[int]:
    """The parts that may have cohesive facets: of their own, or of a bond."""
    own = {i for i, part in enumerate(case.parts) if part.fracture is not None and part.fracture.model == "cohesive"}
    return own.union(*({i, j} for _, bond, i, j in shared_bonds(case) if bond.cohesive))


def meeting(case: Joined) -> list[bool]:
    """(parts,) whether the parts of the body of each may meet each other: where it may break, or one of them may meet
    itself. The parts of one body that cannot come apart do not meet.
    """
    of, names = bodies(case), set(case.self_contact)
    some = {of[i] for i, part in enumerate(case.parts) if part.name in names}
    return [body in some or may for body, may in zip(of, breakable(case), strict=True)]
