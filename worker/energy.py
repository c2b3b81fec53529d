"""The ledger: every joule has a line, and the residual says whether the lines close.

Kinetic energy is the form that the leapfrog step conserves together with the trapezoidal work of the forces:
1/2 m v(n-1/2) . v(n+1/2) for equal steps, and with the steps dt- before n and dt+ after it, seen from before,
1/2 m v(n-1/2) . v(n+1/2) + 1/4 (dt- - dt+) v(n-1/2) . f(n). Seen from after it is less by
1/4 (dt- - dt+) f(n) . (v(n-1/2) - v(n+1/2)): an error of the method, booked node by node as ``stepping``
(docs/numerics.md, Time integration). Work of the stress is summed tet by tet from stress and strain rate, not from
nodal forces, so the residual compares two independent accounts.

The sums over nodes and tets are made part by part, in the quanta of the whole: those of the whole are the sums of the
same integers, so that their bits do not know of parts, and what each part has costs no further pass.
"""

import numpy as np

from conoid.cases.messages import Energy, PartEnergy

from .boundaries import Boundary
from .clock import Clock
from .contact.stage import Contact
from .erosion import Erosion
from .errors import EnergyError
from .fracture.stage import Fracture
from .jit import njit
from .parallel.comm import Comm
from .parallel.fixed_point import Grouped, add_limbs, exact_sums, exact_totals, larger
from .state import CHUNK, WORKS, Block, Floats, Ints, Model

_TOLD = 0.01
"""Share of the largest energy that may be missing, that unequal steps may take or make and averaged pressures make,
without a word, and of the energy of fracture that may come back. Chosen: what the other lines are usually read to.
"""


