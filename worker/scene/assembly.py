"""The whole mesh of a case, on rank 0: the parts as they are meshed, turned, moved apart, loaded and set in motion."""

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
from ..boundaries import surface_pressure
from ..contact import part_pairs
from ..contact.checks import overlap
from ..errors import InputError
from ..mesh.build import build as build_mesh
from ..mesh.faces import FACES, across, normals
from ..mesh.model import TetMesh
from ..model.hashing import uniform
from ..model.loads import Load, LoadedFaces
from ..model.shares import Shares, ranks, shared
from ..model.state import Floats, Indices, Ints
from . import selection
from .facts import Facts
from .joint import asked, built_together, grouped
from .marks import Marks, marks
from .pieces import UNSEEN
from .selection import Members, Nearness, Selected
from .setting import velocities
from .stacking import Stacked, stacked

log = logging.getLogger("conoid.worker")

Say = Callable[[str], None]
"""Reports what the start is doing."""
_JITTER = 0x6A697474
"""Seed of the random velocities of the start."""
_ALIKE = 1e-6
"""Of the larger of two velocities: they differ by rounding."""


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
    shares: Shares
    """Of the nodes of several parts."""
    node_volume: Floats
    mass: Floats
    velocity: Floats
    loads: list[Load | LoadedFaces]
    """Of the tractions of the case."""
    tied: Pieces
    """Of the bonds of meshes that do not match."""
    near: Nearness
    marks: Ints
    """(nodes,) see state.Nodes."""
    warnings: list[str]
    """What the user should know of the meshes, and of what the boundaries of the case select of them."""
    survey: Survey
    """What is measured of meshes from files."""


def quiet(what: str) -> None:
    """Reports nothing."""


def assemble(case: schema.Case, folder: Path, say: Say = quiet) -> Whole:
    """Builds the meshes of all parts; ``folder`` is where relative mesh paths start. Raises MeshError, InputError."""
    facts = Facts(case)
    whole = assembled(case, _built(case, folder, say, facts))
    whole.survey = facts.survey()
    return whole


def _built(case: schema.Case, folder: Path, say: Say, facts: Facts) -> Iterator[tuple[int, TetMesh]]:
    """The meshes of all parts by their numbers; those from files are measured."""
    joint = dict[int, TetMesh]()
    for index, part in enumerate(case.parts):
        said = partial(say, f"meshing {part.name}, part {index + 1} of {len(case.parts)}")
        key = f"parts[{index}].mesh"
        if index not in joint and len(group := grouped(case, index)) > 1:
            joint |= built_together(case, group, folder, said)
        mesh = joint.get(index) or build_mesh(asked(part), folder, key=key, made=said)
        if isinstance(part.mesh, Measured):
            facts.take(index, mesh)
        yield index, mesh


def assembled(case: schema.Case, meshes: Iterable[tuple[int, TetMesh]], overlaps: bool = True) -> Whole:
    """The whole of the ``meshes`` of parts by their numbers. Where these are not all parts, as before a run, what
    boundaries select is found for those whose parts are all there. Bodies that overlap are looked for only where
    ``overlaps`` is set. Raises MeshError, InputError.
    """
    made = stacked(case, meshes, overlaps)
    x, t, part_of_tet, warnings = made.points, made.tets, made.tet_part, made.warnings
    if case.in_contact and not overlaps:
        warnings.append(f"contact: {UNSEEN}")
    elif case.in_contact:
        x = _apart(case, made)
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
    loads, found, told = _loads(case, x, members, (t, part_of_tet), near, known, marked)
    driven, more = _driven(case, x, members, near, known, marked)
    velocity, mixed = _velocities(case, x, part_of_node, shares)
    mixed += _parted(case, x, t, tied)
    return Whole(
        points=x, node_part=part_of_node, tets=t, tet_part=part_of_tet, volumes=volumes,
        across=made.across, shares=shares,
        node_volume=_quarters(t, volumes, len(x)), mass=_weighed(case, _quarters(t, masses, len(x)), part_of_node),
        velocity=velocity, loads=loads, tied=tied, near=near, marks=marked.nodes,
        warnings=[
            *warnings, *marked.told, *told, *more, *selection.off_planes(case, x, members, near, known),
            *selection.compared(case, [*found, *driven]), *mixed,
        ],
        survey=Survey(),
    )  # fmt: skip


def _shares(case: schema.Case, made: Stacked, masses: Floats) -> Shares:
    """What of nodes of several parts is of which, by the ``masses`` (tets,) of the tets, kg."""
    rank = ranks(case)
    if not len(rank):
        return Shares()
    corners, of = made.tets.reshape(-1), np.repeat(made.tet_part, 4)
    met = np.zeros(len(made.points), bool)
    met[corners[of != made.node_part[corners]]] = True
    some = met[corners]
    return shared(corners[some], of[some], np.repeat(masses / 4.0, 4)[some], rank)


