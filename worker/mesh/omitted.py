"""What of a deck is not in its mesh, or is taken otherwise: a line each."""

from collections import Counter
from collections.abc import Iterable, Iterator

from .cells import Cells


def notes(passed: Counter[str], volumes: Counter[str], joining: Counter[str], mark: str) -> Iterator[str]:
    """How many elements without volume were ``passed`` over, how many ``volumes`` cannot be read, and which keywords
    are ``joining`` bodies, by names that the deck writes behind a ``mark``.
    """
    for counts, said in (
        (passed, "elements that carry no volume are skipped"),
        (volumes, "elements that cannot be read are outside of the group"),
        (joining, "keywords that join, hold or load bodies are passed over"),
    ):
        if counts:
            yield f"{said}: {', '.join(f'{many} {mark}{name}' for name, many in sorted(counts.items()))}"


def by_corners(chosen: Iterable[Cells]) -> Iterator[str]:
    """Hexahedra of second order, of which the corners are taken."""
    for each in chosen:
        if each.kind.nodes > 10 and len(each.numbers):
            yield f"{len(each.numbers):,} hexahedra of {each.kind.nodes} nodes are taken by their corners"
