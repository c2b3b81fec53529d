"""The ledger: every joule has a line, and the residual says whether the lines close.

Kinetic energy is the form that the leapfrog step conserves together with the trapezoidal work of the forces:
1/2 m v(n-1/2) . v(n+1/2) for equal steps, and with the steps dt- before n and dt+ after it, seen from before,
1/2 m v(n-1/2) . v(n+1/2) + 1/4 (dt- - dt+) v(n-1/2) . f(n). Seen from after it is less by
1/4 (dt- - dt+) f(n) . (v(n-1/2) - v(n+1/2)): an error of the method, booked node by node as ``stepping``
(docs/theory/time_integration.md, Time integration). Work of the stress is summed tet by tet from stress and strain
rate, not from nodal forces, so the residual compares two independent accounts.

The sums over nodes and tets are made part by part, in the quanta of the whole: those of the whole are the sums of the
same integers, so that their bits do not know of parts, and what each part has costs no further pass.
"""

from typing import Any

import numpy as np

from conoid.cases.messages import Energy, PartEnergy
from conoid.cases.model.schema import Run

from ..bonds.stage import Bonds
from ..boundaries.boundaries import Boundary
from ..boundaries.wall_shapes import Walls
from ..clock import Clock
from ..contact.stage import Contact
from ..elements.work import ElementWork
from ..erosion import Erosion
from ..errors import EnergyError
from ..fracture.stage import Fracture
from ..kernels.jit import njit, types
from ..materials.law import BULK, DENSITY
from ..model.rows import WORKS
from ..model.state import Flags, Floats, Indices, Model, Nodes
from ..parallel.arguments import reader
from ..parallel.comm import Comm
from ..parallel.fixed_point import Columns, Grouped, Table, Tally, exact_sums, totals_and_words
from ..parallel.passes import Pass
from ..parallel.team import TASK, Team
from ..rigid.stage import Rigid
from ..rigid.sums import add_undeformed, energy_of
from .making import STRAIN, TOLD, Making

_NODAL = 10
"""Sums over the nodes (``_of_nodes``), before those of the tets."""
_F, _F1, _F2 = types.float64, types.float64[::1], types.float64[:, ::1]
_OF_NODES = _F2, _F2, _F2, _F2, types.int64[:, ::1], _F, _F1, _F1, _F1, _F1, types.boolean[::1]
_nodal = reader(*_OF_NODES)