def _apart(case: schema.Case, made: Stacked) -> Floats:
    """The points, when no body overlaps another; moved apart where the case asks for that. Raises InputError."""
    assert case.contact is not None
    x, tets, body, part, exposed = made.points, made.tets, made.body, made.part_of_body, made.across < 0
    tet, face = np.nonzero(exposed)
    faces = tets[tet[:, None], FACES[face]]
    meets = ~np.isnan(part_pairs.friction(case))
    for _, one, two in interface.tied_pairs(case):
        meets[one, two] = meets[two, one] = False
    allowed = made.any_of_body(meets[part[:, None], part])
    surface = overlap.Surface(faces, body[faces[:, 0]], exposed)
    before, out_of = x, np.full(len(x), -1, np.int32)
    if case.contact.overlap == "push":
        x, out_of = overlap.move_apart(x, tets, body, surface, allowed)
    for tet in overlap.crushed(before, x, tets):
        node = tets[tet, np.argmax(out_of[tets[tet]])]
        raise _too_deep(case, part[body[node]], part[out_of[node]], before[node])
    found = overlap.find(x, tets, body, surface, allowed)
    if len(found.nodes):
        worst = int(np.argmax(found.depth))
        node = found.nodes[worst]
        raise _overlapping(case, part[body[node]], part[found.part[worst]], found.depth[worst], x[node])
    for tet, other in overlap.nested(x, tets, body, surface, allowed):
        one, other = (part[body[tets[each, 0]]] for each in (tet, other))
        raise _too_deep(case, one, other, before[tets[tet]].mean(axis=0))
    for node, other in overlap.crossing(x, body, surface, allowed):
        raise _too_deep(case, part[body[node]], part[body[other]], before[node])
    return x


def _overlapping(case: schema.Case, one: int, other: int, depth: float, place: Floats) -> InputError:
    assert case.contact is not None
    way = "set contact.overlap = 'push'" if case.contact.overlap == "refuse" else "contact.overlap = 'push' could not"
    return InputError(
        f"parts: {_who(case, one, other)} by {depth:.3g} m at ({_place(place)}) m; move them apart, or {way}"
    )


def _too_deep(case: schema.Case, one: int, other: int, place: Floats) -> InputError:
    return InputError(
        f"parts: {_who(case, one, other)} at ({_place(place)}) m, deeper than contact.overlap = 'push' can undo; move "
        "them apart"
    )


def _who(case: schema.Case, one: int, other: int) -> str:
    if one == other:
        return f"a piece of {case.parts[one].name!r} overlaps another of its pieces"
    return f"{case.parts[one].name!r} overlaps {case.parts[other].name!r}"


def _place(point: Floats) -> str:
    return ", ".join(f"{c:.6g}" for c in point)


def _quarters(tets: Indices, values: Floats, n: int) -> Floats:
    """(n,) a quarter of each tet's value summed at its nodes, in the order of the tets."""
    return np.bincount(tets.reshape(-1), np.repeat(values / 4.0, 4), n).astype(np.float64)


def _weighed(case: schema.Case, mass: Floats, part: Indices) -> Floats:
    """(n,) masses of the nodes, kg, of which those of a rigid part add up to what is given for it."""
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


def _velocities(case: schema.Case, x: Floats, part: Indices, shares: Shares) -> tuple[Floats, list[str]]:
    """Of the nodes (n, 3), whose ``part`` is that which they stand for; and a warning where the parts of one node start
    in two ways: it has the mean of them, by mass.
    """
    v = np.zeros_like(x)
    for index, spec in enumerate(case.parts):
        chosen = part == index
        v[chosen] = velocities(spec, x[chosen])
    told = _mean_velocities(case, v, x, shares)
    for index, spec in enumerate(case.parts):
        if spec.jitter > 0.0:
            chosen = part == index
            places = 3 * np.flatnonzero(chosen)[:, None] + np.arange(3)
            v[chosen] += spec.jitter * (2.0 * uniform(places, _JITTER) - 1.0)
    return v, told


