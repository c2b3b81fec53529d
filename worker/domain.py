"""From parts to what each rank holds: meshes, masses, initial motion, bisection, shared nodes.

Rank 0 builds the whole mesh, numbers it and cuts it; every rank receives its own piece. Global ids follow the order
of the parts and, within a part, the order of the mesh: they do not know how many ranks there are.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from conoid.cases import schema
from conoid.cases.library import material as find_material

from .contact import overlap, pairing
from .elements import wear
from .errors import InputError
from .hashing import uniform
from .materials import models
from .mesh.build import build as build_mesh
from .mesh.faces import FACES, across, normals
from .parallel.comm import Comm, SerialComm
from .parallel.decompose import bisect
from .parallel.ownership import Neighbour
from .state import (
    CHUNK,
    MASS,
    Block,
    Flags,
    Floats,
    Indices,
    Ints,
    Load,
    Model,
    Nodes,
    Tets,
    chunked,
)

GROUPS = 256
"""Parts of the mesh whose loads are told (worker/groups.py)."""
Say = Callable[[str], None]
"""Tells what the start is at."""
_JITTER = 0x6A697474
"""Seed of the random velocities of the start."""


@dataclass
class Whole:
    """The whole mesh, on rank 0."""

    points: Floats
    node_part: Indices
    tets: Indices
    tet_part: Indices
    volumes: Floats
    across: Indices
    """(tets, 4) see state.Block."""
    node_volume: Floats
    mass: Floats
    velocity: Floats
    loads: list[Load]
    """Of the tractions of the case."""


@dataclass
class Piece:
    """What one rank receives."""

    node_ids: Ints
    node_part: Indices
    node_owner: Indices
    owned: Flags
    points: Floats
    velocity: Floats
    mass: Floats
    node_volume: Floats
    loads: list[Load]
    """Of the tractions of the case, on all nodes that this rank holds."""
    tet_ids: Ints
    tet_part: Indices
    tets: Indices
    tet_volume: Floats
    across: Indices
    """(tets, 4) see state.Block."""
    border: Flags
    node_group: Indices
    tet_group: Indices
    groups: Floats
    """(groups, 4) see state.Model."""
    neighbours: list[Neighbour]
    totals: tuple[int, int, int]
    """Tets, nodes and shared nodes of the whole."""
    part_starts: Ints
    """Global id of the first tet of each part."""
    size: float
    """Largest coordinate of the whole, m."""


def quiet(what: str) -> None:
    """Nobody hears what the start is at."""


def assemble(case: schema.Case, folder: Path, say: Say = quiet) -> Whole:
    """Builds the meshes of all parts; ``folder`` is where relative mesh paths start. Raises MeshError."""
    points, tets, node_part, tet_part, density = [], [], [], [], []
    offset = 0
    for index, part in enumerate(case.parts):
        meshing = f"meshing {part.name}, part {index + 1} of {len(case.parts)}"
        mesh = build_mesh(part.mesh, folder, key=f"parts[{index}].mesh", made=partial(say, meshing))
        points.append(mesh.points if part.turn is None else _turned(mesh.points, part.turn))
        tets.append(mesh.tets.astype(np.int64) + offset)
        node_part.append(np.full(len(mesh.points), index, np.int32))
        tet_part.append(np.full(len(mesh.tets), index, np.int32))
        density.append(find_material(case, part.material).density)
        offset += len(mesh.points)
    x, t = np.concatenate(points), np.concatenate(tets).astype(np.int32)
    part_of_tet = np.concatenate(tet_part)
    volumes = _volumes(x, t)
    part_of_node = np.concatenate(node_part)
    behind = across(t) if case.in_contact or case.fractures else np.zeros((0, 4), np.int32)
    if case.in_contact:
        x = _apart(case, x, t, part_of_node, behind < 0)
        volumes = _volumes(x, t)
    return Whole(
        points=x, node_part=part_of_node, tets=t, tet_part=part_of_tet, volumes=volumes,
        across=behind,
        node_volume=_quarters(t, volumes, len(x)), mass=_quarters(t, volumes * np.array(density)[part_of_tet], len(x)),
        velocity=_velocities(case, x, part_of_node), loads=_loads(case, x, part_of_node, t),
    )  # fmt: skip


def _turned(points: Floats, turn: schema.Turn) -> Floats:
    """Points (n, 3) after the rotation."""
    i, j = ((1, 2), (2, 0), (0, 1))["xyz".index(turn.axis)]
    cosine, sine = math.cos(turn.angle), math.sin(turn.angle)
    arms, turned = points - np.array(turn.centre), points.copy()
    turned[:, i] = turn.centre[i] + cosine * arms[:, i] - sine * arms[:, j]
    turned[:, j] = turn.centre[j] + sine * arms[:, i] + cosine * arms[:, j]
    return turned


def _apart(case: schema.Case, x: Floats, tets: Indices, part: Indices, exposed: Flags) -> Floats:
    """The points, when no part overlaps another; moved apart where the case asks for that. Raises InputError."""
    assert case.contact is not None
    tet, face = np.nonzero(exposed)
    faces = tets[tet[:, None], FACES[face]]
    surface, allowed = overlap.Surface(faces, part[faces[:, 0]], exposed), ~np.isnan(pairing.friction(case))
    if case.contact.overlap == "push":
        x = overlap.move_apart(x, tets, part, surface, allowed)
    found = overlap.find(x, tets, part, surface, allowed)
    if not len(found.nodes):
        return x
    worst = int(np.argmax(found.depth))
    node = found.nodes[worst]
    one, other = case.parts[part[node]].name, case.parts[found.part[worst]].name
    place = ", ".join(f"{c:.6g}" for c in x[node])
    way = "set contact.overlap = 'push'" if case.contact.overlap == "refuse" else "contact.overlap = 'push' could not"
    raise InputError(
        f"parts: {one!r} overlaps {other!r} by {found.depth[worst]:.3g} m at ({place}) m; move them apart, or {way}"
    )


def _quarters(tets: Indices, values: Floats, n: int) -> Floats:
    """(n,) a quarter of each tet's value summed at its nodes, in the order of the tets."""
    return np.bincount(tets.reshape(-1), np.repeat(values / 4.0, 4), n).astype(np.float64)


