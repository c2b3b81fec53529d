"""Rigid walls of a Radioss starter: planes, cylinders and spheres, at rest, moving freely with a mass, or driven by the
motion of their node.
"""

from typing import Any

from ..account import Entry
from ..draft import Draft
from ..holds import AXES, Hold
from ..topology import Topology
from ..units import LENGTH, MASS, SPEED, TIME
from ..walls import Stop
from .scene import Moved, Scene
from .text import Fields, Option

_SHAPES = {"PLANE": "plane", "CYL": "cylinder", "SPHER": "sphere"}
WALLS = [("RWALL", word) for word in _SHAPES]
"""The first two words of wall options that are translated."""


def wall(scene: Scene, option: Option, entry: Entry) -> None:
    """Reads ``/RWALL/PLANE``, ``CYL`` and ``SPHER``, walls that stop a group of nodes. Raises CardError, ValueError."""
    shape = _SHAPES[option.words[1]]
    row = option.rows[1][1] if len(option.rows) > 1 else ""
    moves = bool(row[:10].strip(" 0"))
    layout = ["NODE: SLIDE: GRNOD1: GRNOD2:", "D FRIC DIAMETER FFAC IFQ:", "MASS VX0 VY0 VZ0" if moves else "XM YM ZM"]
    fields = Fields(option, entry, option.rows[1:], layout + ["XM1 YM1 ZM1"] * (shape != "sphere"))
    fields.refuse("GRNOD2", "excepted nodes are not translated")
    fields.forgive("FFAC IFQ", "a filter of friction")
    start = _start(scene, fields, moves)
    table: dict[str, Any] = {"kind": "wall", "point": scene.draft.vector(start, LENGTH)}
    if shape != "plane":
        table |= {"shape": shape, "radius": scene.draft.quantity(0.5 * fields.real("DIAMETER"), LENGTH)}
    else:
        fields.forgive("DIAMETER", "no effect on a plane")
    if shape != "sphere":
        table["normal" if shape == "plane" else "axis"] = _direction(fields, start)
    stop = Stop(scene.nodes(_group(fields), entry), table, entry)
    if moves:
        _moving(scene, fields, table)
        scene.moved.append(Moved(fields.whole("NODE"), stop, fields))
    slide, friction = fields.whole("SLIDE"), fields.real("FRIC")
    if slide == 1:
        fields.refuse("SLIDE", "in the deck nodes stick to the wall; Conoid has Coulomb friction")
    if slide == 2 and friction:
        table["friction"] = friction
    scene.walls.append(stop)
    fields.rest()


def drive(scene: Scene, draft: Draft, topology: Topology) -> None:
    """Gives each wall the prescribed motion of its node. A wall whose node has no prescribed motion needs a mass."""
    for wall in scene.moved:
        holds = [each for each in scene.holds if topology.nodes(each.chosen) == {wall.node}]
        if holds:
            scene.holds = [each for each in scene.holds if each not in holds]
            wall.stop.more.extend(each.entry for each in holds)
            _prescribe(draft, wall, holds)
        elif "mass" in wall.stop.table:
            why = "the wall moves with its own mass; other loads on its node are ignored"
            wall.fields.differ("NODE", why)
        else:
            why = "the wall moves with a node; give the wall a mass, or the node an /IMPVEL"
            wall.fields.refuse("NODE", why)


def _prescribe(draft: Draft, wall: Moved, holds: list[Hold]) -> None:
    """Writes the velocity and the course of a wall's node into the table of the wall; ``holds``: prescribed motions
    of the node.
    """
    table, axes = wall.stop.table, [axis for each in holds for axis in each.speeds]
    courses = {each.course for each in holds if any(each.speeds.values())}
    if len(set(axes)) < len(axes) or len(courses) > 1:
        why = "the components of the motion have several courses; a wall has one course"
        wall.fields.refuse("NODE", why)
        return
    table.pop("mass", None)
    speeds = {axis: speed for each in holds for axis, speed in each.speeds.items()}
    table["velocity"] = draft.vector([speeds.get(axis, 0.0) for axis in AXES], SPEED)
    if course := next(iter(courses), ()):
        table["course"] = [[draft.quantity(time, TIME), factor] for time, factor in course]
    wall.fields.differ("NODE", "the wall has the prescribed motion of its node and does not move along other axes")


def _start(scene: Scene, fields: Fields, moves: bool) -> list[float]:
    """Returns the position of a wall. A moving wall has the position of its node. Raises ValueError."""
    if not moves:
        return [fields.real(name) for name in ("XM", "YM", "ZM")]
    number = fields.whole("NODE")
    if (place := scene.points().get(number)) is None:
        raise ValueError(f"the node {number} of the wall is not defined")
    return list(place)


def _direction(fields: Fields, start: list[float]) -> list[float]:
    along = [fields.real(name) - at for name, at in zip(("XM1", "YM1", "ZM1"), start, strict=True)]
    if not any(along):
        raise ValueError("the direction of the wall, from M to M1, has no length")
    return along


def _moving(scene: Scene, fields: Fields, table: dict[str, Any]) -> None:
    mass, speed = fields.real("MASS"), [fields.real(name) for name in ("VX0", "VY0", "VZ0")]
    if any(speed):
        table["velocity"] = scene.draft.vector(speed, SPEED)
    if mass > 0.0:
        table["mass"] = scene.draft.quantity(mass, MASS)


def _group(fields: Fields) -> int:
    """Returns the group of nodes that the wall stops. Raises ValueError."""
    group, reach = fields.whole("GRNOD1"), fields.real("D")
    if not group and not reach:
        raise ValueError("neither grnd_ID1 nor d: the wall stops no node")
    if not group:
        raise ValueError("the wall stops the nodes within the distance d; name a group of nodes (grnd_ID1) instead")
    fields.forgive("D", "distance within which the wall also stops nodes outside of the group")
    return group
