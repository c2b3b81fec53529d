"""What moves, holds and stops bodies in a Radioss deck, what meets, and what the engine file says."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..account import Entry
from ..contacts import Meeting
from ..draft import Draft
from ..holds import Course, Hold, displacement_speed, velocity_course
from ..start import Start
from ..topology import Chosen
from ..units import ACCELERATION, LENGTH, TIME
from ..walls import Stop
from .text import Fields, Option, real


@dataclass
class Scene:
    """What loads ask of the deck, and what they add to the case."""

    draft: Draft
    nodes: Callable[[int, Entry], Chosen]
    curve: Callable[[int, Entry], Course]
    end: float
    starts: list[Start] = field(default_factory=list)
    holds: list[Hold] = field(default_factory=list)
    walls: list[Stop] = field(default_factory=list)


def take(scene: Scene, option: Option, entry: Entry) -> None:
    """An option, if it is one of these. Raises CardError, ValueError."""
    words = [*option.words, "", ""]
    handler = _HANDLERS.get((words[0], words[1])) or _HANDLERS.get((words[0], ""))
    if handler is not None:
        handler(scene, option, entry)


def _translation(scene: Scene, option: Option, entry: Entry) -> None:
    fields = Fields(option, entry, option.rows[1:], ("VX VY VZ GRNOD: SKEW:",))
    fields.refuse("SKEW", "local axes are not taken over")
    speed = {axis: fields.real(f"V{'XYZ'[axis]}") for axis in range(3)}
    scene.starts.append(Start(scene.nodes(fields.whole("GRNOD"), entry), entry, speed))
    fields.rest()


def _about_axis(scene: Scene, option: Option, entry: Entry) -> None:
    fields = Fields(option, entry, option.rows[1:], ("DIR: FRAME: GRNOD:", "VX VY VZ VR"))
    fields.refuse("FRAME", "local axes are not taken over")
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
        fields.refuse("SKEW", "local axes are not taken over")
        code = fields.text("CODE").split()
        if not code or len(code[0]) != 3 or set("".join(code)) - set("01"):
            raise ValueError(f"line {row[0]}: {' '.join(code)!r} is no code of translations and rotations")
        if len(code) > 1 and "1" in code[1]:
            entry.remark("left", f"rotations {code[1]}", "nodes of solids have none")
        speeds = {axis: 0.0 for axis, held in zip("xyz", code[0], strict=True) if held == "1"}
        if speeds:
            scene.holds.append(Hold(scene.nodes(fields.whole("GRNOD"), entry), entry, speeds))
        else:
            entry.leave("no translation is held")


def _scaled(scene: Scene, fields: Fields, entry: Entry, names: tuple[str, str]) -> Course:
    """Times and values of a function, with its scales. Raises ValueError."""
    along, across = fields.nonzero(names[0], 1.0), fields.nonzero(names[1], 1.0)
    return tuple((along * time, across * value) for time, value in scene.curve(fields.whole("FCT"), entry))


def _motion(scene: Scene, option: Option, entry: Entry) -> None:
    layout = ("FCT: DIR: SKEW: SENS: GRNOD: FRAME: ICOOR:", "ASCALE FSCALE TSTART TSTOP")
    fields = Fields(option, entry, option.rows[1:], layout)
    fields.refuse("SKEW SENS FRAME ICOOR TSTART", "local axes, sensors and later starts are not taken over")
    if 0.0 < fields.real("TSTOP") < scene.end:
        fields.refuse("TSTOP", "the motion ends before the run does; here it lasts")
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
    fields.refuse("SKEW SENS GRNOD", "local axes, sensors and groups of nodes are not taken over")
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


def _wall(scene: Scene, option: Option, entry: Entry) -> None:
    """A fixed plane by two points of its normal; it stops the group of nodes."""
    layout = ("NODE: SLIDE: GRNOD1: GRNOD2:", "D FRIC DIAMETER FFAC IFQ:", "XM YM ZM", "XM1 YM1 ZM1")
    fields = Fields(option, entry, option.rows[1:], layout)
    fields.refuse("NODE GRNOD2", "walls that move, and nodes that are left out, are not taken over")
    fields.forgive("DIAMETER FFAC IFQ", "size and filter of friction of the wall")
    slide, friction = fields.whole("SLIDE"), fields.real("FRIC")
    if slide == 1:
        fields.refuse("SLIDE", "nodes stick to the wall there; here friction is Coulomb's")
    group, reach = fields.whole("GRNOD1"), fields.real("D")
    if not group and not reach:
        raise ValueError("neither grnd_ID1 nor d: the wall stops no node")
    if not group:
        raise ValueError("the wall stops the nodes within d of it; name a group of nodes, grnd_ID1")
    fields.forgive("D", "how near nodes are that the wall stops besides")
    low = [fields.real(name) for name in ("XM", "YM", "ZM")]
    high = [fields.real(name) for name in ("XM1", "YM1", "ZM1")]
    normal = [b - a for a, b in zip(low, high, strict=True)]
    if not any(normal):
        raise ValueError("its normal, from M to M1, has no length")
    table: dict[str, Any] = {"kind": "wall", "point": scene.draft.vector(low, LENGTH), "normal": normal}
    if slide == 2 and friction:
        table["friction"] = friction
    scene.walls.append(Stop(scene.nodes(group, entry), table, entry))
    fields.rest()


def _values(option: Option) -> list[float]:
    """Numbers of the engine file, between blanks. Raises CardError."""
    return [real(line, item, option.shown) for line, text in option.rows for item in text.split()]


def _frames(scene: Scene, option: Option, entry: Entry) -> None:
    """``/ANIM/DT`` and ``/H3D/DT``: a start and an interval."""
    values = _values(option)
    scene.draft.set_frames(0.0, values[1] if len(values) > 1 else 0.0, scene.end, entry)


def _step(scene: Scene, option: Option, entry: Entry) -> None:
    """``/DT``: the share of the bound; ``/DT/...`` are limits of elements and nodes."""
    values = _values(option) if len(option.words) == 1 else []
    if len(option.words) > 1 or not values or not 0.0 < values[0] <= 1.0:
        entry.leave("limits of the step: mass is not scaled here, and tets leave by parts[].erosion alone")
        return
    scene.draft.numerics["dt_safety"] = values[0]
    entry.remark("differs", f"{values[0]:g}", "of the bound of this solver: numerics.dt_safety")
    entry.take("numerics.dt_safety")


def contact(option: Option, entry: Entry, surface: Callable[[str, int, Entry], frozenset[str]]) -> Meeting:
    """``/INTER/TYPE7`` and ``TYPE2``: nodes of a group on faces of a surface. Raises CardError, ValueError."""
    rows = option.rows[1:]
    if option.words[1] == "TYPE2":
        fields = Fields(option, entry, rows, ("GRNOD: SURF: IGNORE: SPOTFLAG: LEVEL: ISEARCH: IDEL: -: DSEARCH",))
        fields.forgive("IGNORE SPOTFLAG LEVEL ISEARCH IDEL DSEARCH", "how the other code ties nodes")
        fields.more.clear()
        friction = 0.0
    else:
        fields = Fields(
            option, entry, rows,
            ("GRNOD: SURF: ISTF: ITHE: IGAP: -: IBAG: IDEL: ICURV: IADM:", "FSCALE_GAP GAP_MAX FPENMAX",
             "STMIN STMAX MESH_SIZE DTMIN IREM_GAP: IREM_I2:", "STFAC FRIC GAPMIN TSTART TSTOP",
             "IBC: - INACTI: VIS_S VIS_F BUMULT", "IFRIC: IFILTR: XFREQ IFORM: SENS: FCT_F: ASCALE_F FRIC_ID:"),
        )  # fmt: skip
        fields.refuse("TSTART SENS IFRIC FRIC_ID ITHE", "contact that begins later, or with another friction")
        friction = fields.real("FRIC")
        fields.whole("GRNOD"), fields.whole("SURF")
        fields.rest("left", "stiffness, gap and damping of the penalty method") if friction >= 0.0 else None
    one = surface("GRNOD", fields.whole("GRNOD"), entry)
    other = surface("SURF", fields.whole("SURF"), entry)
    return Meeting(one, None if one == other else other, friction, entry)


_HANDLERS: dict[tuple[str, str], Callable[[Scene, Option, Entry], None]] = {
    ("INIVEL", "TRA"): _translation, ("INIVEL", "AXIS"): _about_axis, ("IMPVEL", ""): _motion,
    ("IMPDISP", ""): _motion, ("GRAV", ""): _gravity, ("RWALL", "PLANE"): _wall, ("BCS", ""): _restraint,
    ("ANIM", "DT"): _frames, ("H3D", "DT"): _frames, ("DT", ""): _step,
}  # fmt: skip