def _volumes(x: Floats, tets: Indices) -> Floats:
    origin = x[tets[:, 0]]
    e1, e2, e3 = x[tets[:, 1]] - origin, x[tets[:, 2]] - origin, x[tets[:, 3]] - origin
    volumes: Floats = np.einsum("ij,ij->i", e1, np.cross(e2, e3)) / 6.0
    return volumes


def _velocities(case: schema.Case, x: Floats, part: Indices) -> Floats:
    v = np.zeros_like(x)
    for index, spec in enumerate(case.parts):
        chosen = part == index
        v[chosen] = spec.velocity
        if spec.spin is not None:
            v[chosen] += np.cross(np.array(spec.spin.rate), x[chosen] - np.array(spec.spin.centre))
        if spec.stretch is not None:
            v[chosen] += np.array(spec.stretch.rate) * (x[chosen] - np.array(spec.stretch.centre))
        if spec.jitter > 0.0:
            places = 3 * np.flatnonzero(chosen)[:, None] + np.arange(3)
            v[chosen] += spec.jitter * (2.0 * uniform(places, _JITTER) - 1.0)
    return v


def _loads(case: schema.Case, x: Floats, part: Indices, tets: Indices) -> list[Load]:
    """The tractions of the case: a third of the force on each face for each of its nodes, in the order of the tets.

    Raises InputError for one that acts on no face.
    """
    found = case.boundaries_of(schema.Traction)
    loads = []
    tet, face = np.nonzero(across(tets) < 0) if found else (np.zeros(0, np.int64), np.zeros(0, np.int64))
    faces = tets[tet[:, None], FACES[face]]
    for index, spec in found:
        chosen = np.isin(part, [i for i, p in enumerate(case.parts) if not spec.parts or p.name in spec.parts])
        if spec.low is not None and spec.high is not None:
            chosen &= ((x >= np.array(spec.low)) & (x <= np.array(spec.high))).all(axis=1)
        inside = chosen[faces].all(axis=1)
        loaded = faces[inside]
        if not len(loaded):
            raise InputError(f"boundaries[{index}]: acts on no face; check its box and its parts")
        area = 0.5 * np.linalg.norm(normals(x, loaded), axis=1)
        force = area[:, None] / 3.0 * np.array(spec.stress)
        of, nodes = np.repeat(tet[inside], 3).astype(np.int64), loaded.reshape(-1).astype(np.int64)
        loads.append(Load(np.arange(len(of)), of, nodes, np.repeat(force, 3, axis=0)))
    return loads


