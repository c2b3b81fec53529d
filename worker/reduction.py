"""The reduction of the step (Allreduce). After the reduction all ranks have the same limits and flags, and make the
same decisions.

The reduction takes the maximum of int64 words over all ranks. Each field of the reduction is one word: an integer, a
flag (0 or 1), or the bit pattern of a float64 that is not negative. Read as integers, the bit patterns of non-negative
floats have the order of the floats, and a NaN is larger than any number. Therefore the maximum of the words is the
maximum of the values for every field. If parts fracture, the reduction has one more word for each rank. If the case has
contact, the sum of six further words is computed at the same time. A run with a single rank sends no message.
"""

import struct
from operator import attrgetter
from typing import Self

import numpy as np

from .model.state import Ints
from .parallel.comm import Comm, Pending

_COSTS, _UNSETTLED = 4, 2
"""Number of words in the sum: 4 words for the energies that contact took from the bodies, 2 words for the residuals of
the contact sweeps."""


class Fields:
    """Fields of the reduction."""

    def __init__(self) -> None:
        """Sets all fields to zero, which means no limit and no request."""
        self.limit = 0.0
        """Largest value over all tets of 1 / stable step, 1/s. The value is NaN if a tet is inverted or has a value
        that is not a number."""
        self.force = 0.0
        """Largest force that a tet contributes to a node, N."""
        self.stop = 0
        """Number of the reason to stop the run; 0 if there is no reason (worker/run/stops.py). If there are several
        reasons, the largest number is used."""
        self.report = False
        """Request of rank 0: all ranks report their loads."""
        self.groups = False
        """Request of rank 0: all ranks also report the loads of their groups of tets."""
        self.approach = 0.0
        """Largest value of 1 / (time in which a node passes through half of the tet that it hits), 1/s."""
        self.opening = False
        """True if a crack has opened so wide that its two sides become surface."""
        self.stray = False
        """True if a contact node (slot) will leave its skin in the next step, so that its candidate pairs must be
        searched again."""
        self.search = False
        """True if the surface of a rank has moved further than the last broad phase allows, so that a new broad phase
        is needed."""
        self.worn = 0
        """State of the tets that erosion will remove: SOUND, TIRED or BROKEN (elements/wear.py)."""
        self.breaking = 0
        """State of the facets: NOTHING, OVERSTRESSED or BREAKS (fracture/stage.py)."""
        self.grown = False
        """True if a rank has more surface nodes than the load balance allows."""
        self.checkpoint = False
        """True if a checkpoint is requested."""
        self.snapshot = False
        """True if a snapshot of the fragments is scheduled."""
        self.apart = False
        """True if a bond of a tied node has failed (bonds/stage.py)."""
        self.nodes = 0
        """Number of nodes on all ranks. After a node separation, ranks without a separated node receive the new number
        of nodes in this field."""

    def pack(self, words: Ints) -> None:
        """Encodes the fields and writes them to the first elements of ``words``."""
        _LAYOUT.pack_into(words.data, 0, *_values(self))

    def unpack(self, words: Ints) -> None:
        """Decodes the fields from the first elements of ``words``."""
        vars(self).update(zip(NAMES, _LAYOUT.unpack_from(words.data), strict=True))


NAMES = tuple(vars(Fields()))
"""Names of the fields. The order is that of their words."""
_values = attrgetter(*NAMES)
_LAYOUT = struct.Struct("=" + "".join("d" if isinstance(value, float) else "q" for value in vars(Fields()).values()))


class Offer(Fields):
    """Contribution of a rank to a reduction."""

    def __init__(self, ranks: int) -> None:
        """``ranks``: number of ranks of the run."""
        super().__init__()
        self.touched: Ints = np.zeros(ranks, np.int64)
        """(ranks,) not zero for each rank that has a node of a facet that breaks (fracture/separation.py)."""
        self.sums: Ints = np.zeros(_COSTS + _UNSETTLED, np.int64)
        self.costs: Ints = self.sums[:_COSTS]
        """(4,) energies that contact took from the bodies on this rank (contact/account.py)."""
        self.unsettled: Ints = self.sums[_COSTS:]
        """(2,) residuals of the contact sweeps on this rank (contact/solver/sweep_count.py)."""


class StepReduction(Fields):
    """Result of the last reduction, equal on all ranks. The attribute ``own`` is the contribution of this rank to the
    next reduction.
    """

    def __init__(self, ranks: int = 1, *, fractures: bool = True, contact: bool = True) -> None:
        """``ranks``: number of ranks; ``fractures``, ``contact``: True if the case has fracture, or contact."""
        super().__init__()
        self.own = Offer(ranks)
        self._alone, self._contact = ranks == 1, contact
        self._given, self._agreed = (np.zeros(len(NAMES) + ranks * fractures, np.int64) for _ in range(2))
        self.touched: Ints = self.own.touched if self._alone else self._agreed[len(NAMES) :]
        """(ranks,) maximum over all ranks of the words that mark the ranks with breaking facets."""
        self._sums: Ints = np.zeros(_COSTS + _UNSETTLED, np.int64)
        self.costs: Ints = self._sums[:_COSTS]
        """(4,) sum over all ranks of the energies that contact took from the bodies."""
        self.unsettled: Ints = self._sums[_COSTS:]
        """(2,) sum over all ranks of the residuals of the contact sweeps."""
        self._pending: list[Pending] = []

    def keep(self) -> Ints:
        """Returns (fields,) the words of the result, for a checkpoint. The words do not depend on the number of
        ranks.
        """
        words = np.zeros(len(NAMES), np.int64)
        self.pack(words)
        return words

    def resume(self, words: Ints) -> None:
        """Restores the result from the words that ``keep`` returned."""
        self.unpack(words)

    def begin(self, comm: Comm) -> Self:
        """Starts the reduction. Collective."""
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
        """Waits until the reduction of the fields over all ranks is complete."""
        if self._alone:
            return
        for pending in self._pending:
            pending.finish()
        self.unpack(self._agreed)

    def begin_again(self) -> None:
        """Clears the requests that were executed before the checkpoint, so that a resumed run does not execute a stop
        or a report again. Requests a broad phase, because a resumed run starts with a broad phase.
        """
        self.stop = 0
        self.report = self.groups = self.stray = self.grown = self.checkpoint = self.snapshot = self.apart = False
