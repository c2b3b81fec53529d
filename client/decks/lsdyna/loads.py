"""Initial velocities, restraints, motions and gravity of an LS-DYNA deck."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from conoid.cases.reading.cards import Block

from ..account import Entry
from ..holds import Hold, displacement_speed, velocity_course
from ..start import Start
from ..topology import Chosen
from ..units import ACCELERATION, TIME
from . import walls
from .fields import Fields, trimmed
from .scene import Scene

_AXES = {1: "x", 2: "y", 3: "z"}
_CORNERS = "DOFX DOFY DOFZ"


# Velocities at the start ----------------------------------------------------------------------------------------------


def velocity(scene: Scene, block: Block, options: frozenset[str], entry: Entry) -> None:
    """Reads ``*INITIAL_VELOCITY``, the initial velocity of a node set or of all nodes."""
    fields = Fields(block, entry, block.cards, ("NSID NSIDEX BOXID IRIGID ICID", "VX VY VZ VXR VYR VZR"))
    fields.refuse("NSIDEX BOXID ICID", "excepted nodes, boxes and local axes are not translated")
    fields.forgive("IRIGID", "sets whether velocities of rigid bodies are overwritten")
    fields.refuse("VXR VYR VZR", "nodes of solids have no rotations")
    chosen = scene.nodes(fields.whole("NSID"), entry)
    scene.starts.append(Start(chosen, entry, {axis: fields.real(f"V{'XYZ'[axis]}") for axis in range(3)}))
    fields.rest("refused")


def velocity_node(scene: Scene, block: Block, options: frozenset[str], entry: Entry) -> None:
    """Reads ``*INITIAL_VELOCITY_NODE``, initial velocities of single nodes, which replace those of
    ``*INITIAL_VELOCITY`` in any order (the manual, volume I). Nodes with equal velocity become one group.
    """
    groups: dict[tuple[float, ...], set[int]] = {}
    for card in block.filled():
        fields = Fields(block, entry, [card], ("NID VX VY VZ VXR VYR VZR ICID",))
        fields.refuse("VXR VYR VZR ICID", "nodes of solids have no rotations, and local axes are not translated")
        values = tuple(fields.real(f"V{axis}") for axis in "XYZ")
        groups.setdefault(values, set()).add(fields.whole("NID"))
    for values, nodes in groups.items():
        chosen = Chosen(f"{len(nodes)} nodes", nodes=lambda nodes=nodes: nodes)  # type: ignore[misc]
        scene.starts.append(Start(chosen, entry, dict(enumerate(values)), rank=1))


def generation(scene: Scene, block: Block, options: frozenset[str], entry: Entry) -> None:
    """Reads ``*INITIAL_VELOCITY_GENERATION``: translation, and rotation about an axis."""
    layout = ("ID STYP OMEGA VX VY VZ IVATN ICID", "XC YC ZC NX NY NZ PHASE IRIGID")
    cards = trimmed(block.cards)
    for one, two in zip(cards[::2], [*cards[1::2], None], strict=False):
        fields = Fields(block, entry, [card for card in (one, two) if card is not None], layout)
        fields.refuse("ICID PHASE", "local axes and later phases of the analysis are not translated")
        fields.forgive("IVATN IRIGID", "sets how rigid bodies and attached nodes are treated")
        number, kind = fields.whole("ID"), fields.whole("STYP")
        wanted = {1: scene.bodies, 2: lambda n, _: scene.part(n), 3: scene.nodes}.get(kind)
        if wanted is None and number:
            raise ValueError(f"STYP = {kind} is not 1, 2 or 3")
        chosen = scene.nodes(0, entry) if wanted is None or not number else wanted(number, entry)
        speed = {axis: fields.real(f"V{'XYZ'[axis]}") for axis in range(3)}
        rate, centre = _axis(fields)
        scene.starts.append(Start(chosen, entry, speed, rate, centre))
        fields.rest("refused")


def _axis(fields: Fields) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Returns the rotation vector of ``*INITIAL_VELOCITY_GENERATION`` and a point of the rotation axis."""
    turn = fields.real("OMEGA")
    centre = fields.real("XC"), fields.real("YC"), fields.real("ZC")
    along = [fields.real(name) for name in ("NX", "NY", "NZ")]
    length = math.sqrt(sum(value * value for value in along))
    if turn and (length == 0.0 or along[0] == -999.0):
        raise ValueError("the axis of OMEGA has no direction")
    x, y, z = (turn * value / length if turn else 0.0 for value in along)
    return (x, y, z), centre


