"""Definitions of a starter deck: nodes, volume elements, parts, subsets, groups of nodes and surfaces."""

from array import array
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from conoid.cases.reading.included import Included, own

from ...errors import MeshError
from .lines import REAL, Block, blocks, number, point, wholes


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


SOLIDS = {"BRICK": 8, "TETRA4": 4, "TETRA10": 10, "PENTA6": 6, "BRIC20": 20}
"""Volume elements that are read, with the number of their nodes (Reference Guide, "Elements")."""
NODES_A_LINE = {"TETRA10": 10, "BRIC20": 8}
"""Number of nodes in one line, for elements that take several lines. The nodes of a tet are in the line that follows
the number of the tet."""
VOLUMES = ("SHEL16", "SPHCEL", "QUAD", "TRIA")
"""Keywords of volume elements or particles that are not read."""
PLATES = ("SHELL", "SH3N", "BEAM", "TRUSS", "SPRING", "XELEM", "RIVET")
"""Keywords of elements without volume."""
REFUSED = ("TRANSFORM", "CNODE", "MERGE", "SUBMODEL", "ADMESH", "MADYMO", "XREF", "REFSTA", "EREF", "INISTA")
"""Keywords that make, move or join nodes and elements, or read their state from a file. The reader does not support
keywords that change nodes or elements."""
JOINING = ("INTER", "RBODY", "RBE2", "RBE3", "RWALL", "RLINK", "MPC", "GJOINT", "CYL_JOINT", "BCS", "ADMAS", "LAG_MUL")
"""Keywords that join or hold bodies, or give them mass. Keywords that join or hold bodies have no effect on the
mesh."""
GROUPS = ("GRNOD", "SURF")
"""First words of the keywords of groups of nodes and of surfaces."""
FAMILIES = _words(
    """
    ACCEL ACTIV ADYREL ALE AMS ANALY ANIM ARCH BEGIN BEM BOX CAA CLOAD CLUSTER CONVEC DAMP DEFAULT DEF_INTER DEF_SHELL
    DEF_SOLID DFS DRAPE DT EBCS EIG EOS ESOUND EULER FAIL FLUX FORCE FRAME FRIC FRICTION FUNCT FUNC_2D FXB FXINP GAUGE
    GRAV GRBEAM GRBRIC GRPART GRQUAD GRSH3N GRSHEL GRSPRI GRTRIA GRTRUS HEAT IMPACC IMPDISP IMPFLUX IMPLICIT IMPTEMP
    IMPVEL INICRACK INIBEAM INIBRI INIMAP1D INIMAP2D INIQUA INISH3 INISHE INISPRI INITEMP INITRUSS INIVEL INIVOL
    INJECTOR INTTHICK IOFLAG KEY LASER LEAK LEVSET LINE LOAD MAT MEMORY MONVOL MOVE_FUNCT NBCS NLOCAL NONLOCAL PARAMETER
    PBLAST PERTURB PLOAD PLY PRELOAD PRINT PROP RADIATION RANDOM SECT SENSOR SKEW SLIPRING SPHBCS SPHGLO SPMD STACK
    STAMPING STATE TABLE TH THERM_STRESS TITLE UNIT UPWIND USERW VEL VERS VISC
    """
)
"""First words of known keywords. A keyword that is not listed is an error, because it could make or move nodes."""


@dataclass
class Solids:
    """Elements of one kind."""

    numbers: "array[int]" = field(default_factory=lambda: array("q"))
    parts: "array[int]" = field(default_factory=lambda: array("q"))
    nodes: "array[int]" = field(default_factory=lambda: array("q"))
    lines: "array[int]" = field(default_factory=lambda: array("q"))


@dataclass
class Group:
    """Group of nodes or surface, as the deck defines it: ``kind`` (for example ``GRNOD/NODE``) and the numbers in its
    lines.
    """

    kind: str
    title: str
    rows: list[tuple[int, list[int]]]


