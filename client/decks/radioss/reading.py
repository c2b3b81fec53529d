"""Import of a Radioss starter with its engine file as a case."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from conoid.cases.reading.cards import CardError
from conoid.cases.reading.included import Included

from ..account import Account, Entry, once
from ..bonds import Tie, join
from ..contacts import Meeting, meet
from ..draft import Body, Draft, Made
from ..holds import Holding
from ..start import begin
from ..topology import Chosen, Topology
from ..units import TIME, System, Weighed, named
from ..walls import stand
from . import bodies, loads, materials
from .mesh import read_nodes, read_points
from .scene import Scene
from .text import Fields, Option, cut, numbers, options, real
from .walls import drive
from .words import LEFT, REFUSED, SOLIDS


class Radioss:
    """Reader of a starter and its engine file: their options and the translation to a case."""

    kind = "Radioss starter"

    def __init__(self, path: Path) -> None:
        """Reads a starter, ``path``, and the engine file ``NAME_0001.rad`` beside ``NAME_0000.rad``. Raises
        CardError, OSError.
        """
        self.path, self.account = path, Account()
        self.own_units: System | None = None
        self.title = ""
        self._options: list[tuple[Option, Entry]] = []
        self._bodies: list[Body] = []
        self._solid: set[str] = set()
        self._mats: dict[int, tuple[str, Fields, str]] = {}
        self._states: dict[int, Fields] = {}
        self._failures: dict[int, Fields] = {}
        self._groups: dict[tuple[str, int], tuple[Option, Entry]] = {}
        self._curves: dict[int, tuple[Option, Entry]] = {}
        self._mains: dict[int, str] = {}
        """Keys of rigid bodies by their main nodes. A load on the main node acts on the rigid body."""
        self._read_all(path, "")
        self._engine()
        for option, entry in self._options:
            self._guarded(self._define, option, entry)

    def _read_all(self, path: Path, name: str) -> None:
        deck = Included(path)
        for option in options(deck, name):
            self._read(option)
        self.account.follow("#include", deck.followed)

    def _read(self, option: Option) -> None:
        entry = self.account.open(option.shown, option.line, option.file)
        if option.words[0] == "NODE" or option.words[0] in SOLIDS:
            entry.take("parts[].mesh")
            if option.words[0] in SOLIDS:
                self._solid.add(str(option.number()))
        else:
            self._options.append((option, entry))

    def _engine(self) -> None:
        """Reads the engine file, whose name is made from that of the starter, if the file exists."""
        stem = self.path.stem
        engine = self.path.with_name(f"{stem[:-4]}0001{self.path.suffix}") if stem.endswith("_0000") else None
        if engine is None or not engine.is_file():
            self.account.remarks.append("no engine file (NAME_0001.rad beside NAME_0000.rad) was found")
            return
        self.account.remarks.append(f"the engine file {engine.name} was read")
        self._read_all(engine, engine.name)

    def _guarded(self, do: Callable[[Option, Entry], None], option: Option, entry: Entry) -> None:
        try:
            do(option, entry)
        except (CardError, ValueError) as error:
            entry.refuse(str(error))

    # What the deck defines --------------------------------------------------------------------------------------------

    def _define(self, option: Option, entry: Entry) -> None:
        word = option.words[0]
        if word == "BEGIN":
            self._begin(option, entry)
        elif word == "TITLE" and not option.file:
            self.title = next((text.strip() for _, text in option.rows if text.strip()), "")
            entry.take("title") if self.title else entry.leave("it is empty")
        elif word == "PART":
            self._part(option, entry)
        elif word in ("MAT", "EOS", "FAIL"):
            self._law(option, entry)
        elif word in ("GRNOD", "GRPART", "SURF"):
            once([number for kind, number in self._groups if kind == word], option.number(), f"group /{word}")
            self._groups[word, option.number()] = option, entry
        elif word == "FUNCT":
            self._curves[once(self._curves, option.number(), "function")] = option, entry

    def _begin(self, option: Option, entry: Entry) -> None:
        """Reads title, version, and the units of input and work."""
        rows = [row for row in option.rows if row[1].strip()]
        self.title = self.title or (rows[0][1].strip() if rows else "")
        if len(rows) > 2:
            mass, length, time = cut(rows[2], 20, 20, 20)
            if mass and length and time:
                self.own_units = named(f"{'t' if mass == 'Mg' else mass},{length},{time}")
        entry.take("title")

    def _part(self, option: Option, entry: Entry) -> None:
        title = option.rows[0][1].strip() if option.rows else ""
        fields = Fields(option, entry, option.rows[1:], ("PROP: MAT: SUBSET: THICK",))
        fields.forgive("PROP SUBSET THICK", "sets how elements are integrated, or groups parts")
        number = str(option.number())
        if number not in self._solid:
            fields.whole("MAT")
            entry.leave("the part has no solid element")
            return
        once([body.key for body in self._bodies], number, "part")
        self._bodies.append(Body(number, title, str(fields.whole("MAT")), number, entry))

    def _law(self, option: Option, entry: Entry) -> None:
        kind = materials.NAMES.get(option.words[1], option.words[1]) if len(option.words) > 1 else ""
        if option.local:
            entry.refuse("an option with its own units (unit_ID) is not translated")
        if option.words[0] == "FAIL":
            self._failures[option.number()] = Fields(option, entry, option.rows, materials.LAYOUTS.get(kind, ()))
            if kind != "JOHNSON":
                entry.refuse(REFUSED["FAIL"])
            return
        title = option.rows[0][1].strip() if option.rows else ""
        fields = Fields(option, entry, option.rows[1:], materials.LAYOUTS.get(kind, ("RHO_I",)))
        if option.words[0] == "EOS":
            self._states[option.number()] = fields
            if kind != "GRUNEISEN":
                entry.refuse(REFUSED["EOS"])
        else:
            self._mats[once(self._mats, option.number(), "material")] = kind, fields, title

    def weighed(self) -> Iterator[Weighed]:
        """Densities and Young's moduli of the materials, from which the import finds the units."""
        for number, (_, fields, title) in self._mats.items():
            try:
                young = fields.real("E") or None
                yield Weighed(repr(title) if title else f"material {number}", fields.real("RHO_I"), young)
            except CardError:
                continue

    # The case ---------------------------------------------------------------------------------------------------------

    def draft(self, system: System) -> Draft:
        """Returns the case; ``system``: unit system of the deck."""
        self._draft = draft = Draft(self.path, system, self.account)
        draft.name = draft.name.removesuffix("_0000")
        draft.title = self.title
        names = draft.call(self._bodies, self._solid)
        self._topology = Topology(
            [body.key for body in self._bodies], partial(read_nodes, self.path), partial(read_points, self.path)
        )
        self._make_materials(system)
        for option, entry in self._options:
            self._guarded(self._rigid, option, entry)
        rigid = frozenset(self._mains.values())
        scene = Scene(draft, self._nodes, self._curve, lambda: self._topology.points, rigid, self._end())
        for option, entry in self._options:
            self._guarded(partial(loads.take, scene), option, entry)
        drive(scene, draft, self._topology)
        begin(draft, self._topology, self._bodies, scene.starts)
        for body in self._bodies:
            draft.add_part(body, names)
        walls = stand(draft, self._topology, self._bodies, scene.walls)
        Holding(draft, self._topology, self._bodies).add(scene.holds, walls)
        self._meet(draft)
        for option, entry in self._options:
            if not entry.decided:
                if why := LEFT.get(option.words[0]):
                    entry.leave(why)
                elif why := REFUSED.get(option.words[0]):
                    entry.refuse(why)
        return draft

    def _rigid(self, option: Option, entry: Entry) -> None:
        if option.words[0] == "RBODY" and option.words[1:2] != ["LAGMUL"]:
            found = bodies.rigid(option, entry, self._bodies, self._topology, self._nodes)
            self._mains |= [found] if found else []

    def _make_materials(self, system: System) -> None:
        used = {body.material for body in self._bodies}
        for number, (kind, fields, title) in self._mats.items():
            if str(number) not in used:
                fields.entry.leave("no translated part uses the option")
                continue
            eos, failure = self._states.get(number), self._failures.get(number)
            made = Made({})
            try:
                made = materials.translated(kind, fields, materials.Context(system, eos, failure)) or made
            except CardError as error:
                fields.entry.refuse(str(error))
            self._draft.add_material(str(number), title, made, fields.entry)
            place = (self._draft.material_of(str(number)) or ("?", made))[0]
            for each, key in ((eos, "eos"), (failure, "strength.damage")):
                if each is not None and key.partition(".")[0] in made.material and not each.entry.barred:
                    each.entry.take(f"materials.{place}.{key}")

    def _end(self) -> float:
        for option, entry in self._options:
            if option.words[0] == "RUN":
                row = next((row for row in option.rows if row[1].strip()), None)
                try:
                    end = real(row[0], row[1].split()[0], "T_stop") if row is not None else 0.0
                except CardError as error:
                    entry.refuse(str(error))
                    return float("inf")
                if end > 0.0:
                    self._draft.run["end_time"] = self._draft.quantity(end, TIME)
                    entry.take("run.end_time")
                    return end
                entry.refuse("the line below the option needs an end time above 0")
        self.account.general.append("no engine file has the option /RUN, so run.end_time is unknown")
        return float("inf")

    # Contact ----------------------------------------------------------------------------------------------------------

    def _meet(self, draft: Draft) -> None:
        meetings: list[Meeting] = []
        ties: list[Tie] = []
        for option, entry in self._options:
            if option.words[0] == "INTER" and loads.CONTACTS.intersection(option.words[1:2]):
                try:
                    made = loads.contact(option, entry, self._surface)
                except (CardError, ValueError) as error:
                    entry.refuse(str(error))
                    continue
                if option.words[1] == "TYPE2":
                    ties += [Tie(pair, entry, loads.tied_distance(option, entry)) for pair in sorted(made.pairs())]
                else:
                    meetings.append(made)
        join(draft, self._topology, self._bodies, ties)
        meet(draft, self._bodies, meetings)

    def _surface(self, word: str, number: int, entry: Entry) -> frozenset[str]:
        """Returns the bodies of a surface: ``/SURF/PART``, or a group of nodes. Raises ValueError."""
        if word == "GRNOD":
            full, some = self._topology.whole(self._nodes(number, entry))
            return frozenset((*full, *some))
        found = self._groups.get((word, number))
        if found is None:
            raise ValueError(f"the surface {number} is not defined")
        option, own = found
        if option.words[1] not in ("PART", "MAT") or option.words[1] == "MAT":
            raise ValueError(f"the surface {number} is a /SURF/{option.words[1]}; only /SURF/PART is supported")
        own.take(f"of {entry.keyword}, {entry.place}")
        parts = {str(part) for part in numbers(option.rows[1:], "part")}
        return frozenset(parts & set(self._topology.bodies))

    # What options name ------------------------------------------------------------------------------------------------

    def _nodes(self, number: int, entry: Entry, within: tuple[int, ...] = ()) -> Chosen:
        """Returns a group of nodes; ``within``: groups that contain it. Raises ValueError."""
        if number in within:
            raise ValueError(f"the group of nodes {number} includes itself")
        found = self._groups.get(("GRNOD", number))
        if found is None:
            raise ValueError(f"the group of nodes {number} is not defined")
        option, own = found
        what, kind = f"node group {number}", option.words[1]
        own.take(f"of {entry.keyword}, {entry.place}")
        items = numbers(option.rows[1:], "node")
        if any(item < 0 for item in items):
            raise ValueError(f"the group of nodes {number} removes nodes by negative numbers, which is not supported")
        if kind == "PART":
            return Chosen(what, bodies=frozenset(map(str, items)))
        if kind == "NODE" and items and set(items) <= self._mains.keys():
            return Chosen(what, bodies=frozenset(self._mains[item] for item in items))
        if kind == "NODE" and not self._mains.keys().isdisjoint(items):
            raise ValueError(f"the group of nodes {number} has main nodes of rigid bodies and other nodes")
        if kind == "NODE":
            on = f"nodes:{number}" if ("SURF", number) in self._groups else str(number)
            return Chosen(what, nodes=lambda: set(items), on=on)
        if kind == "GRNOD":
            groups = [self._nodes(item, entry, (*within, number)) for item in items]
            return Chosen(what, nodes=lambda: set().union(*(self._topology.nodes(each) for each in groups)))
        raise ValueError(f"the group of nodes {number} is a /GRNOD/{kind}; only NODE, PART and GRNOD are supported")

    def _curve(self, number: int, entry: Entry) -> tuple[tuple[float, float], ...]:
        """Returns a function by its number, and marks its option as translated. Raises ValueError."""
        if number not in self._curves:
            raise ValueError(f"the function {number} is not defined")
        option, own = self._curves[number]
        own.take(f"of {entry.keyword}, {entry.place}")
        points = []
        for row in option.rows[1:]:
            if row[1].strip():
                fields = Fields(option, own, [row], ("X Y",))
                points.append((fields.real("X"), fields.real("Y")))
        return tuple(points)
