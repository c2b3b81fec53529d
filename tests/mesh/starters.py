"""Radioss starter decks of random mixtures of elements."""

from random import Random

from conoid.worker.mesh.cells import WEDGE6

from .decks import Split, nodes_of
from .mixtures import Mixture


def starter(truth: Mixture, split: Split, random: Random) -> str:
    """Returns a deck in the style of HyperMesh or of the examples of OpenRadioss: columns of names as comments,
    wedges as /PENTA6 or as bricks."""
    text = [
        "#RADIOSS STARTER",
        "/BEGIN",
        "lump",
        "      2022         0",
        " " * 18 + "kg" + " " * 19 + "m",
        "/UNIT/1",
        "unit",
    ]
    text += ["/NODE", "#  node_ID" + " " * 19 + "X"] if random.random() < 0.5 else ["/NODE"]
    text += [f"{k:10d}" + "".join(f"{x:20.12g}" for x in point) for k, point in enumerate(truth.points, 1)]
    wedges = random.random() < 0.5
    for part, numbers in split.items():
        own = [n for n in numbers if wedges and truth.elements[n][0] is WEDGE6]
        text += [f"/BRICK/{part}"] if len(own) < len(numbers) else []
        text += ["".join(f"{n:10d}" for n in (n, *nodes_of(truth, n))) for n in numbers if n not in own]
        text += [f"/PENTA6/{part}"] if own else []
        text += ["".join(f"{k:10d}" for k in (n, *(node + 1 for node in truth.elements[n][1]))) for n in own]
        text += [f"/PART/{part}", f"piece {part}", f"{1:10d}{1:10d}{3:10d}"]
    text += ["/SUBSET/3", "all of it", "/MAT/ELAST/1", "steel", "/GRNOD/NODE/5", "CLAMP"]
    some = list(range(1, len(truth.points) + 1, 2))
    text += ["".join(f"{n:10d}" for n in some[k : k + 10]) for k in range(0, len(some), 10)]
    return "\n".join([*text, "/SURF/PART/EXT/6", "SKIN", "".join(f"{n:10d}" for n in split), "/END", "more"])
