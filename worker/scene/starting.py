"""Start of the boundary conditions. The boundary conditions change the initial velocities. Contradictions between
boundary conditions are errors.
"""

from collections.abc import Sequence

import numpy as np

from conoid.cases.checks.drives import REST, clash, motions
from conoid.cases.checks.on import bits
from conoid.cases.model import schema
from conoid.cases.shapes.region import GENERATED

from ..boundaries.boundaries import Boundary
from ..boundaries.moving_walls import MovingWalls
from ..boundaries.walls import RigidWalls
from ..errors import InputError
from ..model.state import Flags, Model, Nodes
from ..parallel.comm import Comm
from . import marks, selection
from .conditions import AXES, heights, held_by, of_parts, sides

_ASIDE = 1e-9
"""Ratio of the velocity across a symmetry plane to the largest speed. A velocity with a smaller ratio counts as
round-off. Chosen value."""


def start(
    case: schema.Case, model: Model, boundaries: list[Boundary], comm: Comm, known: Sequence[bool] | None = None
) -> list[str]:
    """Apply the boundaries to the initial velocities; return warnings. Collective.

    ``known``: True for each boundary whose parts are all in the model; None if this is true for all boundaries. A
    boundary with a missing part gets fewer checks. Raises InputError on every rank for these errors: a boundary without
    a node, two boundaries that drive a node differently, a body that starts behind a wall or through a symmetry plane,
    and a motion prescribed across a symmetry plane.
    """
    held = [held_by(case, spec, model) for spec in case.boundaries]
    known = [True] * len(held) if known is None else known
    counts = comm.sum(np.array([int(each.sum()) for each in held], np.int64))
    beside = _beside(case, model, comm)
    for index in np.flatnonzero(counts == 0).tolist():
        if index not in beside and known[index]:
            raise InputError(f"boundaries[{index}]: holds no node; check its place and its parts")
    _refuse_two_drives(case.boundaries, held, comm)
    _refuse_conflicts(case.boundaries, held, model, comm)
    _refuse_overlaps(case, model, boundaries, comm)
    _refuse_crossings(case, model, comm)
    _refuse_off_plane(case, held, model, comm)
    warnings = [
        f"boundaries[{index}]: no node starts on this plane of symmetry; it holds nodes that reach it later"
        for index in beside if counts[index] == 0 and known[index]
    ]  # fmt: skip
    warnings += _stopped(case, held, model.nodes, comm, known)
    for boundary in boundaries:
        boundary.start(model.nodes)
    return warnings


def _beside(case: schema.Case, model: Model, comm: Comm) -> list[int]:
    """Return the symmetry planes, each with the nodes that are near it at the start."""
    planes = case.boundaries_of(schema.Symmetry)
    found = comm.sum(np.array([int(np.count_nonzero(sides(case, spec, model))) for _, spec in planes], np.int64))
    return [index for (index, _), many in zip(planes, found, strict=True) if many]


def _stopped(
    case: schema.Case, held: list[Flags], nodes: Nodes, comm: Comm, known: Sequence[bool]
) -> list[str]:  # fmt: skip
    """Return warnings about symmetry planes that change the initial velocity of nodes on them."""
    planes = case.boundaries_of(schema.Symmetry)
    across = [np.abs(nodes.v[held[index], AXES[spec.axis]]).max(initial=0.0) for index, spec in planes]
    speeds = comm.maximum(np.array([*across, np.abs(nodes.v).max(initial=0.0)]))
    return [
        f"boundaries[{index}]: nodes on this plane of symmetry start with up to {speed:.3g} m/s across it; this "
        "velocity is set to zero; check whether the motion is symmetric"
        for (index, _), speed in zip(planes, speeds[:-1], strict=True)
        if known[index] and speed > _ASIDE * speeds[-1]
    ]  # fmt: skip


def _refuse_overlaps(case: schema.Case, model: Model, boundaries: list[Boundary], comm: Comm) -> None:
    indices = [index for index, _ in case.boundaries_of(schema.Wall)]
    for walls in boundaries:
        if isinstance(walls, RigidWalls | MovingWalls):
            depths = comm.maximum(walls.depths(model.nodes))[: len(indices)]  # images of planes of symmetry follow
            for index, depth in zip(indices, depths, strict=True):
                if depth > GENERATED * model.size:
                    raise InputError(f"boundaries[{index}]: a body starts {depth:.3g} m behind this wall")


