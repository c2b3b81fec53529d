"""Rigid walls of an LS-DYNA deck: infinite planes and cylinders, and spheres; at rest, with prescribed motion, or
with a mass.
"""

import math
from collections.abc import Mapping
from typing import Any

from conoid.cases.reading.cards import Block

from ..account import Entry
from ..holds import displacement_speed, velocity_course
from ..units import LENGTH, MASS, SPEED, TIME
from ..walls import Stop
from .fields import Fields
from .scene import Scene

_TAIL, _HEAD = ("XT", "YT", "ZT"), ("XH", "YH", "ZH")
_SHAPES: Mapping[str, str] = {"CYLINDER": "RADCYL LENCYL NSEGS", "SPHERE": "RADSPH"}
"""Names of the fields on the cards of cylinders and spheres (the manual, *RIGIDWALL_GEOMETRIC)."""
OPTIONS = frozenset({"ID", "FORCES", "DISPLAY", "MOVING", "MOTION", *_SHAPES})
"""Options of rigid walls that are translated. The options ORTHO, FINITE, FLAT and PRISM are not translated."""


def planar(scene: Scene, block: Block, options: frozenset[str], entry: Entry) -> None:
    """Reads ``*RIGIDWALL_PLANAR``: an infinite plane at rest, or with a mass and a speed along its normal."""
    layout = ["NSID NSIDEX BOXID OFFSET BIRTH DEATH RWKSF", "XT YT ZT XH YH ZH FRIC WVEL"]
    layout += ["MASS V0"] if "MOVING" in options else []
    fields = Fields(block, entry, _cards(block, options, len(layout)), layout)
    fields.refuse("OFFSET", "an offset is not translated")
    fields.forgive("RWKSF WVEL", "settings of contact with rigid bodies and of welding")
    table: dict[str, Any] = {"kind": "wall", "point": _point(scene, fields), "normal": _direction(fields)}
    if "MOVING" in options:
        _moving(scene, fields, table)
    _stand(scene, fields, table)


def geometric(scene: Scene, block: Block, options: frozenset[str], entry: Entry) -> None:
    """Reads ``*RIGIDWALL_GEOMETRIC_CYLINDER`` (infinite) and ``_SPHERE``, at rest or moved by a curve (option
    ``_MOTION``).
    """
    shape = next((name for name in _SHAPES if name in options), "")
    if not shape:
        raise ValueError("only cylinders and spheres are translated")
    layout = ["NSID NSIDEX BOXID BIRTH DEATH", "XT YT ZT XH YH ZH FRIC", _SHAPES[shape]]
    layout += ["LCID OPT VX VY VZ"] if "MOTION" in options else []
    fields = Fields(block, entry, _cards(block, options, len(layout)), layout)
    radius = fields.real("RADCYL" if shape == "CYLINDER" else "RADSPH")
    table: dict[str, Any] = {"kind": "wall", "shape": shape.lower(), "point": _point(scene, fields)}
    table["radius"] = scene.draft.quantity(radius, LENGTH)
    if shape == "CYLINDER":
        table["axis"] = _direction(fields)
        fields.refuse("LENCYL", "the cylinder is finite; walls of Conoid are infinite: use a rigid part of this shape")
        fields.forgive("NSEGS", "segments of output")
    else:
        fields.forgive(" ".join(_HEAD), "no effect on a sphere")
    if "MOTION" in options:
        _driven(scene, fields, table)
    _stand(scene, fields, table)


def _cards(block: Block, options: frozenset[str], count: int) -> list[Any]:
    """Returns the cards of a wall without the card of its identifier and without cards that only request output."""
    cards = list(block.cards["ID" in options :])
    return cards[:count] if options & {"FORCES", "DISPLAY"} else cards


def _point(scene: Scene, fields: Fields) -> list[str | float]:
    return scene.draft.vector([fields.real(name) for name in _TAIL], LENGTH)


def _direction(fields: Fields) -> list[float]:
    along = [fields.real(b) - fields.real(a) for a, b in zip(_TAIL, _HEAD, strict=True)]
    if not any(along):
        raise ValueError("the direction of the wall, from XT YT ZT to XH YH ZH, has no length")
    return along


def _moving(scene: Scene, fields: Fields, table: dict[str, Any]) -> None:
    """Reads the mass of a wall and its initial speed along the normal. A wall with a speed and without a mass
    refuses the import.
    """
    along, speed, mass = table["normal"], fields.real("V0"), fields.real("MASS")
    length = math.hypot(*along)
    if speed:
        table["velocity"] = scene.draft.vector([speed * value / length for value in along], SPEED)
    if mass > 0.0:
        table["mass"] = scene.draft.quantity(mass, MASS)
        if fields.real("FRIC"):
            fields.differ(
                "FRIC",
                "in LS-DYNA the wall moves only along its normal; in Conoid friction also moves it along the plane",
            )
    elif speed:
        fields.refuse("V0", "the wall has a speed and no MASS; give the wall a mass, or velocity and course")


def _driven(scene: Scene, fields: Fields, table: dict[str, Any]) -> None:
    """Reads the velocity or the displacement of a wall from a curve, along a direction vector. The length of the
    vector does not scale the motion.
    """
    along = [fields.real(name) for name in ("VX", "VY", "VZ")]
    length = math.hypot(*along)
    if length == 0.0:
        raise ValueError("VX VY VZ: the direction of the motion has no length")
    curve, kind = scene.lasting(fields.whole("LCID")), fields.whole("OPT")
    speed, course = (displacement_speed(curve, scene.end), ()) if kind else velocity_course(curve, scene.end)
    table["velocity"] = scene.draft.vector([speed * value / length for value in along], SPEED)
    if course:
        table["course"] = [[scene.draft.quantity(time, TIME), factor] for time, factor in course]


def _stand(scene: Scene, fields: Fields, table: dict[str, Any]) -> None:
    """Adds a wall, and reads the fields that all walls have: stopped nodes, start and end, friction."""
    fields.refuse("NSIDEX BOXID BIRTH", "excepted nodes, boxes and times are not translated")
    if 0.0 < fields.real("DEATH") < scene.end:
        fields.refuse("DEATH", "the wall is removed before the run ends; in Conoid the wall stays")
    friction = fields.real("FRIC")
    if not 0.0 <= friction < 1.0:
        fields.refuse("FRIC", "in the deck nodes stick to the wall; Conoid has Coulomb friction")
    elif friction:
        table["friction"] = friction
    scene.walls.append(Stop(scene.nodes(fields.whole("NSID"), fields.entry), table, fields.entry))
    fields.rest("refused")
