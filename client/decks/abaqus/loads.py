"""Motions, restraints, end time and output of an Abaqus input file."""

from collections.abc import Callable, Sequence

from conoid.cases.reading.inp import InpError, numbers

from ..account import Entry
from ..draft import Body, Draft
from ..holds import AXES, Course, Hold, displacement_speed, velocity_course
from ..start import Start
from ..topology import Chosen, Topology
from ..units import ACCELERATION, TEMPERATURE, TIME
from .keyword import Keyword, joined

_NAMED = {
    "ENCASTRE": "xyz", "PINNED": "xyz", "XSYMM": "x", "YSYMM": "y", "ZSYMM": "z", "XASYMM": "yz", "YASYMM": "xz",
    "ZASYMM": "xy",
}  # fmt: skip
"""Translations that each named restraint fixes (Analysis User's Guide, "Boundary conditions")."""
_STILL = {
    "ENCASTRE": "xyz", "PINNED": "", "XSYMM": "yz", "YSYMM": "xz", "ZSYMM": "xy", "XASYMM": "x", "YASYMM": "y",
    "ZASYMM": "z",
}  # fmt: skip
"""The rotations that each restraint fixes."""


class Loads:
    """Collects the restraints, motions, initial velocities and gravity of the keywords of a deck."""

    def __init__(self, draft: Draft, amplitudes: Sequence[Keyword], chosen: Callable[[str, Entry], Chosen]) -> None:
        """``chosen``: function that returns the node set of a data line."""
        self._draft, self._chosen = draft, chosen
        self._amplitudes = {each.key("NAME"): each for each in amplitudes}
        self.adiabatic = False
        self.starts: list[Start] = []
        self.holds: list[Hold] = []
        self._temperatures: list[tuple[Chosen, float, Entry]] = []

    def end(self, steps: Sequence[Keyword], dynamics: Sequence[Keyword]) -> float:
        """End of the run, in units of the deck; infinite if the deck does not give it."""
        for step in steps:
            step.forgive(
                "NAME, NLGEOM, INC, PERTURBATION, UNSYMM",
                "setting of the analysis; Conoid always computes with large strains",
            )
            step.rest()
            step.entry.take("run")
        for later in steps[1:]:
            later.entry.refuse("the deck has a second step; a case has one step")
        for each in dynamics:
            try:
                return self._dynamic(each)
            except (InpError, ValueError) as error:
                each.entry.refuse(str(error))
        if not dynamics:
            self._draft.account.general.append("the deck has no *DYNAMIC, EXPLICIT: run.end_time is not known")
        return float("inf")

    def _dynamic(self, each: Keyword) -> float:
        if not each.has("EXPLICIT"):
            raise InpError(f"line {each.line}: *DYNAMIC without EXPLICIT is an implicit analysis; Conoid is explicit")
        self.adiabatic = each.has("ADIABATIC")
        scale = each.get("SCALE FACTOR")
        each.forgive(
            "ELEMENT BY ELEMENT, DIRECT USER CONTROL, FIXED TIME INCREMENTATION, IMPROVED DT METHOD",
            "setting of the time step of Abaqus",
        )
        if scale:
            self._draft.numerics["dt_safety"] = _number(scale)
            each.entry.remark(
                "differs",
                f"SCALE FACTOR = {scale}",
                "in Conoid the factor scales Conoid's own stable step: numerics.dt_safety",
            )
        each.rest()
        row = numbers(*each.filled()[0]) if each.filled() else []
        if len(row) < 2 or row[1] <= 0.0:
            raise InpError(f"line {each.line}: *DYNAMIC, EXPLICIT needs a time period above 0")
        self._draft.run["end_time"] = self._draft.quantity(row[1], TIME)
        each.entry.take("run.end_time")
        return row[1]

    def take(self, each: Keyword, end: float) -> None:
        """Reads a keyword of loads or motions. Raises InpError, ValueError."""
        if each.word == "BOUNDARY":
            self._boundary(each, end)
        elif each.word == "INITIAL CONDITIONS":
            self._initial(each)
        elif each.word == "DLOAD":
            self._dload(each, end)
        elif each.word == "OUTPUT":
            self._output(each, end)

    # Restraints and motions -------------------------------------------------------------------------------------------

    def _boundary(self, each: Keyword, end: float) -> None:
        kind = each.key("TYPE") or "DISPLACEMENT"
        if each.key("OP") == "NEW":
            raise InpError("OP=NEW removes earlier restraints")
        course = self.course(each.get("AMPLITUDE"), each.entry)
        each.forgive("LOAD CASE, REGION TYPE", "no meaning in Conoid")
        each.rest()
        speeds: dict[str, dict[str, tuple[float, Course]]] = {}
        turns: dict[str, dict[str, float]] = {}
        for line, items in each.lists():
            speeds.setdefault(items[0], {}).update(self._row(line, items[1:], kind, course, end))
            turns.setdefault(items[0], {}).update(_turns(line, items[1:]))
        for name, by_axis in speeds.items():
            groups: dict[Course, dict[str, float]] = {}
            for axis, (speed, its) in by_axis.items():
                groups.setdefault(its, {})[axis] = speed
            chosen = self._chosen(name, each.entry)
            if chosen.bodies and any(turns[name].values()):
                raise InpError('a prescribed rotation of a rigid body: [[boundaries]] kind = "rotation"')
            for its, group in groups.items() or [((), {})]:
                self.holds.append(Hold(chosen, each.entry, group, its, "".join(turns[name])))
        if not speeds:
            each.entry.leave("it holds nothing")
        elif not any(speeds.values()):
            each.entry.leave("only rotations are given; nodes of solids have no rotations")

    def _row(
        self, line: int, items: list[str], kind: str, course: Course | None, end: float
    ) -> dict[str, tuple[float, Course]]:
        """Returns the prescribed velocities by axis, with their factors over time (courses), of one data line
        without its node set.
        """
        if not items or joined(items[0]) in _NAMED:
            return dict.fromkeys(_NAMED[joined(items[0])] if items else "", (0.0, ()))
        first, last, value = (numbers(line, ",".join(items) + ",") + [0.0] * 3)[:3]
        last = last or first
        axes = [AXES[d] for d in range(3) if first <= d + 1 <= last]
        if value == 0.0:
            return dict.fromkeys(axes, (0.0, ()))
        if kind == "VELOCITY" and course is None:
            return dict.fromkeys(axes, (value, ()))
        if kind == "VELOCITY" and course is not None:
            most, its = velocity_course(tuple((time, value * factor) for time, factor in course), end)
            return dict.fromkeys(axes, (most, its))
        if kind == "DISPLACEMENT" and course is not None:
            return dict.fromkeys(axes, (displacement_speed(tuple((t, value * f) for t, f in course), end), ()))
        raise InpError(
            f"line {line}: TYPE = {kind}: only velocities, and displacements with an amplitude, are translated"
        )

    def course(self, name: str | None, entry: Entry) -> Course | None:
        """Returns times and factors of an amplitude. Raises InpError if the amplitude is not a table."""
        if not name:
            return None
        found = self._amplitudes.get(joined(name))
        if found is None:
            raise InpError(f"the amplitude {name!r} is not defined")
        kind, smooth = found.key("DEFINITION") or "TABULAR", found.get("SMOOTH")
        if kind != "TABULAR" or _number(smooth):
            raise InpError(
                f"the amplitude {name!r} is {kind}{' with SMOOTH' if smooth else ''}; only TABULAR is translated"
            )
        if found.key("VALUE") == "ABSOLUTE" or found.key("TIME") == "TOTALTIME":
            found.entry.remark(
                "left", "TIME, VALUE", "in a case with one step all times are total times and all values are factors"
            )
        found.entry.take(f"of {entry.keyword}, {entry.place}")
        flat = [value for line, text in found.filled() for value in numbers(line, text)]
        return tuple(zip(flat[::2], flat[1::2], strict=False))

    # The start --------------------------------------------------------------------------------------------------------

    def _initial(self, each: Keyword) -> None:
        kind = each.key("TYPE")
        each.rest()
        if kind == "TEMPERATURE":
            for line, items in each.lists():
                if len(items) < 2:
                    raise InpError(f"line {line}: expected a node set and a temperature")
                value = numbers(line, items[1] + ",")[0]
                self._temperatures.append((self._chosen(items[0], each.entry), value, each.entry))
        elif kind == "VELOCITY":
            for name, velocity in self._components(each).items():
                self.starts.append(Start(self._chosen(name, each.entry), each.entry, velocity))
        elif kind == "ROTATINGVELOCITY":
            self._rotating(each)
        else:
            raise InpError(f"TYPE = {kind}: only initial velocities and temperatures are translated")

    def _components(self, each: Keyword) -> dict[str, dict[int, float]]:
        """Returns velocities by node set and axis. Each data line gives a set, a direction and a value."""
        made: dict[str, dict[int, float]] = {}
        for line, items in each.lists():
            axis = numbers(line, items[1] + ",")[0] if len(items) == 3 else 0.0
            if axis not in (1.0, 2.0, 3.0):
                raise InpError(f"line {line}: expected a node set, a direction from 1 to 3, and a velocity")
            made.setdefault(items[0], {})[int(axis) - 1] = numbers(line, items[2] + ",")[0]
        return made

    def _rotating(self, each: Keyword) -> None:
        """Reads initial rotations: a line with set, rate and translation, then a line with two points of the axis
        (Keywords Guide).
        """
        rows = each.lists()
        for (line, items), (second, axis) in zip(rows[::2], rows[1::2], strict=False):
            rate, vx, vy, vz = (numbers(line, ",".join(items[1:]) + ",") + [0.0] * 4)[:4]
            ends = numbers(second, ",".join(axis))
            along = [b - a for a, b in zip(ends[:3], ends[3:6], strict=False)]
            length = sum(value * value for value in along) ** 0.5
            if len(along) < 3 or length == 0.0:
                raise InpError(f"line {second}: expected two different points of the axis")
            x, y, z = (rate * value / length for value in along)
            start = Start(self._chosen(items[0], each.entry), each.entry, {0: vx, 1: vy, 2: vz}, (x, y, z))
            start.centre = (ends[0], ends[1], ends[2])
            self.starts.append(start)

    def temperatures(self, bodies: Sequence[Body], topology: Topology, zero: float) -> None:
        """Reads initial temperatures of whole bodies."""
        for chosen, value, entry in self._temperatures:
            full, some = topology.whole(chosen)
            if some:
                entry.refuse(
                    f"{chosen.what} has only some nodes of a part; in Conoid a temperature belongs to a whole part"
                )
                continue
            for index, body in enumerate(bodies):
                if body.key in full:
                    body.temperature = self._draft.quantity(value - zero, TEMPERATURE)
                    entry.take(f"parts[{index}].temperature")

    # Gravity and output -----------------------------------------------------------------------------------------------

    def _dload(self, each: Keyword, end: float) -> None:
        course = self.course(each.get("AMPLITUDE"), each.entry)
        each.forgive("OP", "a case with one step has one list of loads")
        each.rest()
        for line, items in each.lists():
            if len(items) < 6 or joined(items[1]) != "GRAV" or items[0]:
                raise InpError(f"line {line}: only gravity on all parts (', GRAV, size, x, y, z') is translated")
            size, *along = numbers(line, ",".join(items[2:6]))
            length = sum(value * value for value in along) ** 0.5
            if length == 0.0:
                raise InpError(f"line {line}: the direction of gravity has no length")
            most, its = (size, ()) if course is None else velocity_course(tuple((t, size * f) for t, f in course), end)
            pull = [most * value / length for value in along]
            table = {"kind": "gravity", "acceleration": self._draft.vector(pull, ACCELERATION)}
            if its:
                table["course"] = [[self._draft.quantity(time, TIME), factor] for time, factor in its]  # type: ignore[misc]
            self._draft.add_boundary(table, each.entry)

    def _output(self, each: Keyword, end: float) -> None:
        count, interval = each.get("NUMBER INTERVAL"), each.get("TIME INTERVAL")
        if not each.has("FIELD") or not (count or interval):
            each.entry.leave("request of output; a run writes frames, history.csv and probes")
            return
        self._draft.set_frames(_number(count), _number(interval), end, each.entry)


def _turns(line: int, items: list[str]) -> dict[str, float]:
    """Returns the rotations of one data line without its node set, by axis."""
    if not items or joined(items[0]) in _NAMED:
        return dict.fromkeys(_STILL[joined(items[0])] if items else "", 0.0)
    first, last, value = (numbers(line, ",".join(items) + ",") + [0.0] * 3)[:3]
    return {axis: value for d, axis in enumerate(AXES, 4) if first <= d <= (last or first)}


def _number(text: str | None) -> float:
    """Reads the number of a parameter; returns 0 if the parameter is missing. Raises InpError."""
    try:
        return float(text or 0.0)
    except ValueError:
        raise InpError(f"{text!r} is not a number") from None
