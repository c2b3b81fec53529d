"""Conversion of restrained and driven nodes of a deck to boundaries of a case: planes of symmetry, motions of whole
parts, motions of node sets.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from .account import Entry
from .draft import Body, Draft
from .topology import Chosen, Topology
from .units import LENGTH, SPEED, TIME

AXES = ("x", "y", "z")
Course = tuple[tuple[float, float], ...]
"""Points of a function of time: time in the unit of the deck, and factor."""
_NEAR = 1e-6
"""Tolerance for nodes on one plane, relative to the size of a body (chosen value: above the rounding of files with six
digits, far below the size of any tet)."""


@dataclass
class Hold:
    """Nodes with prescribed velocity along some axes, in units of the deck."""

    chosen: Chosen
    entry: Entry
    speeds: dict[str, float]
    """Prescribed velocity by axis (x, y, z); 0 for a restraint."""
    course: Course = ()
    still: str = ""
    """Axes about which a rigid body does not rotate in the deck."""
    open: set[str] = field(default_factory=set)
    """Axes for which the import has not made a boundary yet."""

    def __post_init__(self) -> None:
        """Starts with all axes without a boundary."""
        self.open = set(self.speeds)


class Holding:
    """Converter of all restraints of a deck to boundaries."""

    def __init__(self, draft: Draft, topology: Topology, bodies: Sequence[Body]) -> None:
        """``bodies``: bodies of the case, with their names."""
        self._draft, self._topology = draft, topology
        self._names = {body.key: body.name for body in bodies}

    def add(self, holds: Sequence[Hold], walls: Sequence[tuple[str, ...]]) -> None:
        """Makes the boundaries of ``holds``. ``walls``: for each rigid wall, the keys of the parts that the wall
        stops.
        """
        partial = [each for each in holds if each.chosen.bodies is None and not each.course]
        for axis in AXES:
            self._planes(axis, [each for each in partial if self._slides(each) and each.speeds.get(axis) == 0.0])
        for each in holds:
            if each.open:
                self._one(each, walls)
        self._compare(holds)

    def _compare(self, holds: Sequence[Hold]) -> None:
        """Records the axes about which each held rigid body turns, if they differ. In a case a body with one prescribed
        component turns about this axis alone, and a body with two or three does not turn (parts[].rigid).
        """
        for key, name in self._draft.rigid_parts():
            mine = [each for each in holds if key in self._topology.whole(each.chosen)[0]]
            moved = {axis for each in mine for axis in each.speeds}
            deck = set(AXES) - {axis for each in mine for axis in each.still}
            case = set[str]() if len(moved) > 1 else moved or set(AXES)
            if mine and deck != case:
                why = f"{name} turns about {_shown(deck)} in the deck, about {_shown(case)} in Conoid"
                mine[-1].entry.remark("differs", "rotation", why)

    def _slides(self, hold: Hold) -> bool:
        """Returns True if the nodes are fixed along some axes and free along the other axes."""
        return 0 < sum(speed == 0.0 for speed in hold.speeds.values()) < 3 and not any(hold.speeds.values())

    # Planes of symmetry -----------------------------------------------------------------------------------------------

    def _planes(self, axis: str, holds: list[Hold]) -> None:
        """Makes a symmetry boundary for each plane at an end of the bodies, if all nodes of the plane are fixed
        along its normal.
        """
        held = set().union(*(self._topology.nodes(each.chosen) for each in holds))
        planes: dict[float, list[str]] = {}
        done: set[int] = set()
        for key in self._topology.bodies:
            if (at := self._plane(axis, key, held)) is not None:
                same = next((known for known in planes if abs(known - at) <= _NEAR * max(abs(at), 1e-300)), at)
                planes.setdefault(same, []).append(key)
                done |= self._topology.of[key] & held
        of_bodies = set().union(*(self._topology.of[key] for key in self._topology.bodies)) if planes else set()
        covered = [each for each in holds if self._topology.nodes(each.chosen) & of_bodies <= done]
        if not planes or len(covered) < len(holds):
            return
        for at, keys in planes.items():
            nodes = set().union(*(self._topology.of[key] for key in keys))
            those = [each for each in covered if not self._topology.nodes(each.chosen).isdisjoint(nodes)]
            table = {"kind": "symmetry", "axis": axis, "at": self._draft.quantity(at, LENGTH)}
            self._draft.add_boundary({**table, **self._parts(keys)}, *(each.entry for each in those))
        for each in covered:
            each.open.discard(axis)

    def _plane(self, axis: str, key: str, held: set[int]) -> float | None:
        """Returns the coordinate of the plane of the restrained nodes ``held`` of a body. The function returns None
        unless these are all nodes of one plane at an end of the body.
        """
        d, mine = AXES.index(axis), self._topology.of[key] & held
        if not mine:
            return None
        points = self._topology.points
        every = [points[node][d] for node in self._topology.of[key] if node in points]
        here = [points[node][d] for node in mine if node in points]
        low, high = min(every, default=0.0), max(every, default=0.0)
        near = _NEAR * (high - low)
        if not here or max(here) - min(here) > near or near == 0.0:
            return None
        at = here[0]
        if min(at - low, high - at) > near:
            return None
        return at if sum(abs(x - at) <= near for x in every) == len(here) else None

    # Whole parts and sets ---------------------------------------------------------------------------------------------

    def _one(self, hold: Hold, walls: Sequence[tuple[str, ...]]) -> None:
        full, some = self._topology.whole(hold.chosen)
        if not full and not some:
            hold.entry.leave(f"{hold.chosen.what} has no node of a part of the case")
            return
        table: dict[str, Any] = {"kind": "velocity"}
        if some and hold.chosen.on is None:
            hold.entry.refuse(
                f"{hold.chosen.what} has only some nodes of a part and is no set of the mesh; define a set of them"
            )
            return
        if some:
            table["on"] = hold.chosen.on
            stopped = {key for wall in walls for key in wall} & {*full, *some}
            if stopped and len(hold.speeds) < 3:
                names = ", ".join(sorted(self._names[key] for key in stopped))
                hold.entry.remark(
                    "refused", hold.chosen.what,
                    f"the nodes are free along one axis and a rigid wall stops {names}; in Conoid walls do not stop "
                    "nodes with prescribed motion",
                )  # fmt: skip
        table |= self._parts([*full, *some])
        table |= {axis: self._draft.quantity(hold.speeds[axis], SPEED) for axis in AXES if axis in hold.open}
        if hold.course:
            table["course"] = [[self._draft.quantity(time, TIME), factor] for time, factor in hold.course]
        self._draft.add_boundary(table, hold.entry)

    def _parts(self, keys: Sequence[str]) -> dict[str, Any]:
        """Returns the key ``parts`` of a boundary; no key if the boundary acts on all parts."""
        return {} if len(keys) == len(self._names) else {"parts": [self._names[key] for key in keys]}


def _shown(axes: set[str]) -> str:
    return "any axis" if len(axes) == 3 else " and ".join(sorted(axes)) or "no axis"


def velocity_course(curve: Course, end: float) -> tuple[float, Course]:
    """Returns the largest magnitude of a prescribed velocity, and the velocity divided by it over time (course). Raises
    ValueError if the curve is empty or too short.
    """
    if not curve:
        raise ValueError("the curve has no points")
    most = max((value for _, value in curve), key=abs)
    if all(value == most for _, value in curve):
        return most, ()
    if curve[-1][0] < end:
        raise ValueError(f"the curve ends at {curve[-1][0]:g}, before the end of the run at {end:g}")
    return most, tuple((time, value / most) for time, value in curve)


def displacement_speed(curve: Course, end: float) -> float:
    """Returns the constant velocity of displacements that grow linearly from 0 until the end of the run. Raises
    ValueError for other displacements.
    """
    inside = [(time, value) for time, value in curve if time <= end]
    if curve and curve[-1][0] < end:
        raise ValueError(f"the curve ends at {curve[-1][0]:g}, before the end of the run at {end:g}")
    beyond = [(time, value) for time, value in curve if time > end][:1]
    points = [*inside, *beyond]
    if len(points) < 2 or points[0] != (0.0, 0.0):
        raise ValueError("a prescribed displacement must be 0 at the time 0")
    speed = points[-1][1] / points[-1][0]
    most = max(abs(value) for _, value in points)
    if any(abs(speed * time - value) > 1e-6 * most for time, value in points):
        raise ValueError("only displacements that are linear in time are translated; prescribe velocities instead")
    return speed