def velocity_rigid(scene: Scene, block: Block, options: frozenset[str], entry: Entry) -> None:
    """Reads ``*INITIAL_VELOCITY_RIGID_BODY``, which replaces all other velocities of the body (volume I)."""
    for card in block.filled():
        fields = Fields(block, entry, [card], ("PID VX VY VZ VXR VYR VZR ICID",))
        fields.refuse("VXR VYR VZR ICID", "the deck rotates the body about its centre of mass; use parts[].spin")
        speed = {axis: fields.real(f"V{'XYZ'[axis]}") for axis in range(3)}
        scene.starts.append(Start(scene.part(fields.whole("PID")), entry, speed, rank=1))


# Restraints and motions -----------------------------------------------------------------------------------------------


def restraint(scene: Scene, block: Block, options: frozenset[str], entry: Entry) -> None:
    """Reads ``*BOUNDARY_SPC_SET`` and ``*BOUNDARY_SPC_NODE``: nodes that are fixed along some axes. The single nodes of
    one keyword with the same fixed axes become one group.
    """
    groups: dict[str, set[int]] = {}
    for card in list(block.filled())["ID" in options :]:
        fields = Fields(block, entry, [card], ("ID CID DOFX DOFY DOFZ DOFRX DOFRY DOFRZ",))
        fields.refuse("CID", "local axes are not translated")
        fields.forgive("DOFRX DOFRY DOFRZ", "nodes of solids have no rotations")
        axes = "".join(axis for axis, name in zip("xyz", _CORNERS.split(), strict=True) if fields.whole(name))
        number = fields.whole("ID")
        if not axes:
            entry.leave("no translation is held")
        elif "NODE" in options:
            groups.setdefault(axes, set()).add(number)
        else:
            scene.holds.append(Hold(scene.nodes(number, entry), entry, dict.fromkeys(axes, 0.0)))
    for axes, nodes in groups.items():
        scene.holds.append(Hold(scene.group(nodes), entry, dict.fromkeys(axes, 0.0)))


_TC = {1: "x", 2: "y", 3: "z", 4: "xy", 5: "yz", 6: "xz", 7: "xyz"}
"""Translations that the codes TC of ``*NODE`` fix (the manual, volume I)."""


def hold_nodes(scene: Scene, held: Sequence[tuple[int, set[int], Entry]]) -> None:
    """Reads restraints that are fields of ``*NODE`` itself; ``held``: code TC, its nodes, and the keyword."""
    for code, nodes, entry in held:
        if code not in _TC:
            entry.remark("refused", f"TC = {code}", "a code of translations from 1 to 7 is expected")
            continue
        chosen = Chosen(f"nodes with TC = {code}", nodes=lambda nodes=nodes: nodes)  # type: ignore[misc]
        scene.holds.append(Hold(chosen, entry, dict.fromkeys(_TC[code], 0.0)))


def _single(number: int) -> Chosen:
    return Chosen(f"node {number}", nodes=lambda: {number})


