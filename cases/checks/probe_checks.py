"""Checks of probes that involve several tables: names of parts and walls, keys that a field needs or does not use."""

from collections.abc import Iterator

from ..model.measures import BEYOND, COURSES, SHAPES, SUMS, WHOLE, Probe, kind
from ..model.schema import Case, Part, Wall
from ..output.fields import damageable
from ..output.history import COLUMNS
from ..reading.problems import Location, Problem, problem
from ..reading.similar import choices, nearest
from ..shapes.geometry import AXES, bounds
from .boundary_checks import ordered

_HOLES = ("hole_diameter", "hole_width")
_USED: dict[str, tuple[str, ...]] = {
    "wall": ("wall_force", "wall_impulse", *COURSES),
    "by": ("contact_force", "contact_impulse"),
    "beyond": (*SUMS, *BEYOND),
    "axis": SHAPES,
    "at": _HOLES,
    "centre": (*_HOLES, "cone_angle"),
}
"""The probe fields that may have a key, by key."""
_NEEDED: dict[str, tuple[str, ...]] = {"wall": COURSES, "beyond": BEYOND, "axis": SHAPES, "at": _HOLES}
"""The probe fields that need a key, by key."""


def check_probes(case: Case) -> Iterator[Problem]:
    """Yields the problems of the probes of a case, in the order of their keys."""
    parts, names = {part.name: part for part in case.parts}, [probe.name for probe in case.probes]
    for i, probe in enumerate(case.probes):
        location = ("probes", i)
        if (first := names.index(probe.name)) < i:
            yield problem((*location, "name"), probe.name, f"probes[{first}] has this name; use different names")
        if probe.name in COLUMNS:
            message = f"is a column of every history.csv; allowed: any name but {choices(COLUMNS)}"
            yield problem((*location, "name"), probe.name, message)
        yield from _keys(probe, location)
        if (probe.low is None) != (probe.high is None):
            yield problem(location, ..., "needs both low and high, or neither for the whole part")
        elif probe.low is not None and probe.high is not None:
            yield from ordered(probe.low, probe.high, location)
        yield from _part(probe, list(parts), location)
        yield from _pushes(case, i, probe)
        if probe.part not in parts:
            continue
        if probe.field == "cone_angle" and not (damageable(case) or case.erodes):
            yield problem((*location, "field"), probe.field, "the case has neither damage, fracture nor erosion")
        yield from _box(parts[probe.part], probe, location)


def _keys(probe: Probe, location: Location) -> Iterator[Problem]:
    """Yields a problem for each key that the field of the probe needs and the probe lacks, and for each key that the
    field does not use.
    """
    field = kind(probe.field)
    for key, fields in _USED.items():
        if field not in fields and getattr(probe, key) is not None:
            yield problem((*location, key), ..., f"{field} does not use this key; remove it")
    for key, fields in _NEEDED.items():
        if field in fields and getattr(probe, key) is None:
            yield problem((*location, key), ..., f"this key is missing; {field} needs it")
    if field in WHOLE and (probe.low is not None or probe.high is not None):
        yield problem(location, ..., f"{field} {_whole(field)}; remove low and high")


def _whole(field: str) -> str:
    return "is that of a wall" if field in COURSES else "is measured on the whole part"


def _part(probe: Probe, parts: list[str], location: Location) -> Iterator[Problem]:
    """Yields a problem for the key ``part`` if it is absent although needed, names no part of the case, or is given for
    a field of a wall.
    """
    if kind(probe.field) in COURSES:
        if probe.part:
            yield problem((*location, "part"), probe.part, f"{kind(probe.field)} is that of a wall; remove part")
    elif not probe.part:
        if not probe.field.startswith("wall_"):
            yield problem((*location, "part"), ..., f"this key is missing; {probe.field} needs it")
    elif probe.part not in parts:
        yield problem((*location, "part"), probe.part, f"no part of this name; {nearest(probe.part, parts)}")


def _pushes(case: Case, number: int, probe: Probe) -> Iterator[Problem]:
    """Yields a problem for a probe of a force if the wall or part that it names does not exist or cannot exert a
    force.
    """
    location, names = ("probes", number), [wall.name for _, wall in case.boundaries_of(Wall)]
    if probe.field.startswith("wall_"):
        if not names:
            yield problem((*location, "field"), probe.field, "the case has no wall")
        elif probe.wall is not None and probe.wall not in names:
            yield problem((*location, "wall"), probe.wall, f"no wall of this name; {nearest(probe.wall, names)}")
    others = [part.name for part in case.parts if part.name != probe.part]
    if probe.by is not None and probe.by not in others:
        message = "is the part itself" if probe.by == probe.part else "no part of this name"
        yield problem((*location, "by"), probe.by, f"{message}; {nearest(probe.by, others)}")


def _box(part: Part, probe: Probe, location: Location) -> Iterator[Problem]:
    body = bounds(part.mesh)
    if body is None or part.turn is not None or probe.low is None or probe.high is None:
        return
    for d, (a, b) in enumerate(zip(*body, strict=True)):
        if probe.high[d] < a or probe.low[d] > b:
            message = f"the box misses part {probe.part!r}, which lies between {a:g} and {b:g} m along {AXES[d]}"
            yield problem(location, ..., message)
