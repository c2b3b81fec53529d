"""Boundary conditions of a case: the nodes on which each condition acts, and the objects that apply the conditions."""

import numpy as np

from conoid.cases.checks.on import bits
from conoid.cases.model import schema
from conoid.cases.shapes.images import mirrors

from ..boundaries.boundaries import Boundary, SymmetryPlane, driven, mirrored
from ..boundaries.course import Course
from ..boundaries.drivers import Gravity, PrescribedRotation, PrescribedVelocity, Traction
from ..boundaries.moving_axis import MovingAxis
from ..boundaries.moving_walls import MovingWalls
from ..boundaries.surface_pressure import SurfacePressure
from ..boundaries.wall_shapes import Walls
from ..boundaries.walls import RigidWalls
from ..migration.parcel import Parcel
from ..model.loads import Load, LoadedFaces
from ..model.state import Flags, Floats, Indices, Ints, Model
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..rigid.bodies import of_nodes
from . import marks, selection

AXES = {"x": 0, "y": 1, "z": 2}


def loads(parcel: Parcel) -> list[Load | LoadedFaces]:
    """Return the loads of the tractions in a parcel, in the order of the boundaries."""
    found: list[Load | LoadedFaces] = []
    for name in (f"boundary{index}" for index in range(len(parcel.known["last_push"]))):
        if (table := parcel.rows.get(f"{name}.load")) is not None:
            found.append(Load(table["key"], table["tets"], table["of"], table["force"]))
        elif (table := parcel.rows.get(f"{name}.faces")) is not None:
            found.append(LoadedFaces(table["tet"], table["corners"], parcel.known[f"{name}.scale"]))
    return found


def walls_of(case: schema.Case) -> Walls:
    """Return the walls of a case in their initial position.

    If the case has rigid parts, each symmetry plane adds two walls: one for bodies above the plane and one for bodies
    below it. A contact between a rigid body and the wall of a symmetry plane represents the contact between the body
    and its mirror image. A free wall that a plane of symmetry maps to itself does not move across the plane.
    """
    planes = case.boundaries_of(schema.Symmetry) if case.rigid else []
    images = [_image(spec, sign) for _, spec in planes for sign in (1.0, -1.0)]
    walls = [spec for _, spec in case.boundaries_of(schema.Wall)]
    held = np.zeros((len(walls), 3), bool)
    for k, wall in enumerate(walls):
        held[k, [AXES[plane.axis] for _, plane in mirrors(case, wall) if wall.mass is not None]] = True
    return Walls([*walls, *images], held)


def _image(plane: schema.Symmetry, sign: float) -> schema.Wall:
    """Return the plane as a wall. The wall is for bodies above the plane if ``sign`` is 1, or below the plane if
    ``sign`` is -1.
    """
    along = np.eye(3)[AXES[plane.axis]]
    return schema.Wall(
        kind="wall", name="image", point=tuple((plane.at * along).tolist()), normal=tuple((sign * along).tolist())
    )


def bodies_beside(case: schema.Case, model: Model, comm: Comm) -> Ints:
    """Return (planes, parts) the side of each symmetry plane on which a rigid part starts: 1 above, -1 below, 0 for all
    other parts.

    The side is also 0 if the plane does not act on the part, or if the part has a node on the plane. Collective.
    """
    planes, nodes = case.boundaries_of(schema.Symmetry), model.nodes
    found = np.zeros((len(planes), len(model.parts)), np.int64)
    for row, (_, spec) in zip(found, planes, strict=True):
        on = np.zeros(len(model.parts))
        on[nodes.part[of_parts(spec, model) & on_plane(case, spec, model)]] = 1.0
        row[:] = np.where(comm.maximum(on) > 0.0, 0.0, part_sides(case, spec, model, comm))
    return found


def build(
    case: schema.Case, model: Model, loads: list[Load | LoadedFaces], neighbours: list[Neighbour], comm: Comm,
    moving: Walls | None = None,
) -> list[Boundary]:  # fmt: skip
    """Return the boundaries of a case on this rank's nodes, in the order in which they act. Collective.

    Gravity and tractions come first, so that constraints correct their effect. Walls come last and omit nodes with a
    prescribed motion. Rigid parts have their own motion (rigid/motion.py); only symmetry planes act on them here.
    ``loads``: loads of the tractions; ``moving``: walls of the case in their present position.
    """
    nodes = model.nodes
    loose = of_nodes(case, nodes) < 0
    held = [held_by(case, spec, model) & (loose | isinstance(spec, schema.Symmetry)) for spec in case.boundaries]
    boundaries: list[Boundary] = [
        Gravity(_indices(held[i]), np.array(spec.acceleration), Course(spec.course))
        for i, spec in case.boundaries_of(schema.Gravity)
    ]
    boundaries += [
        Traction(nodes.places(load.nodes), load, Course(spec.course))
        if isinstance(load, Load)
        else SurfacePressure(model, load, spec.pressure or 0.0, Course(spec.course), neighbours, comm)
        for (_, spec), load in zip(case.boundaries_of(schema.Traction), loads, strict=True)
    ]
    for i, plane in case.boundaries_of(schema.Symmetry):
        side, on = part_sides(case, plane, model, comm), _indices(held[i])
        boundaries.append(SymmetryPlane(on, AXES[plane.axis], side[nodes.part[on]] != 0.0))
    for spec, h in zip(case.boundaries, held, strict=True):
        if isinstance(spec, schema.Prescribed):
            velocity = np.array([np.nan if c is None else c for c in (spec.x, spec.y, spec.z)])
            boundaries.append(PrescribedVelocity(_indices(h), velocity, Course(spec.course)))
        elif isinstance(spec, schema.Rotation):
            boundaries.append(PrescribedRotation(_indices(h), MovingAxis(spec)))
    moved = driven(nodes.n, boundaries)
    planes, stopped = mirrored(nodes.n, boundaries), [h & ~moved for h in held]
    return [*boundaries, *_walls(case, stopped, planes), *_moving(case, stopped, planes, model, moving, comm)]


