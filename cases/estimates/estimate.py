"""Estimate of the cost of a case before it runs: number of tets, time step, number of steps, memory, CPU time.

The number of tets is exact for the structured generator and within about 10 % for gmsh; the number of steps is within a
factor of two. The CPU time depends on the constants of this module, which were measured on one machine.
"""

import math
from dataclasses import dataclass
from pathlib import Path

from ..model.bodies import MeshFile
from ..model.schema import Case, Part, Rotation
from ..model.solids import Combination, Measured
from ..reading.files import located
from ..reading.library import material
from ..reading.survey import Survey, Surveyed
from ..shapes.combined import combined_size
from ..shapes.geometry import bounds
from ..shapes.placed import Bulk, bulk, driven
from .clock_time import ClockTime, clock_time
from .impact import driven_together, impact_speeds, wave_speed
from .mesh_size import MeshSize, mesh_size, surface_faces
from .shrinkage import shrinkage
from .stages import AVERAGED, CONTACT, STATE, STEPS, STRENGTH, TETS

NANOSECONDS = {"tet": 80.0, "nodal": 45.0, "split": 90.0, "eos": 15.0}
"""CPU time per tet and time step, ns: the first value for every tet, the others in addition for tets with this feature.
The laws of strength have their own values (cases/laws). The values were measured with 10,000 to 750,000 tets."""
FACE_NANOSECONDS = {"contact": 50.0, "erosion": 1400.0}
"""CPU time per surface face and time step, ns. The second value is for parts with erosion, which stay in contact and
whose candidate pairs are often searched again."""
STEP_OVERHEAD = 0.3e-3
"""CPU time of a rank per time step, s, in addition to the time for its tets."""
START = 2.0
"""CPU time of a rank before its first time step, s, if the kernels are already compiled."""

BROKEN_NANOSECONDS = 15_000.0
"""CPU time per tet and time step, ns, of a body that has broken to single tets (dust) in contact with each other.
Measured: 3 to 14 us in the ten hard cases that break without a prescribed motion (docs/verification/accuracy.md: CPU
time minus the estimate without dust, divided by the number of steps and of tets that can break); 10 to 20 us in a glass
plate on aluminium under an eroding cylinder, with friction. A broken facet costs 7 us per step, and completely broken
material has two broken facets for each tet."""
PRESSED_NANOSECONDS = 26_000.0
"""CPU time per tet and time step, ns, of dust that is enclosed and compressed: every tet is in contact on all sides,
and the contact solver needs many sweeps. Measured on one rank: 17,000 to 20,000 ns in a plug of glass under a ram
(tests/bench/press.py); 18,000 and 26,000 ns in a block of 3,600 tets between walls, compressed by a ram to four fifths
and to two thirds of its height; less where the dust can move aside."""
BREAKING_OVERHEAD = 2e-3
"""CPU time of a rank, s, in each time step in which a facet breaks: 1 to 4 ms in twelve scenes of 150 to 24,000 tets.
"""

RIGID_STEPS = 1000.0
"""Number of time steps of a run with only rigid parts; fast rotation of a part increases it (worker/rigid/stage.py)."""

RANK_BYTES = 280_000_000
"""Memory of a rank without a mesh, bytes: interpreter, libraries, and the kernels for a single body. Measured: 260 MB
for rank 0, which writes all files, and 300 MB if pyarrow also writes the history as Parquet; 240 MB for each other
rank."""
STAGE_BYTES = {"contact": 30_000_000, "fracture": 30_000_000}
"""Memory of a rank for the kernels and tables of a stage, bytes, in addition to RANK_BYTES. Measured: 306 MB in all for
the case bar_on_bar; 301 MB in all for the tile of docs/tutorial/first_case.md before it fractures."""
TET_BYTES = {"tet": 330, "nodal": 110, "split": 140, "strength": 50, "facets": 130}
"""Memory per tet and its share of the nodes, bytes, at its maximum during the setup of the model
(docs/performance/bench.md)."""
DUST_BYTES = 46_000
"""Memory per tet of a body that has broken to single tets, bytes, in addition to TET_BYTES: copies of nodes, surface,
candidate pairs and their tables. Measured as the largest memory of a rank with half of its facets broken, minus its
memory before fracture: 40 to 45 kB per tet in the tile of docs/tutorial/first_case.md with 3,900 tets, including the 57
MB with which rank 0 writes the history as Parquet; 20 kB in the case glass_ball_cohesive on two ranks. The
glass bars of the case glass_steel_bar with 9,000 and 39,000 tets and a quarter of their facets broken needed 7 and 5 kB
per tet."""
FILE_BYTES = {".msh": 42, ".inp": 48}
"""Bytes per tet of a mesh file in text form, including the lines of the nodes."""


@dataclass(frozen=True)
class PartEstimate:
    """Estimate of one part. A number is None if the mesh file of the part was not read."""

    name: str
    elements: int | None
    nodes: int | None
    dt: float | None
    """Stable time step of the smallest tet of the part at the start, s. For a rigid part the time step is infinite."""
    bulk: Bulk | None = None


