"""Construction of the whole mesh of a case on rank 0. The module rotates the meshes of all parts, removes overlaps, and
adds loads and initial velocities.
"""

import logging
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from conoid.cases.model import schema
from conoid.cases.model.solids import Measured
from conoid.cases.reading.library import material as find_material
from conoid.cases.reading.survey import Survey

from ..bonds import interface
from ..bonds.pieces import Pieces
from ..bonds.sunk import sunk
from ..mesh.build import build as build_mesh
from ..mesh.faces import across
from ..mesh.model import TetMesh
from ..model.loads import Load, LoadedFaces
from ..model.shares import Shares, ranks, shared
from ..model.state import Floats, Indices, Ints
from . import loading, selection
from .facts import Facts
from .joint import asked, built_together, grouped
from .marks import marks
from .motion import initial_velocities, parted
from .overlapping import apart
from .pieces import UNSEEN
from .remote import remote
from .selection import Nearness
from .stacking import Stacked, stacked

log = logging.getLogger("conoid.worker")

Say = Callable[[str], None]
"""Callback that reports a phase of the start of a run."""


@dataclass
class Whole:
    """The whole mesh of a case with its loads and initial velocities, on rank 0."""

    points: Floats
    node_part: Indices
    tets: Indices
    tet_part: Indices
    volumes: Floats
    across: Indices
    """(tets, 4) neighbours of the faces of each tet (state.Block.across)."""
    shares: Shares
    """Masses of the parts in the nodes that several parts share."""
    node_volume: Floats
    mass: Floats
    velocity: Floats
    loads: list[Load | LoadedFaces]
    """Loads of the tractions that the case defines."""
    tied: Pieces
    """Pieces of the tied bonds between meshes that do not match."""
    near: Nearness
    marks: Ints
    """(nodes,) sets that contain each node, one bit for each set (state.Nodes.marks)."""
    warnings: list[str]
    """Warnings about the meshes and about the regions of the boundaries."""
    survey: Survey
    """Measurements of the meshes that come from files."""


def quiet(what: str) -> None:
    """Do not report the phases of the start."""


def assemble(case: schema.Case, folder: Path, say: Say = quiet) -> Whole:
    """Build the whole mesh from the meshes of all parts. Raises MeshError, InputError.

    ``folder``: folder to which the paths of mesh files are relative.
    """
    facts = Facts(case)
    whole = assembled(case, _built(case, folder, say, facts))
    whole.survey = facts.survey()
    return whole


def _built(case: schema.Case, folder: Path, say: Say, facts: Facts) -> Iterator[tuple[int, TetMesh]]:
    """Yield the mesh of each part with its number, and measure the meshes from files."""
    joint = dict[int, TetMesh]()
    for index, part in enumerate(case.parts):
        announce = partial(say, f"meshing {part.name}, part {index + 1} of {len(case.parts)}")
        key = f"parts[{index}].mesh"
        if index not in joint and len(group := grouped(case, index)) > 1:
            joint |= built_together(case, group, folder, announce)
        mesh = joint.get(index) or build_mesh(asked(part), folder, key=key, made=announce)
        if isinstance(part.mesh, Measured):
            facts.take(index, mesh)
        yield index, mesh


def assembled(case: schema.Case, meshes: Iterable[tuple[int, TetMesh]], overlaps: bool = True) -> Whole:
    """Return the whole mesh, made from the ``meshes`` of the parts and their part numbers. Raises MeshError,
    InputError.

    In a check before a run some parts may be missing. In a check before a run, a boundary selects nodes and faces only
    if all its parts are present. ``overlaps``: True if the function searches for overlaps between bodies.
    """
    made = stacked(case, meshes, overlaps)
    x, t, part_of_tet, warnings = made.points, made.tets, made.tet_part, made.warnings
    if case.in_contact and not overlaps:
        warnings.append(f"contact: {UNSEEN}")
    elif case.in_contact:
        x = apart(case, made)
    tied = Pieces.none()
    if overlaps and interface.tied_pairs(case):
        exposed = (made.across if len(made.across) else across(t)) < 0
        joined = interface.find(case, x, t, part_of_tet, exposed)
        x, tied = joined.x, joined.pieces
        warnings += [*joined.warnings, *sunk(case, x, t, part_of_tet, exposed, tied)]
    volumes = _volumes(x, t)
    masses = volumes * np.array([find_material(case, part.material).density for part in case.parts])[part_of_tet]
    shares = _shares(case, made, masses)
    part_of_node = made.node_part
    part_of_node[shares.standing()[0]] = shares.standing()[1]
    members = shares.members(part_of_node)
    near = selection.nearness(case, x, members, t, part_of_tet)
    known = selection.settled(case, made.part_of_body)
    marked = marks(case, made.read, len(x))
    loads, found, missed = loading.loads(case, x, members, (t, part_of_tet), near, known, marked, tied)
    driven, more = loading.driven(case, x, members, near, known, marked)
    velocity, mixed = initial_velocities(case, x, part_of_node, shares)
    mixed += parted(case, x, t, tied)
    return Whole(
        points=x, node_part=part_of_node, tets=t, tet_part=part_of_tet, volumes=volumes,
        across=made.across, shares=shares,
        node_volume=_quarters(t, volumes, len(x)), mass=_weighed(case, _quarters(t, masses, len(x)), part_of_node),
        velocity=velocity, loads=loads, tied=tied, near=near, marks=marked.nodes,
        warnings=[
            *warnings, *remote(case, x, t, part_of_tet, volumes), *marked.warnings, *missed, *more,
            *selection.off_planes(case, x, members, near, known),
            *selection.compared(case, [*found, *driven]), *mixed,
        ],
        survey=Survey(),
    )  # fmt: skip


def _shares(case: schema.Case, made: Stacked, masses: Floats) -> Shares:
    """Return the masses of the parts in the nodes of several parts. ``masses`` (tets,): mass of each tet, kg."""
    rank = ranks(case)
    if not len(rank):
        return Shares()
    corners, of = made.tets.reshape(-1), np.repeat(made.tet_part, 4)
    met = np.zeros(len(made.points), bool)
    met[corners[of != made.node_part[corners]]] = True
    some = met[corners]
    return shared(corners[some], of[some], np.repeat(masses / 4.0, 4)[some], rank)


def _quarters(tets: Indices, values: Floats, n: int) -> Floats:
    """Return (n,) sums at the nodes. Each tet adds a quarter of its value to each of its nodes, in the order of the
    tets.
    """
    return np.bincount(tets.reshape(-1), np.repeat(values / 4.0, 4), n).astype(np.float64)


def _weighed(case: schema.Case, mass: Floats, part: Indices) -> Floats:
    """Return (n,) the masses of the nodes, kg. If the case gives the mass of a rigid part, the masses of its nodes are
    scaled to this mass.
    """
    for index in case.rigid:
        spec = case.parts[index].rigid
        if spec is not None and spec.mass is not None:
            some = part == index
            mass[some] *= spec.mass / math.fsum(mass[some])
    return mass


def _volumes(x: Floats, tets: Indices) -> Floats:
    origin = x[tets[:, 0]]
    e1, e2, e3 = x[tets[:, 1]] - origin, x[tets[:, 2]] - origin, x[tets[:, 3]] - origin
    volumes: Floats = (e1 * np.cross(e2, e3)).sum(axis=1) / 6.0
    return volumes
