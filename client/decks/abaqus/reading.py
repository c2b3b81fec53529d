"""Import of an Abaqus/Explicit input file as a case."""

from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path

from conoid.cases.reading.inp import Block, InpError, Source, numbers

from ..account import Account, Entry
from ..bonds import join
from ..contacts import meet
from ..draft import Body, Draft, Made
from ..holds import Holding
from ..naming import Names
from ..start import begin
from ..topology import Chosen, Topology
from ..units import System, Weighed
from .keyword import Keyword, joined
from .loads import Loads
from .materials import Heat, Material, weighed
from .meetings import Meetings
from .mesh import AbaqusMesh
from .pressure import Pressures
from .surfaces import Surfaces
from .words import LEFT, MATERIAL, REFUSED, spelt

_MESH = ("NODE", "ELEMENT")


class Abaqus:
    """Reader of an input file: its keywords and their translation to a case."""

    kind = "Abaqus/Explicit input file"
    own_units: System | None = None

    def __init__(self, path: Path) -> None:
        """Reads all of ``path``. Raises InpError, OSError."""
        self.path, self.account = path, Account()
        self.keywords: list[Keyword] = []
        self._scope, self._material, self._step = "", "", 0
        self._steps = 0
        self._references: dict[int, set[str]] = {}
        """Reference nodes of rigid bodies, and the keys of these: a load on the node acts on the body."""
        self._source = Source(path)
        for block in self._source.blocks():
            self._take(block)
        self.account.follow("*INCLUDE", self._source.included.followed)
        self.instances = {each.key("NAME"): each for each in self.of("INSTANCE")}

    def of(self, *words: str) -> list[Keyword]:
        """Returns the keywords of these words, in order."""
        return [each for each in self.keywords if each.word in words]

    def _take(self, block: Block) -> None:
        word = spelt(block.word)
        entry = self.account.open(f"*{word}", int(block.line), getattr(block.line, "file", ""))
        if word not in MATERIAL:
            self._material = ""
        rows = [] if word in _MESH else list(self._source.data())
        made = Keyword(word, block.line, dict(block.parameters), rows, entry, self._scope, self._material, self._step)
        if word in ("PART", "INSTANCE"):
            self._scope = made.scope = made.key("NAME")
        elif word in ("END PART", "END INSTANCE"):
            self._scope = ""
        elif word == "MATERIAL":
            self._material = made.material = made.key("NAME")
        elif word == "STEP":
            self._steps += 1
            self._step = made.step = self._steps
        elif word == "END STEP":
            self._step = 0
        if word in _MESH:
            entry.take("parts[].mesh")
        self.keywords.append(made)

    def weighed(self) -> Iterator[Weighed]:
        """Densities of the materials, from which the units are found."""
        for head in self.of("MATERIAL"):
            found = weighed(head.get("NAME") or "material", self._below(head))
            if found is not None:
                yield found

    def _below(self, head: Keyword) -> list[Keyword]:
        return [each for each in self.keywords if each.material == head.material and each.word != "MATERIAL"]

    # The case ---------------------------------------------------------------------------------------------------------

    def draft(self, system: System) -> Draft:
        """Returns the case; ``system``: unit system of the deck."""
        self._draft = Draft(self.path, system, self.account)
        self._heading()
        bodies = list(self._bodies())
        names = Names()
        for body in bodies:
            body.name = names.give(body.title, "part", body.key)
        self.topology = Topology([body.key for body in bodies], self._nodes_of, lambda: self.mesh.points())
        loads = Loads(self._draft, self.of("AMPLITUDE"), self.chosen)
        end = loads.end(self.of("STEP"), self.of("DYNAMIC"))
        self._make_materials(system, bodies, loads.adiabatic)
        self._rigid(bodies)
        surfaces = Surfaces(self.of("SURFACE"), self.of("ELSET"), lambda: self.mesh, self.topology)
        pressures = Pressures(self._draft, loads.course, surfaces.bodies, bodies)
        for each in self.keywords:
            self._guarded(loads.take if each.word != "DSLOAD" else pressures.take, each, end)
        loads.temperatures(bodies, self.topology, self._zero())
        begin(self._draft, self.topology, bodies, loads.starts)
        for body in bodies:
            self._draft.add_part(body, names)
        Holding(self._draft, self.topology, bodies).add(loads.holds, [])
        meetings = Meetings(self.keywords, bodies, surfaces.bodies)
        meet(self._draft, bodies, meetings.made)
        join(self._draft, self.topology, bodies, meetings.ties)
        self._leave_rest()
        return self._draft

    def _heading(self) -> None:
        for each in self.of("HEADING"):
            text = " ".join(text.strip() for _, text in each.filled())
            each.entry.take("title") if text else each.entry.leave("it is empty")
            self._draft.title = self._draft.title or text

    def _zero(self) -> float:
        """Returns the absolute zero of temperatures: 0 if the deck gives none."""
        named = [each for each in self.of("PHYSICAL CONSTANTS") if each.has("ABSOLUTE ZERO")]
        found = [each.get("ABSOLUTE ZERO") for each in named]
        for each in named:
            each.entry.take("parts[].temperature")
        return numbers(named[0].line, found[0] or "0")[0] if named else 0.0

    def _make_materials(self, system: System, bodies: list[Body], adiabatic: bool) -> None:
        used = {body.material for body in bodies}
        for head in self.of("MATERIAL"):
            head.forgive("RTOL, SRATE FACTOR", "how the other code reads tables")
            if head.material not in used:
                for each in (head, *self._below(head)):
                    each.entry.leave("no part that is translated has it")
                continue
            made = Made({})
            try:
                material = Material(head, self._below(head), system, Heat(adiabatic, self._zero()))
                made = material.made()
            except (InpError, ValueError, ZeroDivisionError) as error:
                head.entry.refuse(f"its constants cannot be used: {error}")
                for each in self._below(head):
                    if not each.entry.decided:
                        each.entry.leave("its material is not translated")
            self._draft.add_material(head.material, head.get("NAME") or "", made, head.entry)
            if made.material:
                material.taken(f"materials.{(self._draft.material_of(head.material) or ('?', made))[0]}")

    def _bodies(self) -> Iterator[Body]:
        """Makes a body for each section of solids, in each instance of its part."""
        sections = self.of("SOLID SECTION")
        for section in sections:
            section.forgive("CONTROLS, ORIENTATION", "how elements are integrated")
            elset, material = section.key("ELSET"), section.key("MATERIAL")
            shown = section.get("ELSET") or ""
            section.rest()
            for each in self.of("ELSET"):
                if each.scope == section.scope and each.key("ELSET") == elset:
                    each.entry.take(f"of {section.entry.keyword}, {section.entry.place}")
            alone = sum(each.scope == section.scope for each in sections) == 1
            if section.scope and self.instances and section.scope not in self.instances:
                for name, instance in self.instances.items():
                    if instance.key("PART") == section.scope:
                        label = instance.get("NAME") or name
                        title = label if alone else f"{label}_{shown}"
                        yield Body(f"{name}|{elset}", title, material, f"{label}.{shown}", section.entry)
                        instance.entry.take("parts[].mesh")
            else:
                group = f"{section.scope}.{shown}" if section.scope else shown
                yield Body(f"{section.scope}|{elset}", shown, material, group, section.entry)

    def _rigid(self, bodies: list[Body]) -> None:
        """Reads ``*RIGID BODY, ELSET=``: the bodies whose section has the named set become rigid."""
        for each in self.of("RIGID BODY"):
            wanted = self._of_elements(each)
            found = [body for body in bodies if body.key in wanted]
            if not found:
                each.entry.refuse(REFUSED["RIGID BODY"])
                continue
            each.forgive("POSITION", "where the other code puts the reference node")
            for body in found:
                for number in self._reference(each, body):
                    self._references.setdefault(number, set()).add(body.key)
            each.rest()
            for body in found:
                body.rigid = True
            each.entry.take("parts[].rigid")

    def _reference(self, each: Keyword, body: Body) -> set[int]:
        """Returns the reference node of a rigid body: a number or a set of its instance, or of the whole deck."""
        name, owner = each.get("REF NODE") or "", body.key.partition("|")[0]
        shown = f"{owner}.{name}" if each.scope and owner in self.instances else name
        return (self.mesh.named(shown, "node_sets") or set()) if name else set()

    def _owners(self, scope: str) -> set[str]:
        """Returns a part or an instance, and the instances of the part."""
        return {scope, *(one for one, made in self.instances.items() if made.key("PART") == scope)}

    def _of_elements(self, each: Keyword) -> set[str]:
        """Returns the keys of the bodies whose elements all lie in a set. No keys are returned if the set also has
        other elements or only some elements of a body.
        """
        name = each.get("ELSET") or ""
        if each.scope:
            return {f"{owner}|{joined(name)}" for owner in self._owners(each.scope)}
        wanted = self.mesh.named(name, "element_sets") or set()
        parts = {key: self.mesh.body(*key.split("|"))[0] for key in self.topology.bodies}
        found = {key for key, elements in parts.items() if elements and elements <= wanted}
        return found if wanted == set().union(*(parts[key] for key in found)) else set()

    def _guarded(self, take: Callable[[Keyword, float], None], each: Keyword, end: float) -> None:
        try:
            take(each, end)
        except (InpError, ValueError) as error:
            each.entry.refuse(str(error))

    def _leave_rest(self) -> None:
        for each in self.keywords:
            if each.entry.decided:
                continue
            if each.word in ("PART", "INSTANCE", "ASSEMBLY"):
                each.entry.take("parts[].mesh")
            elif why := LEFT.get(each.word):
                each.entry.leave(why)
            elif why := REFUSED.get(each.word):
                each.entry.refuse(why)
            elif each.word in MATERIAL:
                each.entry.refuse("the keyword is not below a translated material")

    # What keywords name -----------------------------------------------------------------------------------------------

    @cached_property
    def mesh(self) -> AbaqusMesh:
        """Nodes, elements and sets of the deck, read at the first use."""
        return AbaqusMesh(self.path)

    def _nodes_of(self) -> dict[str, set[int]]:
        pairs = {key: key.partition("|") for key in self.topology.bodies}
        return {key: self.mesh.body(scope, elset)[1] for key, (scope, _, elset) in pairs.items()}

    def chosen(self, name: str, entry: Entry) -> Chosen:
        """Returns the node set or the node that a data line names, and marks the keyword of the set as read."""
        plain, _, last = name.strip().strip('"').rpartition(".")
        for each in self.of("NSET"):
            if each.key("NSET") == joined(last) and (not plain or joined(plain) in self._scopes(each)):
                each.entry.take(f"of {entry.keyword}, {entry.place}")

        def nodes() -> set[int]:
            found = self.mesh.named(name, "node_sets")
            if found is None:
                raise InpError(f"{entry.place}: the node set {name[:60]!r} is not defined")
            return found

        if self._references and not self._references.keys().isdisjoint(nodes()):
            return self._rigid_bodies(name, nodes())
        on = None if name.strip().isdigit() else name.strip().strip('"')
        if on is not None and any(each.key("NAME") == joined(last) for each in self.of("SURFACE")):
            on = f"nodes:{on}"
        return Chosen(f"node set {name}", nodes=nodes, on=on)

    def _rigid_bodies(self, name: str, nodes: set[int]) -> Chosen:
        """Returns the rigid bodies whose reference nodes are in a set. Raises InpError for other nodes in it."""
        keys = set[str]().union(*(self._references.get(node, ()) for node in nodes))
        if not nodes <= self._references.keys() | set[int]().union(*(self.topology.of[key] for key in keys)):
            raise InpError(f"the node set {name[:60]!r} has reference nodes of rigid bodies and other nodes")
        return Chosen(f"node set {name}", bodies=frozenset(keys))

    def _scopes(self, each: Keyword) -> set[str]:
        """Returns the instances in which a keyword can define a set."""
        if each.scope in self.instances:
            return {each.scope}
        return {name for name, one in self.instances.items() if one.key("PART") == each.scope} | {each.key("INSTANCE")}
