"""A case as a flat mapping from keys to values, including defaults, in SI units: for example from
``parts[0].velocity[2]`` to -210.0.
"""

from collections.abc import Iterator
from itertools import islice
from typing import Any

Scalar = bool | int | float | str
"""Value of a key of a case."""
_WITHOUT_EFFECT = frozenset({"name", "title", "description", "reference"})
"""Keys of a case that have no effect on the answer."""


def flat(case: dict[str, Any], most: int, longest: int) -> dict[str, Scalar]:
    """Returns the flat mapping of a case, with at most ``most`` keys; texts are cut to ``longest`` characters. Keys
    without effect on the answer are left out: names, descriptions, references.
    """
    entries = ((key, value) for key, value in case.items() if key not in _WITHOUT_EFFECT)
    pairs = (pair for key, value in entries for pair in _scalars(key, value))
    return {key: value[:longest] if isinstance(value, str) else value for key, value in islice(pairs, most)}


def _scalars(key: str, value: Any) -> Iterator[tuple[str, Scalar]]:
    if isinstance(value, dict):
        for name, each in value.items():
            if name != "description":
                yield from _scalars(f"{key}.{name}", each)
    elif isinstance(value, list):
        for n, each in enumerate(value):
            yield from _scalars(f"{key}[{n}]", each)
    elif value is not None:
        yield key, value
