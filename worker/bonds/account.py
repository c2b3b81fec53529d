"""Energy account of the tied bonds. Half of the work of an impulse is computed with the velocity before the impulse,
and half with the velocity after it.
"""

import numpy as np

from ..migration.parcel import Parcel
from ..model.columns import ZERO
from ..model.state import Floats, Indices, Ints, Nodes
from . import sweeps


class BondAccount:
    """Work of the impulses of tied bonds on the nodes of a rank."""

    def __init__(self, nodes: Nodes, scale: float) -> None:
        """``nodes``: local nodes of the rank; ``scale``: quanta per N s."""
        self.scale = scale
        self.loss, self.external = np.zeros((2, nodes.n))
        """(nodes,) energy dissipated by the bonds, J, and external work, J: work of prescribed velocities against the
        bonds."""
        nodes.columns.declare(self, loss=ZERO, external=ZERO)  # the energies of a copy of a node start with zero
        self.mobility: Floats = np.zeros((0, 3))
        """(nodes, 3) inverse mass for each component, 1/kg, as the sweeps use it; 0 for a component with prescribed
        velocity."""
        self._local: Indices = np.zeros(0, np.int32)
        """(h,) nodes on which the last impulses act."""
        self._total, self._before = np.zeros((0, 3), np.int64), np.zeros((0, 3))
        """Two arrays (h, 3) for the nodes on which the last impulses act: these impulses, quanta, and velocities
        v(n-1/2), m/s."""

    def note(self, v: Floats, local: Indices) -> None:
        """Adds the second half of the work of the last impulses. Then stores v(n-1/2) of the nodes ``local``; to be
        called before the kick.
        """
        self._before = v[self._local]
        self._book()
        self._local, self._before = local, v[local]

    def add(self, total: Ints) -> None:
        """Adds the first half of the work of the impulses of the step; ``total`` (h, 3): impulses, quanta."""
        self._total = total
        self._book()

    def keep(self, parcel: Parcel) -> None:
        """Adds the account to a parcel (a checkpoint or migration message)."""
        impulse = np.zeros((len(self.loss), 3), np.int64)
        impulse[self._local] = self._total
        parcel.nodes |= {"bonds.loss": self.loss, "bonds.external": self.external, "bonds.impulse": impulse}

    def resume(self, parcel: Parcel, scale: float) -> None:
        """Restores the account from a parcel (a checkpoint or migration message)."""
        self.scale = scale
        self.loss, self.external = (np.array(parcel.nodes[f"bonds.{name}"]) for name in ("loss", "external"))
        impulse = parcel.nodes["bonds.impulse"]
        self._local = np.flatnonzero(impulse.any(axis=1)).astype(np.int32)
        self._total = impulse[self._local]

    def _book(self) -> None:
        held = self.mobility[self._local]
        sweeps.book(self.loss, self.external, self._local, self._before, self._total, held, self.scale)