def cut(whole: Whole, ranks: int, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> list[Piece]:
    """The pieces of ``ranks`` ranks: tets by recursive bisection of their centres, nodes with every tet's rank.

    ``scale`` multiplies the centres first: a direction that is small is cut last.
    Raises InputError when there are more ranks than tets.
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
    shared = holders > 1
    totals = (len(whole.tets), len(whole.points), int(shared.sum()))
    return [_piece(whole, owner, rank, nodes_of, shared, home, grouped, totals) for rank in range(ranks)]


def _grouped(whole: Whole, centres: Floats) -> tuple[Indices, Indices, Floats]:
    """The groups of the nodes and of the tets, and the groups; the tets are bisected by their ``centres`` (tets, 3)."""
    n = min(GROUPS, len(centres))
    tets, _ = bisect(centres, np.arange(len(centres)), np.ones(len(centres)), n, SerialComm())
    middle, sizes = whole.points[whole.tets].mean(axis=1), np.bincount(tets, minlength=n)
    sums = [np.bincount(tets, middle[:, axis], n) / sizes for axis in range(3)]
    return _home(whole, tets), tets, np.column_stack([*sums, sizes])


def _home(whole: Whole, owner: Indices) -> Indices:
    """Which part of a cut has each node: the one that has its tet of smallest id; that rank owns the node."""
    home = np.zeros(len(whole.points), np.int32)
    home[whole.tets[::-1].reshape(-1)] = np.repeat(owner[::-1], 4)
    return home


def _piece(
    whole: Whole, owner: Indices, rank: int, nodes_of: list[Ints], shared: Flags, home: Indices,
    grouped: tuple[Indices, Indices, Floats], totals: tuple[int, int, int],
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
        whole.velocity[nodes], whole.mass[nodes], whole.node_volume[nodes],
        [load.take(np.isin(load.nodes, nodes)) for load in whole.loads],
        ids.astype(np.int64),
        whole.tet_part[ids], local[tets], whole.volumes[ids],
        whole.across[ids] if len(whole.across) else whole.across, np.any(shared[tets], axis=1),
        grouped[0][nodes], grouped[1][ids], grouped[2], neighbours, totals,
        np.searchsorted(whole.tet_part, np.arange(whole.tet_part[-1] + 1)), float(np.abs(whole.points).max()),
    )  # fmt: skip


def build(case: schema.Case, folder: Path, comm: Comm, say: Say = quiet) -> tuple[Model, Piece]:
    """This rank's model; rank 0 calls ``say`` with what it is at.

    Raises MeshError on every rank when rank 0 cannot build a mesh.
    """
    pieces: list[Piece] | None = None
    failure: Exception | None = None
    if comm.rank == 0:
        try:
            whole = assemble(case, folder, say)
            say(f"cutting {len(whole.tets)} tets for {comm.size} rank{'s' if comm.size > 1 else ''}")
            pieces = cut(whole, comm.size, case.run.cut_scale)
        except Exception as error:
            failure = error
    failure = comm.broadcast(failure)
    if failure is not None:
        raise failure
    piece: Piece = comm.scatter(pieces)
    return _model(case, piece), piece


def _model(case: schema.Case, piece: Piece) -> Model:
    nodes = Nodes(
        id=piece.node_ids, part=piece.node_part, owner=piece.node_owner, owned=piece.owned, x0=piece.points.copy(),
        x=piece.points, v=piece.velocity, mass=piece.mass, force=np.zeros(piece.points.shape, np.int64),
        group=piece.node_group,
    )  # fmt: skip
    blocks = [_block(case, piece, index) for index in range(len(case.parts)) if (piece.tet_part == index).any()]
    return Model(
        nodes, blocks, [p.name for p in case.parts], piece.totals[0], piece.totals[1], piece.part_starts, piece.size,
        piece.groups,
    )  # fmt: skip


def _block(case: schema.Case, piece: Piece, index: int) -> Block:
    part, chosen = case.parts[index], np.flatnonzero(piece.tet_part == index)
    material = find_material(case, part.material)
    chosen = chosen[np.argsort(~piece.border[chosen], kind="stable")]
    rows = models.rows_of(material, case.numerics.pressure)
    state = np.zeros((-(-len(chosen) // CHUNK), rows, CHUNK))
    state[:, MASS, :] = chunked(piece.tet_volume[chosen] * material.density)
    for row, value in models.beginning(material, part.temperature).items():
        if row < rows:
            state[:, row, :] = value
    across = piece.across[chosen] if len(piece.across) else piece.across
    tets = np.ascontiguousarray(piece.tets[chosen], np.uint32)
    made = block(case, index, piece.tet_ids[chosen], tets, state, across, int(piece.border[chosen].sum()))
    made.group = piece.tet_group[chosen]
    return made


def block(
    case: schema.Case, index: int, ids: Ints, tets: Tets, state: Floats, across: Indices, border: int
) -> Block:  # fmt: skip
    """The block of part ``index``: what is known of its tets, the ``border`` ones first, and what the case says."""
    part = case.parts[index]
    material = find_material(case, part.material)
    return Block(
        part=index, n=len(ids), id=ids, state=state, tets=tets,
        kind=models.strength_of(material), eos=models.eos_of(material),
        params=models.parameters(material, case.numerics.viscosity),
        border_chunks=-(-border // CHUNK), temperature=part.temperature, across=across,
        worn=np.zeros(len(ids) if part.erosion is not None else 0, bool), life=wear.life(part.erosion),
    )  # fmt: skip
