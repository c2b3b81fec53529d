"""Motions, restraints and contacts of a Radioss starter, and the options of the engine file."""

from collections.abc import Callable
from typing import Any

from ..account import Entry
from ..bonds import MOVED
from ..contacts import Meeting
from ..holds import Course, Hold, displacement_speed, velocity_course
from ..start import Start
from ..units import ACCELERATION, TIME
from .scene import Scene
from .text import Fields, Option, real
from .walls import WALLS, wall


def take(scene: Scene, option: Option, entry: Entry) -> None:
    """Reads an option of loads, motions or output. Raises CardError, ValueError."""
    words = [*option.words, "", ""]
    handler = _HANDLERS.get((words[0], words[1])) or _HANDLERS.get((words[0], ""))
    if handler is not None:
        handler(scene, option, entry)


def _translation(scene: Scene, option: Option, entry: Entry) -> None:
    fields = Fields(option, entry, option.rows[1:], ("VX VY VZ GRNOD: SKEW:",))
    fields.refuse("SKEW", "local axes are not translated")
    speed = {axis: fields.real(f"V{'XYZ'[axis]}") for axis in range(3)}
    scene.starts.append(Start(scene.nodes(fields.whole("GRNOD"), entry), entry, speed))
    fields.rest()


def _about_axis(scene: Scene, option: Option, entry: Entry) -> None:
    fields = Fields(option, entry, option.rows[1:], ("DIR: FRAME: GRNOD:", "VX VY VZ VR"))
    fields.refuse("FRAME", "local axes are not translated")
    along = fields.text("DIR").upper()
    if along not in ("X", "Y", "Z"):
        raise ValueError(f"Dir = {along!r} is not X, Y or Z")
    speed = {axis: fields.real(f"V{'XYZ'[axis]}") for axis in range(3)}
    turn = fields.real("VR")
    x, y, z = (turn if along == each else 0.0 for each in "XYZ")
    scene.starts.append(Start(scene.nodes(fields.whole("GRNOD"), entry), entry, speed, (x, y, z)))
    fields.rest()


def _restraint(scene: Scene, option: Option, entry: Entry) -> None:
    for row in option.rows[1:]:
        if not row[1].strip():
            continue
        fields = Fields(option, entry, [row], ("CODE: SKEW: GRNOD:",))
        fields.refuse("SKEW", "local axes are not translated")
        code = fields.text("CODE").split()
        if not code or len(code[0]) != 3 or set("".join(code)) - set("01"):
            raise ValueError(f"line {row[0]}: {' '.join(code)!r} is not a code of translations and rotations")
        chosen = scene.nodes(fields.whole("GRNOD"), entry)
        speeds = {axis: 0.0 for axis, held in zip("xyz", code[0], strict=True) if held == "1"}
        still = "".join(axis for axis, held in zip("xyz", "".join(code[1:2]), strict=False) if held == "1")
        if chosen.bodies and chosen.bodies & scene.rigid:
            if code[1:] != ["111"] or not speeds:
                raise ValueError(
                    "a rigid body with fixed axes and free rotations is not supported; fix all rotations (111)"
                )
        elif len(code) > 1 and "1" in code[1]:
            entry.remark("left", f"rotations {code[1]}", "nodes of solids have none")
        if speeds:
            scene.holds.append(Hold(chosen, entry, speeds, still=still))
        else:
            entry.leave("no translation is held")


def _scaled(scene: Scene, fields: Fields, entry: Entry, names: tuple[str, str]) -> Course:
    """Returns times and values of a function, multiplied by their scale factors. Raises ValueError."""
    along, across = fields.nonzero(names[0], 1.0), fields.nonzero(names[1], 1.0)
    return tuple((along * time, across * value) for time, value in scene.curve(fields.whole("FCT"), entry))


