"""No missed pair: for any number of ranks the run finds every active contact of the whole surface once. The ranks of
this test are threads. The active contacts of a step are recorded: each contact with its nodes and, to the last bit, its
weights, its normal and its target velocity before restitution. On one rank the same kernels get all pairs of nodes and
faces, and of edges, instead of the candidate pairs.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from conoid.cases.load import apply_overrides, parse_case, read_data, shipped
from conoid.cases.model.schema import Case
from conoid.worker import simulation, step
from conoid.worker.contact.broad_phase import domain, search
from conoid.worker.contact.broad_phase.boxes import Primitives
from conoid.worker.contact.broad_phase.pairs import PairTable
from conoid.worker.contact.narrow_phase.tables import ContactRows, Step
from conoid.worker.contact.scene.near_surface import NearSurface
from conoid.worker.contact.scene.scene import Scene
from conoid.worker.contact.scene.surface_motion import SurfaceMotion
from conoid.worker.contact.surface.normals import COLUMNS, MeanNormals
from conoid.worker.contact.surface.records import AGED, OPEN
from conoid.worker.parallel.comm import Comm, SerialComm
from conoid.worker.parallel.team import team
from conoid.worker.simulation import Simulation

from ..contact.bodies import Flags, Indices
from ..contact.kernels import edge_table, edges_met, face_table, faces_met, slot_table, taken
from ..contact.ranks import on_ranks
from ..worker.meshes import Floats

RANKS = (1, 2, 3, 4, 7)
STEPS, EVERY = 60, 3
"""Number of steps of a run, and interval in steps at which all pairs are tested."""
CLOSER = {
    "crossed_bars": ("parts[0].velocity[2]=100", "parts[1].velocity[2]=-100"),
    "hertz_spheres": ("parts[0].velocity[2]=100", "parts[1].velocity[2]=-100"),
    "colliding": ("parts[0].velocity[2]=800", "parts[2].velocity[2]=-800"),
}
"""Speeds at which bodies, or large parts of their surfaces, touch within the number of steps of the run."""
OURS = ("colliding", "eroding")
"""Scenes of this folder."""
QUICK = ("eroding", "crossed_bars", "sliding_block")
"""Cases for the fast tests: surface exposed by erosion, edges, and steps in which contact has no energy to give
back."""
_MOST = 1_000_000
"""Largest number of pairs in one call of a kernel."""

Met = Counter[tuple[bytes, ...]]


def case_of(name: str, *changes: str) -> Case:
    data = read_data(Path(__file__).with_name(f"{name}.toml") if name in OURS else shipped()[name])
    return parse_case(apply_overrides(data, [*CLOSER.get(name, ()), "run.frames=0", *changes]))


CASES = {name: case_of(name) for name in sorted(shipped())}
NAMES = [*OURS, *(name for name, case in CASES.items() if case.in_contact and not case.fractures)]
"""Scenes without separation: the test makes the whole surface again, without the cracks of the broad phase."""


def written(met: ContactRows, ids: "np.ndarray") -> Met:
    """Returns the active contacts, by the global ids of their nodes."""
    columns = ids[met.nodes], met.weights, met.normals, met.wanted[:, None]
    return Counter(tuple(np.ascontiguousarray(row).tobytes() for row in rows) for rows in zip(*columns, strict=True))


class Found:
    """The active contacts of a rank at each step."""

    def __init__(self, sim: Simulation) -> None:
        assert sim.contact is not None
        self.sim, self.contact, self.at = sim, sim.contact, dict[int, Met]()
        self._meet, self.contact._meet = self.contact._meet, self.meet  # type: ignore[method-assign]

    def meet(self, now: Scene, give: float, dt: float) -> None:
        self._meet(now, give, dt)
        self.at[self.sim.clock.step] = written(
            taken(now.active.room, now.active.found[: now.active.n]), now.surface_nodes.id
        )

    def run(self) -> dict[int, Met]:
        """Makes some steps and records the active contacts that this rank computed; boundaries and forces act as
        usual.
        """
        step.prepare(self.sim)
        for _ in range(STEPS):
            step.first_half(self.sim)
            step.second_half(self.sim)
        self.sim.free()
        return self.at


class Brute(Found):
    """A rank that also records, in some steps, the active contacts among all pairs of the surface."""

    def __init__(self, sim: Simulation) -> None:
        super().__init__(sim)
        self.all = dict[int, Met]()

    def meet(self, now: Scene, give: float, dt: float) -> None:
        if self.sim.clock.step % EVERY == 0:
            if self.sim.clock.step % self.contact._scheme.interval == 0:
                self.contact.exterior.sharpen(now, self.contact._scheme.sharp)
            sides = self._sides()
            step = self._step(sides, give, dt)
            self.all[self.sim.clock.step] = self._nodes(sides, step) + self._edges(sides, step)
        super().meet(now, give, dt)

    def _sides(self) -> NearSurface:
        """Returns the whole present surface: with the faces exposed since the last broad phase, without deleted
        faces.
        """
        exterior = self.contact.exterior
        found = exterior._build(exterior.surface.flags, exterior.surface.turned)
        return SurfaceMotion(found, self.sim.model.nodes, exterior.motion.mobility, exterior.size, self.sim.comm).sides

    def _step(self, sides: NearSurface, give: float, dt: float) -> Step:
        nodes = self.sim.model.nodes
        x, v = (state[sides.surface_nodes.local] for state in (nodes.x, nodes.v))
        return Step.of(x, v, sides.surface_nodes.part, self.contact.searches.mu, give, dt)

    def _nodes(self, sides: NearSurface, step: Step) -> Met:
        met = Met()
        faces, local, owned = sides.face_places, sides.surface_nodes.local, sides.surface_nodes.places(sides.owned)
        exterior = self.contact.exterior
        mean, on_surface = np.zeros((len(local), COLUMNS)), exterior.surface.flags[local]
        MeanNormals(team(1)).means(
            mean, np.arange(len(local), dtype=np.int32), exterior._moments, local.astype(np.int32)
        )
        none = np.zeros(len(local))
        for pairs in self._pairs(sides, owned[:, None], faces[:, :3]):
            table, first = PairTable(), np.full(len(local), -1, np.int32)
            table.add(np.column_stack([owned[pairs[:, 0]], pairs[:, 1]]).astype(np.int32))
            table.hang(first, 0)
            slots = slot_table(first, mean, none, step.v)._replace(on_surface=on_surface)
            of = face_table(faces, sides.faces.size, np.zeros(len(faces)))
            of = of._replace(id=sides.faces.id, exposed=sides.faces.exposed)
            room, _ = faces_met(table.arrays(), slots, of, step, 0.0)
            met += written(room, sides.surface_nodes.id)
        return met

    def _edges(self, sides: NearSurface, step: Step) -> Met:
        met = Met()
        edges = sides.edges.take(sides.edges.sharp)
        edges = edges.take(np.lexsort((edges.sides[:, 1], edges.sides[:, 0])))
        places = sides.surface_nodes.places(edges.nodes)
        of = edge_table(places, edges.size, edges.deep, np.zeros(len(places)))._replace(
            meets=np.asarray((edges.opened >= AGED).all(axis=1) & (edges.opened == OPEN).any(axis=1))
        )
        for every in self._pairs(sides, places[:, :2], places[:, :2]):
            pairs, table = every[every[:, 0] < every[:, 1]], PairTable()
            table.add(pairs)
            room, _ = edges_met(table.arrays(), of, step, np.zeros_like(step.x), 0.0)
            met += written(room, sides.surface_nodes.id)
        return met

    def _pairs(self, sides: NearSurface, small: Indices, large: Indices) -> Iterator[Indices]:
        """Yields (p, 2) all pairs of a node and a face, or of two edges, whose parts may be in contact and that have no
        common corner.
        """
        part, allowed = sides.surface_nodes.part, ~np.isnan(self.contact.searches.mu)
        for begin in range(0, len(small), max(_MOST // max(len(large), 1), 1)):
            some = small[begin : begin + max(_MOST // max(len(large), 1), 1)]
            meet = allowed[part[some[:, 0]][:, None], part[large[:, 0]][None, :]]
            for corner in some.T:
                meet &= (corner[:, None, None] != large[None]).all(axis=2)
            i, j = np.nonzero(meet)
            yield np.column_stack([i + begin, j]).astype(np.int32)


def brute(case: Case) -> Brute:
    """Returns a rank of the run after its steps."""
    ran = Brute(simulation.build(case, Path(), SerialComm()))
    ran.run()
    return ran


def found(case: Case, ranks: int) -> dict[int, Met]:
    """Returns the active contacts of all ranks together at each step."""

    def one(comm: Comm) -> dict[int, Met]:
        return Found(simulation.build(case, Path(), comm)).run()

    together = dict[int, Met]()
    for mine in on_ranks(ranks, one):
        for number, met in mine.items():
            together[number] = together.get(number, Met()) + met
    return together


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in NAMES]
)
def test_every_pair_that_meets_is_found_once_on_any_number_of_ranks(name: str) -> None:
    """The contacts that one rank finds in the steps between two broad phases are also compared."""
    case = case_of(name)
    whole = brute(case)
    assert sum(map(bool, whole.all.values())) > len(whole.all) // 3
    assert case.erodes or whole.contact.searches.many < STEPS // 3
    for number, met in whole.all.items():
        assert set(met.values()) <= {1}
        assert whole.at[number] == met
    for ranks in RANKS[1:]:
        assert found(case, ranks) == whole.at


def missed(case: Case) -> int:
    """Returns the active contacts among all pairs that one rank has not found."""
    whole = brute(case)
    return sum((met - whole.at[number]).total() for number, met in whole.all.items())


def test_a_search_without_foresight_is_found_out() -> None:
    """Control: the check can fail. The candidates in the control are pairs that are near at present, without the
    predicted motion, and the skin is too small for the motion until the next broad phase.
    """
    case, find = case_of("fast_fragment", "contact.skin=0.1"), search.find

    def blind(
        small: Primitives,
        large: Primitives,
        x: Floats,
        v: Floats,
        part: Indices,
        allowed: Flags,
        horizon: float,
        *rest: Any,
    ) -> Indices:
        return find(small, large, x, v, part, allowed, 0.0, *rest)

    assert missed(case) == 0
    with patch.object(search, "find", blind):
        assert missed(case) > 0


@pytest.mark.slow
def test_a_search_without_skin_is_found_out() -> None:
    case, find = case_of("hertz_spheres"), search.find

    def bare(small: Primitives, large: Primitives, *rest: Any) -> Indices:
        one, other = (replace(each, reach=np.zeros_like(each.reach)) for each in (small, large))
        return find(one, other, *rest)

    with patch.object(search, "find", bare):
        assert missed(case) > 0


def test_ranks_that_send_no_surface_are_found_out() -> None:
    case = case_of("fast_fragment")
    whole = found(case, 1)
    assert found(case, 2) == whole
    with patch.object(domain, "choose", lambda *_: {}):
        assert found(case, 2) != whole
