"""A bar of hexahedra as an Abaqus input file, with sets of nodes and surfaces at its ends."""

from itertools import product
from pathlib import Path

CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def bar(path: Path, cells: tuple[int, int, int] = (10, 2, 2), more: str = "") -> Path:
    """Returns the text of a bar of ``cells`` cubes of size 1 along x, y and z from the origin. Sets of the bar: CLAMP,
    the nodes at x = 0; TIP, the nodes at the other end; END, the faces at the other end; SKIN, all faces of the
    surface; INNER, faces inside of the bar.
    """
    places = list(product(*(range(n + 1) for n in cells)))
    number = {place: k for k, place in enumerate(places, 1)}
    bricks = list(product(*(range(n) for n in cells)))
    text = ["*NODE", *(f"{number[place]}, {place[0]}., {place[1]}., {place[2]}." for place in places)]
    text.append("*ELEMENT, TYPE=C3D8R, ELSET=BAR")
    for k, (i, j, m) in enumerate(bricks, 1):
        text.append(", ".join(map(str, (k, *(number[i + a, j + b, m + c] for a, b, c in CORNERS)))))
    for name, at in (("CLAMP", 0), ("TIP", cells[0])):
        text += [f"*NSET, NSET={name}", *(f"{number[place]}," for place in places if place[0] == at)]
    for name, at in (("LAST", cells[0] - 1), ("FIRST", 0)):
        text += [f"*ELSET, ELSET={name}", *(f"{k}," for k, brick in enumerate(bricks, 1) if brick[0] == at)]
    text += ["*SURFACE, NAME=END, TYPE=ELEMENT", "LAST, S4"]
    text += ["*SURFACE, NAME=SKIN", "BAR,", "*SURFACE, NAME=INNER", "FIRST, S4", more]
    path.write_text("\n".join(text) + "\n", encoding="utf-8")
    return path
