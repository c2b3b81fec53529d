"""Checks of rigid parts that involve several tables: keys without effect on rigid parts, and boundaries that act on
only some nodes of a rigid part.
"""

from collections.abc import Iterator

from ..model.bonds import SharedBond
from ..model.rigid import tensor_problems
from ..model.schema import Case, Part, Prescribed, Rotation, Traction
from ..reading.problems import Location, Problem, problem
from .on import parts


def check_rigid(case: Case) -> Iterator[Problem]:
    """Yields the problems of the rigid parts of a case, and of the boundaries on rigid parts."""
    for i in case.rigid:
        part = case.parts[i]
        yield from _part(part, ("parts", i))
        if case.contact is not None and part.name in (case.contact.self_contact or ()):
            message = f"{part.name!r} is rigid and cannot have self-contact; remove it"
            yield problem(("contact", "self_contact"), part.name, message)
    yield from _boundaries(case)
    yield from _bonds(case)


def _bonds(case: Case) -> Iterator[Problem]:
    """Yields a problem for a bond between two rigid parts, and for a bond with common nodes to a rigid part."""
    rigid = [case.parts[i].name for i in case.rigid]
    for k, bond in enumerate(case.bond):
        held = [name for name in bond.parts if name in rigid]
        if len(held) == 2 and held[0] != held[1]:
            message = "both are rigid; make one rigid part of the two (a union, or a group that has both)"
            yield problem(("bond", k, "parts"), ", ".join(bond.parts), message)
        elif held and isinstance(bond, SharedBond):
            message = (
                f"{held[0]!r} is rigid, and its nodes cannot be those of another part; set kind = 'tied', also for "
                "meshes that match"
            )
            yield problem(("bond", k, "kind"), "shared", message)


def _part(part: Part, location: Location) -> Iterator[Problem]:
    for key in ("erosion", "fracture", "stretch"):
        if getattr(part, key) is not None:
            yield problem((*location, key), ..., "a rigid part has no stress and no strain; remove this key or rigid")
    if part.jitter > 0.0:
        yield problem((*location, "jitter"), part.jitter, "a rigid part has no jitter; remove this key or rigid")
    spec = part.rigid
    if spec is None:
        return
    if spec.centre is not None and spec.inertia is None:
        yield problem((*location, "rigid", "centre"), ..., "needs rigid.inertia, about this centre")
    if spec.inertia is not None:
        for message in tensor_problems(spec.inertia):
            yield problem((*location, "rigid", "inertia"), ", ".join(f"{c:g}" for c in spec.inertia), message)


def _boundaries(case: Case) -> Iterator[Problem]:
    rigid = [case.parts[i] for i in case.rigid]
    for k, boundary in enumerate(case.boundaries):
        on_set = isinstance(boundary, Prescribed | Rotation | Traction) and boundary.on is not None
        meant = parts(case, boundary) if isinstance(boundary, Prescribed | Rotation | Traction) and on_set else rigid
        held = [part.name for part in rigid if (not boundary.parts or part.name in boundary.parts) and part in meant]
        if not held:
            continue
        if isinstance(boundary, Traction):
            message = (
                f"acts on the rigid part {held[0]!r}, on which tractions are not allowed; name the other parts in parts"
            )
            yield problem(("boundaries", k), ..., message)
        elif on_set:
            message = f"drives a set of the rigid part {held[0]!r}; drive all of it, without on"
            yield problem(("boundaries", k), ..., message)
        elif isinstance(boundary, Prescribed) and boundary.low is not None:
            message = f"drives a box of the rigid part {held[0]!r}; drive all of it, without low and high"
            yield problem(("boundaries", k), ..., message)
