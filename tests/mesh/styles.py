"""Writes small Abaqus input files in the styles of Abaqus/CAE, HyperMesh, FreeCAD and PrePoMax, with random numbering
and spelling. Each writer returns the content of every group of its file, computed from the arrays that it wrote.
"""

import itertools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from random import Random

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

KUHN = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
"""Six tets of a cube; the three bits of the number i are the coordinates of corner i."""


@dataclass
class Block:
    """A box of tets with random numbers: ``nodes`` (n,), ``points`` (n, 3), ``tets`` (m,), ``corners`` (m, 4)."""

    nodes: Ints
    points: Floats
    tets: Ints
    corners: Ints

    def measured(self, some: Iterable[int] | None = None) -> Floats:
        """Returns volume and first moments, (4,), of the tets with the given numbers, or of all tets for None."""
        keep = np.ones(len(self.tets), bool) if some is None else np.isin(self.tets, list(some))
        return measured(self.points, np.searchsorted(self.nodes, self.corners[keep]))


def measured(points: Floats, tets: NDArray[np.integer]) -> Floats:
    """Returns volume and first moments, (4,), of tets that are given by indices."""
    x = points[tets]
    volumes = np.abs(np.einsum("ij,ij->i", x[:, 1] - x[:, 0], np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 0]))) / 6.0
    return np.concatenate([[volumes.sum()], (volumes[:, None] * x.mean(axis=1)).sum(axis=0)])


def block(random: Random) -> Block:
    """Returns a box of 1 to 3 cells in each direction at a random position; its nodes and tets have increasing numbers
    with gaps.
    """
    cells = [random.randint(1, 3) for _ in range(3)]
    grid = list(itertools.product(*(range(n + 1) for n in cells)))
    place = {point: i for i, point in enumerate(grid)}
    low = [random.choice((0.0, random.uniform(-5.0, 5.0))) for _ in range(3)]
    size = random.choice((1.0, 0.25, 1e-3))
    rows = []
    for cell in itertools.product(*map(range, cells)):
        corner = [place[tuple(c + (i >> k & 1) for k, c in enumerate(cell))] for i in range(8)]
        rows += [[corner[i] for i in tet] for tet in KUHN]
    nodes, tets = _numbers(random, len(grid)), _numbers(random, len(rows))
    points = np.array(low) + size * np.array(grid, np.float64)
    points = np.array([[float(_short(x)) for x in point] for point in points])
    volumes = np.linalg.det(points[np.array(rows)][:, 1:] - points[np.array(rows)][:, :1])
    assert (volumes > 0).all()
    return Block(nodes, points, tets, nodes[np.array(rows)])


def _numbers(random: Random, n: int) -> Ints:
    steps = [1] * n if random.random() < 0.5 else [random.randint(1, 3) for _ in range(n)]
    return random.choice((0, 100, 123456)) + np.cumsum(steps)


def _short(value: float) -> str:
    return f"{value:.9g}"