@dataclass(frozen=True)
class Estimate:
    """Estimate of a case. A number is None if the mesh file of a part was not read."""

    elements: int | None
    nodes: int | None
    dt: float | None
    """First time step of the run, s."""
    steps: int | None
    memory_bytes: int | None
    """Memory of all ranks together without fracture, bytes."""
    core_seconds: float | None
    """CPU time of all ranks together, s."""
    clock: ClockTime | None
    """Wall time of the case on its ranks and threads."""
    costs: dict[str, float]
    """CPU time of each stage of the case (cases/estimates/stages.py), s; empty if unknown. The cost of fracture is not
    included: its amount depends on the run."""
    breaking: float
    """Additional CPU time, s, if the parts that can fracture break as far as they can; 0 without fracture."""
    dust_bytes: int
    """Additional memory of all ranks, bytes, if the parts that can fracture break as far as they can."""
    parts: tuple[PartEstimate, ...]


def estimate(case: Case, folder: Path | None = None, survey: Survey = Survey()) -> Estimate:  # noqa: B008
    """Returns the estimate of ``case``. ``folder``: folder to which the paths of mesh files are relative; without it no
    file is read. ``survey``: result of the survey of the mesh files. Raises CaseError if a material is unknown.
    """
    known = [survey.of(index) for index in range(len(case.parts))]
    sizes = [_size(part, folder, found) for part, found in zip(case.parts, known, strict=True)]
    parts = tuple(_part(case, *each) for each in zip(case.parts, sizes, known, strict=True))
    dt = _at_most(case, _least([part.dt for part in parts]))
    shrunk = [
        None if p.dt is None else p.dt / shrinkage(case, q, speed)
        for p, q, speed in zip(parts, case.parts, impact_speeds(case), strict=True)
    ]
    mean = _at_most(case, _least(shrunk))
    steps = None if mean is None else min(math.ceil(case.run.end_time / mean), case.run.max_steps)
    costs = _costs(case, parts, steps, sum(found.faces for found in survey.parts))
    breaking = _breaking(case, parts, steps) if costs else 0.0
    return Estimate(
        elements=_total([part.elements for part in parts]),
        nodes=_total([part.nodes for part in parts]),
        dt=dt,
        steps=steps,
        memory_bytes=_memory(case, parts),
        core_seconds=sum(costs.values()) if costs else None,
        clock=clock_time(case, costs, breaking) if costs else None,
        costs=costs,
        breaking=breaking,
        dust_bytes=DUST_BYTES * _tets_that_break(case, parts),
        parts=parts,
    )


def _at_most(case: Case, dt: float | None) -> float | None:
    """Time step, s, limited so that a case with only rigid parts has at least a fixed number of steps."""
    return case.run.end_time / RIGID_STEPS if dt == math.inf else dt


def _size(part: Part, folder: Path | None, found: Surveyed | None) -> MeshSize | int | None:
    """Returns what is known of the mesh of the part: its size (MeshSize), only its number of tets, or None."""
    if found is not None:
        return MeshSize(found.elements, found.nodes, found.step_length)
    if not isinstance(part.mesh, Measured):
        return mesh_size(part.mesh)
    if isinstance(part.mesh, Combination):
        return combined_size(part.mesh)
    if folder is None or not isinstance(part.mesh, MeshFile):
        return None
    path = located(part.mesh.path, part.mesh.sha256, folder)
    try:
        return path.stat().st_size // FILE_BYTES.get(path.suffix, FILE_BYTES[".msh"])
    except (OSError, ValueError):  # a name with a null byte raises ValueError
        return None


def _part(case: Case, part: Part, size: MeshSize | int | None, found: Surveyed | None) -> PartEstimate:
    if not isinstance(size, MeshSize):
        return PartEstimate(part.name, size, None, None)
    made = material(case, part.material)
    slowest = wave_speed(made) * _viscous_factor(case)
    step = math.inf if part.rigid is not None else case.numerics.dt_safety * size.step_length / slowest
    if isinstance(part.mesh, Measured):
        brings = None if found is None else found.bulk
    else:
        brings = bulk(driven(case, part), part.mesh, made.density)
    return PartEstimate(part.name, size.elements, size.nodes, step, brings)


def _viscous_factor(case: Case) -> float:
    """Factor by which the linear bulk viscosity reduces the time step."""
    viscosity = case.numerics.viscosity
    linear = viscosity.linear if viscosity is not None else 0.0
    return linear + math.hypot(1.0, linear)


def _memory(case: Case, parts: tuple[PartEstimate, ...]) -> int | None:
    needed = [
        None if size.elements is None else size.elements * _tet_bytes(case, part)
        for size, part in zip(parts, case.parts, strict=True)
    ]
    tets = _total(needed)
    there = {"contact": case.in_contact, "fracture": case.fractures}
    rank = RANK_BYTES + sum(STAGE_BYTES[stage] for stage, is_there in there.items() if is_there)
    return None if tets is None else tets + case.run.ranks * rank