def _motion(scene: Scene, option: Option, entry: Entry) -> None:
    layout = ("FCT: DIR: SKEW: SENS: GRNOD: FRAME: ICOOR:", "ASCALE FSCALE TSTART TSTOP")
    fields = Fields(option, entry, option.rows[1:], layout)
    fields.refuse("SKEW SENS FRAME ICOOR TSTART", "local axes, sensors and later starts are not translated")
    if 0.0 < fields.real("TSTOP") < scene.end:
        fields.refuse("TSTOP", "the motion ends before the run; in Conoid a motion lasts until the end")
    axis = fields.text("DIR").lower()
    if axis not in ("x", "y", "z"):
        raise ValueError(f"Dir = {axis!r} is not X, Y or Z")
    curve = _scaled(scene, fields, entry, ("ASCALE", "FSCALE"))
    chosen = scene.nodes(fields.whole("GRNOD"), entry)
    if option.words[0] == "IMPDISP":
        scene.holds.append(Hold(chosen, entry, {axis: displacement_speed(curve, scene.end)}))
    else:
        speed, course = velocity_course(curve, scene.end)
        scene.holds.append(Hold(chosen, entry, {axis: speed}, course))
    fields.rest()


def _gravity(scene: Scene, option: Option, entry: Entry) -> None:
    layout = ("FCT: DIR: SKEW: SENS: GRNOD:", "ASCALE FSCALE")
    fields = Fields(option, entry, option.rows[1:], layout)
    fields.refuse("SKEW SENS GRNOD", "local axes, sensors and groups of nodes are not translated")
    axis = fields.text("DIR").upper()
    if fields.whole("FCT"):
        most, course = velocity_course(_scaled(scene, fields, entry, ("ASCALE", "FSCALE")), scene.end)
    else:
        most, course = fields.nonzero("FSCALE", 1.0), ()
        fields.real("ASCALE")
    if axis not in ("X", "Y", "Z"):
        raise ValueError(f"Dir = {axis!r} is not X, Y or Z")
    pull = [most if axis == each else 0.0 for each in "XYZ"]
    table: dict[str, Any] = {"kind": "gravity", "acceleration": scene.draft.vector(pull, ACCELERATION)}
    if course:
        table["course"] = [[scene.draft.quantity(time, TIME), factor] for time, factor in course]
    scene.draft.add_boundary(table, entry)
    fields.rest()


def _values(option: Option) -> list[float]:
    """Reads the numbers of an option of the engine file; blanks separate the numbers. Raises CardError."""
    return [real(line, item, option.shown) for line, text in option.rows for item in text.split()]


def _frames(scene: Scene, option: Option, entry: Entry) -> None:
    """Reads the start and the interval of frames from ``/ANIM/DT`` or ``/H3D/DT``."""
    values = _values(option)
    scene.draft.set_frames(0.0, values[1] if len(values) > 1 else 0.0, scene.end, entry)


def _step(scene: Scene, option: Option, entry: Entry) -> None:
    """Reads ``/DT``, the factor of the stable time step. An option ``/DT/...`` sets limits for elements and nodes."""
    values = _values(option) if len(option.words) == 1 else []
    if len(option.words) > 1 or not values or not 0.0 < values[0] <= 1.0:
        entry.leave("limits of the time step: Conoid does not scale masses, and only parts[].erosion deletes tets")
        return
    scene.draft.numerics["dt_safety"] = values[0]
    entry.remark(
        "differs", f"{values[0]:g}", "in Conoid the factor scales Conoid's own stable step: numerics.dt_safety"
    )
    entry.take("numerics.dt_safety")