class Ledger:
    """Sums the accounts of all ranks; the first call sets the initial energy."""

    def __init__(
        self, model: Model, boundaries: list[Boundary], contact: Contact | None, bonds: Bonds | None,
        erosion: Erosion | None, fracture: Fracture | None, undeformed: tuple[Rigid | None, Walls], comm: Comm,
        clock: Clock, team: Team,
    ) -> None:  # fmt: skip
        """``team``: whose threads go over the nodes."""
        self._of_nodes, self._columns = Pass(team, _of_nodes, *_OF_NODES), np.empty(0)
        self._model = model
        self._boundaries = boundaries
        self._contact, self._bonds = contact, bonds
        self._erosion = erosion
        self._cohesion = fracture.cohesion if fracture is not None else None
        self._comm = comm
        self._clock = clock
        nodes, self._undeformed, self._rigid = model.nodes, undeformed, undeformed[0]
        self.initial = float(self._node_sum(0.5 * nodes.mass * (nodes.v * nodes.v).sum(axis=1), self._counted()))
        self.initial += energy_of(*undeformed)
        self.worst = 0.0
        """Largest residual so far."""
        self.making = Making(self._rounding())
        """What each line has made."""
        self.lost = 0.0
        """Share of the initial energy that contact has taken, friction included, at the last call."""
        self.residual = 0.0
        """What does not add up, over the largest energy, at the last call: of what has come in so far, of the work of
        the stress and of motion."""
        self.beyond = 0.0
        """Energy of motion beyond all that has come in, over the same, at the last call: all other lines add up to less
        than nothing."""
        self.unpaid = 0.0
        """Most that the energy lost to fracture has fallen by so far, over what all broken facets take: facets gave
        what nobody had paid."""
        self._taken = 0.0
        """The largest energy lost to fracture so far, J."""
        self.came = self.initial
        """The largest energy that has come in so far, J."""
        self.momentum = np.zeros(3)
        """Linear momentum at the last call, kg m/s, that of what has left included."""
        self.angular_momentum = np.zeros(3)
        """The same about the origin, kg m^2/s."""
        self.eroded_mass = 0.0
        """kg; of nodes that have left, at the last call."""
        self.parts: dict[str, PartEnergy] = {}
        """Of each part at the last call; empty where there is one part alone."""

    def keep(self) -> tuple[Any, ...]:
        """What it remembers, equal on all ranks."""
        largest = self.initial, self.came, self.worst, self.lost, self._taken, self.unpaid
        return largest, self.momentum, self.angular_momentum, self.eroded_mass, self.making.keep()

    def resume(self, known: tuple[Any, ...]) -> None:
        """Takes it back."""
        largest, self.momentum, self.angular_momentum, self.eroded_mass, made = known
        self.making.resume(made)
        self.initial, self.came, self.worst, self.lost, self._taken, self.unpaid = largest

    def close(self, before: Floats) -> Energy:
        """The ledger at time n; ``before`` is v(n-1/2), the model holds v(n+1/2)."""
        sums, of_parts, told = self._added_up(before)
        add_undeformed(sums[:_NODAL], of_parts, *self._undeformed)
        node_sums, (work, viscous, plastic, averaged) = sums[:_NODAL], sums[_NODAL : _NODAL + len(WORKS)]
        self.parts = _named(self._model.parts, of_parts[:, 0], of_parts[:, _NODAL] + of_parts[:, _NODAL + 1])
        gone, gone_kinetic, gone_momenta = self._gone(told)
        gone_work, gone_viscous, gone_plastic, gone_averaged, gone_heat = gone.tolist()
        self.momentum, self.angular_momentum = node_sums[3:6] + gone_momenta[:3], node_sums[7:] + gone_momenta[3:]
        self.lost = float(node_sums[1]) / self.initial if self.initial > 0.0 else 0.0
        kinetic_sum, loss_sum, external_sum, stepping = (float(v) for v in (*node_sums[:3], node_sums[6]))
        eroded = gone_work - gone_plastic - gone_averaged + gone_kinetic
        plastic_sum, viscous_sum = float(plastic) + gone_plastic, float(viscous) + gone_viscous
        elastic, averaging = float(work - plastic - averaged), float(averaged) + gone_averaged
        lost, cohesive = 0.0, 0.0
        if self._cohesion is not None:
            lost, cohesive, whole = self._cohesion.energies(told["open"], told["facets"])
            self._taken = max(self._taken, lost)
            self.unpaid = max(self.unpaid, (self._taken - lost) / whole if whole > 0.0 else 0.0)
        lost += sum(told["bonds"].tolist())
        inside = elastic + plastic_sum + viscous_sum + averaging
        total = kinetic_sum + inside + loss_sum + eroded + lost + cohesive + stepping
        friction = self._friction_work(told)
        self.came = max(self.came, abs(external_sum))
        scale = max(self.came, abs(float(work)), kinetic_sum)
        left = abs(total - self.initial - external_sum)
        self.residual = left / scale if scale != 0.0 else left
        self.beyond = max(kinetic_sum - self.initial - external_sum, 0.0) / scale if scale != 0.0 else 0.0
        self.worst = max(self.worst, self.residual)
        closed = Energy(
            kinetic=kinetic_sum, elastic=elastic, plastic=plastic_sum, viscous=viscous_sum, averaging=averaging,
            contact=loss_sum - friction, friction=friction, eroded=eroded, fracture=lost, cohesive=cohesive,
            stepping=stepping, external=external_sum, initial=self.initial, residual=self.residual,
        )  # fmt: skip
        self.making.look(closed, scale, self._clock.t, gone_heat)
        return closed

    def warnings(self, safety: float) -> list[str]:
        """What the user should know of the account so far; ``safety``: numerics.dt_safety."""
        paid = "of the energy that all broken facets take, which nobody had paid"
        told = [
            (self.worst, "the account of the energy has not closed by up to {:.2g} of the largest energy"),
            (self.unpaid, f"facets that closed have given {{:.2g}} {paid}"),
        ]
        compare = f"compare with numerics.dt_safety = {0.5 * safety:.2g}"
        open_ = [f"{text.format(share)}; {compare}" for share, text in told if share > TOLD]
        return open_ + self.making.warnings(safety)

    def require(self, run: Run, safety: float, when: str) -> None:
        """Raises EnergyError where a limit of ``run`` is passed: run.residual_limit by the last call, run.made_limit by
        any; ``safety``: numerics.dt_safety.
        """
        limit = run.residual_limit
        for what, share in (
            ("the energy of motion beyond all that has come in", self.beyond),
            ("the energy residual", self.residual),
        ):
            if not share <= limit:
                raise EnergyError(f"{what}, {share:.3g}, passed run.residual_limit {limit:g} {when}")
        self.making.require(run.made_limit, safety, when)

    def _rounding(self) -> float:
        """Energy of a volume strain of making.STRAIN everywhere, J; all ranks take part."""
        nodes, bulk = self._model.nodes, np.zeros(len(self._model.parts))
        for block in self._model.blocks:
            bulk[block.part] = block.params[BULK] / block.params[DENSITY]
        bulk = self._comm.maximum(bulk)
        return self._node_sum(0.5 * STRAIN * STRAIN * nodes.mass * bulk[nodes.part], nodes.owned)

    def _node_sum(self, values: Floats, counted: Flags) -> float:
        return float(exact_sums(self._comm, values[counted][:, None])[0])

    def _counted(self) -> Flags:
        """(nodes,) those that this rank adds up: it owns them, and they are of no rigid body."""
        nodes = self._model.nodes
        return nodes.owned if self._rigid is None else nodes.owned & (self._rigid.of_part[nodes.part] < 0)

    def _added_up(self, before: Floats) -> tuple[Floats, Floats, dict[str, Floats]]:
        """All that is added up over the ranks, at once: the sums of ``_of_nodes`` and of WORKS, those of each part, and
        by their names those of friction on boundaries, of ``open`` facets and of what has been booked so far.
        """
        nodes, parts = self._model.nodes, len(self._model.parts)
        if _NODAL * nodes.n > len(self._columns):
            self._columns = np.empty(int(1.25 * _NODAL * nodes.n))
        columns = self._columns[: _NODAL * nodes.n].reshape(_NODAL, nodes.n)
        self._of_nodes.run(
            nodes.n, columns, nodes.x, before, nodes.v, nodes.force, self._clock.shorter / nodes.scale, nodes.stepping,
            nodes.mass, *self._boundary_work(), self._counted(),
        )  # fmt: skip
        tables: list[Columns] = [
            Grouped(*_by_part(columns, nodes), parts), ElementWork(self._model.blocks, parts), *self._rubbed(parts)
        ]  # fmt: skip
        rubbed = len(tables) - 2
        bound = rubbed
        if self._bonds is not None:
            tables.append(Table(np.where(nodes.owned, self._bonds.account.loss, 0.0)[:, None], parts))
            bound += 1
        if self._cohesion is not None:
            tables.append(Table(self._cohesion.columns(), parts))
        tallies = self._tallies()
        words = np.concatenate([np.zeros(0, np.int64), *(tally.words.reshape(-1) for tally in tallies.values())])
        sums, of_parts, words = totals_and_words(self._comm, tables, words)
        booked = sums[_NODAL + len(WORKS) :]
        told = {"boundaries": booked[:rubbed], "bonds": booked[rubbed:bound], "open": booked[bound:]}
        for name, tally in tallies.items():
            told[name] = tally.valued(words[: tally.words.size].reshape(2, -1))
            words = words[tally.words.size :]
        return sums, of_parts, told

    def _tallies(self) -> dict[str, Tally]:
        """What has been added up through the run."""
        found = {}
        if self._contact is not None:
            found["friction"] = self._contact.books.friction
        if self._erosion is not None:
            found |= {"tets": self._erosion.account.work, "nodes": self._erosion.account.nodal}
        if self._cohesion is not None:
            found["facets"] = self._cohesion.gone
        return found

    def _rubbed(self, parts: int) -> list[Table]:
        """(n, 1) what friction on each boundary has taken, J."""
        owned = self._model.nodes.owned
        pairs = [(each.nodes, each.friction_loss) for each in self._boundaries if each.friction_loss is not None]
        return [Table(np.where(owned[nodes], loss, 0.0)[:, None], parts) for nodes, loss in pairs]

    def _gone(self, told: dict[str, Floats]) -> tuple[Floats, float, Floats]:
        """(5,) WORKS of eroded tets and the heat that their pressure has seen, J; of eroded nodes energy, J, momentum,
        kg m/s, and angular momentum, kg m^2/s.
        """
        if self._erosion is None:
            return np.zeros(len(WORKS) + 1), 0.0, np.zeros(6)
        kinetic, mass, *momenta = told["nodes"]
        self.eroded_mass = float(mass)
        return told["tets"], float(kinetic), np.array(momenta)

    def _friction_work(self, told: dict[str, Floats]) -> float:
        """Energy, J, that friction has taken, of contact and of boundaries."""
        work = self._contact.books.friction_work(told["friction"]) if self._contact is not None else 0.0
        if self._rigid is not None:
            work += float(self._rigid.account.friction_loss.sum())
        return sum(told["boundaries"].tolist(), work)

    def _boundary_work(self) -> tuple[Floats, Floats]:
        """(nodes,) energy lost by impacts, and work from outside, J."""
        n, contact = self._model.nodes.n, self._contact
        loss = np.zeros(n) if contact is None else contact.books.contact_loss.copy()
        external = np.zeros(n)
        for boundary in self._boundaries:
            _add(loss, external, boundary.nodes, boundary.contact_loss, boundary.external_work)
        if contact is not None:
            external += contact.books.external_work
        if self._bonds is not None:
            external += self._bonds.account.external
        return loss, external