@dataclass
class Text:
    """The text of a file in a random spelling."""

    random: Random
    lines: list[str] = field(default_factory=list)
    case: Callable[[str], str] = str

    def keyword(self, word: str, *parameters: str, abbreviate: bool = False) -> None:
        """Writes a keyword line with parameters ``NAME=value`` or single words."""
        words = [f"*{self.case(word)}"]
        for each in parameters:
            name, equals, value = each.partition("=")
            name = name[: self.random.randint(3, len(name))] if abbreviate and len(name) > 5 else name
            blank = self.random.choice(("", "", " "))
            words.append(f"{self.case(name)}{blank}{equals}{blank}{value}")
        comma = self.random.choice((", ", ",", " , "))
        if len(words) > 1 and self.random.random() < 0.1:
            self.lines += [comma.join(words[:-1]) + ",", self.random.choice(("", "   ")) + words[-1]]
        else:
            self.lines.append(comma.join(words))

    def nodes(self, body: Block) -> None:
        """Writes the data lines of *NODE."""
        style = self.random.randrange(4)
        for number, point in zip(body.nodes, body.points, strict=True):
            texts = [_coordinate(value, style) for value in point]
            self.lines.append(", ".join((f"{number:7d}" if style == 1 else str(number), *texts)))
            self._noise()

    def tets(self, numbers: Ints, corners: Ints) -> None:
        """Writes the data lines of *ELEMENT."""
        two = self.random.random() < 0.15
        for number, corner in zip(numbers, corners, strict=True):
            texts = [str(each) for each in (number, *corner)]
            if two and self.random.random() < 0.5:
                self.lines += [", ".join(texts[:3]) + ",", " " + ", ".join(texts[3:])]
            else:
                self.lines.append(", ".join(texts))
            self._noise()

    def listed(self, numbers: Iterable[object], per_line: int) -> None:
        """Writes the data lines of a set."""
        texts = [str(number) for number in numbers]
        comma = self.random.choice((", ", ","))
        for start in range(0, len(texts), per_line):
            more = comma.rstrip() if start + per_line < len(texts) or self.random.random() < 0.3 else ""
            self.lines.append(comma.join(texts[start : start + per_line]) + more)

    def elset(self, name: str, numbers: Ints, *more: str) -> None:
        """Writes a set of elements, as a range if it is one."""
        steps = np.diff(numbers)
        if len(numbers) > 1 and (steps == steps[0]).all() and self.random.random() < 0.7:
            self.keyword("Elset", f"elset={name}", *more, "generate", abbreviate=self.random.random() < 0.5)
            self.lines.append(f"{numbers[0]}, {numbers[-1]}, {steps[0]}")
        else:
            self.keyword("Elset", f"elset={name}", *more)
            self.listed(numbers, self.random.choice((8, 16)))

    def extra(self, number: int, nodes: Ints) -> None:
        """Writes an element without volume."""
        kind, n = self.random.choice((("S3", 3), ("T3D2", 2), ("CONN3D2", 2), ("SPRINGA", 2), ("MASS", 1), ("M3D3", 3),
                                      ("S6", 6), ("B31", 2), ("CPS3", 3), ("COH3D6", 6), ("DASHPOTA", 2)))  # fmt: skip
        self.keyword("Element", f"type={kind}", f"elset=extra{number}")
        self.lines.append(", ".join(str(each) for each in (number, *itertools.islice(itertools.cycle(nodes), n))))

    def _noise(self) -> None:
        if self.random.random() < 0.01:
            self.lines.append(self.random.choice(("** a comment, *with* signs", "", "**", "   ")))

    def bytes(self) -> bytes:
        """Returns the text as the bytes of a file."""
        end = self.random.choice(("\n", "\n", "\r\n"))
        mark = b"\xef\xbb\xbf" if self.random.random() < 0.1 else b""
        return mark + (end.join(self.lines) + end).encode()


def _coordinate(value: float, style: int) -> str:
    text = _short(value)
    if value == 0.0 and style == 2:
        return ""
    if style == 3 and value:
        return f"{value:.8E}".replace("E", "D")
    return text if any(sign in text for sign in ".e") else f"{text}."


Groups = dict[str | None, Floats]
"""Volume and first moments, (4,), by name of the group."""


def _parted(random: Random, body: Block) -> tuple[Ints, Ints]:
    """Returns the tets of a body divided into two sets."""
    cut = random.randint(1, len(body.tets) - 1)
    return body.tets[:cut], body.tets[cut:]