_PENALTY = "setting of stiffness, gap or damping of the penalty method"
_GENERAL = (
    "SURF1: SURF2: ISTF: ITHE: IGAP: IREM_I2: -: IDEL: IEDGE: IPSTIF:", "GRNOD: -: GAP_SCALE MESH_SIZE GAP_S GAP_M",
    "STMIN STMAX IGAP0: IPEN0: IPEN_MAX STFAC_MDT", "STFAC FRIC - TSTART TSTOP",
    "IBC: -: IVIS2: INACTI: VIS_S ITHICK: -: PMAX", "IFRIC: IFILTR: XFREQ -: SENS: DTSTIF -: FRIC_ID:",
)  # fmt: skip
"""Names of the fields on the lines of TYPE24 and TYPE25. The lines differ in settings of the penalty method
(Reference Guide, /INTER/TYPE24)."""
_LAYOUTS: dict[str, tuple[str, ...]] = {
    "TYPE2": ("GRNOD: SURF: IGNORE: SPOTFLAG: LEVEL: ISEARCH: IDEL: -: DSEARCH",),
    "TYPE7": (
        "GRNOD: SURF: ISTF: ITHE: IGAP: -: IBAG: IDEL: ICURV: IADM:", "FSCALE_GAP GAP_MAX FPENMAX",
        "STMIN STMAX MESH_SIZE DTMIN IREM_GAP: IREM_I2:", "STFAC FRIC GAPMIN TSTART TSTOP",
        "IBC: - INACTI: VIS_S VIS_F BUMULT", "IFRIC: IFILTR: XFREQ IFORM: SENS: FCT_F: ASCALE_F FRIC_ID:",
    ),
    "TYPE24": _GENERAL,
    "TYPE25": _GENERAL,
}  # fmt: skip
CONTACTS = frozenset(_LAYOUTS)
Surface = Callable[[str, int, Entry], frozenset[str]]


def contact(option: Option, entry: Entry, surface: Surface) -> Meeting:
    """Reads ``/INTER``: contact between nodes of a group and faces of a surface (``TYPE7``, ``TYPE2``), or between
    surfaces and of a surface with itself (``TYPE24``, ``TYPE25``). Raises CardError, ValueError.
    """
    kind = option.words[1]
    fields = Fields(option, entry, option.rows[1:], _LAYOUTS[kind])
    if kind == "TYPE2":
        fields.forgive("IGNORE SPOTFLAG LEVEL ISEARCH IDEL", "setting with which Radioss ties nodes")
        fields.extra.clear()
        return _meeting(fields, surface, ("GRNOD", "SURF"), 0.0)
    fields.refuse(
        "TSTART SENS IFRIC FRIC_ID ITHE IVIS2 PMAX", "the contact begins after the start, or has another friction law"
    )
    names = tuple(name for name in ("GRNOD", "SURF", "SURF1", "SURF2") if fields.whole(name))
    friction = fields.real("FRIC")
    fields.rest("left", _PENALTY)
    return _meeting(fields, surface, names, friction)


def tied_distance(option: Option, entry: Entry) -> float:
    """Returns the largest distance of nodes that ``/INTER/TYPE2`` ties; 0 if the deck does not give it."""
    distance = Fields(option, entry, option.rows[1:], _LAYOUTS["TYPE2"]).real("DSEARCH")
    entry.remark("differs", "TYPE2", MOVED)
    return distance


def _meeting(fields: Fields, surface: Surface, names: tuple[str, ...], friction: float) -> Meeting:
    """Returns a contact of one or two surfaces; a single surface is in contact with itself. Raises ValueError."""
    entry = fields.entry
    if not names or names == ("GRNOD",):
        raise ValueError("no surface is named")
    if len(names) > 2:
        raise ValueError("a group of nodes in addition to two surfaces is not translated")
    sides = [surface(name.rstrip("12"), fields.whole(name), entry) for name in names]
    return Meeting(sides[0], None if sides[0] == sides[-1] else sides[-1], friction, entry)


_HANDLERS: dict[tuple[str, str], Callable[[Scene, Option, Entry], None]] = {
    ("INIVEL", "TRA"): _translation, ("INIVEL", "AXIS"): _about_axis, ("IMPVEL", ""): _motion,
    ("IMPDISP", ""): _motion, ("GRAV", ""): _gravity, **dict.fromkeys(WALLS, wall), ("BCS", ""): _restraint,
    ("ANIM", "DT"): _frames, ("H3D", "DT"): _frames, ("DT", ""): _step,
}  # fmt: skip
