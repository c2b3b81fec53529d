"""V24, H5: a cohesive facet driven by prescribed positions, compared with the closed form of its law.

After insertion the pairs of nodes open by ``u``. With e the offset, n the normal, b^2 = 1 / weight and D = |(e + u)| in
the norm of the law, the traction has the size strength (1 - (D - |e|) / critical) and the direction <d_n> n + b^2 d_t;
the absorbed energy at D = |e| + critical is energy times area, for any path.
"""

import math

import numpy as np
import numpy.typing as npt
import pytest

from conoid.worker.fracture.cohesive import Cohesion
from conoid.worker.fracture.columns import Facets
from conoid.worker.fracture.insertion import inserted
from conoid.worker.model.state import Nodes
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.parallel.fixed_point import exact_sums
from conoid.worker.parallel.team import team

Floats = npt.NDArray[np.float64]

STRENGTH, ENERGY, STIFFNESS = 2e6, 50.0, 1e12
CRITICAL = 2.0 * ENERGY / STRENGTH
CORNERS = np.array([[0.1, 0.2, 0.3], [2.1, 0.4, 0.1], [0.6, 1.9, 0.8]]) * 1e-3
EDGES = CORNERS[1:] - CORNERS[0]
AREA = 0.5 * float(np.linalg.norm(np.cross(*EDGES)))
NORMAL = np.cross(*EDGES) / (2.0 * AREA)
ALONG = EDGES[0] / np.linalg.norm(EDGES[0])
ANGLES = [0.0, 20.0, 45.0, 70.0, 90.0]
"""Angles between the normal and the traction at insertion, degrees."""


def direction(angle: float, turn: float = 0.4) -> Floats:
    """Returns a unit vector at ``angle``, rad, to the normal; ``turn``, rad: direction of its shear in the plane of the
    facet.
    """
    shear = math.cos(turn) * ALONG + math.sin(turn) * np.cross(NORMAL, ALONG)
    return np.asarray(math.cos(angle) * NORMAL + math.sin(angle) * shear)


class Facet:
    """A facet that is inserted under ``traction`` (3,), Pa, and is opened by displacements of its far side."""

    def __init__(
        self, traction: Floats, weight: float = 1.0, effective: float = STRENGTH, stiffness: float = STIFFNESS
    ) -> None:
        x = np.concatenate([CORNERS, CORNERS])
        n = len(x)
        nodes = Nodes(
            np.arange(n), np.zeros(n, np.int32), np.zeros(n, np.int32), np.ones(n, bool), x.copy(), x.copy(),
            np.zeros((n, 3)), np.ones(n), np.zeros((n, 3), np.int64), np.zeros(n),
        )  # fmt: skip
        one = np.ones(1)
        sides = np.arange(6, dtype=np.int32)[None]
        new: Facets = inserted(
            nodes, sides, sides, np.array([[0, 1]]), traction[None], effective * one, ENERGY * one, weight * one,
            stiffness * one, AREA * one,
        )  # fmt: skip
        self.x0, self.weight = x, weight
        self.offset = float(new.softening.lent[0, 0])
        self.cohesion = Cohesion(ENERGY * AREA, team(1))
        self.cohesion.insert(new)

    @property
    def facets(self) -> Facets:
        return self.cohesion.facets

    @property
    def pull(self) -> Floats:
        """Returns the (3,) traction on the first side of the facet, Pa."""
        return np.asarray(self.facets.state.pull[0].sum(axis=0) / AREA)

    @property
    def work(self) -> float:
        """Returns the work done on the facet so far, J."""
        return sum(self.energies()[:2])

    def energies(self) -> tuple[float, float, float]:
        """Returns dissipated, recoverable and fracture energy of the facet, J."""
        sums = exact_sums(SerialComm(), self.cohesion.columns())
        return self.cohesion.energies(sums, self.cohesion.gone.total(SerialComm()))

    def open(self, u: Floats, turned: Floats | None = None) -> None:
        """Moves the far side of the facet away from the first side by ``u`` (3,), m; ``turned`` (3, 3): rotation of
        both sides.
        """
        x = self.x0.copy()
        x[3:] += u
        self.cohesion.open(x if turned is None else np.ascontiguousarray(x @ turned.T))


def tear(facet: Facet, way: Floats, steps: int = 4000, turned: bool = False) -> None:
    """Opens a facet along ``way`` (3,) until the facet has failed; ``turned``: whether the facet turns by 1 rad
    meanwhile.
    """
    along = float(way @ NORMAL)
    end = 1.01 * (CRITICAL + 2.0 * facet.offset) / math.sqrt(along**2 + (1.0 - along**2) / facet.weight)
    for k in range(1, steps + 1):
        spin = rotation(k / steps) if turned else None
        facet.open(end * k / steps * way, spin)
    assert not len(facet.facets.state.work)


