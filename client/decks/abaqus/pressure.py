"""Pressures on surfaces of an Abaqus input file."""

from collections.abc import Callable, Sequence
from typing import Any

from conoid.cases.reading.inp import InpError, numbers

from ..account import Entry
from ..draft import Body, Draft
from ..holds import Course, velocity_course
from ..units import STRESS, TIME
from .keyword import Keyword, joined


class Pressures:
    """Converter of ``*DSLOAD`` to boundaries."""

    def __init__(
        self, draft: Draft, course: Callable[[str | None, Entry], Course | None],
        surface: Callable[[str, Entry], frozenset[str]], bodies: Sequence[Body],
    ) -> None:  # fmt: skip
        """``course``: function that returns an amplitude by its name; ``surface``: function that returns the bodies of
        a surface.
        """
        self._draft, self._course, self._surface = draft, course, surface
        self._names = {body.key: body.name for body in bodies}

    def take(self, each: Keyword, end: float) -> None:
        """Reads pressures that follow surfaces: ``surface, P, size``. Raises InpError, ValueError."""
        course = self._course(each.get("AMPLITUDE"), each.entry)
        each.forgive("OP", "a case with one step has one list of loads")
        each.rest()
        for line, items in each.lists():
            if len(items) < 3 or joined(items[1]) != "P":
                raise InpError(f"line {line}: only pressures ('surface, P, size') are translated")
            size = numbers(line, items[2] + ",")[0]
            most, its = (size, ()) if course is None else velocity_course(tuple((t, size * f) for t, f in course), end)
            table: dict[str, Any] = {"kind": "traction", "pressure": self._draft.quantity(most, STRESS)}
            table |= {"follows": True, "on": items[0].strip('"')}
            keys = self._surface(items[0], each.entry)
            if len(keys) < len(self._names):
                table["parts"] = [name for key, name in self._names.items() if key in keys]
            if its:
                table["course"] = [[self._draft.quantity(time, TIME), factor] for time, factor in its]
            self._draft.add_boundary(table, each.entry)
