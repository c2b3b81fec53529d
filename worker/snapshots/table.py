"""Table of the fragments in a snapshot. The heaviest fragments come first, and each of them has its own row. All other
fragments share one row.
"""

from dataclasses import dataclass

import numpy as np

from conoid.cases.output.snapshot import REST

from ..fracture import fragments
from ..model.state import Floats, Ints
from ..parallel.comm import SerialComm
from .share import Whole

MOST_ROWS = 2048
"""Largest number of fragments that have their own row in the table. Chosen value: these rows take a tenth of the bytes
of a snapshot, and a user selects fewer fragments."""


@dataclass
class Table:
    """Table of all fragments of a model, in ascending order of their labels. The values of the fragments are
    bit-identical to those of ``fragments.table``.
    """

    label: Ints
    """(g,) label of each fragment."""
    of: Ints
    """(tets,) index of the fragment of each tet."""
    tets: Ints
    """(g,) number of tets of each fragment."""
    mass: Floats
    """(g,) mass of each fragment, kg."""
    centre: Floats
    """(g, 3) centre of mass of each fragment, m."""
    velocity: Floats
    """(g, 3) velocity of each fragment, m/s."""
    size: Floats
    """(g,) longest side of the bounding box of each fragment, m."""


def measured(whole: Whole, labels: Ints) -> Table:
    """Return the fragments; ``labels`` (tets,): label of the fragment of each tet."""
    groups = fragments.Groups(labels, SerialComm())
    nodes, n = whole.model.nodes, len(whole.mass)
    corners = np.concatenate([np.zeros((0, 4), np.int64), *(b.tets for b in whole.model.blocks)]).astype(np.int64).T
    quarter, moment, momentum = whole.mass / 4.0, np.zeros((n, 3)), np.zeros((n, 3))
    reach = np.full((n, 6), -np.inf)
    for corner in corners:
        moment += quarter[:, None] * nodes.x[corner]
        momentum += quarter[:, None] * nodes.v[corner]
        reach = np.maximum(reach, np.column_stack([nodes.x[corner], -nodes.x[corner]]))
    sums = groups.sums(np.column_stack([whole.mass, moment, momentum]))
    size = (box := groups.largest(reach))[:, :3] + box[:, 3:]
    tets = groups.count(np.ones((n, 1), np.int64))[:, 0]
    return Table(
        groups.label, groups.of, tets, sums[:, 0], sums[:, 1:4] / sums[:, :1], sums[:, 4:7] / sums[:, :1],
        size.max(axis=1, initial=0.0),
    )  # fmt: skip


def columns(table: Table, birth: Floats) -> tuple[dict[str, "np.ndarray"], Ints]:
    """Return the arrays of a snapshot for the table, and (g,) the row of each fragment. ``birth`` (g,): time at which
    each fragment was formed, s.
    """
    order = np.argsort(-table.mass, kind="stable")
    listed, rest = order[:MOST_ROWS], order[MOST_ROWS:]
    row = np.empty(len(order), np.int64)
    row[order] = np.minimum(np.arange(len(order)), MOST_ROWS)
    made: dict[str, np.ndarray] = {
        "fragment_id": table.label[listed], "fragment_mass": table.mass[listed],
        "fragment_size": table.size[listed].astype(np.float32),
        "fragment_centre": table.centre[listed].astype(np.float32),
        "fragment_velocity": table.velocity[listed].astype(np.float32),
        "fragment_tets": table.tets[listed].astype(np.uint32), "fragment_birth": birth[listed].astype(np.float32),
    }  # fmt: skip
    if len(rest):
        last = _rest(table, rest)
        made = {name: np.concatenate([values, last[name].astype(values.dtype)]) for name, values in made.items()}
    return made, row


def _rest(table: Table, rest: Ints) -> dict[str, "np.ndarray"]:
    """Return the one row for all fragments ``rest``. The row has sums and means, but no size and no time of
    formation.
    """
    mass = table.mass[rest]
    total = mass.sum()
    return {
        "fragment_id": np.array([REST]), "fragment_mass": np.array([total]), "fragment_size": np.zeros(1),
        "fragment_centre": (mass[:, None] * table.centre[rest]).sum(axis=0)[None] / total,
        "fragment_velocity": (mass[:, None] * table.velocity[rest]).sum(axis=0)[None] / total,
        "fragment_tets": table.tets[rest].sum()[None], "fragment_birth": np.zeros(1),
    }  # fmt: skip


def by_size(size: Floats) -> tuple[int, list[int]]:
    """Return a histogram of the sizes ``size`` (g,), m, of fragments: a first number k, and counts.

    Count i is the number of fragments with sizes from 2^((k+i)/2) m up to the next bound, 2^((k+i+1)/2) m. Fragments
    without extent are omitted.
    """
    steps = np.floor(2.0 * np.log2(size[size > 0.0])).astype(np.int64)
    if not len(steps):
        return 0, []
    first = int(steps.min())
    return first, np.bincount(steps - first).tolist()