def _by_part(columns: Floats, nodes: Nodes) -> tuple[Floats, Indices]:
    """(n, k) rows of ``columns`` (k, nodes), and their parts (n,): a node of several parts has a row for each, by its
    mass.
    """
    shares = nodes.shares
    if not len(shares.node):
        return columns.T, nodes.part
    more = columns[:, shares.node] * shares.fraction
    columns[:, shares.node] = 0.0
    return np.concatenate([columns, more], axis=1).T, np.concatenate([nodes.part, shares.part])


def _named(parts: list[str], kinetic: Floats, internal: Floats) -> dict[str, PartEnergy]:
    """By part; none where there is one part alone."""
    rows = zip(parts, kinetic.tolist(), internal.tolist(), strict=True)
    return {part: PartEnergy(kinetic=k, internal=i) for part, k, i in rows} if len(parts) > 1 else {}


@njit("void(float64[::1], float64[::1], int32[::1], float64[::1], float64[::1])", cache=True)
def _add(loss, external, nodes, lost, worked):  # type: ignore[no-untyped-def]
    """Adds what a boundary has booked of its ``nodes`` (n,) to two columns of all nodes."""
    for i in range(len(nodes)):
        loss[nodes[i]] += lost[i]
        external[nodes[i]] += worked[i]


