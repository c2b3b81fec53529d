"""Rigid walls of a Radioss starter: planes, cylinders and spheres, at rest or moving freely with a mass."""

from typing import Any

from ..account import Entry
from ..units import LENGTH, MASS, SPEED
from ..walls import Stop
from .scene import Scene
from .text import Fields, Option

_SHAPES = {"PLANE": "plane", "CYL": "cylinder", "SPHER": "sphere"}
WALLS = [("RWALL", word) for word in _SHAPES]
"""The first two words of translated options."""


def wall(scene: Scene, option: Option, entry: Entry) -> None:
    """Reads ``/RWALL/PLANE``, ``CYL`` and ``SPHER``, which stop a group of nodes. Raises CardError, ValueError."""
    shape = _SHAPES[option.words[1]]
    row = option.rows[1][1] if len(option.rows) > 1 else ""
    moves = bool(row[:10].strip(" 0"))
    layout = ["NODE: SLIDE: GRNOD1: GRNOD2:", "D FRIC DIAMETER FFAC IFQ:", "MASS VX0 VY0 VZ0" if moves else "XM YM ZM"]
    fields = Fields(option, entry, option.rows[1:], layout + ["XM1 YM1 ZM1"] * (shape != "sphere"))
    fields.refuse("GRNOD2", "nodes that are left out are not translated")
    fields.forgive("FFAC IFQ", "a filter of friction")
    start = _start(scene, fields, moves)
    table: dict[str, Any] = {"kind": "wall", "point": scene.draft.vector(start, LENGTH)}
    if shape != "plane":
        table |= {"shape": shape, "radius": scene.draft.quantity(0.5 * fields.real("DIAMETER"), LENGTH)}
    else:
        fields.forgive("DIAMETER", "without meaning for a plane")
    if shape != "sphere":
        table["normal" if shape == "plane" else "axis"] = _direction(fields, start)
    if moves:
        _moving(scene, fields, table)
    slide, friction = fields.whole("SLIDE"), fields.real("FRIC")
    if slide == 1:
        fields.refuse("SLIDE", "in the deck nodes stick to the wall; Conoid has Coulomb friction")
    if slide == 2 and friction:
        table["friction"] = friction
    scene.walls.append(Stop(scene.nodes(_group(fields), entry), table, entry))
    fields.rest()


def _start(scene: Scene, fields: Fields, moves: bool) -> list[float]:
    """Returns the position of the wall. A moving wall has the position of its node. Raises ValueError."""
    if not moves:
        return [fields.real(name) for name in ("XM", "YM", "ZM")]
    number = fields.whole("NODE")
    if (place := scene.points().get(number)) is None:
        raise ValueError(f"the node {number} of the wall is not defined")
    return list(place)


def _direction(fields: Fields, start: list[float]) -> list[float]:
    along = [fields.real(name) - at for name, at in zip(("XM1", "YM1", "ZM1"), start, strict=True)]
    if not any(along):
        raise ValueError("its direction, from M to M1, has no length")
    return along


def _moving(scene: Scene, fields: Fields, table: dict[str, Any]) -> None:
    mass, speed = fields.real("MASS"), [fields.real(name) for name in ("VX0", "VY0", "VZ0")]
    if any(speed):
        table["velocity"] = scene.draft.vector(speed, SPEED)
    if mass > 0.0:
        table["mass"] = scene.draft.quantity(mass, MASS)
        fields.differ("NODE", "the wall moves with the mass of the option; other loads on its node are ignored")
    else:
        fields.refuse("NODE", "a wall that moves with its node; give it a mass, or velocity and course")


def _group(fields: Fields) -> int:
    """Returns the group of nodes that the wall stops. Raises ValueError."""
    group, reach = fields.whole("GRNOD1"), fields.real("D")
    if not group and not reach:
        raise ValueError("neither grnd_ID1 nor d: the wall stops no node")
    if not group:
        raise ValueError("the wall stops the nodes within d of it; name a group of nodes, grnd_ID1")
    fields.forgive("D", "how near nodes are that the wall stops besides")
    return group