def _refuse_crossings(case: schema.Case, model: Model, comm: Comm) -> None:
    """Raise InputError if a tet has nodes on both sides of a symmetry plane. A tet that crosses a symmetry plane would
    overlap its own mirror image.
    """
    for index, spec in case.boundaries_of(schema.Symmetry):
        named, beyond = selection.named(spec, model.parts), np.zeros(len(model.parts))
        height = heights(case, spec, model)
        for block in (block for block in model.blocks if named[block.part]):
            of = height[block.tets]
            beyond[block.part] = np.minimum(of.max(axis=1), -of.min(axis=1)).max(initial=beyond[block.part])
        beyond = comm.maximum(beyond)
        if (most := beyond.max()) > 0.0:
            raise InputError(
                f"boundaries[{index}]: tets of part {model.parts[int(beyond.argmax())]!r} reach {most:.3g} m through "
                "this plane of symmetry into their own mirror images; let the body end on it, or name the parts that "
                "have an image in parts"
            )


def _refuse_off_plane(case: schema.Case, held: list[Flags], model: Model, comm: Comm) -> None:
    """Raise InputError if the set of a symmetry plane has a node that is too far from the plane."""
    for index, spec in case.boundaries_of(schema.Symmetry):
        if spec.on is None:
            continue
        off = marks.held(model.nodes.marks, bits(case)[spec.on]) & of_parts(spec, model) & ~held[index]
        away = np.abs(model.nodes.x0[off, AXES[spec.axis]] - spec.at).max(initial=0.0)
        if (most := float(comm.maximum(np.array([away]))[0])) > 0.0:
            raise InputError(
                f"boundaries[{index}].on = {spec.on!r}: nodes of the set are up to {most:.3g} m off the plane "
                f"{spec.axis} = {spec.at:g} m, more than a hundredth of an edge; check axis and at"
            )


def _refuse_two_drives(specs: Sequence[schema.Boundary], held: list[Flags], comm: Comm) -> None:
    """Raise InputError if a component of the velocity of a node has two different prescribed motions."""
    found = comm.maximum(np.array([float(_two_drives(specs, held))]))[0]
    if found >= 0:
        second, first = divmod(int(found), len(specs))
        axes = ", ".join(clash(specs[first], specs[second]))
        raise InputError(
            f"boundaries[{second}]: drives nodes along {axes} that boundaries[{first}] drives in another way; give "
            "each of the two boundaries its own nodes"
        )


def _two_drives(specs: Sequence[schema.Boundary], held: list[Flags]) -> int:
    """Return a pair of boundaries that drive a node of this rank differently, as the number second * boundaries +
    first. Return -1 if no two boundaries drive a node differently.
    """
    drivers = {axis: np.full(len(held[0]) if held else 0, -1) for axis in AXES}
    for second, spec in enumerate(specs):
        for axis in motions(spec):
            of = drivers[axis]
            for first in np.unique(of[held[second]]):
                if first >= 0 and axis in clash(specs[first], spec):
                    return second * len(specs) + int(first)
            of[held[second]] = second
    return -1


def _refuse_conflicts(specs: Sequence[schema.Boundary], held: list[Flags], model: Model, comm: Comm) -> None:
    """Raise InputError if a motion is prescribed across a symmetry plane at any time, because the plane would do
    work.
    """
    planes = [(index, spec.axis) for index, spec in enumerate(specs) if isinstance(spec, schema.Symmetry)]
    crossed = np.zeros((len(planes), len(specs)))
    for row, (plane, axis) in zip(crossed, planes, strict=True):
        for drive, spec in enumerate(specs):
            if motions(spec).get(axis, REST) != REST:
                across = _leaves(spec, axis, model) if isinstance(spec, schema.Rotation) else True
                row[drive] = float((across & held[plane] & held[drive]).any())
    crossed = comm.maximum(crossed.reshape(-1)).reshape(crossed.shape)
    for row, drive in np.argwhere(crossed):
        plane, axis = planes[row]
        raise InputError(
            f"boundaries[{drive}]: moves nodes off their plane of symmetry, boundaries[{plane}], along {axis}; only "
            "motion within the plane is allowed"
        )


def _leaves(spec: schema.Rotation, axis: str, model: Model) -> Flags:
    """Return (n,) whether a rotation leads each node off a plane normal to ``axis`` at any time. A node on the axis of
    the rotation leaves the plane with this axis.
    """
    rate, along = np.array(spec.spin.rate), AXES[axis]
    moves = spec.velocity[along] != 0.0
    across = np.cross(rate, model.nodes.x0 - np.array(spec.spin.centre))
    least = _ASIDE * model.size * np.abs(rate).max()
    turns = np.delete(rate, along).any() & (np.abs(across) > least).any(axis=1)
    return np.asarray(turns | moves)
