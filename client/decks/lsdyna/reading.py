"""Import of an LS-DYNA keyword deck as a case."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

from conoid.cases.reading.cards import Block, CardError, Deck

from ..account import Account, Entry, once
from ..bonds import Tie, join
from ..contacts import Meeting, meet
from ..draft import Body, Draft, Made
from ..holds import Hold, Holding
from ..start import begin
from ..topology import Topology
from ..units import TIME, System, Weighed
from ..walls import stand
from . import control, loads, materials, sets
from .elasticity import Context
from .fields import Fields, numbers
from .layouts import LAYOUTS, NUMBERS
from .mesh import held_of, parts_of, read_nodes, read_points
from .named import Numbered
from .scene import Scene
from .words import LEFT, REFUSED, SWITCHED, SWITCHES, reason

_MESH = ("NODE", "ELEMENT_SOLID")
_SETS = frozenset({"TITLE", "LIST", "GENERATE", "GENERAL", "ADD", "COLUMN", "COLLECT", "ADVANCED", "INTERSECT"})


class LsDyna:
    """Reader of a deck: its keywords and their translation to a case."""

    kind = "LS-DYNA keyword deck"

    def __init__(self, path: Path) -> None:
        """Reads a deck, ``path``, and the files that it includes. Raises CardError, OSError."""
        self.path, self.account = path, Account()
        self._blocks: list[tuple[Block, Entry]] = []
        self._solid: set[str] = set()
        self._held: list[tuple[int, set[int], Entry]] = []
        deck = Deck(path)
        for block in deck.blocks():
            entry = self._open(block)
            if block.name == "ELEMENT_SOLID":
                self._solid |= parts_of(block)
            elif block.name == "NODE":
                for code, nodes in held_of(block).items():
                    self._held.append((code, nodes, entry))
            else:
                self._blocks.append((block, entry))
        for block in deck.followed:
            self._open(block)
        if not deck.ended:
            self.account.remarks.append("the deck has no *END: it may be cut off")
        self._numbered = Numbered()
        self._materials: dict[int, tuple[str, Fields, str]] = {}
        self._states: dict[int, Fields] = {}
        self._eroding: dict[int, Fields] = {}
        self._bodies: list[Body] = []
        self.title = ""
        for block, entry in self._blocks:
            self._guarded(self._define, block, entry)

    own_units: System | None = None

    def _open(self, block: Block) -> Entry:
        entry = self.account.open(f"*{block.name}", block.number, block.file)
        if block.name in _MESH:
            entry.take("parts[].mesh")
        elif why := reason(block.name, LEFT):
            entry.leave(why)
        return entry

    def _guarded(self, do: object, block: Block, entry: Entry) -> None:
        """Translates a keyword. If the keyword cannot be read, it refuses the import, with its line."""
        try:
            do(block, entry)  # type: ignore[operator]
        except (CardError, ValueError) as error:
            entry.refuse(str(error))

    # What the deck defines --------------------------------------------------------------------------------------------

    def _define(self, block: Block, entry: Entry) -> None:
        name, options = block.parted({"TITLE", "ID"})
        plain = NUMBERS.get(name, name)
        if plain in LAYOUTS:
            title, cards = sets.titled(block, options)
            fields = Fields(block, entry, cards, LAYOUTS[plain])
            if plain.startswith("EOS"):
                self._states[once(self._states, fields.whole("EOSID"), "equation of state")] = fields
            else:
                self._materials[once(self._materials, fields.whole("MID"), "material")] = plain, fields, title
        elif name == "MAT_ADD_EROSION":
            layout = (
                "MID EXCL MXPRES MNEPS EFFEPS VOLEPS NUMFIP NCS",
                "MNPRES SIGP1 SIGVM MXEPS EPSSH SIGTH IMPULSE FAILTM",
            )
            fields = Fields(block, entry, sets.titled(block, options)[1], layout)
            self._eroding[fields.whole("MID")] = fields
        elif name.startswith("MAT_"):
            card = sets.titled(block, options)[1][:1]
            fields = Fields(block, entry, card, ("MID RO",))
            number = once(self._materials, fields.whole("MID"), "material")
            self._materials[number] = plain, fields, sets.titled(block, options)[0]
        elif name.startswith(("SET_NODE", "SET_SEGMENT", "SET_PART")):
            self._set(block, entry)
        elif name == "DEFINE_CURVE":
            number, curve = sets.curve(block, options, entry)
            self._numbered.curves[once(self._numbered.curves, number, "curve")] = curve, entry
        elif block.name in ("PART", "PART_CONTACT"):
            self._parts(block, entry)
        elif name == "TITLE" or block.name == "TITLE":
            self.title = next((card.text.strip() for card in block.filled()), "")
            entry.take("title") if self.title else entry.leave("it is empty")

    def _set(self, block: Block, entry: Entry) -> None:
        name, options = block.parted(_SETS)
        if name == "SET_NODE":
            found = sets.node_set(block, options, entry)
            self._numbered.node_sets[once(self._numbered.node_sets, found.number, "node set")] = found
        elif name == "SET_SEGMENT":
            found = sets.segment_set(block, options, entry)
            self._numbered.segments[once(self._numbered.segments, found.number, "set of segments")] = found
        elif name == "SET_PART" and not options - {"LIST", "TITLE"}:
            cards = sets.titled(block, options)[1]
            number = once(self._numbered.part_sets, Fields(block, entry, cards, ("SID",)).whole("SID"), "part set")
            self._numbered.part_sets[number] = set(numbers(block, cards[1:], "pid")), entry
        else:
            entry.refuse(f"*{block.name} is not supported")

    def _parts(self, block: Block, entry: Entry) -> None:
        cards, step = list(block.cards), 3 if block.name == "PART_CONTACT" else 2
        while cards and not cards[-1].text.strip():
            cards.pop()
        for title, card in zip(cards[::step], cards[1::step], strict=False):
            fields = Fields(block, entry, [card], ("PID SECID MID EOSID HGID GRAV ADPOPT TMID",))
            number = str(fields.whole("PID"))
            fields.forgive("SECID HGID ADPOPT", "how elements are integrated")
            fields.refuse("GRAV TMID", "settings of preloaded gravity and of conduction of heat")
            eos = fields.whole("EOSID")
            if number not in self._solid:
                fields.whole("MID")
                entry.remark("left", f"part {number}", "the part has no solid element")
                continue
            once([body.key for body in self._bodies], number, "part")
            material = f"{fields.whole('MID')}/{eos}" if eos else str(fields.whole("MID"))
            self._bodies.append(Body(number, title.text.strip(), material, number, entry))
        if len(cards) < 2:
            raise block.error(None, "a *PART needs a title and a card with numbers")
        if not any(body.entry is entry for body in self._bodies):
            entry.leave("the part has no solid element")

    def weighed(self) -> Iterator[Weighed]:
        """Densities and Young's moduli of the materials, from which the import finds the units."""
        for number, (name, fields, title) in self._materials.items():
            shown = f"{title!r}" if title else f"material {number}"
            try:
                yield Weighed(shown, *materials.weighed(name, fields))
            except (CardError, ValueError):
                continue

    # The case ---------------------------------------------------------------------------------------------------------

    def draft(self, system: System) -> Draft:
        """Returns the case; ``system``: unit system of the deck."""
        self._draft = Draft(self.path, system, self.account)
        self._draft.title = self.title
        names = self._draft.call(self._bodies, self._solid)
        self._topology = Topology(
            [body.key for body in self._bodies], partial(read_nodes, self.path), partial(read_points, self.path)
        )
        self._make_materials(system)
        end, named = self._end(), self._numbered
        named.topology = self._topology
        self._scene = Scene(self._draft, named.nodes, named.part_set, named.part, named.group, named.curve, end)
        self._meetings: list[Meeting] = []
        self._ties: list[Tie] = []
        for block, entry in self._blocks:
            self._guarded(self._load, block, entry)
        loads.hold_nodes(self._scene, self._held)
        for body in self._bodies:
            found = self._draft.material_of(body.material)
            if found is not None and found[1].held:
                entry = self._materials[int(body.material.partition("/")[0])][1].entry
                held = dict.fromkeys(found[1].held, 0.0)
                self._scene.holds.append(Hold(named.part(int(body.key)), entry, held, still="xyz"))
        begin(self._draft, self._topology, self._bodies, self._scene.starts)
        for body in self._bodies:
            self._draft.add_part(body, names)
        walls = stand(self._draft, self._topology, self._bodies, self._scene.walls)
        Holding(self._draft, self._topology, self._bodies).add(self._scene.holds, walls)
        meet(self._draft, self._bodies, self._meetings)
        join(self._draft, self._topology, self._bodies, self._ties)
        self._leave_rest()
        return self._draft

    def _make_materials(self, system: System) -> None:
        curves = {number: points for number, (points, _) in self._numbered.curves.items()}
        used = {body.material for body in self._bodies}
        for key in sorted(used):
            number, _, eos = key.partition("/")
            found = self._materials.get(int(number))
            if found is None:
                continue
            name, fields, title = found
            state = self._states.get(int(eos)) if eos else None
            context = Context(system, state, curves)
            made = Made({})
            try:
                made = materials.translated(name, fields, context) or made
            except (CardError, ValueError) as error:
                fields.entry.refuse(str(error))
            if fields.given("LCSS"):
                self._numbered.curves.get(fields.whole("LCSS"), ((), fields.entry))[1].take("materials")
            materials.erode(self._eroding.get(int(number)) or self._eroding.get(0), made)
            label = title or next(body.title for body in self._bodies if body.material == key)
            self._draft.add_material(key, label, made, fields.entry)
            if state is not None and made.material and not state.entry.reasons:
                state.entry.take(f"materials.{(self._draft.material_of(key) or ('?', made))[0]}.eos")

    def _load(self, block: Block, entry: Entry) -> None:
        name = block.name
        for base, (handler, allowed) in loads.HANDLERS.items():
            found, options = block.parted(allowed)
            if found == base and (options or not allowed or base.startswith("RIGIDWALL")):
                handler(self._scene, block, options, entry)
                return
        base, options = block.parted(control.OPTIONS)
        if base in control.SINGLE | control.DOUBLE:
            self._meetings.append(control.contact(block, base, options, entry, self._numbered.surface))
        elif (tied := block.parted(control.OPTIONS | control.OFFSETS))[0] in control.TIED:
            self._ties += control.tied(block, *tied, entry, self._numbered.surface)
        elif name == "CONTROL_TIMESTEP":
            control.time_step(self._draft, block, entry)
        elif name == "DATABASE_BINARY_D3PLOT":
            entry.reasons.clear()
            control.pictures(self._draft, block, entry, self._scene.end)
        elif name in SWITCHES:
            control.switch(block, entry)
        elif name.startswith("SECTION_SOLID"):
            control.section(block, frozenset(name.split("_")), entry)
        elif not entry.decided and name not in ("CONTROL_TERMINATION",) and not name.startswith(("SET_", "DEFINE_C")):
            self._unknown(name, entry)

    def _unknown(self, name: str, entry: Entry) -> None:
        plain = NUMBERS.get(name.removesuffix("_TITLE"), name.removesuffix("_TITLE"))
        if plain in LAYOUTS or name.startswith("MAT_"):
            entry.leave("no translated part uses the keyword")
        elif why := reason(name, SWITCHED):
            entry.leave(why)
        elif why := reason(name, REFUSED):
            entry.refuse(why)

    def _end(self) -> float:
        found = [(block, entry) for block, entry in self._blocks if block.name == "CONTROL_TERMINATION"]
        for _, entry in found[1:]:
            entry.refuse("the end of the run is given twice")
        for block, entry in found[:1]:
            try:
                end = control.termination(block, entry)
                self._draft.run["end_time"] = self._draft.quantity(end, TIME)
                return end
            except (CardError, ValueError) as error:
                entry.refuse(str(error))
        if not found:
            self.account.general.append("the deck has no *CONTROL_TERMINATION, so run.end_time is unknown")
        return float("inf")

    def _leave_rest(self) -> None:
        self._numbered.leave_rest()
        for fields in (*self._eroding.values(), *self._states.values()):
            if not fields.entry.decided:
                fields.entry.leave("no translated part uses the keyword")