def held_by(case: schema.Case, spec: schema.Boundary, model: Model) -> Flags:
    """Return (n,) True for each node on which a boundary acts."""
    nodes, on_set = model.nodes, isinstance(spec, schema.Prescribed | schema.Rotation) and spec.on is not None
    marked = marks.held(nodes.marks, bits(case)[str(getattr(spec, "on", ""))]) if on_set else np.True_
    if isinstance(spec, schema.Prescribed):
        return selection.held(spec, model.parts, nodes.x0, nodes.of_parts(), model.slack) & marked
    chosen = of_parts(spec, model) & marked
    return chosen & on_plane(case, spec, model) if isinstance(spec, schema.Symmetry) else chosen


def of_parts(spec: schema.Boundary, model: Model) -> Flags:
    """Return (n,) True for each node of a part that the boundary names."""
    return model.nodes.among(selection.named(spec, model.parts))


def heights(case: schema.Case, spec: schema.Symmetry, model: Model) -> Floats:
    """Return (n,) the heights of nodes above a symmetry plane at the start, m. The height is 0 for nodes within
    round-off of the plane. The height is also 0 for nodes of the plane's set if they are within the tolerance of their
    part.
    """
    found, part = model.nodes.x0[:, AXES[spec.axis]] - spec.at, model.nodes.part
    within = model.rounding[part]
    if spec.on is not None:
        within = np.where(_marked(case, spec, model), model.slack[part], within)
    return np.where(np.abs(found) <= within, 0.0, found)


def on_plane(case: schema.Case, spec: schema.Symmetry, model: Model) -> Flags:
    """Return (n,) True for each node that starts on a symmetry plane. If the plane has a set of nodes, these are the
    nodes of the set; else they are the nodes at the plane.
    """
    there = heights(case, spec, model) == 0.0
    return there if spec.on is None else np.asarray(there & _marked(case, spec, model))


def _marked(case: schema.Case, spec: schema.Symmetry, model: Model) -> Flags:
    return marks.held(model.nodes.marks, bits(case)[spec.on or ""])


def sides(case: schema.Case, spec: schema.Symmetry, model: Model) -> Floats:
    """Return (n,) the side of a symmetry plane on which each node starts: 1 above, -1 below. The side is 0 for nodes at
    the plane, and for nodes on which the plane does not act.
    """
    return np.where(of_parts(spec, model), np.sign(heights(case, spec, model)), 0.0)


def node_sides(case: schema.Case, spec: schema.Symmetry, model: Model, comm: Comm) -> Floats:
    """Return a copy of ``sides``. Nodes that are at the plane and not in its set get the side of their part.
    Collective.
    """
    side = sides(case, spec, model)
    if spec.on is None:
        return side
    touching = of_parts(spec, model) & (heights(case, spec, model) == 0.0) & ~_marked(case, spec, model)
    return np.where(touching, part_sides(case, spec, model, comm)[model.nodes.part], side)


def part_sides(case: schema.Case, spec: schema.Symmetry, model: Model, comm: Comm) -> Floats:
    """Return (parts,) the side of a symmetry plane: 1 for a part above the plane, -1 for a part below.

    The side is 0 for a part on which the plane does not act, and for a part with nodes on both sides. Collective.
    """
    side, found = sides(case, spec, model), np.zeros((2, len(model.parts)))
    nodes, part = model.nodes.of_parts()
    for way, sign in enumerate((1.0, -1.0)):
        found[way, part[side[nodes] == sign]] = 1.0
    above, below = comm.maximum(found.ravel()).reshape(found.shape)
    return np.asarray(above - below)


def _walls(case: schema.Case, held: list[Flags], planes: Flags) -> list[Boundary]:
    found = [(spec, held[index] & spec.plain) for index, spec in case.boundaries_of(schema.Wall)]
    if not any(spec.plain for spec, _ in found):
        return []
    touched = np.any([h for _, h in found], axis=0)
    points, normals = (
        np.array([spec.point for spec, _ in found]),
        np.array([spec.normal or (0, 0, 1) for spec, _ in found], float),
    )
    which = np.ascontiguousarray(np.array([h[touched] for _, h in found]).T)
    friction = np.array([spec.friction for spec, _ in found])
    tells = "contact_pressure" in case.run.fields
    return [RigidWalls(_indices(touched), points, normals, which, planes[touched], friction, tells)]


def _moving(
    case: schema.Case, held: list[Flags], planes: Flags, model: Model, walls: Walls | None, comm: Comm
) -> list[Boundary]:  # fmt: skip
    """Return the walls of the case that are not fixed planes. Collective."""
    found = [held[index] & (not spec.plain) for index, spec in case.boundaries_of(schema.Wall)]
    if all(spec.plain for _, spec in case.boundaries_of(schema.Wall)):
        return []
    walls, nodes = walls or walls_of(case), model.nodes
    tells = "contact_pressure" in case.run.fields
    touched = np.any(found, axis=0)
    which = np.zeros((np.count_nonzero(touched), walls.n), bool)
    which[:, : len(found)] = np.array([h[touched] for h in found]).T
    return [MovingWalls(_indices(touched), nodes.owned[touched], walls, which, planes[touched], comm, tells)]


def _indices(chosen: Flags) -> Indices:
    return np.flatnonzero(chosen).astype(np.int32)
