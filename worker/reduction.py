"""The reduction of the step: what all ranks agree on, by which they decide alike what the next step does.

A maximum of int64 words over all ranks, one word a field: an integer, a flag (0 or 1), or the bits of a float64 that is
not negative. Such bits have the order of the floats, and a NaN is larger than any number, so that the maximum of words
is right for every field. Where parts fracture a word for every rank follows. Where there is contact a sum of six words
is added up at the same time. One rank sends nothing and encodes nothing.
"""

import struct
from operator import attrgetter
from typing import Self

import numpy as np

from .model.state import Ints
from .parallel.comm import Comm, Pending

_COSTS, _UNSETTLED = 4, 2
"""Words of the sum: what contact has taken, and what its sweeps leave undone."""


class Fields:
    """The fields of the reduction."""

    def __init__(self) -> None:
        """Nothing is asked for, nothing limits."""
        self.limit = 0.0
        """Largest one-over-stable-step of all tets, 1/s; NaN when some tet is inverted or not a number."""
        self.force = 0.0
        """Largest contribution to a nodal force, N."""
        self.stop = 0
        """Reason to stop, 0 for none (worker/run/loop.py): the largest wins."""
        self.report = False
        """Rank 0 wants the loads of all ranks."""
        self.groups = False
        """Rank 0 wants the loads of groups besides."""
        self.approach = 0.0
        """Largest one-over-step in which a node passes half of a tet that it meets, 1/s."""
        self.opening = False
        """A crack has become so wide that its sides are surface from now on."""
        self.stray = False
        """In the next step a slot will have strayed so far that it is registered anew."""
        self.search = False
        """The surface of a rank has used up the last search for contact."""
        self.worn = 0
        """What a rank has found of worn-out tets (elements/wear.py)."""
        self.breaking = 0
        """What a rank has found of facets that break (fracture/stage.py)."""
        self.grown = False
        """A rank has more surface nodes than the balance allows it."""
        self.checkpoint = False
        """A checkpoint is asked for."""
        self.snapshot = False
        """A snapshot of the fragments is due."""
        self.apart = False
        """A tied node has come apart from the faces that it was tied to (bonds/stage.py)."""
        self.nodes = 0
        """All nodes; a rank knows of those that have separated elsewhere since the last reduction when this is done."""

    def pack(self, words: Ints) -> None:
        """Encodes the fields in the first ``words``."""
        _LAYOUT.pack_into(words.data, 0, *_values(self))

    def unpack(self, words: Ints) -> None:
        """Takes the fields that are encoded in the first ``words``."""
        vars(self).update(zip(NAMES, _LAYOUT.unpack_from(words.data), strict=True))


NAMES = tuple(vars(Fields()))
"""Of the fields, in the order of their words."""
_values = attrgetter(*NAMES)
_LAYOUT = struct.Struct("=" + "".join("d" if isinstance(value, float) else "q" for value in vars(Fields()).values()))


class Offer(Fields):
    """What a rank gives to a reduction."""

    def __init__(self, ranks: int) -> None:
        """Of so many."""
        super().__init__()
        self.touched: Ints = np.zeros(ranks, np.int64)
        """(ranks,) whom the facets that break concern (fracture/separation.py)."""
        self.sums: Ints = np.zeros(_COSTS + _UNSETTLED, np.int64)
        self.costs: Ints = self.sums[:_COSTS]
        """(4,) what contact has taken from the bodies on this rank (contact/account.py)."""
        self.unsettled: Ints = self.sums[_COSTS:]
        """(2,) what the sweeps of contact leave undone on this rank (contact/need.py)."""


class StepReduction(Fields):
    """What all ranks have agreed on in the last reduction; ``own`` is what this rank gives to the next one."""

    def __init__(self, ranks: int = 1, *, fractures: bool = True, contact: bool = True) -> None:
        """On so many ranks; whether parts of the case fracture, and whether there is contact."""
        super().__init__()
        self.own = Offer(ranks)
        self._alone, self._contact = ranks == 1, contact
        self._given, self._agreed = (np.zeros(len(NAMES) + ranks * fractures, np.int64) for _ in range(2))
        self.touched: Ints = self.own.touched if self._alone else self._agreed[len(NAMES) :]
        """(ranks,) the maximum of what the ranks have given."""
        self._sums: Ints = np.zeros(_COSTS + _UNSETTLED, np.int64)
        self.costs: Ints = self._sums[:_COSTS]
        """(4,) of all ranks."""
        self.unsettled: Ints = self._sums[_COSTS:]
        """(2,) of all ranks."""
        self._pending: list[Pending] = []

    def keep(self) -> Ints:
        """(fields,) what a run that goes on must know, on any number of ranks."""
        words = np.zeros(len(NAMES), np.int64)
        self.pack(words)
        return words

    def resume(self, words: Ints) -> None:
        """Takes it back."""
        self.unpack(words)

    def begin(self, comm: Comm) -> Self:
        """Starts the reduction. All ranks take part."""
        own = self.own
        if self._alone:
            vars(self).update(zip(NAMES, _values(own), strict=True))
            self._sums[:] = own.sums
            return self
        own.pack(self._given)
        self._given[len(NAMES) :] = own.touched[: len(self.touched)]
        self._pending = [comm.begin_maximum(self._given, self._agreed)]
        if self._contact:
            self._pending.append(comm.begin_sum(own.sums, self._sums))
        return self

    def finish(self) -> None:
        """Returns when the fields are those of all ranks."""
        if self._alone:
            return
        for pending in self._pending:
            pending.finish()
        self.unpack(self._agreed)

    def begin_again(self) -> None:
        """Clears what was asked for once: a run that goes on from a checkpoint does not stop or report again, and
        begins with a search.
        """
        self.stop = 0
        self.report = self.groups = self.stray = self.grown = self.checkpoint = self.snapshot = self.apart = False
