"""The reduction of the step: the one maximum over all ranks by which they agree on what the next step does.

A field is one int64 word. This file alone decides where a field is and how it is encoded: as an integer, as a flag (0
or 1), or as the bits of a non-negative float64. Such bits have the order of the floats, and a NaN is larger than any
number, so that the maximum over int64 words is right for every field. Behind the fields there
are words for every rank: the others give less there than the rank itself, so that the maximum is its own word.
"""

from typing import Generic, Self, TypeVar, overload

import numpy as np

from .parallel import fixed_point
from .parallel.comm import Comm, Pending
from .state import Ints

_COSTS, _UNSETTLED = 4, 2
"""Words of a rank about what contact takes, and about what its sweeps leave undone."""
Value = TypeVar("Value", int, bool, float)


class _Field(Generic[Value]):
    """A word of a record; the places follow the order of the definitions."""

    def __set_name__(self, owner: "type[Fields]", name: str) -> None:
        self.place = owner.size
        owner.size += 1

    @overload
    def __get__(self, record: None, owner: "type[Fields]") -> Self: ...
    @overload
    def __get__(self, record: "Fields", owner: "type[Fields]") -> Value: ...
    def __get__(self, record: "Fields | None", owner: "type[Fields]") -> Self | Value:
        return self if record is None else self._decoded(int(record.words[self.place]))

    def __set__(self, record: "Fields", value: Value) -> None:
        record.words[self.place] = self._encoded(value)

    def word(self, record: "Fields") -> int:
        """The field of a record as it is encoded."""
        return int(record.words[self.place])

    def _decoded(self, word: int) -> Value:
        raise NotImplementedError

    def _encoded(self, value: Value) -> int:
        return int(value)


class Number(_Field[int]):
    """An integer."""

    def _decoded(self, word: int) -> int:
        return word


class Flag(_Field[bool]):
    """True where it is true on any rank."""

    def _decoded(self, word: int) -> bool:
        return bool(word)


class Real(_Field[float]):
    """A float64 that is not negative, or NaN without sign; by its bits."""

    def _decoded(self, word: int) -> float:
        return fixed_point.float_of(word)

    def _encoded(self, value: float) -> int:
        return fixed_point.bits_of(value)


class Fields:
    """The fields of the reduction."""

    size = 0
    """Number of fields."""

    limit = Real()
    """Largest one-over-stable-step of all tets, 1/s; NaN when some tet is inverted or not a number."""
    force = Real()
    """Largest contribution to a nodal force, N."""
    stop = Number()
    """Reason to stop, 0 for none (worker/loop.py): the largest wins."""
    report = Flag()
    """Rank 0 wants the loads of all ranks."""
    groups = Flag()
    """Rank 0 wants the loads of groups besides."""
    approach = Real()
    """Largest one-over-step in which a node passes half of a tet that it meets, 1/s."""
    opening = Flag()
    """A crack has become so wide that its sides are surface from now on."""
    stray = Flag()
    """In the next step a slot will have strayed so far that it is registered anew."""
    search = Flag()
    """The surface of a rank has used up the last search for contact."""
    worn = Number()
    """What a rank has found of worn-out tets (elements/wear.py)."""
    breaking = Number()
    """What a rank has found of facets that break (fracture/stage.py)."""
    grown = Flag()
    """A rank has more surface nodes than the balance allows it."""
    checkpoint = Flag()
    """A checkpoint is asked for."""
    snapshot = Flag()
    """A snapshot of the fragments is due."""
    nodes = Number()
    """All nodes; a rank knows of those that have separated elsewhere since the last reduction when this one is done."""

    def __init__(self, ranks: int = 1) -> None:
        """A word or some for each of the ``ranks`` stand behind the fields."""
        self.words: Ints = np.zeros(self.size + (1 + _COSTS + _UNSETTLED) * ranks, np.int64)
        """What the ranks exchange."""
        self.touched: Ints = self.words[self.size :][:ranks]
        """(ranks,) whom the facets that break concern (fracture/separation.py)."""
        each = self.words[self.size + ranks :].reshape(ranks, -1)
        self.costs: Ints = each[:, :_COSTS]
        """(ranks, 4) what contact has taken from the bodies on each rank (contact/account.py)."""
        self.unsettled: Ints = each[:, _COSTS:]
        """(ranks, 2) what the sweeps of contact leave undone on each rank (contact/need.py)."""


class StepReduction(Fields):
    """What all ranks have agreed on in the last reduction; ``own`` is what this rank gives to the next one."""

    def __init__(self, ranks: int = 1, rank: int = 0) -> None:
        """On this ``rank`` of so many."""
        super().__init__(ranks)
        self.own = Fields(ranks)
        for words in (self.own.costs, self.own.unsettled):
            words[np.arange(ranks) != rank] = np.iinfo(np.int64).min

    def keep(self) -> Ints:
        """(fields,) what a run that goes on must know, on any number of ranks."""
        return self.words[: self.size].copy()

    def resume(self, words: Ints) -> None:
        """Takes it back."""
        self.words[: self.size] = words

    def begin(self, comm: Comm) -> Pending:
        """Starts the reduction; the fields are those of all ranks once it is finished. All ranks take part."""
        return comm.begin_maximum(self.own.words, self.words)

    def begin_again(self) -> None:
        """Clears what was asked for once: a run that goes on from a checkpoint does not stop or report again, and
        begins with a search.
        """
        self.stop = 0
        self.report = self.groups = self.stray = self.grown = self.checkpoint = self.snapshot = False