def motion(scene: Scene, block: Block, options: frozenset[str], entry: Entry) -> None:
    """Reads ``*BOUNDARY_PRESCRIBED_MOTION_SET``, ``_NODE`` and ``_RIGID``: a velocity or a displacement with a
    curve.
    """
    for card in list(block.filled())["ID" in options :]:
        fields = Fields(block, entry, [card], ("ID DOF VAD LCID SF VID DEATH BIRTH",))
        number, axis = fields.whole("ID"), _AXES.get(fields.whole("DOF"))
        if axis is None:
            raise ValueError(
                f"DOF = {fields.text('DOF')} is not 1, 2 or 3; only motions along x, y and z are translated"
            )
        scale, kind = fields.nonzero("SF", 1.0), fields.whole("VAD")
        curve = tuple((time, scale * value) for time, value in scene.lasting(fields.whole("LCID")))
        if 0.0 < fields.real("DEATH") < scene.end:
            fields.refuse("DEATH", "the motion ends before the run; in Conoid a motion lasts until the end")
        fields.refuse("BIRTH", "the motion begins after the start; in Conoid a motion begins at the start")
        fields.forgive("VID", "direction vector for DOF = 4")
        if kind == 0:
            speed, course = velocity_course(curve, scene.end)
        elif kind == 2:
            speed, course = displacement_speed(curve, scene.end), ()
        else:
            raise ValueError(f"VAD = {kind}: only velocities (0) and displacements (2) are translated")
        chosen = scene.part(number) if "RIGID" in options else _single(number) if "NODE" in options else None
        scene.holds.append(Hold(chosen or scene.nodes(number, entry), entry, {axis: speed}, course))
        fields.rest("refused")


# Gravity --------------------------------------------------------------------------------------------------------------


def body_load(scene: Scene, block: Block, options: frozenset[str], entry: Entry) -> None:
    """Reads ``*LOAD_BODY_X``, ``_Y``, ``_Z``: an acceleration of the base; the bodies accelerate in the opposite
    direction.
    """
    fields = Fields(block, entry, block.cards, ("LCID SF LCIDDR XC YC ZC CID",))
    fields.forgive("LCIDDR", "load of the dynamic relaxation, which Conoid does not have")
    fields.refuse("CID", "local axes are not translated")
    fields.forgive("XC YC ZC", "centre of rotation; no effect on a translation")
    (axis,) = options & {"X", "Y", "Z"}
    scale = fields.nonzero("SF", 1.0)
    curve = tuple((time, -scale * value) for time, value in scene.lasting(fields.whole("LCID")))
    most, course = velocity_course(curve, scene.end)
    pull = [most if axis == each else 0.0 for each in "XYZ"]
    table: dict[str, Any] = {"kind": "gravity", "acceleration": scene.draft.vector(pull, ACCELERATION)}
    if course:
        table["course"] = [[scene.draft.quantity(time, TIME), factor] for time, factor in course]
    entry.remark("differs", f"LOAD_BODY_{axis}", f"the base accelerates along +{axis}: bodies are pulled along -{axis}")
    scene.draft.add_boundary(table, entry)


Handler = Callable[[Scene, Block, frozenset[str], Entry], None]
HANDLERS: Mapping[str, tuple[Handler, frozenset[str]]] = {
    "INITIAL_VELOCITY": (velocity, frozenset()),
    "INITIAL_VELOCITY_NODE": (velocity_node, frozenset()),
    "INITIAL_VELOCITY_GENERATION": (generation, frozenset()),
    "INITIAL_VELOCITY_RIGID_BODY": (velocity_rigid, frozenset()),
    "BOUNDARY_SPC": (restraint, frozenset({"SET", "NODE", "ID"})),
    "BOUNDARY_PRESCRIBED_MOTION": (motion, frozenset({"SET", "NODE", "RIGID", "ID"})),
    "RIGIDWALL_PLANAR": (walls.planar, walls.OPTIONS - {"MOTION", "CYLINDER", "SPHERE"}),
    "RIGIDWALL_GEOMETRIC": (walls.geometric, walls.OPTIONS - {"FORCES", "MOVING"}),
    "LOAD_BODY": (body_load, frozenset({"X", "Y", "Z"})),
}
"""Translated keywords, each with the options that may follow its name."""