class Ledger:
    """Sums the accounts of all ranks; the first call sets the initial energy."""

    def __init__(
        self, model: Model, boundaries: list[Boundary], contact: Contact | None, erosion: Erosion | None,
        fracture: Fracture | None, comm: Comm, clock: Clock,
    ) -> None:  # fmt: skip
        self._model = model
        self._boundaries = boundaries
        self._contact = contact
        self._erosion = erosion
        self._fracture = fracture
        self._comm = comm
        self._clock = clock
        nodes = model.nodes
        self.initial = float(self._node_sum(0.5 * nodes.mass * (nodes.v * nodes.v).sum(axis=1)))
        self.worst = 0.0
        """Largest residual so far."""
        self.lost = 0.0
        """Share of the initial energy that contact has taken, friction included, at the last call."""
        self.stepping = 0.0
        """Magnitude of what unequal steps have taken, over the largest energy, at the last call: of what has come in so
        far, of the work of the stress and of motion."""
        self.residual = 0.0
        """What does not add up, over the same, at the last call."""
        self.averaged = 0.0
        """What averaged pressures have given beyond all that they have taken, over the same, at the last call."""
        self.beyond = 0.0
        """Energy of motion beyond all that has come in, over the same, at the last call: all other lines add up to less
        than nothing."""
        self.made = 0.0
        """What contact has given beyond all that it has taken, over ``came``, at the last call."""
        self.unpaid = 0.0
        """Most that the energy lost to fracture has fallen by so far, over what all broken facets take: facets gave
        what nobody had paid."""
        self._taken = 0.0
        """The largest energy lost to fracture so far, J."""
        self.came = self.initial
        """The largest energy that has come in so far, J."""
        self.momentum = np.zeros(3)
        """Linear momentum at the last call, kg m/s, that of what has left included."""
        self.eroded_mass = 0.0
        """kg; of nodes that have left, at the last call."""
        self.parts: dict[str, PartEnergy] = {}
        """Of each part at the last call; empty where there is one part alone."""

    def keep(self) -> tuple[tuple[float, float, float, float, float, float], Floats, float]:
        """What it remembers, equal on all ranks."""
        largest = self.initial, self.came, self.worst, self.lost, self._taken, self.unpaid
        return largest, self.momentum, self.eroded_mass

    def resume(self, known: tuple[tuple[float, float, float, float, float, float], Floats, float]) -> None:
        """Takes it back."""
        largest, self.momentum, self.eroded_mass = known
        self.initial, self.came, self.worst, self.lost, self._taken, self.unpaid = largest

    def close(self, before: Floats) -> Energy:
        """The ledger at time n; ``before`` is v(n-1/2), the model holds v(n+1/2)."""
        nodes = self._model.nodes
        loss, external = self._boundary_work()
        shorter = self._clock.shorter / nodes.scale
        columns = _of_nodes(
            before, nodes.v, nodes.force, shorter, nodes.stepping, nodes.mass, loss, external, nodes.owned
        )
        parts = len(self._model.parts)
        of_nodes = Grouped(columns, nodes.part[nodes.owned], parts)
        sums, of_parts = exact_totals(self._comm, of_nodes, ElementWork(self._model.blocks, parts))
        node_sums, (work, viscous, plastic, averaged) = sums[:7], sums[7:]
        self.parts = _named(self._model.parts, of_parts[:, 0], of_parts[:, 7] + of_parts[:, 8])
        gone, gone_kinetic, gone_momentum = self._gone()
        gone_work, gone_viscous, gone_plastic, gone_averaged = gone.tolist()
        self.momentum = node_sums[3:6] + gone_momentum
        self.lost = float(node_sums[1]) / self.initial if self.initial > 0.0 else 0.0
        kinetic_sum, loss_sum, external_sum, stepping = (float(v) for v in (*node_sums[:3], node_sums[6]))
        eroded = gone_work - gone_plastic - gone_averaged + gone_kinetic
        plastic_sum, viscous_sum = float(plastic) + gone_plastic, float(viscous) + gone_viscous
        elastic, averaging = float(work - plastic - averaged), float(averaged) + gone_averaged
        lost, cohesive = 0.0, 0.0
        if self._fracture is not None and self._fracture.cohesion is not None:
            lost, cohesive, whole = self._fracture.cohesion.energies(self._comm)
            self._taken = max(self._taken, lost)
            self.unpaid = max(self.unpaid, (self._taken - lost) / whole if whole > 0.0 else 0.0)
        inside = elastic + plastic_sum + viscous_sum + averaging
        total = kinetic_sum + inside + loss_sum + eroded + lost + cohesive + stepping
        friction = self._friction_work()
        self.came = max(self.came, abs(external_sum))
        scale = max(self.came, abs(float(work)), kinetic_sum)
        left = abs(total - self.initial - external_sum)
        self.residual = left / scale if scale != 0.0 else left
        self.stepping = abs(stepping) / scale if scale != 0.0 else 0.0
        self.averaged = max(-averaging, 0.0) / scale if scale != 0.0 else 0.0
        self.beyond = max(kinetic_sum - self.initial - external_sum, 0.0) / scale if scale != 0.0 else 0.0
        self.made = max(friction - loss_sum, 0.0) / self.came if self.came > 0.0 else 0.0
        self.worst = max(self.worst, self.residual)
        return Energy(
            kinetic=kinetic_sum, elastic=elastic, plastic=plastic_sum, viscous=viscous_sum, averaging=averaging,
            contact=loss_sum - friction, friction=friction, eroded=eroded, fracture=lost, cohesive=cohesive,
            stepping=stepping, external=external_sum, initial=self.initial, residual=self.residual,
        )  # fmt: skip

    @property
    def warnings(self) -> list[str]:
        """What the user should know of the account, by the last call."""
        step, form = "a smaller numerics.dt_safety lowers it", "with numerics.pressure = 'standard' there is none"
        told = [
            (self.worst, "the account of the energy has not closed by up to {:.2g} of the largest energy", step),
            (self.stepping, "unequal time steps have taken or made {:.2g} of the largest energy", step),
            (self.averaged, "averaged pressures have made {:.2g} of the largest energy", form),
            (
                self.unpaid,
                "facets that closed have given {:.2g} of the energy that all broken facets take, which nobody had paid",
                step,
            ),
        ]
        return [f"{text.format(share)}; {remedy}" for share, text, remedy in told if share > _TOLD]

    def require(self, limit: float, when: str) -> None:
        """Raises EnergyError when the last call has found more than ``limit``, run.residual_limit; ``when``: of it."""
        for what, share, remedy in (
            ("the energy that contact has made", self.made, ""),
            ("the energy of motion beyond all that has come in", self.beyond, ""),
            ("the energy residual", self.residual, ""),
            ("the energy of unequal time steps", self.stepping, "; a smaller numerics.dt_safety lowers it"),
        ):
            if not share <= limit:
                raise EnergyError(f"{what}, {share:.3g}, passed run.residual_limit {limit:g} {when}{remedy}")

    def _node_sum(self, values: Floats) -> float:
        return float(exact_sums(self._comm, values[self._model.nodes.owned][:, None])[0])

    def _gone(self) -> tuple[Floats, float, Floats]:
        """(4,) WORKS of eroded tets, J; energy, J, and momentum, kg m/s, of eroded nodes."""
        if self._erosion is None:
            return np.zeros(len(WORKS)), 0.0, np.zeros(3)
        kinetic, mass, *momentum = self._erosion.nodal()
        self.eroded_mass = float(mass)
        return self._erosion.work(), float(kinetic), np.array(momentum)

    def _friction_work(self) -> float:
        """Energy, J, that friction has taken, of contact and of boundaries."""
        work = self._contact.friction_work() if self._contact is not None else 0.0
        for boundary in self._boundaries:
            if boundary.friction_loss is not None:
                loss = np.zeros(self._model.nodes.n)
                loss[boundary.nodes] = boundary.friction_loss
                work += self._node_sum(loss)
        return work

    def _boundary_work(self) -> tuple[Floats, Floats]:
        """(nodes,) energy lost by impacts, and work from outside, J."""
        n, contact = self._model.nodes.n, self._contact
        loss = np.zeros(n) if contact is None else contact.books.contact_loss.copy()
        external = np.zeros(n)
        for boundary in self._boundaries:
            np.add.at(loss, boundary.nodes, boundary.contact_loss)
            np.add.at(external, boundary.nodes, boundary.external_work)
        if contact is not None:
            external += contact.books.external_work
        return loss, external


