"""Notes about contents of a deck that are not in its mesh or are interpreted in an unexpected way."""

from collections import Counter
from collections.abc import Iterable, Iterator

from .cells import Cells


def notes(passed: Counter[str], volumes: Counter[str], joining: Counter[str], mark: str) -> Iterator[str]:
    """Return notes about contents of a deck that are not in the mesh.

    The notes give the number of omitted elements without volume (``passed``), the number of ``volumes`` that cannot
    be read, and the keywords that are ``joining`` bodies, with the ``mark`` of the deck before their names.
    """
    for counts, said in (
        (passed, "elements that carry no volume are skipped"),
        (volumes, "elements that cannot be read are outside of the group"),
        (joining, "keywords that join, hold or load bodies are ignored"),
    ):
        if counts:
            yield f"{said}: {', '.join(f'{many} {mark}{name}' for name, many in sorted(counts.items()))}"


def by_corners(chosen: Iterable[Cells]) -> Iterator[str]:
    """Return notes about hexahedra of second order, of which only the corners are used."""
    for each in chosen:
        if each.kind.nodes > 10 and len(each.numbers):
            yield f"{len(each.numbers):,} hexahedra of {each.kind.nodes} nodes are taken by their corners"