class Deck:
    """Contents of a deck."""

    def __init__(self, path: Path) -> None:
        """Read the deck. Raises MeshError with a line that cannot be read."""
        self.nodes, self.points = array("q"), array("d")
        self.solids: dict[str, Solids] = {}
        self.titles: dict[int, str] = {}
        """Dictionary from the numbers of the parts to their titles."""
        self.subset_of: dict[int, int] = {}
        """Number of the subset of each part."""
        self.subsets: dict[int, tuple[str, list[int]]] = {}
        """Title of each subset, and the numbers of the subsets that it contains."""
        self.groups: dict[tuple[str, int], Group] = {}
        """Groups of a deck; the key of a group is its first word and its number."""
        self.passed, self.volumes, self.joining = Counter[str](), Counter[str](), Counter[str]()
        """Two counts for each first word: of lines of elements that are not read, and of keywords that join bodies."""
        self.included = Included(path)
        """Paths of the deck and of the files that it includes."""
        self.length = ""
        """Unit of length that the block ``/BEGIN`` gives; empty if the block gives no unit."""
        for block in blocks(self.included):
            self._take(block)

    def _take(self, block: Block) -> None:
        word = block.words[0]
        if word in SOLIDS:
            self._solid(block, word)
        elif word == "NODE":
            self._node(block)
        elif word == "BEGIN":
            self._begin(block)
        elif word in ("PART", "SUBSET"):
            self._part(block, word)
        elif word in GROUPS:
            self._group(block, word)
        elif word in VOLUMES or word in PLATES:
            (self.volumes if word in VOLUMES else self.passed)[word] += sum(1 for _, text in block.rows if text.strip())
        elif word in JOINING:
            self.joining[word] += 1
        elif word in REFUSED:
            raise MeshError(f"line {block.line}: /{word} is not supported; write the nodes and elements out")
        elif word not in FAMILIES:
            raise MeshError(f"line {block.line}: the keyword /{word} is not known; it could change the mesh")

    def _node(self, block: Block) -> None:
        if block.words[1:]:
            raise MeshError(f"line {block.line}: /{'/'.join(block.words)}: nodes in a unit of their own are not read")
        for line, text in block.rows:
            if text.strip():
                self.nodes.append(number(line, text, "a node"))
                self.points.extend(point(line, text))

    def _begin(self, block: Block) -> None:
        """Read the unit of length of the deck. The block has a title, the version, and the units of mass, length and
        time in fields of 20 columns.
        """
        filled = [text for _, text in block.rows if text.strip()]
        self.length = filled[2][REAL : 2 * REAL].strip() if len(filled) > 2 else ""

    def _solid(self, block: Block, word: str) -> None:
        rows, made, part = self.solids.setdefault(word, Solids()), SOLIDS[word], block.id
        filled = [(line, text) for line, text in block.rows if text.strip()]
        several = -(-made // NODES_A_LINE[word]) + (word == "TETRA10") if word in NODES_A_LINE else 1
        for k in range(0, len(filled), several):
            line, text = filled[k]
            nodes = [] if word == "TETRA10" else wholes(line, text)[1:]
            for more in filled[k + 1 : k + several]:
                nodes += wholes(*more)
            while len(nodes) > made and not nodes[-1]:
                nodes.pop()
            if len(nodes) != made or min(nodes) < 1:
                raise MeshError(f"line {line}: an element of /{word} with {len(nodes)} nodes; expected {made}")
            rows.numbers.append(number(line, text, "an element"))
            rows.parts.append(part)
            rows.nodes.extend(nodes)
            rows.lines.append(own(line))

    def _part(self, block: Block, word: str) -> None:
        title, rows = block.titled()
        if block.id in (self.titles if word == "PART" else self.subsets):
            raise MeshError(f"line {block.line}: /{word}/{block.id} is defined twice")
        if word == "SUBSET":
            self.subsets[block.id] = title, [each for line, text in rows for each in wholes(line, text) if each]
            return
        self.titles[block.id] = title
        if rows:
            line, text = rows[0]
            self.subset_of[block.id] = [*wholes(line, text[:30]), 0, 0, 0][2]

    def _group(self, block: Block, word: str) -> None:
        if (word, block.id) in self.groups:
            raise MeshError(f"line {block.line}: /{word} {block.id} is defined twice")
        title, rows = block.titled()
        group = Group(block.kind, title, [])
        self.groups[word, block.id] = group
        if group.kind in KNOWN:
            group.rows = [(line, wholes(line, text)) for line, text in rows]


KNOWN = frozenset(
    (
        "GRNOD/NODE", "GRNOD/NODENS", "GRNOD/PART", "GRNOD/SUBSET", "GRNOD/GRNOD", "GRNOD/GENE", "GRNOD/SURF",
        "SURF/SEG", "SURF/SURF", "SURF/PART", "SURF/PART/EXT", "SURF/SUBSET", "SURF/SUBSET/EXT",
    )
)  # fmt: skip
"""Kinds of groups that the reader supports."""