def _named(parts: list[str], kinetic: Floats, internal: Floats) -> dict[str, PartEnergy]:
    """By part; none where there is one part alone."""
    rows = zip(parts, kinetic.tolist(), internal.tolist(), strict=True)
    return {part: PartEnergy(kinetic=k, internal=i) for part, k, i in rows} if len(parts) > 1 else {}


class ElementWork:
    """The columns WORKS over all tets, grouped by part, J; read where they are."""

    def __init__(self, blocks: list[Block], parts: int) -> None:
        self._blocks, self._parts = blocks, parts

    def largest(self) -> Floats:
        return self._visited(np.zeros(0))[0]

    def limbs(self, scale: Floats) -> Ints:
        return self._visited(scale)[1]

    def _visited(self, scale: Floats) -> tuple[Floats, Ints]:
        largest, words = np.zeros(len(WORKS)), np.zeros((self._parts, 2 * len(WORKS)), np.int64)
        for block in self._blocks:
            _visit_work(largest, words[block.part], block.state, block.n, scale)
        return largest, words


@njit("void(float64[::1], int64[::1], float64[:, :, ::1], int64, float64[::1])", cache=True)
def _visit_work(largest, words, state, n, scale):  # type: ignore[no-untyped-def]
    """Raises the ``largest`` (4,) magnitudes; adds to the limbs ``words`` (8,) where ``scale`` (4,) is given."""
    for j in range(len(WORKS)):
        row = WORKS[j]
        if row >= state.shape[1]:
            continue
        for c in range(state.shape[0]):
            for i in range(min(CHUNK, n - c * CHUNK)):
                largest[j] = larger(largest[j], state[c, row, i])
                if len(scale) > 0:
                    add_limbs(words, j, state[c, row, i], scale[j])


@njit(
    "float64[:, ::1](float64[:, ::1], float64[:, ::1], int64[:, ::1], float64, float64[::1], float64[::1], "
    "float64[::1], float64[::1], boolean[::1])",
    cache=True,
)
def _of_nodes(before, v, force, shorter, stepping, mass, loss, external, owned):  # type: ignore[no-untyped-def]
    """(owned nodes, 7) kinetic energy, J, energy lost by impacts and work from outside, J, momentum, kg m/s, and what
    unequal steps have taken, J: that ``kick`` has booked the half of this one already is kinetic energy until n.
    """
    out, m = np.empty((len(owned), 7)), 0
    for a in range(len(owned)):
        if not owned[a]:
            continue
        squares, power = 0.0, 0.0
        for i in range(3):
            squares += before[a, i] * v[a, i]
            power += before[a, i] * force[a, i]
            out[m, 3 + i] = 0.5 * mass[a] * (before[a, i] + v[a, i])
        out[m, 0], out[m, 6] = 0.5 * mass[a] * squares + shorter * power, stepping[a] - shorter * power
        out[m, 1], out[m, 2] = loss[a], external[a]
        m += 1
    return out[:m]