@njit(TASK, cache=True, error_model="numpy")
def _of_nodes(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Sets ``out`` (_NODAL, nodes): kinetic energy, J, energy lost by impacts and work from outside, J, momentum,
    kg m/s, what unequal steps have taken, J: that ``kick`` has booked the half of this one already is kinetic energy
    until n; and angular momentum about the origin, kg m^2/s, by the positions ``at`` n, m. Nothing of nodes that are
    not ``owned``.
    """
    out, at, before, v, force, shorter, stepping, mass, loss, external, owned = _nodal(table)
    at, before, v, force = at[first:stop], before[first:stop], v[first:stop], force[first:stop]
    stepping, mass, loss = stepping[first:stop], mass[first:stop], loss[first:stop]
    external, owned, out = external[first:stop], owned[first:stop], out[:, first:stop]
    for a in range(len(mass)):
        if not owned[a]:
            out[:, a] = 0.0
            continue
        half, x, y, z = 0.5 * mass[a], before[a, 0], before[a, 1], before[a, 2]
        power = x * force[a, 0] + y * force[a, 1] + z * force[a, 2]
        squares = x * v[a, 0] + y * v[a, 1] + z * v[a, 2]
        out[0, a], out[1, a], out[2, a] = half * squares + shorter * power, loss[a], external[a]
        p, q, r = half * (x + v[a, 0]), half * (y + v[a, 1]), half * (z + v[a, 2])
        out[3, a], out[4, a], out[5, a], out[6, a] = p, q, r, stepping[a] - shorter * power
        out[7, a] = at[a, 1] * r - at[a, 2] * q
        out[8, a] = at[a, 2] * p - at[a, 0] * r
        out[9, a] = at[a, 0] * q - at[a, 1] * p
