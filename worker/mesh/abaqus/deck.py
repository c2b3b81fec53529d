"""Keywords of an Abaqus input file that define a mesh. Each keyword is read into the part, instance or model to which
it belongs.
"""

from array import array
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from conoid.cases.reading.included import own
from conoid.cases.reading.inp import Block, Source, fields, is_whole, numbers, shortened, whole, wholes

from ...errors import MeshError
from .data import axis, cylindrical, element_rows, numbers_of, translation
from .elements import Kind, element_type
from .keywords import JOINING, MESH, REFUSED, SURFACE, known, needed, options
from .labels import Label, Labelled, label
from .scopes import OWN, ElementSet, Instance, Rows, Scope, Surface

_ROOT = Label("", "")
_NODE_VALUES = 6
"""Largest number of values of a node: coordinates, and components of a normal (Keywords Guide, *NODE)."""


class Deck:
    """Definitions of one file: parts, instances, and definitions outside of parts."""

    def __init__(self, path: Path) -> None:
        """Read all of ``path``. Raises MeshError with the number of a line that cannot be read."""
        self.root = Scope(_ROOT, 0)
        self.parts: Labelled[Scope] = Labelled()
        self.instances: Labelled[Instance] = Labelled()
        self.joining: Counter[str] = Counter()
        """Counts of the keywords that join, hold or remove bodies."""
        self.unread: list[str] = []
        """Names of surfaces that are made neither of elements nor of nodes."""
        self._here: Scope = self.root
        self._assembly = self._step = False
        self._source = Source(path)
        for block in self._source.blocks():
            self._take(block)
        self.files = self._source.included.files
        """The file itself, and the files that it includes."""
        if self._here is not self.root:
            raise MeshError(f"the file ends inside of {_named(self._here)}; is it cut off?")

    def _take(self, block: Block) -> None:
        word = known(block, self._step)
        if word in ("STEP", "ENDSTEP"):
            self._step = word == "STEP"
        if word in REFUSED or (word in MESH and "INPUT" in dict(block.parameters)):
            extra = "" if word in REFUSED else ", INPUT"
            raise MeshError(f"line {block.line}: *{word}{extra} is not supported; write the nodes and elements out")
        if word in JOINING:
            self.joining[word] += 1
        if word == SURFACE:
            self._surface(block)
        reader = _READERS.get(word)
        if reader is not None:
            reader(self, block, options(block, word))

    # Scopes -----------------------------------------------------------------------------------------------------------

    def _part(self, block: Block, found: dict[str, str]) -> None:
        name = label(needed(block, found, "PART", "NAME"))
        if self._here is not self.root or self._assembly:
            raise MeshError(f"line {block.line}: *PART inside of {_named(self._here)}; *END PART is missing")
        if self.parts.get(name) is not None:
            raise MeshError(f"line {block.line}: the part {name.text!r} is defined twice")
        self._here = self.parts.add(name, Scope(name, block.line))

    def _end_part(self, block: Block, found: dict[str, str]) -> None:
        if self._here is self.root or isinstance(self._here, Instance):
            raise MeshError(f"line {block.line}: *END PART without *PART")
        self._here = self.root

    def _start_assembly(self, block: Block, found: dict[str, str]) -> None:
        if self._here is not self.root or self._assembly:
            raise MeshError(f"line {block.line}: *ASSEMBLY inside of {_named(self._here)}")
        self._assembly = True

    def _end_assembly(self, block: Block, found: dict[str, str]) -> None:
        if self._here is not self.root or not self._assembly:
            raise MeshError(f"line {block.line}: *END ASSEMBLY without *ASSEMBLY, or before *END INSTANCE")
        self._assembly = False

    def _instance(self, block: Block, found: dict[str, str]) -> None:
        name, wanted = (label(needed(block, found, "INSTANCE", word)) for word in ("NAME", "PART"))
        part = self.parts.get(wanted)
        if part is None:
            names = ", ".join(each.text for each, _ in self.parts) or "none"
            raise MeshError(
                f"line {block.line}: instance {name.text!r} of the unknown part {wanted.text!r}; known: {names}"
            )
        if self._here is not self.root:
            raise MeshError(f"line {block.line}: *INSTANCE inside of {_named(self._here)}")
        if self.instances.get(name) is not None:
            raise MeshError(f"line {block.line}: the instance {name.text!r} is defined twice")
        move, axis = self._placing()
        self._here = self.instances.add(name, Instance(name, block.line, part=part, move=move, axis=axis))

    def _placing(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the two data lines of *INSTANCE: a translation, then an axis with an angle. Each of the two data lines
        may be empty.
        """
        lines = list(self._source.data())
        while lines and not lines[-1][1].strip():
            lines.pop()
        if len(lines) > 2:
            raise MeshError(f"line {lines[2][0]}: *INSTANCE has two data lines at most")
        return translation(*lines[0]) if lines else (0.0, 0.0, 0.0), axis(*lines[1]) if lines[1:] else ()

    def _end_instance(self, block: Block, found: dict[str, str]) -> None:
        here = self._here
        if not isinstance(here, Instance):
            raise MeshError(f"line {block.line}: *END INSTANCE without *INSTANCE")
        if not here.empty and not here.part.empty:
            raise MeshError(f"line {block.line}: {_named(here)} has a mesh of its own, and its part also has a mesh")
        self._here = self.root

    # Mesh -------------------------------------------------------------------------------------------------------------

    def _node(self, block: Block, found: dict[str, str]) -> None:
        system = found.get("SYSTEM", "R").upper()
        if system not in ("R", "C"):
            raise MeshError(f"line {block.line}: *NODE, SYSTEM={system} is not read; allowed: R, C")
        here, made = self._here, array("q")
        for number, text in self._source.filled():
            first, _, rest = text.partition(",")
            values = numbers(number, rest)
            if len(values) > _NODE_VALUES:
                raise MeshError(f"line {number}: a node has up to {_NODE_VALUES} values; found {len(values)}")
            point = [*values, 0.0, 0.0, 0.0][:3]
            made.append(whole(number, first))
            here.points.extend(point if system == "R" else cylindrical(*point))
        here.nodes.extend(made)
        if "NSET" in found:
            here.named_set(label(found["NSET"]), here.node_sets).add(OWN, made)

    def _element(self, block: Block, found: dict[str, str]) -> None:
        kind = element_type(needed(block, found, "ELEMENT", "TYPE"))
        here, made = self._here, Rows()
        known = kind.kind is Kind.SOLID or kind.corners is not None
        for line, items in element_rows(self._source.filled(), kind):
            row = wholes(line, items if known else items[:1])
            made.numbers.append(row[0])
            made.nodes.extend(row[1 : 1 + (kind.corners or len(row))])
            made.lines.append(own(line))
        if kind.kind is Kind.SOLID:
            here.solids.setdefault(kind, Rows()).extend(made)
        elif made.numbers:
            here.others.setdefault(kind, array("q")).extend(made.numbers)
            if known:
                here.plates.setdefault(kind, Rows()).extend(made)
        if "ELSET" in found:
            here.named_set(label(found["ELSET"])).add(OWN, made.numbers)

    # Sets -------------------------------------------------------------------------------------------------------------

    def _elset(self, block: Block, found: dict[str, str]) -> None:
        name = label(needed(block, found, "ELSET", "ELSET"))
        self._fill(block, found, self._here.named_set(name), of_nodes=False)

    def _nset(self, block: Block, found: dict[str, str]) -> None:
        name = label(needed(block, found, "NSET", "NSET"))
        one = self._here.named_set(name, self._here.node_sets)
        if "ELSET" in found:
            self._here.node_sets_of.append((one, label(found["ELSET"]), block.line))
        else:
            self._fill(block, found, one, of_nodes=True)

    def _fill(self, block: Block, found: dict[str, str], one: ElementSet, of_nodes: bool) -> None:
        instance = self._instance_of(block, found)
        owner = OWN if instance is None else instance.name.key
        for number, text in self._source.filled():
            items = [item for item in fields(text) if item]
            if "GENERATE" in found:
                one.add(owner, numbers_of(number, text))
            elif all(map(is_whole, items)):
                one.add(owner, array("q", wholes(number, items)))
            else:
                for item in items:
                    self._member(one, instance, item, number, of_nodes)

    def _instance_of(self, block: Block, found: dict[str, str]) -> Instance | None:
        if "INSTANCE" not in found:
            return None
        instance = self.instances.get(label(found["INSTANCE"]))
        if instance is None or self._here is not self.root:
            names = ", ".join(each.text for each, _ in self.instances) or "none"
            raise MeshError(
                f"line {block.line}: *{block.word} of the unknown instance {found['INSTANCE']!r}; known: {names}"
            )
        return instance

    def _member(self, one: ElementSet, instance: Instance | None, item: str, line: int, of_nodes: bool) -> None:
        """Add members to a set. A member of a set of elements is an element or a set of elements, of this scope or of
        an instance. Members of a set of nodes are nodes.
        """
        owner = OWN if instance is None else instance.name.key
        if is_whole(item):
            one.add(owner, array("q", [whole(line, item)]))
            return
        here = self._here.node_sets if of_nodes else self._here.sets
        other = here.get(label(item)) if instance is None else instance.set_named(label(item), of_nodes)
        if other is None and instance is None and isinstance(self._here, Instance):
            other = self._here.set_named(label(item), of_nodes)
        if other is one:
            raise MeshError(f"line {line}: the set {label(item).text!r} has itself among its members")
        if other is not None:
            one.include(other, owner)
            return
        place, rest = self._qualified(item)
        if place is not None and is_whole(rest):
            one.add(place.name.key, array("q", [whole(line, rest)]))
        elif place is not None and (other := place.set_named(label(rest), of_nodes)) is not None:
            one.include(other, place.name.key)
        else:
            what = "node and no node set" if of_nodes else "element and no element set"
            raise MeshError(f"line {line}: {shortened(item)} is no {what} that is defined above")

    def _surface(self, block: Block) -> None:
        """Store a surface as it is written in the file. The file may define the elements of the surface at a later
        place.
        """
        found = dict(block.parameters)
        kind, name = (found.get("TYPE") or "ELEMENT").upper(), found.get("NAME")
        if name is None or "COMBINE" in found or kind not in ("ELEMENT", "NODE"):
            self.unread.append(label(name or "?").text)
            return
        rows = [(number, [*fields(text), ""]) for number, text in self._source.filled()]
        self._here.surfaces.append(Surface(label(name), block.line, kind == "NODE", rows))

    def _qualified(self, item: str) -> tuple[Instance | None, str]:
        """Return the instance and the rest of a qualified name, such as ``Bar-1.5`` or ``Bar-1.Set-1``, in the scope of
        the assembly.
        """
        if self._here is self.root:
            for at in (i for i, sign in enumerate(item) if sign == "."):
                start, rest = item[:at], item[at + 1 :]
                if start.startswith('"') and not start.endswith('"'):
                    start, rest = f'{start}"', f'"{rest}'
                found = self.instances.get(label(start))
                if found is not None:
                    return found, rest
        return None, item


_READERS: dict[str, Callable[[Deck, Block, dict[str, str]], None]] = {
    "PART": Deck._part,
    "ENDPART": Deck._end_part,
    "ASSEMBLY": Deck._start_assembly,
    "ENDASSEMBLY": Deck._end_assembly,
    "INSTANCE": Deck._instance,
    "ENDINSTANCE": Deck._end_instance,
    "NODE": Deck._node,
    "ELEMENT": Deck._element,
    "ELSET": Deck._elset,
    "NSET": Deck._nset,
}


def _named(scope: Scope) -> str:
    """Return the name of a scope for messages: ``the part 'Bar' (line 7)``."""
    if not scope.line:
        return "the assembly"
    kind = "instance" if isinstance(scope, Instance) else "part"
    return f"the {kind} {scope.name.text!r} (line {scope.line})"
