"""Checks that involve several tables of a case: names, sizes that fit each other, boundaries that a sector needs."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import chain
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from ..model.bodies import Mesh
from ..model.materials import Material, Strength
from ..model.schema import MOST_PARTS, Case, Contact, Erosion, Part, Reference, Symmetry, Wall
from ..model.solids import Measured, Solid
from ..reading.library import library
from ..reading.problems import Location, Problem, dotted, problem
from ..reading.similar import choices, nearest
from ..shapes.combined import cut_by
from ..shapes.geometry import AXES, centre, cut_directions, whole_bounds
from .bond_checks import check_bonds
from .boundary_checks import ROUNDING, check_boundaries, check_walls
from .mesh_checks import check_mesh
from .on import check_ons
from .overlap import bond_gaps, overlaps
from .probe_checks import check_probes
from .rigid_checks import check_rigid

NEEDED: dict[str, frozenset[str]] = {
    "extent": frozenset({"part", "axis"}),
    "radius": frozenset({"part", "axis"}),
    "plastic_strain_max": frozenset({"part"}),
    "temperature_max": frozenset({"part"}),
    "stress_max": frozenset({"part"}),
    "speed_mean": frozenset({"part", "axis"}),
    "probe_mean": frozenset({"probe"}),
    "probe_max": frozenset({"probe"}),
    "probe_min": frozenset({"probe"}),
    "probe_last": frozenset({"probe"}),
    "contact_time": frozenset(),
    "contact_loss": frozenset(),
    "penetration": frozenset({"part", "axis"}),
    "worst_residual": frozenset(),
}
"""The keys that each reference quantity needs. A reference must not have any other of the keys ``part``, ``probe`` and
``axis``."""

Read = TypeVar("Read", bound=BaseModel)


def check(case: Case) -> list[Problem]:
    """Returns every problem that involves several keys of a case, in the order of the keys."""
    checks: tuple[Callable[[Case], Iterable[Problem]], ...] = (
        _materials, _parts, _overlaps, _sectors, check_boundaries, check_ons, check_walls, check_bonds, check_rigid,
        _contact, check_probes, _fields, _references,
    )  # fmt: skip
    return list(chain.from_iterable(found(case) for found in checks))


def check_parts(data: Mapping[str, Any]) -> Iterator[Problem]:
    """Yields the problems of the parts of a case that has errors in other tables: materials, sizes, overlap."""
    listed, own = data.get("parts"), data.get("materials")
    known = {*library(), *(own if isinstance(own, Mapping) else ())}
    parts: list[tuple[int, Part]] = []
    for i, entry in enumerate(listed[:MOST_PARTS] if isinstance(listed, list | tuple) else ()):
        name = entry.get("material") if isinstance(entry, Mapping) else None
        if isinstance(name, str) and name not in known:
            yield problem(("parts", i, "material"), name, f"unknown material; {nearest(name, sorted(known))}")
        part = _read(Part, entry)
        found = list(check_mesh(part.mesh, ("parts", i, "mesh"))) if part is not None else []
        yield from found
        if part is not None and not found:
            parts.append((i, part))
    spec = data.get("contact")
    yield from overlaps(parts, None if spec == "none" else _read(Contact, spec) or Contact(), _tied(data.get("bond")))


def _tied(bonds: object) -> dict[frozenset[str], float]:
    """Returns an infinite allowed overlap for each pair of bonded parts, by their names: the overlap of bonded parts is
    checked after the whole case has been read.
    """
    listed = bonds if isinstance(bonds, list | tuple) else ()
    names = [each.get("parts") for each in listed if isinstance(each, Mapping)]
    pairs = [pair for pair in names if isinstance(pair, list | tuple) and all(isinstance(name, str) for name in pair)]
    return {frozenset(pair): math.inf for pair in pairs}


def _read(model: type[Read], value: object) -> Read | None:
    try:
        return model.model_validate(value)
    except ValidationError:
        return None


def _overlaps(case: Case) -> Iterator[Problem]:
    sound = ((i, part) for i, part in enumerate(case.parts) if not any(check_mesh(part.mesh, ())))
    yield from overlaps(sound, case.contact, bond_gaps(case))


def _materials(case: Case) -> Iterator[Problem]:
    for name, made in case.materials.items():
        if made.strength is not None:
            for key in ("eos", "spall"):
                if made.strength.own_pressure and getattr(made, key) is not None:
                    yield problem(("materials", name, key), ..., f"{made.strength.model} contains it; remove the key")
            if made.strength.linear_pressure and made.eos is not None:
                yield problem(
                    ("materials", name, "eos"), ..., "dilation_angle needs the linear pressure; remove the table eos"
                )
            for key, value, message in made.strength.problems():
                yield problem(("materials", name, "strength", key), value, message)


def _parts(case: Case) -> Iterator[Problem]:
    yield from _unique([part.name for part in case.parts], "parts")
    known = {**library(), **case.materials}
    for i, part in enumerate(case.parts):
        if part.material not in known:
            message = f"unknown material; {nearest(part.material, sorted(known))}"
            yield problem(("parts", i, "material"), part.material, message)
            continue
        law = known[part.material].strength
        if law is not None and part.temperature >= law.melting:
            message = f"must be below {law.melting} K, where {part.material} melts"
            yield problem(("parts", i, "temperature"), part.temperature, message)
        yield from check_mesh(part.mesh, ("parts", i, "mesh"))
        if part.erosion is not None:
            yield from _erosion(part.erosion, part.material, law, ("parts", i, "erosion"))
        yield from _fracture(part, known[part.material], ("parts", i, "fracture"))
        sector = getattr(part.mesh, "sector", "full")
        if part.turn is not None and sector != "full":
            yield problem(("parts", i, "turn"), ..., f"a {sector} body cannot be turned; use sector = 'full'")


def _erosion(spec: Erosion, name: str, law: Strength | None, location: Location) -> Iterator[Problem]:
    """Yields a problem for each erosion limit that the material of the part can never reach."""
    if law is None and spec.plastic_strain is not None:
        message = f"{name} is elastic (no table strength) and has no plastic strain; remove the key"
        yield problem((*location, "plastic_strain"), spec.plastic_strain, message)
    if spec.damage is not None and not (law is not None and law.counts_damage):
        message = (
            f"{name} has no damage; use strength.model = 'johnson_holmquist', or 'johnson_cook' with a table damage"
        )
        yield problem((*location, "damage"), spec.damage, message)


def _fracture(part: Part, made: Material, location: Location) -> Iterator[Problem]:
    spec = part.fracture
    if spec is None:
        return
    if made.brittle is None:
        message = (
            f"{part.material} cannot fracture: it has no table brittle with a tensile strength and a fracture energy"
        )
        yield problem(location, ..., message)
    elif made.brittle.scatter is not None and made.brittle.scatter.minimum >= made.brittle.strength:
        message = f"must be below the strength, {made.brittle.strength:g} Pa"
        where = ("materials", part.material, "brittle", "scatter", "minimum")
        yield problem(where, made.brittle.scatter.minimum, message)
    if spec.model == "cohesive" and spec.shear_weight == 0.0:
        yield problem((*location, "shear_weight"), 0.0, "must be above 0 with model = 'cohesive', which includes shear")


def _sectors(case: Case) -> Iterator[Problem]:
    """Yields a problem for each plane of a half or quarter body without a boundary ``symmetry``."""
    for i, part in enumerate(case.parts):
        mesh = part.mesh
        for d, at in _cuts(mesh):
            if not any(_holds(boundary, part, d, at) for boundary in case.boundaries):
                message = (
                    f"needs a boundary with kind = 'symmetry', axis = {AXES[d]!r}, at = {at:g} "
                    f"for part {part.name!r}, or sector = 'full'"
                )
                yield problem(("parts", i, "mesh", "sector"), getattr(mesh, "sector", ...), message)


def _cuts(mesh: Mesh) -> Iterator[tuple[int, float]]:
    """Planes in which the sector cuts the body: direction and coordinate, m, of each plane."""
    if isinstance(mesh, Solid):
        yield from ((d, mesh.centre[d]) for d in cut_by(mesh.sector, mesh.axis))
    elif not isinstance(mesh, Measured):
        whole, at = whole_bounds(mesh)[0], centre(mesh)
        yield from ((d, at[d]) for d in cut_directions(mesh, mesh.axis) if whole[d] < at[d])


def _holds(boundary: object, part: Part, direction: int, at: float) -> bool:
    if not isinstance(boundary, Symmetry) or boundary.axis != AXES[direction]:
        return False
    return math.isclose(boundary.at, at, abs_tol=1e-9) and (not boundary.parts or part.name in boundary.parts)


def _contact(case: Case) -> Iterator[Problem]:
    contact, names = case.contact, [part.name for part in case.parts]
    if contact is None:
        return
    named: list[tuple[Location, tuple[str, ...]]] = [
        (("contact", "parts"), contact.parts), (("contact", "self_contact"), contact.self_contact or ()),
        *((("contact", "pairs", i, "parts"), pair.parts) for i, pair in enumerate(contact.pairs)),
    ]  # fmt: skip
    for location, listed in named:
        for k, name in enumerate(listed):
            if name not in names:
                yield problem((*location, k), name, f"no part of this name; {nearest(name, names)}")
            elif contact.parts and name not in contact.parts:
                yield problem((*location, k), name, f"must be in contact.parts: {choices(contact.parts)}")
    for i, pair in enumerate(contact.pairs):
        one, other = pair.parts
        if one == other and one in names and one not in case.self_contact:
            message = "this part has no self-contact; name it in contact.self_contact"
            yield problem(("contact", "pairs", i, "parts"), f"{one}, {other}", message)
        for k, earlier in enumerate(contact.pairs[:i]):
            if sorted(earlier.parts) == sorted(pair.parts):
                message = f"contact.pairs[{k}] has the same parts; keep one of the two"
                yield problem(("contact", "pairs", i, "parts"), f"{one}, {other}", message)


def _references(case: Case) -> Iterator[Problem]:
    parts = [part.name for part in case.parts]
    probes = [probe.name for probe in case.probes]
    walls = any(isinstance(boundary, Wall) for boundary in case.boundaries)
    for i, reference in enumerate(case.reference):
        location = ("reference", i)
        yield from _reference_keys(reference, location)
        if reference.part is not None and reference.part not in parts:
            message = f"no part of this name; {nearest(reference.part, parts)}"
            yield problem((*location, "part"), reference.part, message)
        if reference.probe is not None and reference.probe not in probes:
            message = f"no probe of this name; {nearest(reference.probe, probes)}"
            yield problem((*location, "probe"), reference.probe, message)
        if reference.quantity in ("contact_time", "contact_loss") and not (walls or case.in_contact):
            message = "needs a boundary with kind = 'wall', or contact"
            yield problem((*location, "quantity"), reference.quantity, message)
        yield from _window(case, reference, location)


def _reference_keys(reference: Reference, location: Location) -> Iterator[Problem]:
    given = {key for key in ("part", "probe", "axis") if getattr(reference, key) is not None}
    needed = NEEDED[reference.quantity]
    for key in sorted(needed - given):
        yield problem(
            (*location, key), ..., f"this key is missing; {reference.quantity!r} needs {choices(sorted(needed))}"
        )
    for key in sorted(given - needed):
        message = f"{reference.quantity!r} does not use this key; it needs {choices(sorted(needed))}"
        yield problem((*location, key), getattr(reference, key), message)


def _window(case: Case, reference: Reference, location: Location) -> Iterator[Problem]:
    end = case.run.end_time
    if reference.since >= end:
        yield problem((*location, "since"), reference.since, f"must be below run.end_time, {end} s")
    if reference.until is not None and not reference.since < reference.until <= end * (1 + ROUNDING):
        message = f"must be above since, {reference.since} s, and not above run.end_time, {end} s"
        yield problem((*location, "until"), reference.until, message)


def _fields(case: Case) -> Iterator[Problem]:
    fields = case.run.fields
    for k, name in enumerate(fields):
        if name in fields[:k]:
            yield problem(("run", "fields", k), name, "is listed twice; remove one of them")
    if "contact_pressure" in fields and not (case.in_contact or case.boundaries_of(Wall)):
        location = ("run", "fields", fields.index("contact_pressure"))
        yield problem(location, "contact_pressure", "the case has neither contact between parts nor a wall")


def _unique(names: list[str], key: str) -> Iterator[Problem]:
    for i, name in enumerate(names):
        if name in names[:i]:
            first = dotted((key, names.index(name)))
            yield problem((key, i, "name"), name, f"{first} has this name; use different names")
