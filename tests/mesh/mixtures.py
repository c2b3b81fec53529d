"""Random meshes of hexahedra, wedges and pyramids, and the tets that result from the rule of cutting."""

import math
import random
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conoid.worker.mesh.cells import HEX8, PYRAMID5, WEDGE6, Cells, Kind, cells
from conoid.worker.mesh.solid import Content

Element = tuple[Kind, tuple[int, ...]]
FACES = {
    HEX8: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    WEDGE6: ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    PYRAMID5: ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}
DEGENERATE = {WEDGE6: (1, 0, 3, 4, 2, 2, 5, 5), PYRAMID5: (0, 1, 2, 3, 4, 4, 4, 4)}
"""Elements in the form of LS-DYNA: the wedge lies on a face with four corners."""


@dataclass
class Mixture:
    """A mesh: ``points`` (n, 3) by node number, and elements by number."""

    points: NDArray[np.float64]
    elements: dict[int, Element]

    def content(self, degenerate: bool = False) -> Content:
        """Returns the elements in the form of a reader of mesh files."""
        return Content(np.arange(len(self.points)), self.points, list(self.cells(degenerate)))

    def cells(self, degenerate: bool = False) -> list[Cells]:
        """Returns the elements by kind; with ``degenerate``, wedges and pyramids are written as hexahedra that repeat
        nodes.
        """
        rows: dict[Kind, list[tuple[int, tuple[int, ...]]]] = {}
        for number, (kind, nodes) in self.elements.items():
            if degenerate and kind in DEGENERATE:
                rows.setdefault(HEX8, []).append((number, tuple(nodes[k] for k in DEGENERATE[kind])))
            else:
                rows.setdefault(kind, []).append((number, nodes))
        return [
            cells(kind, np.array([n for n, _ in each]), np.array([nodes for _, nodes in each]), np.zeros(len(each)))
            for kind, each in rows.items()
        ]

    def surface(self) -> set[tuple[int, ...]]:
        """Returns the triangles of the faces that belong to only one element; each triangle begins with its smallest
        node and is directed outward.
        """
        faces = [[nodes[k] for k in face] for kind, nodes in self.elements.values() for face in FACES[kind]]
        times = Counter(frozenset(face) for face in faces)
        outer = [face for face in faces if times[frozenset(face)] == 1]
        return {turned(triangle) for face in outer for triangle in halves(face)}

    def volumes(self) -> dict[int, float]:
        """Returns the volumes of the polyhedra of the elements; the faces of a polyhedron are cut through their
        smallest node.
        """
        return {number: self._volume(element) for number, element in self.elements.items()}

    def _volume(self, element: Element) -> float:
        kind, nodes = element
        terms = []
        for face in FACES[kind]:
            for triangle in halves([nodes[k] for k in face]):
                (a, b, c), (d, e, f), (g, h, i) = (self.points[node] - self.points[nodes[0]] for node in triangle)
                terms += [a * e * i, -a * f * h, b * f * g, -b * d * i, c * d * h, -c * e * g]
        return math.fsum(terms) / 6.0


def halves(face: list[int]) -> list[list[int]]:
    """Returns the triangles of a face that is cut by the diagonal through its smallest node."""
    first = face.index(min(face))
    a, b, c, *d = face[first:] + face[:first]
    return [[a, b, c], [a, c, *d]] if d else [[a, b, c]]


def turned(face: list[int]) -> tuple[int, ...]:
    """Returns the nodes of a face in the same cyclic order, beginning with the smallest node."""
    first = face.index(min(face))
    return tuple(face[first:] + face[:first])


def mixture(seed: int, jitter: float = 0.12) -> Mixture:
    """Returns a grid whose nodes are moved and numbered at random; each cell is a hexahedron, two wedges or six
    pyramids.
    """
    chance = random.Random(seed)
    shape = [chance.randint(1, 4) for _ in range(3)]
    stretch = [chance.uniform(0.3, 3.0) for _ in range(3)]
    grid = [(i, j, k) for i in range(shape[0] + 1) for j in range(shape[1] + 1) for k in range(shape[2] + 1)]
    corners = {place: n for n, place in enumerate(grid)}
    points = [[stretch[d] * (x + chance.uniform(-jitter, jitter)) for d, x in enumerate(place)] for place in grid]
    kinds = chance.choice([("hexahedron",), ("wedge",), ("pyramid",), ("hexahedron", "wedge", "pyramid")])
    found: list[Element] = []
    for i in range(shape[0]):
        for j in range(shape[1]):
            column = chance.choice(kinds)
            for k in range(shape[2]):
                around = [(0, 0), (1, 0), (1, 1), (0, 1)]
                node = [corners[i + a, j + b, k + c] for c in (0, 1) for a, b in around]
                kind = (
                    column
                    if column == "wedge"
                    else chance.choice([each for each in kinds if each != "wedge"] or [column])
                )
                if kind == "hexahedron":
                    found.append((HEX8, tuple(node)))
                elif kind == "wedge":
                    found += [(WEDGE6, tuple(node[p] for p in row)) for row in ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7))]
                else:
                    points.append(np.mean([points[p] for p in node], axis=0).tolist())
                    found += [(PYRAMID5, (*(node[p] for p in face[::-1]), len(points) - 1)) for face in FACES[HEX8]]
    names = list(range(len(points)))
    chance.shuffle(names)
    ordered = np.empty((len(points), 3))
    ordered[names] = points
    numbers = chance.sample(range(1, 10 * len(found) + 1), len(found))
    return Mixture(
        ordered, {n: (kind, tuple(names[p] for p in nodes)) for n, (kind, nodes) in zip(numbers, found, strict=True)}
    )