def rotation(angle: float) -> Floats:
    """Returns the rotation matrix for a rotation about the z axis."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("weight", [1.0, 0.25, 4.0])
@pytest.mark.parametrize("angle", ANGLES)
def test_the_traction_at_insertion_is_that_before(angle: float, weight: float) -> None:
    mixed = direction(math.radians(angle))
    traction = STRENGTH * mixed / math.sqrt((mixed @ NORMAL) ** 2 + weight * (1.0 - (mixed @ NORMAL) ** 2))
    facet = Facet(traction, weight)
    assert facet.pull == pytest.approx(traction, abs=1e-12 * STRENGTH)
    facet.open(np.zeros(3))
    assert facet.pull == pytest.approx(traction, abs=1e-12 * STRENGTH)
    assert facet.offset == pytest.approx(max(1.0, 1.0 / weight) * STRENGTH / STIFFNESS, rel=1e-12)


@pytest.mark.parametrize("weight", [1.0, 0.25])
@pytest.mark.parametrize("insertion", [0.0, 45.0, 90.0])
@pytest.mark.parametrize("angle", ANGLES)
def test_failure_absorbs_the_fracture_energy_in_any_direction(angle: float, insertion: float, weight: float) -> None:
    """The direction of opening may differ from that of the traction at insertion."""
    mixed = direction(math.radians(insertion))
    size = math.sqrt((mixed @ NORMAL) ** 2 + weight * (1.0 - (mixed @ NORMAL) ** 2))
    facet = Facet(STRENGTH * mixed / size, weight)
    tear(facet, direction(math.radians(angle), turn=-0.9))
    assert facet.work == pytest.approx(ENERGY * AREA, rel=1e-6)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_traction_falls_linearly_with_the_opening(angle: float) -> None:
    way = direction(math.radians(angle))
    facet = Facet(STRENGTH * way)
    for share in np.linspace(0.05, 0.95, 19):
        facet.open(share * CRITICAL * way)
        assert facet.pull == pytest.approx((1.0 - share) * STRENGTH * way, abs=1e-9 * STRENGTH)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_facet_unloads_along_the_secant_and_releases_the_energy_under_it(angle: float) -> None:
    way, most = direction(math.radians(angle)), 0.4 * CRITICAL
    facet = Facet(STRENGTH * way)
    e, top = facet.offset, 0.6 * STRENGTH
    for share in np.linspace(0.0, 1.0, 401):
        facet.open(share * most * way)
    secant = top / (most + e)
    taken = facet.work
    for share in (0.9, 0.5, 0.1, 0.0, 0.3, 0.8, 1.0):
        facet.open(share * most * way)
        assert facet.pull == pytest.approx(secant * (share * most + e) * way, abs=1e-9 * STRENGTH)
    assert facet.work == pytest.approx(taken, rel=1e-9)
    lost, back, _ = facet.energies()
    assert back == pytest.approx(AREA * 0.5 * secant * ((most + e) ** 2 - e**2), rel=1e-9)
    assert lost + back == pytest.approx(AREA * 0.5 * (STRENGTH + top) * most, rel=1e-6)
    facet.open(0.0 * way)
    assert facet.work == pytest.approx(lost, rel=1e-9)
    assert facet.energies()[1] == pytest.approx(0.0, abs=1e-12 * lost)
    tear(facet, way)
    assert facet.work == pytest.approx(ENERGY * AREA, rel=1e-6)


def test_dissipated_energy_never_decreases() -> None:
    """The opening makes a random walk, including closing beyond the start. A step that closes a facet further than the
    start releases half of its traction times the step. A step in which the normal opening changes its sign (<d_n> is
    its positive part), so that the mean of two forces is not exact, releases stiffness times step^2 / 8.
    """
    random, u, lost, largest = np.random.default_rng(3), np.zeros(3), [0.0], 0.0
    facet = Facet(STRENGTH * direction(0.7), weight=0.5)
    for _ in range(3000):
        change = random.normal(scale=0.004 * CRITICAL, size=3) + 2e-5 * CRITICAL * NORMAL
        drop = 0.5 * np.abs(np.einsum("mpi,i->mp", facet.facets.state.pull, change))
        lent = facet.facets.softening.lent.copy()
        u, largest = u + change, max(largest, abs(float(change @ NORMAL)))
        facet.open(u)
        one, back, _ = facet.energies()
        assert back >= 0.0
        gone = len(facet.facets.state.work) == 0
        lost.append(one if gone else one + float(drop[(lent > 0.0) & (facet.facets.softening.lent == 0.0)].sum()))
        if gone:
            break
        assert lost[-1] > lost[-2] - STIFFNESS * AREA * largest**2 / 8.0
        lost[-1] = one
    assert lost[-1] > 0.2 * ENERGY * AREA


@pytest.mark.parametrize("angle", ANGLES)
def test_a_facet_that_closes_beyond_its_start_is_unloaded(angle: float) -> None:
    """The facet closes in one step that is far shorter than the offset: the facet releases half of the traction times
    the step once, and no more energy later.
    """
    way, facet = direction(math.radians(angle)), Facet(STRENGTH * direction(math.radians(angle)))
    step = 1e-3 * facet.offset
    facet.open(-step * way)
    assert np.abs(facet.pull).max() == 0.0
    lost, back, _ = facet.energies()
    assert back == 0.0
    assert lost == pytest.approx(-0.5 * STRENGTH * step * AREA, rel=1e-9)
    for share in np.linspace(0.0, 0.9, 201):
        facet.open(-(step + share * facet.offset) * way)
        one, back, _ = facet.energies()
        assert one == pytest.approx(lost, abs=1e-9 * ENERGY * AREA)
        assert back >= 0.0
    facet.open(-step * way)
    assert facet.work == pytest.approx(lost, rel=1e-6)


@pytest.mark.parametrize("stiffness", [STIFFNESS, 0.02 * STIFFNESS])
@pytest.mark.parametrize("opened", [0.0, 0.3])
@pytest.mark.parametrize("angle", ANGLES)
def test_an_unloaded_facet_absorbs_the_rest_of_the_energy(angle: float, opened: float, stiffness: float) -> None:
    """The strength is lowered if the offset is so long that stiffness and strength would require more energy."""
    way = direction(math.radians(angle))
    facet = Facet(STRENGTH * way, stiffness=stiffness)
    for share in [*np.linspace(0.0, opened, 301), *np.linspace(opened, -1e-3, 301)]:
        facet.open(share * CRITICAL * way)
    assert (facet.facets.softening.lent == 0.0).all()
    assert facet.facets.softening.strength.max() <= STRENGTH
    tear(facet, way, steps=40000)
    assert facet.work == pytest.approx(ENERGY * AREA, rel=2e-3)


def test_a_facet_that_turns_with_its_bodies_takes_the_same() -> None:
    facet = Facet(STRENGTH * direction(0.5))
    tear(facet, direction(0.5), turned=True)
    assert facet.work == pytest.approx(ENERGY * AREA, rel=1e-6)


def test_an_offset_across_the_opening_does_no_more_work_when_a_facet_turns_than_its_size_allows() -> None:
    """Traction and opening are not collinear after a rotation: a rotation by an angle adds at most strength times
    offset times angle.
    """
    facet = Facet(STRENGTH * direction(0.0))
    tear(facet, direction(math.pi / 2), turned=True)
    assert abs(facet.work - ENERGY * AREA) < STRENGTH * facet.offset * AREA


@pytest.mark.parametrize("depth", [0.0, 0.3, 3.0])
def test_under_pressure_only_shear_counts(depth: float) -> None:
    """Sides of a facet that have passed each other slide: the traction is in the plane of the facet, for any depth."""
    shear = direction(math.pi / 2)
    facet = Facet(STRENGTH * shear)
    for share in np.linspace(0.1, 0.9, 9):
        facet.open(share * CRITICAL * shear - depth * CRITICAL * NORMAL)
        assert facet.pull == pytest.approx((1.0 - share) * STRENGTH * shear, abs=1e-9 * STRENGTH)


def test_a_facet_that_broke_under_pressure_holds_the_shear_that_friction_leaves() -> None:
    """The effective traction under pressure is sqrt(weight) (t_s - friction |t_n|): 3 - 0.5 * 2 = 2 MPa at weight 1."""
    shear = direction(math.pi / 2)
    facet = Facet(3e6 * shear - 2e6 * NORMAL, effective=2e6)
    assert facet.pull == pytest.approx(2e6 * shear, abs=1e-6 * STRENGTH)
    tear(facet, shear)
    assert facet.work == pytest.approx(ENERGY * AREA, rel=1e-6)


def test_one_pair_fails_after_the_other() -> None:
    """The facet is opened as a hinge about its first edge: only one of three pairs of nodes opens, and absorbs a third
    of the energy.
    """
    facet = Facet(STRENGTH * NORMAL)
    x = facet.x0.copy()
    steps = 4000
    for k in range(1, steps + 1):
        x[5] = facet.x0[5] + 1.5 * CRITICAL * k / steps * NORMAL
        facet.cohesion.open(x)
    assert len(facet.facets.state.work) == 1
    assert facet.facets.state.pull[0, 2] == pytest.approx(np.zeros(3))
    assert facet.work == pytest.approx(ENERGY * AREA / 3.0, rel=2e-3)
