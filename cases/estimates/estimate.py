"""Estimate of the cost of a case before a run: tets, time step, steps, memory, core time.

Numbers of tets are exact for the structured generator and within about 10 % for gmsh; numbers of steps are within a
factor of two. The core time depends on the constants of this module, which were measured on one machine.
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
"""Core time per tet and step: for every tet, and for each feature; laws of strength have separate times (cases/laws).
Measured with 10,000 to 750,000 tets."""
FACE_NANOSECONDS = {"contact": 50.0, "erosion": 1400.0}
"""Core time per surface face and step; the second value is for parts that erode, stay in contact, and are searched
often."""
STEP_OVERHEAD = 0.3e-3
"""Core time of a rank per step, s, in addition to the core time of its tets."""
START = 2.0
"""Core time of a rank before its first step, s, with a warm kernel cache."""

BROKEN_NANOSECONDS = 15_000.0
"""Core time per tet and step of a body that has turned to dust, whose fragments touch each other. Measured: 3 to 14 us
in the ten hard cases that break without a prescribed motion (docs/verification/accuracy.md: CPU s less the estimate
without dust, divided by steps and by tets that can break); 10 to 20 us in a glass plate under an eroding cylinder, on
aluminium, with friction. A broken facet costs 7 us, and completely fragmented material has two broken facets for each
tet."""
PRESSED_NANOSECONDS = 26_000.0
"""Core time per tet and step of dust that is enclosed and pressed; every tet is then in contact on all sides, and
contact needs many sweeps. Measured: a plug of glass under a ram (tests/bench/press.py) 17,000 to 20,000 on one rank; a
block of 3,600 tets between walls, compressed by a ram to four fifths and two thirds of its height, 18,000 and 26,000;
less where the dust can move aside."""
BREAKING_OVERHEAD = 2e-3
"""Core time of a rank per step in which any facet breaks, s: 1 to 4 ms in twelve scenes of 150 to 24,000 tets."""

RIGID_STEPS = 1000.0
"""Number of steps of a run with rigid parts only; more steps if the rotation of the parts needs more
(worker/rigid/stage.py)."""

RANK_BYTES = 280_000_000
"""Memory of a rank without a mesh: interpreter, libraries and the kernels of a single body. Rank 0, which writes all
files, uses 260 MB, and 300 MB if pyarrow also writes a history as Parquet; each other rank uses 240 MB."""
STAGE_BYTES = {"contact": 20_000_000, "fracture": 30_000_000}
"""Additional memory of a rank for kernels and tables of a stage. The case bar_on_bar used 276 MB in all; the tile of
docs/tutorial/first_case.md used 301 MB before fracture."""
TET_BYTES = {"tet": 330, "nodal": 110, "split": 140, "strength": 50, "facets": 130}
"""Memory per tet, including the tet's share of the nodes, at the peak during the setup of the model
(docs/performance/bench.md)."""
DUST_BYTES = 38_000
"""Additional memory per tet of a body that has turned to dust: copies of nodes, surface, candidate pairs and their
tables. Measured as the peak of a rank with half of the facets broken, less its memory before fracture: 20 kB in the
tile of docs/tutorial/first_case.md with 3,900 tets, 35 and 40 kB with the 57 MB that rank 0 needs at the end to write
the history as Parquet; 20 kB in glass_ball_cohesive on two ranks. Glass bars with a quarter of the facets broken needed
7 and 5 kB per tet: glass_steel_bar with 9,000 and 39,000 tets."""
FILE_BYTES = {".msh": 42, ".inp": 48}
"""Bytes per tet of a mesh file in text, including the tet's share of the node lines."""


@dataclass(frozen=True)
class PartEstimate:
    """Estimate of a part; None if its mesh file is not known."""

    name: str
    elements: int | None
    nodes: int | None
    dt: float | None
    """Stable time step of the smallest tet of the part at the start, s; infinite for a rigid part."""
    bulk: Bulk | None = None


@dataclass(frozen=True)
class Estimate:
    """Estimate of a case; None if the mesh file of a part is not known."""

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
    """Core time of each stage of the case (cases/estimates/stages.py), s; empty if unknown. Fracture costs more, by an
    amount that cannot be estimated."""
    breaking: float
    """Additional CPU time, s, if the parts that can fracture break as far as they can; 0 without fracture."""
    dust_bytes: int
    """Additional memory of all ranks, bytes, if the parts that can fracture break as far as they can."""
    parts: tuple[PartEstimate, ...]


def estimate(case: Case, folder: Path | None = None, survey: Survey = Survey()) -> Estimate:  # noqa: B008
    """Returns the estimate of ``case``. Relative paths of mesh files start in ``folder`` (without ``folder`` no file is
    read); ``survey``: the survey of the mesh files. Raises CaseError if a material is unknown.
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
    """Time step of a case with rigid parts only, s: such a run has at least a fixed number of steps."""
    return case.run.end_time / RIGID_STEPS if dt == math.inf else dt


def _size(part: Part, folder: Path | None, found: Surveyed | None) -> MeshSize | int | None:
    """Returns the known data of the mesh of a part: all sizes, or only the number of tets, or None."""
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
    """Returns core seconds by stage, for mesh files with ``faces`` faces; empty if the number of tets is unknown."""
    if steps is None or any(size.elements is None for size in parts):
        return {}
    found = {STEPS: steps * case.run.ranks * STEP_OVERHEAD + case.run.ranks * START}
    for size, part in zip(parts, case.parts, strict=True):
        for name, nanoseconds in _nanoseconds(case, part).items():
            found[name] = found.get(name, 0.0) + 1e-9 * steps * (size.elements or 0) * nanoseconds
    found[CONTACT] = 1e-9 * steps * _contact(case, faces)
    return {name: seconds for name, seconds in found.items() if seconds > 0.0}


def _breaking(case: Case, parts: tuple[PartEstimate, ...], steps: int | None) -> float:
    """Returns the largest core time of fracture, and of contact between fragments, s. A part that moves freely is
    assumed to break as far as its kinetic energy allows; a part with a prescribed motion is assumed to become dust and
    to be pressed.
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
    """Returns the largest share of the facets of a part that can break in an impact at ``speed``, m/s.

    The size of fragments is such that the kinetic energy of their stretching equals the energy of their crack surface:
    s^3 = 24 G / (density rate^2), Grady 1982 (J. Appl. Phys. 53, 322); facets are one element apart. The rate is the
    largest of three: the rate of the part's stretch or spin; the speed divided by the length of the part; the rate that
    strains the part to its strength while a wave crosses it. The share is 1 for mesh files.
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
    """Returns the number of tets of the parts that fracture, as far as mesh files are known."""
    pairs = zip(parts, case.parts, strict=True)
    return sum(size.elements or 0 for size, part in pairs if part.fracture is not None)


def _contact(case: Case, faces: int) -> float:
    """Returns the core time of contact per step, ns; ``faces``: number of faces of the parts from mesh files, as far as
    known.
    """
    if not case.in_contact:
        return 0.0
    faces += sum(surface_faces(part.mesh) for part in case.parts if not isinstance(part.mesh, Measured))
    return faces * FACE_NANOSECONDS["erosion" if case.erodes else "contact"]


def _nanoseconds(case: Case, part: Part) -> dict[str, float]:
    """Returns the core time per tet and step by stage, ns."""
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
