"""Notes about contents of a deck that are not in its mesh, or that the reader interprets in an unexpected way."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from .cells import Cells
from .model import Ids

_SHOWN = 5
"""Largest number of sets in a note. Chosen value: they fill one or two lines of a terminal."""


def notes(passed: Counter[str], volumes: Counter[str], joining: Counter[str], mark: str) -> Iterator[str]:
    """Return notes about contents of a deck that are not in the mesh.

    ``passed``: counts of omitted elements without volume; ``volumes``: counts of volume elements that cannot be read;
    ``joining``: counts of keywords that join bodies. ``mark``: first character of a keyword in the deck.
    """
    for counts, reason in (
        (passed, "elements that carry no volume are skipped"),
        (volumes, "elements that cannot be read are outside of the group"),
        (joining, "keywords that join, hold or load bodies are ignored"),
    ):
        if counts:
            yield f"{reason}: {', '.join(f'{many} {mark}{name}' for name, many in sorted(counts.items()))}"


def by_corners(chosen: Iterable[Cells]) -> Iterator[str]:
    """Return notes about the chosen hexahedra of second order. Only the corners of hexahedra of second order are
    used.
    """
    for each in chosen:
        if each.kind.nodes > 10 and len(each.numbers):
            yield f"{len(each.numbers):,} hexahedra of {each.kind.nodes} nodes are read with their corners only"


def undefined(lost: Mapping[str, Ids]) -> Iterator[str]:
    """Return a note about sets with members that the file does not define; ``lost``: undefined members of each set."""
    some = {name: np.unique(numbers) for name, numbers in lost.items() if len(numbers)}
    if some:
        words = [f"{name} ({len(numbers)}, such as {numbers[0]})" for name, numbers in list(some.items())[:_SHOWN]]
        more = ["..."] if len(some) > _SHOWN else []
        yield f"sets have undefined members; these members are left out: {', '.join([*words, *more])}"