def cae(random: Random) -> tuple[bytes, Groups]:
    """Writes parts, instances that are moved and turned, and sets of parts and of the assembly that have equal
    names.
    """
    text = Text(random, case=random.choice((str, str.upper)))
    text.keyword("Heading")
    text.lines += ["** Job name: Job-1 Model name: Model-1", "** Generated by: Abaqus/CAE 2022"]
    text.keyword("Preprint", "echo=NO", "model=NO", "history=NO", "contact=NO")
    bodies = {f"Part-{i + 1}": block(random) for i in range(random.randint(1, 2))}
    cuts = {}
    for name, body in bodies.items():
        text.keyword("Part", f"name={name}")
        text.keyword("Node")
        text.nodes(body)
        text.keyword("Element", "type=C3D4")
        text.tets(body.tets, body.corners)
        if random.random() < 0.3:
            text.extra(int(body.tets[-1]) + 5, body.nodes)
        cuts[name] = _parted(random, body)
        text.elset("Set-1", cuts[name][0])
        text.keyword("Solid Section", "elset=Set-1", "material=Steel")
        text.lines.append(",")
        text.keyword(random.choice(("End Part", "EndPart")))
    text.keyword("Assembly", "name=Assembly")
    groups: Groups = {None: np.zeros(4), "Set-1": np.zeros(4)}
    placed: list[tuple[str, str, Block]] = []
    for name in [*bodies, *random.sample(list(bodies), random.randint(0, 1))]:
        instance = f"{name}-{sum(each.startswith(name) for each, _, _ in placed) + 1}"
        text.keyword("Instance", f"name={instance}", f"part={name}")
        body = _placed(text, random, bodies[name])
        text.keyword("End Instance")
        placed.append((instance, name, body))
        groups[None] = groups[None] + body.measured()
        groups[instance] = body.measured()
        groups[f"{instance}.Set-1"] = body.measured(cuts[name][0])
    for instance, name, body in placed:
        if random.random() < 0.5 or instance == placed[0][0]:
            text.elset("Set-1", cuts[name][1], f"instance={instance}", "internal")
            groups["Set-1"] = groups["Set-1"] + body.measured(cuts[name][1])
    some = [(instance, number, body) for instance, _, body in placed for number in random.sample(list(body.tets), 2)]
    text.keyword("Elset", "elset=Picked")
    text.listed((f"{instance}.{number}" for instance, number, _ in some), 4)
    groups["Picked"] = sum((body.measured([number]) for _, number, body in some), np.zeros(4))
    text.keyword("End Assembly")
    _analysis(text)
    return text.bytes(), groups


def _placed(text: Text, random: Random, body: Block) -> Block:
    """Writes the data lines of an instance; returns the body at the position of the instance."""
    move, axis, angle = np.zeros(3), random.randrange(3), 0.0
    kind = random.randrange(4)
    if kind & 1:
        move = np.array([float(_short(random.uniform(-9.0, 9.0))) for _ in range(3)])
    if kind & 2:
        angle = random.choice((90.0, -30.0, 180.0, 12.5))
    if kind:
        text.lines.append(
            "" if kind == 2 and random.random() < 0.5 else ", ".join(f"{value!r}" for value in move.tolist())
        )
    start = np.array([float(random.randint(-2, 2)) for _ in range(3)])
    end = start + np.eye(3)[axis]
    if kind & 2:
        text.lines.append(", ".join(f"{value!r}" for value in (*start.tolist(), *end.tolist(), angle)))
    arm, turned = body.points + move - start, body.points + move - start
    i, j = (axis + 1) % 3, (axis + 2) % 3
    cosine, sine = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    turned[:, i], turned[:, j] = cosine * arm[:, i] - sine * arm[:, j], sine * arm[:, i] + cosine * arm[:, j]
    return Block(body.nodes, turned + start, body.tets, body.corners)


def hypermesh(random: Random) -> tuple[bytes, Groups]:
    """Writes components as sets of *ELEMENT, one after the other, with comments in the style of HyperMesh."""
    text = Text(random, case=str.upper)
    text.lines += [
        "**",
        "** ABAQUS Input Deck Generated by HyperMesh Version : 2022",
        "**",
        "**   Template:  ABAQUS/STANDARD 3D",
    ]
    body = block(random)
    first, second = _parted(random, body)
    text.keyword("NODE")
    text.nodes(body)
    for name, numbers in (("auto1", first), ("solid_2", second)):
        text.lines.append(f"**HWCOLOR COMP          1    11 {name}")
        text.keyword("ELEMENT", "TYPE=C3D4", f"ELSET={name}")
        text.tets(numbers, body.corners[np.isin(body.tets, numbers)])
    groups: Groups = {None: body.measured(), "auto1": body.measured(first), "SOLID_2": body.measured(second)}
    if random.random() < 0.6:
        text.extra(int(body.tets[-1]) + 1, body.nodes)
    if random.random() < 0.3:
        _strange(text, body, int(body.tets[-1]) + 20)
        del groups[None]
    some = np.array(sorted(random.sample(list(body.tets), min(5, len(body.tets)))))
    text.elset("some", some)
    groups["some"] = body.measured(some.tolist())
    text.lines.append("*****")
    _analysis(text)
    return text.bytes(), groups


def _strange(text: Text, body: Block, number: int) -> None:
    """Writes a volume element that the reader does not support, in a separate component."""
    text.keyword("ELEMENT", "TYPE=SC8R", "ELSET=hexes")
    text.lines.append(", ".join(str(each) for each in (number, *body.nodes[:8])))


