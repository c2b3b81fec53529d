"""Random combinations of shapes, in the form of a case."""

import random
from typing import Any

_SIMPLE = ("box", "plate", "cylinder", "tube", "sphere", "cone", "ogive", "hemisphere", "ring_sector")
_COMBINED = ("union", "difference", "intersection")


def tree(seed: int) -> dict[str, Any]:
    """Returns a combination of two or three shapes, or of combinations, near the origin, with sizes of about 1 m."""
    chance = random.Random(seed)
    return {"shape": chance.choice(_COMBINED), "of": [_operand(chance, 1) for _ in range(chance.randint(2, 3))]}


def _operand(chance: random.Random, depth: int) -> dict[str, Any]:
    kind = chance.choice(_SIMPLE + (_COMBINED if depth < 2 else ()))
    if kind in _COMBINED:
        made: dict[str, Any] = {"of": [_operand(chance, depth + 1) for _ in range(chance.randint(2, 3))]}
    else:
        made = _sizes(kind, chance)
        if chance.random() < 0.4:
            centre = [chance.uniform(-0.3, 0.3) for _ in range(3)]
            made["turn"] = {"axis": chance.choice("xyz"), "angle": chance.uniform(-3.0, 3.0), "centre": centre}
    return {"shape": kind, **made}


def _sizes(kind: str, chance: random.Random) -> dict[str, Any]:
    of, at = chance.uniform, [chance.uniform(-0.3, 0.3) for _ in range(3)]
    if kind == "box":
        return {"low": [x - of(0.2, 0.7) for x in at], "high": [x + of(0.2, 0.7) for x in at]}
    if kind == "sphere":
        return {"centre": at, "radius": of(0.3, 0.8)}
    length = of(0.5, 1.4)
    base = {"base": [x - 0.5 * length for x in at], "axis": chance.choice("xyz")}
    sizes: dict[str, dict[str, Any]] = {
        "plate": {"width": of(0.4, 1.5), "height": of(0.4, 1.5), "thickness": length},
        "cylinder": {"radius": of(0.2, 0.7), "length": length},
        "tube": {"radius": of(0.4, 0.7), "inner_radius": of(0.1, 0.3), "length": length},
        "cone": {"radius": of(0.3, 0.7), "top_radius": chance.choice([0.0, of(0.1, 0.5)]), "length": length},
        "ogive": {"radius": of(0.2, 0.5), "crh": of(0.6, 3.0), "shank": of(0.0, 0.6), "pointing": "low"},
        "hemisphere": {"radius": of(0.3, 0.8)},
        "ring_sector": {
            "radius": of(0.5, 0.8), "inner_radius": of(0.1, 0.4), "length": length, "start": of(-3.0, 3.0),
            "angle": of(0.5, 5.5),
        },
    }  # fmt: skip
    return {**base, **sizes[kind]}
