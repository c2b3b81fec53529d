"""Division of the whole mesh among the ranks. Each rank receives its tets and nodes, shared nodes, masses and blocks of
tets.

Rank 0 builds the whole mesh (assembly.py), numbers its tets and nodes, and divides it. Global ids have the order of the
parts and, within a part, the order of the mesh, for any number of ranks.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from conoid.cases.estimates.estimate import estimate
from conoid.cases.model import schema
from conoid.cases.reading.library import material as find_material
from conoid.cases.reading.survey import Survey
from conoid.cases.warnings.touching import touching
from conoid.cases.warnings.warned import warned

from ..bonds.pieces import Pieces
from ..elements import wear
from ..errors import InputError
from ..materials import models
from ..model.loads import Load, LoadedFaces
from ..model.rows import MASS
from ..model.shares import Shares
from ..model.state import CHUNK, Block, Flags, Floats, Indices, Ints, Model, Nodes, Tets, chunked, force_table
from ..parallel.comm import Comm, SerialComm
from ..parallel.decompose import bisect
from ..parallel.ownership import Neighbour
from . import assembly
from .assembly import Say, Whole

GROUPS = 256
"""Number of groups of tets for which loads are recorded (migration/groups.py). Chosen value."""


@dataclass
class Piece:
    """Data of the whole mesh that one rank receives."""

    node_ids: Ints
    node_part: Indices
    node_owner: Indices
    owned: Flags
    points: Floats
    velocity: Floats
    mass: Floats
    node_volume: Floats
    shares: Shares
    """Masses of the parts in the nodes that several parts share."""
    loads: list[Load | LoadedFaces]
    """Loads of the tractions on all nodes of this rank. The load of a pressure that follows the surface consists of
    faces of the tets of this rank."""
    tied: Pieces
    """Pieces of the tied bonds between meshes that do not match. Every rank has the pieces of all ranks."""
    tet_ids: Ints
    tet_part: Indices
    tets: Indices
    tet_volume: Floats
    across: Indices
    """(tets, 4) neighbours of the faces of each tet (state.Block.across)."""
    border: Flags
    node_group: Indices
    tet_group: Indices
    groups: Floats
    """(groups, 4) centre and number of tets of each group of tets (state.Model.groups)."""
    neighbours: list[Neighbour]
    totals: tuple[int, int, int]
    """Numbers of tets, nodes and shared nodes of the whole mesh."""
    part_starts: Ints
    """(parts,) global id of the first tet of each part."""
    mean_volumes: Floats
    """(parts,) mean volume of the tets of each part, m^3."""
    size: float
    """Largest absolute coordinate of the whole mesh, m."""
    slack: Floats
    rounding: Floats
    """(parts,) tolerances with which nodes are compared with regions and symmetry planes, m (state.Model)."""
    marks: Ints
    """(nodes,) sets that contain each node, one bit for each set (state.Nodes.marks)."""
    warnings: list[str]
    """Warnings about the meshes and the boundaries (assembly.Whole)."""


def cut(whole: Whole, ranks: int, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> list[Piece]:
    """Return the pieces of the mesh for ``ranks`` ranks. The centres of the tets are divided by recursive bisection. A
    rank gets all nodes of its tets.

    Before the bisection the centres are multiplied by ``scale``. A direction with a small factor is cut last. Raises
    InputError if there are more ranks than tets.
    """
    if ranks > len(whole.tets):
        raise InputError(f"run.ranks = {ranks}: at most {len(whole.tets)}, the number of tets")
    centres = whole.points[whole.tets].mean(axis=1) * np.array(scale)
    owner, _ = bisect(centres, np.arange(len(centres)), np.ones(len(centres)), ranks, SerialComm())
    nodes_of = [np.unique(whole.tets[owner == rank]) for rank in range(ranks)]
    holders = np.zeros(len(whole.points), np.int32)
    for nodes in nodes_of:
        holders[nodes] += 1
    home, grouped = _home(whole, owner), _grouped(whole, centres)
    starts = np.searchsorted(whole.tet_part, np.arange(whole.tet_part[-1] + 1))
    means = np.array([math.fsum(part) / max(len(part), 1) for part in np.split(whole.volumes, starts[1:])])
    shared = holders > 1
    totals = (len(whole.tets), len(whole.points), int(shared.sum()))
    return [
        _piece(whole, owner, rank, nodes_of, shared, home, grouped, totals, (starts, means)) for rank in range(ranks)
    ]


def _grouped(whole: Whole, centres: Floats) -> tuple[Indices, Indices, Floats]:
    """Return the group of each node and of each tet, and the groups (groups, 4). The groups are made by bisection of
    the tets by their ``centres`` (tets, 3).
    """
    n = min(GROUPS, len(centres))
    tets, _ = bisect(centres, np.arange(len(centres)), np.ones(len(centres)), n, SerialComm())
    middle, sizes = whole.points[whole.tets].mean(axis=1), np.bincount(tets, minlength=n)
    sums = [np.bincount(tets, middle[:, axis], n) / sizes for axis in range(3)]
    return _home(whole, tets), tets, np.column_stack([*sums, sizes])


def _home(whole: Whole, owner: Indices) -> Indices:
    """Return (nodes,) the rank that owns each node: the rank with the tet of smallest id at the node."""
    home = np.zeros(len(whole.points), np.int32)
    home[whole.tets[::-1].reshape(-1)] = np.repeat(owner[::-1], 4)
    return home


def _piece(
    whole: Whole, owner: Indices, rank: int, nodes_of: list[Ints], shared: Flags, home: Indices,
    grouped: tuple[Indices, Indices, Floats], totals: tuple[int, int, int], parts: tuple[Ints, Floats],
) -> Piece:  # fmt: skip
    nodes, ids = nodes_of[rank], np.flatnonzero(owner == rank)
    local = np.full(len(whole.points), -1, np.int32)
    local[nodes] = np.arange(len(nodes), dtype=np.int32)
    mine = nodes[shared[nodes]]
    neighbours = []
    for other, theirs in enumerate(nodes_of):
        common = np.intersect1d(mine, theirs, assume_unique=True) if other != rank else mine[:0]
        if len(common):
            neighbours.append(Neighbour(other, local[common]))
    tets = whole.tets[ids]
    return Piece(
        nodes.astype(np.int64), whole.node_part[nodes], home[nodes], home[nodes] == rank, whole.points[nodes],
        whole.velocity[nodes], whole.mass[nodes], whole.node_volume[nodes], whole.shares.of_nodes(local),
        [load.here(nodes, ids) for load in whole.loads], whole.tied,
        ids.astype(np.int64),
        whole.tet_part[ids], local[tets], whole.volumes[ids],
        whole.across[ids] if len(whole.across) else whole.across, np.any(shared[tets], axis=1),
        grouped[0][nodes], grouped[1][ids], grouped[2], neighbours, totals, *parts, float(np.abs(whole.points).max()),
        whole.near.slack, whole.near.rounding, whole.marks[nodes] if len(whole.marks) else whole.marks, whole.warnings,
    )  # fmt: skip


def build(case: schema.Case, folder: Path, comm: Comm, say: Say = assembly.quiet) -> tuple[Model, Piece]:
    """Return the model of this rank, and its piece of the mesh. Rank 0 reports each phase of the start by the callback
    ``say``.

    Collective. Raises MeshError on every rank if rank 0 cannot build a mesh.
    """
    pieces: list[Piece] | None = None
    failure: Exception | None = None
    if comm.rank == 0:
        try:
            whole = assembly.assemble(case, folder, say)
            whole.warnings[:0] = _warned(case, folder, whole.survey)
            say(f"cutting {len(whole.tets)} tets for {comm.size} rank{'s' if comm.size > 1 else ''}")
            pieces = cut(whole, comm.size, case.run.cut_scale)
        except Exception as error:
            failure = error
    failure = comm.broadcast(failure)
    if failure is not None:
        raise failure
    piece: Piece = comm.scatter(pieces)
    return _model(case, piece), piece


def _warned(case: schema.Case, folder: Path, survey: Survey) -> list[str]:
    """Return the warnings about the case that ``conoid validate`` would give."""
    try:
        expected = estimate(case, folder, survey)
    except (ArithmeticError, ValueError):  # if the case has too many elements to count, its reader gives an error
        return []
    return [str(each) for each in warned(case, expected, survey, [*touching(case), *survey.touching])]


def alone(case: schema.Case, whole: Whole) -> tuple[Model, Piece]:
    """Return the model and the piece of the mesh for a run with a single rank."""
    (piece,) = cut(whole, 1)
    return _model(case, piece), piece


def _model(case: schema.Case, piece: Piece) -> Model:
    nodes = Nodes(
        id=piece.node_ids, part=piece.node_part, owner=piece.node_owner, owned=piece.owned, x0=piece.points.copy(),
        x=piece.points, v=piece.velocity, mass=piece.mass, force=force_table(len(piece.points)),
        stepping=np.zeros(len(piece.mass)),
        group=piece.node_group, marks=piece.marks, shares=piece.shares,
    )  # fmt: skip
    blocks = [_block(case, piece, index) for index in range(len(case.parts)) if (piece.tet_part == index).any()]
    return Model(
        nodes, blocks, [p.name for p in case.parts], piece.totals[0], piece.totals[1], piece.part_starts,
        piece.mean_volumes, piece.size, piece.slack, piece.rounding, piece.groups,
    )  # fmt: skip


def _block(case: schema.Case, piece: Piece, index: int) -> Block:
    part, chosen = case.parts[index], np.flatnonzero(piece.tet_part == index)
    material = find_material(case, part.material)
    chosen = chosen[np.argsort(~piece.border[chosen], kind="stable")]
    rows = models.rows_of(material, case.numerics.pressure)
    state = np.zeros((-(-len(chosen) // CHUNK), rows, CHUNK))
    state[:, MASS, :] = chunked(piece.tet_volume[chosen] * _density(part, material.density, piece, index))
    for row, value in models.beginning(material, part.temperature).items():
        if row < rows:
            state[:, row, :] = value
    across = piece.across[chosen] if len(piece.across) else piece.across
    tets = np.ascontiguousarray(piece.tets[chosen], np.uint32)
    made = block(case, index, piece.tet_ids[chosen], tets, state, across, int(piece.border[chosen].sum()))
    made.group = piece.tet_group[chosen]
    return made


def _density(part: schema.Part, density: float, piece: Piece, index: int) -> float:
    """Return the mass of a part divided by the volume of its mesh, kg/m^3: ``density``, unless the case gives the mass
    of a rigid part.
    """
    if part.rigid is None or part.rigid.mass is None:
        return density
    tets = np.append(piece.part_starts, piece.totals[0])[index + 1] - piece.part_starts[index]
    return part.rigid.mass / float(tets * piece.mean_volumes[index])


def block(
    case: schema.Case, index: int, ids: Ints, tets: Tets, state: Floats, across: Indices, border: int
) -> Block:  # fmt: skip
    """Return the block of tets of part ``index``. The block is made from the case and from the arrays of the tets of
    the part; the ``border`` tets come first.
    """
    part = case.parts[index]
    material = find_material(case, part.material)
    return Block(
        part=index, n=len(ids), id=ids, state=state, tets=tets,
        kind=models.strength_of(material), eos=models.eos_of(material),
        params=models.parameters(material, case.numerics.viscosity, breaks=part.fracture is not None),
        border_chunks=-(-border // CHUNK), temperature=part.temperature, across=across,
        worn=np.zeros(len(ids) if part.erosion is not None else 0, bool), life=wear.life(part.erosion),
        rigid=part.rigid is not None,
        quiet=np.zeros((-(-len(ids) // CHUNK), 3), np.int64),
    )  # fmt: skip
