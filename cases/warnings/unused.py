"""Warnings about keys that have no effect because of the value of another key."""

from collections.abc import Iterator

from pydantic import BaseModel

from ..model.schema import Case
from ..reading.problems import Location, Problem, problem

_NEEDS = (
    ("balance", "alpha", "policy", "outside"), ("balance", "every", "policy", "every"),
    ("mesh", "split", "generator", "structured"), ("fracture", "resolution", "resolve", "strength"),
)  # fmt: skip
"""Table, key, other key of the table, and the value of the other key with which the first key has an effect."""


def unused(case: Case) -> Iterator[Problem]:
    """Yields a warning for each key that has no effect and whose value is not its default."""
    yield from _idle(case.balance, ("balance",))
    for i, part in enumerate(case.parts):
        yield from _idle(part.mesh, ("parts", i, "mesh"))
        yield from _idle(part.fracture, ("parts", i, "fracture"))


def _idle(table: BaseModel | None, location: Location) -> Iterator[Problem]:
    for name, key, chooser, value in _NEEDS:
        if table is None or name != location[-1] or not {key, chooser} <= type(table).model_fields.keys():
            continue
        given = getattr(table, key)
        if getattr(table, chooser) != value and given != type(table).model_fields[key].default:
            yield problem((*location, key), given, f'has no effect without {chooser} = "{value}"')
