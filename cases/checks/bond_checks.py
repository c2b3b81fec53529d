"""Checks of the bonds of a case that involve several tables: names of parts, keys that need each other, meshes."""

from collections.abc import Iterator

from ..model.bodies import Box, Loose, MeshFile, Plate
from ..model.bonds import Bonded, SharedBond
from ..model.boundaries import Gravity
from ..model.joined import bodies
from ..model.schema import Case, Part
from ..model.solids import Stl
from ..reading.problems import Location, Problem, problem
from ..reading.similar import choices, nearest


def check_bonds(case: Case) -> Iterator[Problem]:
    """Yields every problem of the bonds of a case."""
    found = list(_each(case))
    yield from found or _pulled(case)


def _each(case: Case) -> Iterator[Problem]:
    """Yields the problems of one bond, and of two bonds between the same parts."""
    parts = {part.name: part for part in case.parts}
    for i, bond in enumerate(case.bond):
        location: Location = ("bond", i)
        yield from _keys(bond, location)
        unknown = [k for k, name in enumerate(bond.parts) if name not in parts]
        for k in unknown:
            message = f"no part of this name; {nearest(bond.parts[k], parts)}"
            yield problem((*location, "parts", k), bond.parts[k], message)
        if bond.parts[0] == bond.parts[1]:
            message = "a part cannot be bonded to itself; name two parts"
            yield problem((*location, "parts"), _both(bond), message)
        elif not unknown:
            yield from _twice(case, i)
            if isinstance(bond, SharedBond):
                yield from _meshes(parts[bond.parts[0]], parts[bond.parts[1]], (*location, "parts"))


def _pulled(case: Case) -> Iterator[Problem]:
    """Yields a problem for gravity that acts on only some parts of a body: each node of the interface belongs to
    several parts and can have only one acceleration.
    """
    body = bodies(case)
    for k, spec in enumerate(case.boundaries):
        if isinstance(spec, Gravity) and spec.parts:
            some = {of for part, of in zip(case.parts, body, strict=True) if part.name in spec.parts}
            left = [part.name for part, of in zip(case.parts, body, strict=True)
                    if of in some and part.name not in spec.parts]  # fmt: skip
            if left:
                message = f"these parts and {choices(left)} are one body with common nodes; name all of them"
                yield problem(("boundaries", k, "parts"), ", ".join(spec.parts), message)


def _both(bond: Bonded) -> str:
    return ", ".join(bond.parts)


def _keys(bond: Bonded, location: Location) -> Iterator[Problem]:
    if not bond.breaks:
        given = (("shear_strength", bond.shear_strength), ("energy", bond.energy), ("shear_energy", bond.shear_energy))
        for key, value in given:
            if value:
                yield problem((*location, key), value, "a bond without strength never breaks; give strength too")
        return
    normal, shear = bond.energies
    if (normal > 0.0) != (shear > 0.0):
        key, value = ("shear_energy", shear) if shear == 0.0 else ("energy", normal)
        message = "give energy and shear_energy both above 0, or both 0"
        yield problem((*location, key), value, message)


def _twice(case: Case, number: int) -> Iterator[Problem]:
    bond = case.bond[number]
    for k, earlier in enumerate(case.bond[:number]):
        if sorted(earlier.parts) == sorted(bond.parts):
            message = f"bond[{k}] joins the same parts; keep one of the two"
            yield problem(("bond", number, "parts"), _both(bond), message)


def _meshes(one: Part, other: Part, location: Location) -> Iterator[Problem]:
    """Yields a problem for parts whose meshes cannot have common nodes."""
    names, pair = f"{one.name}, {other.name}", (one.mesh, other.mesh)
    way = "set kind = 'tied'"
    loose = [part.name for part in (one, other) if isinstance(part.mesh, Loose)]
    if loose:
        yield problem(location, names, f"{choices(loose)}: single tets have no nodes in common with other parts; {way}")
    elif isinstance(one.mesh, MeshFile) or isinstance(other.mesh, MeshFile):
        if not all(isinstance(mesh, MeshFile) for mesh in pair):
            message = f"a mesh from a file and a generated mesh have no nodes in common; {way}"
            yield problem(location, names, message)
    elif one.mesh.generator != other.mesh.generator:
        yield problem(location, names, f"the two meshes have different generators; use the same for both, or {way}")
    elif one.mesh.generator == "structured" and not all(isinstance(mesh, Box | Plate) for mesh in pair):
        message = f"only structured meshes of boxes and plates have nodes in common; use gmsh, or {way}"
        yield problem(location, names, message)
    elif any(isinstance(mesh, Stl) for mesh in pair):
        message = f"a body from an STL file is meshed separately; take both from one STEP or mesh file, or {way}"
        yield problem(location, names, message)
    if one.turn != other.turn:
        yield problem(location, names, f"the two parts are turned differently; their nodes would separate; {way}")