def freecad(random: Random) -> tuple[bytes, Groups]:
    """Writes one body with sets of sets and node sets, and the steps of CalculiX."""
    text = Text(random)
    text.lines += ["** written by FreeCAD inp file writer for CalculiX,Abaqus meshes", "** all mesh elements.", ""]
    body = block(random)
    first, _ = _parted(random, body)
    text.lines.append("** Nodes")
    text.keyword("Node", "NSET=Nall")
    text.nodes(body)
    text.lines.append("** Volume elements")
    text.keyword("Element", "TYPE=C3D4", "ELSET=Evolumes")
    text.tets(body.tets, body.corners)
    if random.random() < 0.5:
        text.extra(int(body.tets[-1]) + 3, body.nodes)
    text.keyword("ELSET", "ELSET=Eall")
    text.lines.append("Evolumes")
    text.keyword("ELSET", "ELSET=MaterialSolidSolid")
    text.listed([f"{number}," for number in first], 1)
    text.keyword("ELSET", "ELSET=Both")
    text.lines.append("Eall, MaterialSolidSolid,")
    _analysis(text)
    groups: Groups = {name: body.measured() for name in (None, "Eall", "EVOLUMES", "Both")}
    return text.bytes(), groups | {"MaterialSolidSolid": body.measured(first)}


def prepomax(random: Random) -> tuple[bytes, Groups]:
    """Writes several parts as sets of *ELEMENT, each part with separate nodes."""
    text = Text(random, case=random.choice((str, str.title)))
    text.lines += ["************************************************************", "**", "** Heading"]
    text.keyword("Heading")
    text.lines.append("Hash: fgUbmCTb, Date: 11/29/2026, Unit system: MM_TON_S_C")
    bodies = [block(random) for _ in range(random.randint(1, 3))]
    last = [0, 0]
    for body in bodies:
        body.corners, body.nodes, body.tets = body.corners + last[0], body.nodes + last[0], body.tets + last[1]
        last = [int(body.nodes[-1]), int(body.tets[-1])]
    text.keyword("Node")
    for body in bodies:
        text.nodes(body)
    groups: Groups = {None: sum((body.measured() for body in bodies), np.zeros(4))}
    for i, body in enumerate(bodies):
        text.keyword("Element", "Type=C3D4", f"Elset=Solid_part-{i + 1}")
        text.tets(body.tets, body.corners)
        groups[f"Solid_part-{i + 1}"] = body.measured()
    text.keyword("Nset", "Nset=Internal-1_Fixed")
    text.listed(bodies[0].nodes[:20], 16)
    text.keyword("Elset", "Elset=Internal_Selection-1")
    text.lines.append(", ".join(f"Solid_part-{i + 1}" for i in range(len(bodies))))
    groups["Internal_Selection-1"] = groups[None]
    _analysis(text)
    return text.bytes(), groups


def _analysis(text: Text) -> None:
    """Writes materials, loads and a step, which the reader of meshes skips."""
    text.keyword("Material", "name=Steel")
    text.keyword("Density")
    text.lines.append("7.85e-09,")
    text.keyword("Elastic")
    text.lines.append("210000., 0.3")
    text.keyword("Step", "name=Step-1", "nlgeom=YES")
    text.keyword("Dynamic", "Explicit")
    text.lines.append(", 0.001")
    text.keyword(text.random.choice(("Node File", "Output", "El Print", "File Output")))
    text.lines.append("U")
    text.keyword("End Step")


STYLES = (cae, hypermesh, freecad, prepomax)
POISONS: tuple[Callable[[Random, list[bytes]], None], ...] = (
    lambda random, lines: lines.append(b"*ELSET, ELSET=Broken\nNo-such-set"),
    lambda random, lines: lines.append(b"*NGEN\n1, 5, 1"),
    lambda random, lines: lines.append(b"*ELSET, ELSET=Broken, GENERATING\n1, 2"),
    lambda random, lines: lines.append(b"*ELSET, ELSET=Broken, GENERATE\n1, 4, 2"),
    lambda random, lines: lines.append(b"*SOMETHING, NAME=unknown\n1, 2"),
    lambda random, lines: lines.append(b"*INCLUDE, INPUT=other.inp"),
    lambda random, lines: lines.append(b"*NODE\n1, 0, zero, 0"),
    lambda random, lines: lines.insert(0, b"1, 2, 3"),
)
"""Changes of a file after which the reader must refuse the file."""