def _mean_velocities(case: schema.Case, v: Floats, x: Floats, shares: Shares) -> list[str]:
    """Sets those of nodes whose parts start in several ways; a warning where there are any."""
    own = np.zeros((len(shares.node), 3))
    for index, spec in enumerate(case.parts):
        chosen = shares.part == index
        own[chosen] = velocities(spec, x[shares.node[chosen]])
    odd = np.isin(shares.node, shares.node[(own != v[shares.node]).any(axis=1)])
    if not odd.any():
        return []
    nodes, weight = np.unique(shares.node[odd]), shares.fraction[odd, None]
    v[nodes] = 0.0
    np.add.at(v, shares.node[odd], weight * own[odd])
    names = " and ".join(repr(case.parts[i].name) for i in np.unique(shares.part[odd]))
    return [f"bond: {len(nodes)} nodes of {names} would start at two velocities, and start at their mean by mass"]


def _parted(case: schema.Case, x: Floats, tets: Indices, tied: Pieces) -> list[str]:
    """Warnings of ``tied`` parts that start with other velocities than each other where they are bonded."""
    told = []
    for k, one, two in interface.tied_pairs(case):
        places = x[np.unique(interface.corners(tied.slave[tied.bond == k], tets))]
        u, v = (velocities(case.parts[i], places) for i in (one, two))
        if (most := float(np.abs(u - v).max(initial=0.0))) > _ALIKE * float(np.abs([u, v]).max(initial=0.0)):
            told.append(
                f"bond[{k}]: {case.parts[one].name!r} and {case.parts[two].name!r} start at two velocities where they "
                f"are tied, up to {most:.3g} m/s from each other: the bond takes the energy of that in the first step, "
                "or breaks"
            )
    return told


def _loads(
    case: schema.Case,
    x: Floats,
    members: Members,
    of_tets: tuple[Indices, Indices],
    near: Nearness,
    known: list[bool],
    marked: Marks,
) -> tuple[list[Load | LoadedFaces], list[Selected], list[str]]:
    """The tractions of the case: a third of the force on each face for each of its nodes, in the order of the tets, or
    the faces that a pressure follows; what they act on, and warnings; ``of_tets``: (m, 4), and their parts (m,). Those
    that are not ``known`` act on nothing. Raises InputError for another one that acts on no face.
    """
    tractions = case.boundaries_of(schema.Traction)
    loads, found, told = list[Load | LoadedFaces](), list[Selected](), list[str]()
    tets, tet_part = of_tets
    tet, face = np.nonzero(across(tets) < 0) if tractions else (np.zeros(0, np.int64), np.zeros(0, np.int64))
    faces = tets[tet[:, None], FACES[face]]
    for index, spec in tractions:
        if not known[index]:
            none = np.zeros(0, np.int64)
            loads.append(_load(spec, none, np.zeros((0, 3), np.int64), np.zeros((0, 3))))
            continue
        selected, chosen = selection.counted(case, index, x, members, (faces, tet_part[tet]), near, marked)
        loaded = faces[chosen]
        if not len(loaded):
            where = "its box and its parts" if spec.cylinder is None else "its cylinder, its box and its parts"
            where = where if spec.on is None else f"whether the faces of {spec.on!r} are on the surface, and its box"
            raise InputError(f"boundaries[{index}]: acts on no face; check {where}")
        found.append(selected)
        took = np.isin(np.arange(len(case.parts)), tet_part[tet[chosen]])
        told += selection.missed(case, index, x, members, near, took)
        loads.append(_load(spec, tet[chosen].astype(np.int64), loaded.astype(np.int64), 0.5 * normals(x, loaded)))
    return loads, found, told


def _load(spec: schema.Traction, tets: Ints, faces: Ints, outward: Floats) -> Load | LoadedFaces:
    """That of a traction on ``faces`` (m, 3) of ``tets`` (m,) with areas along their normals, ``outward`` (m, 3)."""
    if spec.follows:
        return LoadedFaces(tets, faces, surface_pressure.scale(spec, outward))
    if spec.stress is not None:
        force = np.linalg.norm(outward, axis=1)[:, None] / 3.0 * np.array(spec.stress)
    else:
        force = -(spec.pressure or 0.0) / 3.0 * outward
    of = np.repeat(tets, 3)
    return Load(np.arange(len(of)), of, faces.reshape(-1), np.repeat(force, 3, axis=0))


def _driven(
    case: schema.Case, x: Floats, members: Members, near: Nearness, known: list[bool], marked: Marks
) -> tuple[list[Selected], list[str]]:
    """What the boxes of prescribed velocities that are ``known`` hold, and warnings."""
    found, told = list[Selected](), list[str]()
    for index in (index for index, _ in case.boundaries_of(schema.Prescribed) if known[index]):
        selected, held = selection.counted(case, index, x, members, selection.NO_FACES, near, marked)
        found.append(selected)
        if held.any():
            took = np.isin(np.arange(len(case.parts)), members[1][held[members[0]]])
            told += selection.missed(case, index, x, members, near, took)
    return found, told