def _tet_bytes(case: Case, part: Part) -> int:
    there = {"strength": material(case, part.material).strength is not None, "facets": part.fracture is not None}
    features = sum(TET_BYTES[feature] for feature, is_there in there.items() if is_there)
    return TET_BYTES["tet"] + TET_BYTES.get(case.numerics.pressure, 0) + features


def _costs(case: Case, parts: tuple[PartEstimate, ...], steps: int | None, faces: int) -> dict[str, float]:
    """Returns the CPU time of each stage, s; the result is empty if the number of tets is unknown. ``faces``: number of
    surface faces of the parts with mesh files.
    """
    if steps is None or any(size.elements is None for size in parts):
        return {}
    found = {STEPS: steps * case.run.ranks * STEP_OVERHEAD + case.run.ranks * START}
    for size, part in zip(parts, case.parts, strict=True):
        for name, nanoseconds in _nanoseconds(case, part).items():
            found[name] = found.get(name, 0.0) + 1e-9 * steps * (size.elements or 0) * nanoseconds
    found[CONTACT] = 1e-9 * steps * _contact(case, faces)
    return {name: seconds for name, seconds in found.items() if seconds > 0.0}


def _breaking(case: Case, parts: tuple[PartEstimate, ...], steps: int | None) -> float:
    """Returns the largest CPU time, s, of fracture and of contact between fragments. A part that moves freely is
    assumed to break as far as its kinetic energy allows. A part with a prescribed motion is assumed to break to single
    tets that are compressed.
    """
    pressed = case.in_contact and driven_together(case)
    dust = 0.0
    for size, part, speed in zip(parts, case.parts, impact_speeds(case), strict=True):
        if part.fracture is not None:
            share = 1.0 if pressed else broken_share(case, part, speed)
            dust += share * (size.elements or 0) * (PRESSED_NANOSECONDS if pressed else BROKEN_NANOSECONDS)
    rate = case.run.ranks * BREAKING_OVERHEAD + 1e-9 * dust
    return (steps or 0) * rate if case.fractures else 0.0


def broken_share(case: Case, part: Part, speed: float) -> float:
    """Returns the largest fraction of the facets of a part that can break in an impact at ``speed``, m/s.

    The size s of the fragments follows from the balance of the kinetic energy of their stretching and the energy of
    their crack surface: s^3 = 24 G / (density rate^2), Grady 1982 (J. Appl. Phys. 53, 322). Facets are one element
    apart. The rate is the largest of three: the rate of the stretch or spin of the part; ``speed`` divided by the
    length of the part; the rate that strains the part to its strength while a wave crosses it. For a mesh file the
    returned fraction is 1.
    """
    made, body = material(case, part.material), bounds(part.mesh)
    if made.brittle is None or body is None or isinstance(part.mesh, Measured):
        return 1.0
    length = max(high - low for low, high in zip(*body, strict=True))
    own = [abs(rate) for motion in (part.stretch, part.spin) if motion is not None for rate in motion.rate]
    rate = max(speed / length, made.brittle.strength / made.elastic.young * wave_speed(made) / length, *own)
    fragment = (24.0 * made.brittle.energy / (made.density * rate**2)) ** (1.0 / 3.0)
    return float(min(1.0, part.mesh.element_size / fragment))


def _tets_that_break(case: Case, parts: tuple[PartEstimate, ...]) -> int:
    """Returns the number of tets of the parts that can fracture, without parts whose mesh file was not read."""
    pairs = zip(parts, case.parts, strict=True)
    return sum(size.elements or 0 for size, part in pairs if part.fracture is not None)


def _contact(case: Case, faces: int) -> float:
    """Returns the CPU time of contact per time step, ns. ``faces``: number of surface faces of the parts with mesh
    files, without files that were not read.
    """
    if not case.in_contact:
        return 0.0
    faces += sum(surface_faces(part.mesh) for part in case.parts if not isinstance(part.mesh, Measured))
    return faces * FACE_NANOSECONDS["erosion" if case.erodes else "contact"]


def _nanoseconds(case: Case, part: Part) -> dict[str, float]:
    """Returns the CPU time of each stage per tet and time step, ns."""
    if part.rigid is not None:
        return {}
    made = material(case, part.material)
    turned = any(b.on is None and (not b.parts or part.name in b.parts) for _, b in case.boundaries_of(Rotation))
    return {
        TETS: NANOSECONDS["tet"], AVERAGED: NANOSECONDS.get(case.numerics.pressure, 0.0),
        STRENGTH: made.strength.nanoseconds if made.strength is not None and not turned else 0.0,
        STATE: NANOSECONDS["eos"] if made.eos is not None else 0.0,
    }  # fmt: skip


def _least(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return min(known) if len(known) == len(values) else None


def _total(values: list[int | None]) -> int | None:
    known = [value for value in values if value is not None]
    return sum(known) if len(known) == len(values) else None
