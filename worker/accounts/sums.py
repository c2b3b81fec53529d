"""Sums of the energy ledger at time n, over the nodes, tets, boundaries, facets and bonds of all ranks.

One reduction over the ranks computes all sums, for each part and for the whole model, in the quanta of the whole model.
The sums of the whole model add the same integers as the sums of the parts, so they do not depend on the division into
parts. The sums of parts need no further pass.
"""

from dataclasses import dataclass, field

import numpy as np

from ..bonds.stage import Bonds
from ..boundaries.boundaries import Boundary
from ..boundaries.wall_shapes import Walls
from ..clock import Clock
from ..contact.stage import Contact
from ..elements.work import ElementWork
from ..erosion import Erosion
from ..fracture.stage import Fracture
from ..materials.law import BULK, DENSITY
from ..model.rows import WORKS
from ..model.state import Flags, Floats, Indices, Model, Nodes
from ..parallel.comm import Comm
from ..parallel.fixed_point import Columns, Table, Tally, exact_sums, totals_and_words
from ..parallel.grouped import Grouped
from ..parallel.passes import Pass
from ..parallel.team import Team
from ..rigid.stage import Rigid
from ..rigid.sums import add_undeformed, energy_of, of_bonds
from .making import STRAIN
from .nodal import NODAL, OF_NODES, add_booked, of_nodes


@dataclass(frozen=True)
class Eroded:
    """Energies, mass and momenta of removed tets and nodes."""

    works: Floats
    """(5,) sums of WORKS over the removed tets, and of the part of their heat on which their pressure depends, J."""
    kinetic: float = 0.0
    """Kinetic energy of the removed nodes, J."""
    mass: float = 0.0
    """Mass of the removed nodes, kg."""
    momenta: Floats = field(default_factory=lambda: np.zeros(6))
    """Momentum, kg m/s, and angular momentum, kg m^2/s, of the removed nodes."""


@dataclass(frozen=True)
class Totals:
    """The sums of the energy ledger at time n."""

    t: float
    """Simulated time at step n, s."""
    nodal: Floats
    """(NODAL,) sums of the rows of ``nodal.of_nodes`` over all nodes, rigid bodies and walls."""
    works: Floats
    """(4,) sums of the columns WORKS over all tets, J."""
    kinetic: Floats
    """(parts,) kinetic energy of each part, J."""
    internal: Floats
    """(parts,) work of the stress and of the bulk viscosity in each part, J."""
    eroded: Eroded
    facets: tuple[float, float, float]
    """Energies of the cohesive facets, J: dissipated energy, recoverable energy, and the fracture energy of all facets
    that were ever inserted."""
    bonds: list[float]
    """Energy lost by bonds of meshes that do not match, J."""
    friction: float
    """Energy lost by friction of contact and of boundaries, J."""


