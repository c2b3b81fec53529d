"""Output of the command ``conoid validate``: parts, files, loads, contacts, cost."""

import math
from collections.abc import Callable, Sequence

from rich.table import Table

from conoid.cases.estimates.estimate import Estimate
from conoid.cases.estimates.stages import without
from conoid.cases.figures import UNKNOWN, alike, count, crew, duration, exact, percent, si, size, vectors
from conoid.cases.model.bodies import Mesh, MeshFile
from conoid.cases.model.schema import Boundary, Case, Traction
from conoid.cases.model.solids import Cad
from conoid.cases.reading.library import material
from conoid.cases.reading.survey import Survey
from conoid.cases.shapes.load import Load
from conoid.cases.shapes.placed import Bulk
from conoid.cases.warnings.touching import Touch

from .tables import pairs, table


def estimate_table(case: Case, expected: Estimate) -> Table:
    """Returns a table of the approximate needs of a case and the fraction of each stage; a dash stands for numbers
    of a mesh file that is not read.
    """
    total = expected.core_seconds or 1.0
    shares = sorted(expected.costs.items(), key=lambda cost: -cost[1])
    return pairs({
        "tets": _about(expected.elements, count),
        "nodes": _about(expected.nodes, count),
        "time step": _about(expected.dt, lambda value: si(value, "s")),
        "steps": _about(expected.steps, count),
        "memory": _up_to(expected.memory_bytes, expected.dust_bytes, size),
        "core time": _up_to(expected.core_seconds, expected.breaking, duration, "what breaks becomes dust"),
        "clock time": _clock(case, expected),
        "of which": ", ".join(f"{name} {percent(seconds / total, 0)}" for name, seconds in shares),
        "without": ", ".join(without(case)),
    })  # fmt: skip


def _clock(case: Case, expected: Estimate) -> str:
    """Returns the estimated wall time on the ranks and threads of the case, and the assumptions of the estimate."""
    clock, run = expected.clock, case.run
    if clock is None:
        return UNKNOWN
    took = _up_to(clock.seconds, clock.breaking, duration, "what breaks becomes dust")
    assumed = [f"ranks {percent(clock.ranks, 0)} efficient"] if run.ranks > 1 else []
    if run.threads > 1:
        assumed.append(
            f"{percent(clock.shared, 0)} of the core time in parallel regions, {percent(clock.threads, 0)} efficient"
        )
    return f"{took}, on {crew(run.ranks, run.threads)}{'; assumed: ' if assumed else ''}{', '.join(assumed)}"


def _up_to(
    value: float | None,
    more: float,
    shown: Callable[[float], str],
    when: str = "breakable parts become single tets",
) -> str:
    """Returns the memory as text. With ``more``, the text also has the larger memory that is needed ``when`` bodies
    break into single tets.
    """
    if value is None or not more:
        return _about(value, shown)
    return f"{_about(value, shown)}, up to {shown(value + more)} if {when}"


def parts_table(case: Case, expected: Estimate) -> Table:
    """Returns a table of the models of each part, with its approximate size and its initial state."""
    right = ("tets", "mass", "extent", "momentum", "energy")
    made = table("part", "material", *right, right=right, wide=("material",))
    brought = _brings([each.bulk for each in expected.parts])
    for part, each, bulk in zip(case.parts, expected.parts, brought, strict=True):
        made.add_row(part.name, part.material, count(each.elements), *bulk)
    return made


def files_table(case: Case, survey: Survey) -> Table:
    """Returns a table of mesh files, combined shapes and CAD files: their volumes, and the smallest altitude of a
    tet, which determines the time step.
    """
    right = ("nodes", "volume", "smallest altitude")
    made = table("part", "from", "group", *right, right=right, wide=("from",))
    for each in survey.parts:
        part = case.parts[each.part]
        volume = exact(1e9 * each.mass / material(case, part.material).density, "mm^3")
        made.add_row(part.name, *_source(part.mesh), count(each.nodes), volume, si(each.altitude, "m"))
    return made


def _source(mesh: Mesh) -> tuple[str, str]:
    """Returns the source of a mesh: a file and the part of the file, or a combination of shapes."""
    if isinstance(mesh, MeshFile):
        return mesh.path, mesh.group or "all tets"
    if isinstance(mesh, Cad):
        return mesh.path, ", ".join(map(str, mesh.solids)) or "all solids"
    return getattr(mesh, "path", mesh.shape), UNKNOWN


def touching_table(case: Case, touches: Sequence[Touch]) -> Table:
    """Returns a table of pairs of parts that touch at the start and have no bond; contact does not join such parts."""
    title = "parts that touch and are not joined (a [[bond]] joins parts)"
    made = table(title, "area", right=("area",), wide=(title,))
    for touch in touches:
        names = " and ".join(case.parts[i].name for i in (touch.one, touch.other))
        made.add_row(names, _about(touch.area, lambda value: si(value, "m^2")))
    return made


def loads_table(case: Case, acted_on: Sequence[Load]) -> Table:
    """Returns a table of the loads: the approximate area on which each traction and each prescribed velocity acts."""
    columns = ("area", "faces", "nodes")
    made = table("boundary", "acts by", *columns, right=columns, wide=("acts by",))
    for load in acted_on:
        area = _about(load.area, lambda value: si(value, "m^2"))
        nodes = count(load.nodes) if load.nodes is not None and load.exact else _about(load.nodes, count)
        acts = _acts(case.boundaries[load.boundary])
        made.add_row(f"boundaries[{load.boundary}]", acts, area, _about(load.faces, count), nodes)
    return made


def _acts(spec: Boundary) -> str:
    if isinstance(spec, Traction):
        if spec.pressure is None:
            return "stress"
        return f"pressure of {si(spec.pressure, 'Pa')}{', following the surface' if spec.follows else ''}"
    return spec.kind


def _brings(parts: Sequence[Bulk | None]) -> list[tuple[str, ...]]:
    """Returns mass, extent, momentum and kinetic energy of each part; dashes if a mesh file is not read."""
    known = [bulk for bulk in parts if bulk is not None]
    columns = (
        alike([bulk.mass for bulk in known], "kg"), vectors([bulk.extent for bulk in known], "m", between=" x "),
        alike([math.hypot(*bulk.momentum) for bulk in known], "N s"), alike([bulk.energy for bulk in known], "J"),
    )  # fmt: skip
    rows = zip(*columns, strict=True)
    return [(UNKNOWN,) * len(columns) if bulk is None else next(rows) for bulk in parts]


def _about(value: float | None, shown: Callable[[float], str]) -> str:
    return "–" if value is None else f"about {shown(value)}"
