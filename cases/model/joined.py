"""Parts that form one body because bonds with common nodes join them."""

from typing import Any, Protocol

from .bonds import Bonded, SharedBond


class Joined(Protocol):
    """The keys of a case that determine which parts form one body."""

    @property
    def parts(self) -> tuple[Any, ...]:
        """Parts of the case (schema.Part)."""

    @property
    def bond(self) -> tuple[Bonded, ...]:
        """Bonds of the case."""

    @property
    def self_contact(self) -> tuple[str, ...]:
        """Names of the parts with self-contact."""


def shared_bonds(case: Joined) -> list[tuple[int, SharedBond, int, int]]:
    """Returns the bonds with common nodes: for each, its index in ``bond`` and the indices of its two parts, the lower
    index first.
    """
    numbers = {part.name: i for i, part in enumerate(case.parts)}
    found = [(k, bond, sorted(numbers[name] for name in bond.parts)) for k, bond in enumerate(case.bond)
             if isinstance(bond, SharedBond)]  # fmt: skip
    return [(k, bond, one, other) for k, bond, (one, other) in found]


def bodies(case: Joined) -> list[int]:
    """Returns the body of each part, an array (parts,). The index of a body is the lowest index of the parts that bonds
    with common nodes join.
    """
    of = list(range(len(case.parts)))
    for _, _, i, j in shared_bonds(case):
        low, high = sorted((of[i], of[j]))
        of = [low if body == high else body for body in of]
    return of


def breakable(case: Joined) -> list[bool]:
    """Returns for each part whether facets of its body can break, an array (parts,). The facets of a body can break if
    a part of the body, or a bond between two of its parts, can break.
    """
    of = bodies(case)
    some = {of[i] for i, part in enumerate(case.parts) if part.fracture is not None}
    some |= {of[i] for _, bond, i, _ in shared_bonds(case) if bond.breaks}
    return [body in some for body in of]


def wearing(case: Joined) -> bool:
    """Returns whether the case has a body with breakable facets from which tets may be deleted."""
    return any(breaks and part.erosion is not None for part, breaks in zip(case.parts, breakable(case), strict=True))


def cohesive(case: Joined) -> set[int]:
    """Returns the indices of the parts that can have cohesive facets, inside of the part or at a bond."""
    own = {i for i, part in enumerate(case.parts) if part.fracture is not None and part.fracture.model == "cohesive"}
    return own.union(*({i, j} for _, bond, i, j in shared_bonds(case) if bond.cohesive))


def meeting(case: Joined) -> list[bool]:
    """Returns for each part whether it can be in contact with other parts of its body, an array (parts,). The parts of
    a body can be in contact with each other if the body can break, or if one of them has self-contact. Parts that
    cannot separate from each other need no contact.
    """
    of, names = bodies(case), set(case.self_contact)
    some = {of[i] for i, part in enumerate(case.parts) if part.name in names}
    return [body in some or may for body, may in zip(of, breakable(case), strict=True)]