class Sums:
    """Object that computes the sums of the energy ledger. Every public method is collective."""

    def __init__(
        self, model: Model, boundaries: list[Boundary], contact: Contact | None, bonds: Bonds | None,
        erosion: Erosion | None, fracture: Fracture | None, undeformed: tuple[Rigid | None, Walls], comm: Comm,
        clock: Clock, team: Team,
    ) -> None:  # fmt: skip
        """``undeformed``: rigid parts and walls; ``team``: threads that pass over the nodes."""
        self._pass, self._columns = Pass(team, of_nodes, *OF_NODES), np.empty(0)
        self._by_part, self._work = Grouped(team, len(model.parts)), ElementWork(model, team)
        self._model, self._boundaries, self._contact, self._bonds = model, boundaries, contact, bonds
        self._erosion, self._undeformed, self._comm, self._clock = erosion, undeformed, comm, clock
        self._cohesion = fracture.cohesion if fracture is not None else None

    def kinetic(self) -> float:
        """Return the kinetic energy of the present velocities of the model, J."""
        nodes = self._model.nodes
        energy = 0.5 * nodes.mass * (nodes.v * nodes.v).sum(axis=1)
        return self._node_sum(energy, self._counted()) + energy_of(*self._undeformed)

    def rounding(self) -> float:
        """Return the energy that a volume strain of making.STRAIN has in the whole model, J."""
        nodes, bulk = self._model.nodes, np.zeros(len(self._model.parts))
        for block in self._model.blocks:
            bulk[block.part] = block.params[BULK] / block.params[DENSITY]
        bulk = self._comm.maximum(bulk)
        return self._node_sum(0.5 * STRAIN * STRAIN * nodes.mass * bulk[nodes.part], nodes.owned)

    def take(self, before: Floats) -> Totals:
        """Return the sums at time n. ``before`` is v(n-1/2) (nodes, 3); the model has v(n+1/2)."""
        tables, tallies = self._tables(before), self._tallies()
        words = np.concatenate([np.zeros(0, np.int64), *(tally.words.reshape(-1) for tally in tallies.values())])
        sums, of_parts, words = totals_and_words(self._comm, [each for some in tables.values() for each in some], words)
        rest, first = sums[NODAL + len(WORKS) :], len(tables["boundaries"])
        second = first + len(tables["bonds"])
        booked = {"boundaries": rest[:first], "bonds": rest[first:second], "facets": rest[second:]}
        for name, tally in tallies.items():
            booked[name] = tally.valued(words[: tally.words.size].reshape(2, -1))
            words = words[tally.words.size :]
        add_undeformed(sums[:NODAL], of_parts, *self._undeformed)
        cohesion = self._cohesion
        return Totals(
            t=self._clock.t, nodal=sums[:NODAL], works=sums[NODAL : NODAL + len(WORKS)], kinetic=of_parts[:, 0],
            internal=of_parts[:, NODAL] + of_parts[:, NODAL + 1], eroded=self._eroded(booked),
            facets=cohesion.energies(booked["facets"], booked["gone"]) if cohesion is not None else (0.0, 0.0, 0.0),
            bonds=[*booked["bonds"].tolist(), *of_bonds(self._undeformed[0])], friction=self._friction(booked),
        )  # fmt: skip

    def _tables(self, before: Floats) -> dict[str, list[Columns]]:
        """Return the columns to be summed, in the order of the sums: NODAL, WORKS, one column for each boundary with
        friction, one for bonds, and the columns of cohesive facets.
        """
        nodes, parts = self._model.nodes, len(self._model.parts)
        tables: dict[str, list[Columns]] = {
            "nodes": [self._by_part.of(*_with_shares(self._of_nodes(before), nodes))],
            "tets": [self._work],
            "boundaries": [
                Table(np.where(nodes.owned[each.nodes], each.friction_loss, 0.0)[:, None], parts)
                for each in self._boundaries if each.friction_loss is not None
            ], "bonds": [], "facets": [],
        }  # fmt: skip
        if self._bonds is not None:
            tables["bonds"].append(Table(np.where(nodes.owned, self._bonds.account.loss, 0.0)[:, None], parts))
        if self._cohesion is not None:
            tables["facets"].append(Table(self._cohesion.columns(), parts))
        return tables

    def _of_nodes(self, before: Floats) -> Floats:
        """Return (NODAL, nodes) the energies and momenta of the nodes. The next call overwrites the returned array."""
        nodes = self._model.nodes
        if NODAL * nodes.n > len(self._columns):
            self._columns = np.empty(int(1.25 * NODAL * nodes.n))
        columns = self._columns[: NODAL * nodes.n].reshape(NODAL, nodes.n)
        self._pass.run(
            nodes.n, columns, nodes.x, before, nodes.v, nodes.force, self._clock.shorter / nodes.scale, nodes.stepping,
            nodes.mass, *self._boundary_work(), self._counted(),
        )  # fmt: skip
        return columns

    def _boundary_work(self) -> tuple[Floats, Floats]:
        """Return (nodes,) the energy lost by impacts and the external work, J."""
        n, contact = self._model.nodes.n, self._contact
        loss = np.zeros(n) if contact is None else contact.books.contact_loss.copy()
        external = np.zeros(n)
        for boundary in self._boundaries:
            add_booked(loss, external, boundary.nodes, boundary.contact_loss, boundary.external_work)
        if contact is not None:
            external += contact.books.external_work
        if self._bonds is not None:
            external += self._bonds.account.external
        return loss, external

    def _tallies(self) -> dict[str, Tally]:
        """Return the sums that are accumulated over the whole run."""
        found = {}
        if self._contact is not None:
            found["friction"] = self._contact.books.friction
        if self._erosion is not None:
            found |= {"eroded tets": self._erosion.account.work, "eroded nodes": self._erosion.account.nodal}
        if self._cohesion is not None:
            found["gone"] = self._cohesion.gone
        return found

    def _eroded(self, booked: dict[str, Floats]) -> Eroded:
        if self._erosion is None:
            return Eroded(np.zeros(len(WORKS) + 1))
        kinetic, mass, *momenta = booked["eroded nodes"]
        return Eroded(booked["eroded tets"], float(kinetic), float(mass), np.array(momenta))

    def _friction(self, booked: dict[str, Floats]) -> float:
        rigid = self._undeformed[0]
        work = self._contact.books.friction_work(booked["friction"]) if self._contact is not None else 0.0
        if rigid is not None:
            work += float(rigid.account.friction_loss.sum())
        return sum(booked["boundaries"].tolist(), work)

    def _node_sum(self, values: Floats, counted: Flags) -> float:
        return float(exact_sums(self._comm, values[counted][:, None])[0])

    def _counted(self) -> Flags:
        """Return (nodes,) True for each node that this rank counts. It counts the nodes that it owns, except nodes of
        rigid parts.
        """
        nodes, rigid = self._model.nodes, self._undeformed[0]
        return nodes.owned if rigid is None else nodes.owned & (rigid.of_part[nodes.part] < 0)


def _with_shares(columns: Floats, nodes: Nodes) -> tuple[Floats, Indices]:
    """Return (NODAL, n) the ``columns`` (NODAL, nodes), and the part of each row (n,). A node of several parts has one
    row for each of its parts; its values are divided among the parts in proportion to mass.
    """
    shares = nodes.shares
    if not len(shares.node):
        return columns, nodes.part
    more = columns[:, shares.node] * shares.fraction
    columns[:, shares.node] = 0.0
    return np.concatenate([columns, more], axis=1), np.concatenate([nodes.part, shares.part])
