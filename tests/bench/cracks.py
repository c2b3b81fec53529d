"""Running cracks on several meshes: time of start and branching, crack speed, and dissipated work.

A facet counts as open when it carries no traction any more. A facet breaks before it is open; the facets between the
two states are the cohesive zone.
"""

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal
from unittest.mock import patch

import numpy as np
from matplotlib.tri import Triangulation

from conoid.cases import load
from conoid.cases.messages import Energy
from conoid.cases.model.bodies import Box, Plate
from conoid.cases.model.materials import Material
from conoid.cases.model.schema import Case
from conoid.cases.shapes.geometry import bounds
from conoid.worker import simulation, step
from conoid.worker.fracture import connectivity
from conoid.worker.materials.law import DENSITY
from conoid.worker.mesh import build
from conoid.worker.mesh.faces import FACES, areas
from conoid.worker.mesh.model import TetMesh, check, step_lengths
from conoid.worker.mesh.order import morton_ordered
from conoid.worker.mesh.structured import divisions
from conoid.worker.model.rows import MASS
from conoid.worker.model.state import INTACT, Floats, Ints
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.scene import assembly
from conoid.worker.simulation import Simulation

from .table import Cell, table

Kind = Literal["structured", "gmsh", "random"]
_LOOK = 0.25e-6
"""Time between two measurements of a crack, s."""
_SPAN = 12.0
"""Length over which the speed of a crack is fitted, in elements. If a facet ahead of the tip opens first, the tip
advances by two elements, which is a sixth of this length."""
_BIN = 2.0
"""Width of the bins along x in which branches of the crack are searched, in elements."""
_THROUGH = 1.5
"""Distance of the crack tip from the far edge, in elements, at which a crack counts as complete."""
_GAP = 3.0
"""Smallest distance between two branches of a crack, in elements."""
_MOVED = 0.2
"""Largest random displacement of a node in each coordinate, over the element size."""
_FLAT = 0.6
"""Smallest height of a tet after the displacement of its nodes, over the mean height."""

STRIP = """
name = "strip"
[materials.glass]
density = 2450
elastic = { young = 32e9, poisson = 0.2 }
brittle = { strength = 7e6, energy = 3 }
[[parts]]
name = "strip"
material = "glass"
stretch = { rate = [0, 6, 0] }
fracture = { model = "cohesive", delay = 0 }
[parts.mesh]
shape = "plate"
base = ["20 mm", 0, 0]
width = "40 mm"
height = "20 mm"
thickness = "0.5 mm"
generator = "structured"
element_size = "0.5 mm"
slit = { axis = "y", at = 0, low = [0, 0], high = ["1 mm", "10 mm"] }
[[boundaries]]
kind = "velocity"
low = [-1, "9.9 mm", -1]
high = [1, 1, 1]
y = 0.06
[[boundaries]]
kind = "velocity"
low = [-1, -1, -1]
high = [1, "-9.9 mm", 1]
y = -0.06
[numerics]
pressure = "standard"
[run]
end_time = "34 us"
frames = 0
"""
"""Strip under uniform tension. In the strip the energy release rate of a long crack, E strain^2 H / 2, exceeds G_c
after 16 us and is 4 G_c after 32 us; the stress reaches the strength after 36 us."""

BAR = """
name = "bar"
[materials.ceramic]
density = 2750
elastic = { young = 275e9, poisson = 0 }
brittle = { strength = 300e6, energy = 100, scatter = { modulus = 100 } }
[[parts]]
name = "bar"
material = "ceramic"
stretch = { rate = [35703, 0, 0] }
fracture = { model = "cohesive", delay = 0 }
[parts.mesh]
shape = "box"
low = [-1.528e-3, 0, 0]
high = [1.528e-3, 7.64e-5, 7.64e-5]
generator = "structured"
element_size = 7.64e-5
[[boundaries]]
kind = "velocity"
low = [-1, -1, -1]
high = [-1.527e-3, 1, 1]
x = -54.55
[[boundaries]]
kind = "velocity"
low = [1.527e-3, -1, -1]
high = [1, 1, 1]
x = 54.55
[numerics]
pressure = "standard"
dt_safety = 0.15
[run]
end_time = 3.67e-7
frames = 0
"""
"""The ceramic bar of the stretched-bar study: length 10 s_0, width s_0 / 4, strain rate rate_0, for 12 t_0."""


def rayleigh(made: Material) -> float:
    """Returns the speed of surface waves, m/s. The speed c follows from the root z below 1 of z^3 - 8 z^2 + 8 (3 - 2 k)
    z - 16 (1 - k) = 0 with z = (c / c_s)^2, k = (c_s / c_p)^2."""
    poisson = made.elastic.poisson
    k = (1.0 - 2.0 * poisson) / (2.0 - 2.0 * poisson)
    roots = np.roots([1.0, -8.0, 8.0 * (3.0 - 2.0 * k), -16.0 * (1.0 - k)])
    z = min(float(r.real) for r in roots if abs(r.imag) < 1e-9)
    return float(np.sqrt(z * made.elastic.young / (2.0 * (1.0 + poisson) * made.density)))


def slit(mesh: TetMesh, length: float) -> TetMesh:
    """Returns the mesh with a slit along the facets nearest to y = 0, from the edge to x = ``length``, m. The nodes at
    the tip of the slit are not doubled."""
    behind = mesh.points[mesh.tets, 1].mean(axis=1) > 0.0
    sides = np.zeros((2, len(mesh.points)), bool)
    for side in (0, 1):
        sides[side, mesh.tets[behind == side]] = True
    nodes = np.flatnonzero(sides.all(axis=0) & (mesh.points[:, 0] < length * (1.0 - 1e-9)))
    copies = np.arange(len(mesh.points), dtype=np.int32)
    copies[nodes] = len(mesh.points) + np.arange(len(nodes))
    points = np.concatenate([mesh.points, mesh.points[nodes]])
    return TetMesh(points, np.where(behind[:, None], copies[mesh.tets], mesh.tets))


def perturbed(mesh: TetMesh, size: float, seed: int) -> TetMesh:
    """Moves each coordinate of the interior nodes at random by at most _MOVED of ``size``, m, or by less if a tet would
    become flat."""
    points, low, high = mesh.points, mesh.points.min(axis=0), mesh.points.max(axis=0)
    least = min(_FLAT * float(mesh.step_lengths().mean()), float(mesh.step_lengths().min()))
    move = np.random.default_rng(seed).uniform(-_MOVED * size, _MOVED * size, points.shape)
    near = 1e-6 * size
    move[(points < low + near) | (points > high - near)] = 0.0
    while (flat := step_lengths(points + move, mesh.tets) < least).any():
        move[mesh.tets[flat]] *= 0.5
    return TetMesh(points + move, mesh.tets)


def random(body: Box | Plate, seed: int, straight: float = 0.0) -> TetMesh:
    """Returns one layer of prisms of three tets on a Delaunay triangulation of random points.

    The points of a grid are moved at random by up to half an element, and after that ten times to the mean of their
    neighbours. Points on the border keep their position, and no triangle has all its corners on the border. Points on
    the line y = 0 up to x = ``straight``, m, also keep their position, so that a slit along this line is smooth.
    """
    (x_low, y_low, z_low), (x_high, y_high, z_high) = bounds(body) or ((0.0,) * 3, (0.0,) * 3)
    lines = [np.linspace(a, b, divisions(b - a, body.element_size) + 1) for a, b in ((x_low, x_high), (y_low, y_high))]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = ((grid > [x_low, y_low]) & (grid < [x_high, y_high])).all(axis=1)
    inside &= (np.abs(grid[:, 1]) > 0.1 * body.element_size) | (grid[:, 0] > straight)
    grid[inside] += np.random.default_rng(seed).uniform(-0.5, 0.5, (inside.sum(), 2)) * body.element_size
    near = 0.4 * body.element_size
    grid[inside] = np.clip(grid[inside], [x_low + near, y_low + near], [x_high - near, y_high - near])
    for _ in range(10):
        edges = Triangulation(*grid.T).edges
        total, count = np.zeros_like(grid), np.bincount(edges.ravel(), minlength=len(grid))
        for a, b in (edges.T, edges.T[::-1]):
            np.add.at(total, a, grid[b])
        grid[inside] = (total / count[:, None])[inside]
    a, b, c = np.sort(Triangulation(*grid.T).triangles, axis=1).T
    n = len(grid)
    tets = np.concatenate(
        [np.stack(t, axis=1) for t in ((a, b, c, c + n), (a, b, b + n, c + n), (a, a + n, b + n, c + n))]
    )
    points = np.concatenate([np.column_stack([grid, np.full(n, z)]) for z in (z_low, z_high)])
    turned = TetMesh(points, tets).volumes() < 0.0
    tets[turned] = tets[turned][:, [0, 2, 1, 3]]
    return morton_ordered(TetMesh(points, tets))


@dataclass(frozen=True)
class Plan:
    """Plan of a run: a case, the element size, m, and the kind of mesh. The number ``seed`` is for the displacement of
    the nodes, or for a ``random`` mesh."""

    case: str
    size: float
    kind: Kind = "structured"
    seed: int | None = None
    words: tuple[str, ...] = ()
    """Assignments to keys of the case."""
    text: str = ""
    """Text of a case that is neither shipped nor in this file."""
    straight: bool = False
    """True if the slit of a ``random`` mesh is a straight line; False if the slit is made of facets near that line."""

    @property
    def name(self) -> str:
        """Name of the plan in tables."""
        seeded = f" {self.seed}" if self.kind == "random" else f", moved ({self.seed})"
        kind = self.kind + ("" if self.seed is None else seeded)
        return f"{kind}, {1e3 * self.size:.2g} mm"


def prepared(plan: Plan) -> tuple[Case, TetMesh]:
    """Returns the case and its mesh with the slit. A plate is one element thick."""
    text = plan.text or {"strip": STRIP, "bar": BAR}.get(plan.case)
    data = load.toml_data(text) if text else load.read_data(load.shipped_path(plan.case))
    words = ["run.frames=0", f"parts[0].mesh.element_size={plan.size}", *plan.words]
    if data["parts"][0]["mesh"]["shape"] == "plate":
        words.append(f"parts[0].mesh.thickness={plan.size}")
    case = load.parse_case(load.apply_overrides(data, words))
    body = case.parts[0].mesh
    assert isinstance(body, Box | Plate)
    if plan.kind == "random":
        smooth = body.slit.high[1] if body.slit is not None and plan.straight else 0.0
        mesh = check(random(body, plan.seed or 0, smooth))
    else:
        mesh = build.build(body.model_copy(update={"generator": plan.kind, "slit": None}), Path())
        if plan.seed is not None:
            mesh = perturbed(mesh, plan.size, plan.seed)
    return case, slit(mesh, body.slit.high[1]) if body.slit is not None else mesh


def open_facets(sim: Simulation) -> tuple[Ints, Floats, Floats]:
    """Returns ids (m,), initial centres (m, 3), m, and initial areas (m,), m^2, of the facets that carry no traction
    any more."""
    assert sim.fracture is not None
    assert sim.fracture.cohesion is not None
    held, x0 = sim.fracture.cohesion.facets.tets, sim.model.nodes.x0
    (block,) = sim.model.blocks
    own = 4 * block.id[:, None] + np.arange(4)
    place, face = np.nonzero((block.bond != INTACT) & (own < block.across))
    pairs = np.sort(np.column_stack([block.id[place], block.across[place, face] // 4]), axis=1)
    key = np.int64(sim.model.elements_global)
    free = ~np.isin(pairs[:, 0] * key + pairs[:, 1], held.min(axis=1) * key + held.max(axis=1))
    place, face = place[free], face[free]
    corners = np.sort(block.tets[place[:, None], FACES[face]].astype(np.int32), axis=1)
    return own[place, face], x0[corners].mean(axis=1), areas(x0, corners)


@dataclass
class Crack:
    """Open facets of a run in the order in which they opened."""

    size: float
    """Element size, m."""
    begin: float
    end: float
    """Coordinate x of the tip of the slit, and of the far edge, m."""
    id: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    centre: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    area: Floats = field(default_factory=lambda: np.zeros(0))
    time: Floats = field(default_factory=lambda: np.zeros(0))
    broken: float = np.nan
    """Time at which the first facet broke, s."""

    def look(self, sim: Simulation) -> None:
        """Adds the facets that have opened since the previous call."""
        assert sim.fracture is not None
        if not sim.fracture.broken:
            return
        if np.isnan(self.broken):
            self.broken = sim.clock.t
        ids, centres, sizes = open_facets(sim)
        new = ~np.isin(ids, self.id)
        self.id, self.centre = np.concatenate([self.id, ids[new]]), np.concatenate([self.centre, centres[new]])
        self.area = np.concatenate([self.area, sizes[new]])
        self.time = np.concatenate([self.time, np.full(int(new.sum()), sim.clock.t)])

    @property
    def start(self) -> float:
        """Time at which the first facet was open, s; NaN without an open facet."""
        return float(self.time.min()) if len(self.time) else np.nan

    def front(self) -> tuple[Floats, Floats]:
        """Returns the times, s, and x, m, of the crack tip each time the tip advances; the first position is the tip of
        the slit.
        """
        order = np.lexsort((-self.centre[:, 0], self.time))
        x = self.centre[order, 0]
        ahead = x > np.concatenate([[self.begin], np.maximum.accumulate(x)[:-1]])
        return self.time[order][ahead], x[ahead]

    def passed(self, x: float) -> float:
        """Returns the time at which the crack tip passed ``x``, s; NaN if the crack tip did not pass ``x``."""
        times, tip = self.front()
        return float(times[tip >= x][0]) if (tip >= x).any() else np.nan

    def speeds(self) -> tuple[Floats, Floats]:
        """Returns x, m, and the speed along x, m/s: slopes of straight lines through _SPAN elements of the path of the
        crack tip."""
        times, tip = self.front()
        where, speed = [], []
        for first in tip:
            some = (tip >= first) & (tip <= first + _SPAN * self.size)
            if np.ptp(tip[some]) > 0.75 * _SPAN * self.size:
                t = times[some] - times[some].mean()
                where.append(float(tip[some].mean()))
                speed.append(float((t @ (tip[some] - tip[some].mean())) / (t @ t)))
        return np.array(where), np.array(speed)

    def branches(self) -> tuple[Floats, list[Floats]]:
        """Returns x of each bin (bins,), m, and the y of each branch in the bin; two branches are separated by _GAP
        elements without an open facet."""
        step = _BIN * self.size
        edges = np.arange(self.begin, self.end, step)
        found = []
        for low in edges:
            y = np.sort(self.centre[(self.centre[:, 0] >= low) & (self.centre[:, 0] < low + step), 1])
            cuts = np.flatnonzero(np.diff(y) > _GAP * self.size) + 1
            found.append(np.array([float(part.mean()) for part in np.split(y, cuts) if len(part)]))
        return edges + 0.5 * step, found

    @property
    def branched(self) -> float:
        """Coordinate x, m, from which two branches exist over 10 elements; NaN without branching."""
        x, ways = self.branches()
        two = np.array([len(y) > 1 for y in ways])
        long = [k for k in range(len(two) - 4) if two[k : k + 5].all()]
        return float(x[long[0]]) if long else np.nan

    @property
    def straight(self) -> float:
        """Length of the branches, m: the sum of straight lines between bins; bins without an open facet are skipped."""
        x, ways = self.branches()
        total, before, last = 0.0, np.zeros(1), 2.0 * x[0] - x[1]
        for at, y in zip(x, ways, strict=True):
            total += sum(float(np.hypot(at - last, np.abs(before - here).min())) for here in y)
            before, last = (y, at) if len(y) else (before, last)
        return total

    @property
    def wake(self) -> "Crack":
        """Returns the part of the crack that is at least _SPAN elements behind the tip, in whole bins; the whole crack
        if the tip is at the far edge.

        Near the tip facets open in any order, so the open area near the tip has no defined length.
        """
        tip = float(self.centre[:, 0].max(initial=self.begin))
        if tip > self.end - _THROUGH * self.size:
            return self
        step = _BIN * self.size
        left = self.begin + step * np.floor((tip - _SPAN * self.size - self.begin) / step)
        own = self.centre[:, 0] < left
        columns = self.id[own], self.centre[own], self.area[own], self.time[own]
        return Crack(self.size, self.begin, self.end, *columns, self.broken)

    @property
    def inflation(self) -> float:
        """Open area over the area of straight lines along the branches, in a plate that is one element thick; NaN if
        the crack is too short."""
        wake = self.wake
        return float(wake.area.sum()) / (self.size * wake.straight) if len(wake.id) else np.nan


@dataclass(frozen=True)
class Run:
    """Result of a run."""

    plan: Plan
    case: Case
    tets: int
    crack: Crack
    energy: Energy
    fragments: int
    """Number of fragments of at least a tenth of the cube of the width."""
    steps: int
    cpu: float
    worst: float

    @property
    def made(self) -> Material:
        """Material of the only part of the case."""
        return self.case.materials[self.case.parts[0].material]

    @property
    def toughness(self) -> float:
        """Critical energy release rate G_c, J/m^2."""
        assert self.made.brittle is not None
        return self.made.brittle.energy

    @property
    def taken(self) -> float:
        """Work on all cohesive facets, J."""
        return self.energy.fracture + self.energy.cohesive

    @property
    def fastest(self) -> tuple[float, float]:
        """Largest crack speed along x before branching, and in the whole run, over the Rayleigh speed."""
        x, speed = self.crack.speeds()
        single = x < self.crack.branched if np.isfinite(self.crack.branched) else np.ones(len(x), bool)
        return tuple(float(v.max(initial=0.0)) / rayleigh(self.made) for v in (speed[single], speed))  # type: ignore[return-value]

    @property
    def median(self) -> float:
        """Median of the fitted speeds over the Rayleigh speed."""
        _, speed = self.crack.speeds()
        return float(np.median(speed)) / rayleigh(self.made) if len(speed) else np.nan

    @property
    def inflation(self) -> float:
        """Open area over the area of straight lines, computed by ``Crack``."""
        return self.crack.inflation

    @property
    def share(self) -> float:
        """Work on the cohesive facets of a plate over G_c times the open area."""
        return self.taken / (self.toughness * float(self.crack.area.sum()))


def watch(plan: Plan) -> Run:
    """Computes a case and measures its crack every _LOOK s; a bar is measured 20 times."""
    case, mesh = prepared(plan)
    low, high = bounds(case.parts[0].mesh) or ((0.0,) * 3, (0.0,) * 3)
    body = case.parts[0].mesh
    begin = body.slit.high[1] if isinstance(body, Box | Plate) and body.slit is not None else low[0]
    began = time.process_time()
    with patch.object(assembly, "build_mesh", lambda *_, **__: mesh):
        sim = simulation.build(case, Path(), SerialComm())
    crack, due, every = Crack(plan.size, begin, high[0]), 0.0, min(_LOOK, case.run.end_time / 20)
    step.prepare(sim)
    while True:
        looks = sim.clock.t >= due or sim.clock.done
        before = sim.model.nodes.v.copy() if looks else None
        step.first_half(sim)
        if before is not None:
            energy = sim.ledger.close(before)
            crack.look(sim)
            due += every
        if sim.clock.done:
            break
        step.second_half(sim)
    return Run(
        plan, case, len(mesh.tets), crack, energy, _fragments(sim, min(np.subtract(high, low)) ** 3), sim.clock.step,
        time.process_time() - began, sim.ledger.worst,
    )  # fmt: skip


def _fragments(sim: Simulation, cube: float) -> int:
    """Returns the number of fragments of at least a tenth of the volume ``cube``, m^3."""
    assert sim.fracture is not None
    assert sim.fracture.cohesion is not None
    (labels,) = connectivity.labels(sim.model, sim.fracture.cohesion.facets.tets, sim.comm)
    (block,) = sim.model.blocks
    _, of = np.unique(labels, return_inverse=True)
    return int((np.bincount(of, block.row(MASS)) > 0.1 * cube * block.params[DENSITY]).sum())


FINE = 1e-3 / 1.5
_KINDS: tuple[tuple[Kind, int | None], ...] = (("structured", None), ("structured", 0), ("gmsh", None), ("random", 0))
PLATES = tuple(Plan("branching_plate", size, kind, seed) for size in (1e-3, FINE) for kind, seed in _KINDS)
"""Plans of the branching benchmark on four kinds of meshes."""
SIBLINGS = tuple(Plan("branching_plate", FINE, "random", seed) for seed in range(1, 5))
"""Further random meshes, like the last mesh of PLATES."""
RANDOM = (PLATES[-1], *SIBLINGS)
"""Five random meshes without preferred directions, with the finer elements."""
_SAFETIES = (0.9, 0.899, 0.898, 0.897, 0.896, 0.895, 0.89)


def _stepped(plan: Plan, safety: float) -> Plan:
    return replace(plan, words=(f"numerics.dt_safety={safety}",))


STEPPED = (
    *(_stepped(PLATES[3], safety) for safety in _SAFETIES),
    *(_stepped(plan, safety) for safety in (0.897, 0.893) for plan in RANDOM),
)
"""Plans with slightly different time steps: a coarse mesh with seven safety factors, and the meshes of RANDOM with two
further safety factors."""
ROWS = tuple(tuple(_stepped(plan, safety) for safety in _SAFETIES) for plan in (PLATES[0], PLATES[4]))
"""Plans with seven time steps on the meshes whose facets lie in rows along the crack. The row in which the crack runs
varies with the time step."""
SHOWN = (PLATES[0], PLATES[6], PLATES[7], *SIBLINGS[:3])
"""Plans whose cracks are drawn."""
STRIPS = (Plan("strip", 0.5e-3), Plan("strip", 0.5e-3, "random", 0))
_WIDTH = 7.64e-5
BARS = tuple(
    Plan("bar", _WIDTH / n, "structured", seed) for seed, finest in ((None, 5), (0, 3)) for n in range(1, finest + 1)
)
"""Plans of the bar with one to five elements across its width."""


def measure(plans: Iterable[Plan]) -> Iterator[Run]:
    """Runs the plans one after the other."""
    for plan in plans:
        yield watch(plan)


def as_data(runs: Sequence[Run]) -> dict[str, list[float]]:
    """Returns work, J, number of fragments, CPU time, s, and, for cracks, the columns of the table."""
    return {
        ", ".join((r.plan.case, r.plan.name, *r.plan.words)): [
            r.taken,
            float(r.fragments),
            r.cpu,
            *(_columns(r) if r.plan.case != "bar" else []),
        ]
        for r in runs
    }


def report(runs: Sequence[Run]) -> str:
    """Returns all tables of the study."""
    of = {name: [r for r in runs if r.plan.case == name] for name in ("branching_plate", "strip", "bar")}
    plates = [r for r in of["branching_plate"] if not r.plan.words]
    random = [r for r in plates if r.plan in RANDOM]
    fine, coarse = ([r for r in runs if r.plan in STEPPED and r.plan.size == size] for size in (FINE, PLATES[3].size))
    rows = (scatter(f"runs of {some[0].name}, seven steps", [r for r in runs if r.plan in some]) for some in ROWS)
    return "\n\n".join([
        _cracks(plates), scatter("meshes", random), scatter("runs of these, three steps", [*random, *fine]),
        scatter("runs of one, 1 mm, seven steps", coarse), *rows,
        _cracks(of["strip"]), _bars(of["bar"]),
    ])  # fmt: skip


def _some(value: float, digits: int = 1) -> Cell:
    return f"{value:.{digits}f}" if np.isfinite(value) else None


def _columns(r: Run) -> list[float]:
    """Returns the columns of a crack: time of the first broken and the first open facet, us; position, mm, and time,
    us, of branching; time at the edge, us; speeds; area over straight area; work over G_c times area."""
    c = r.crack
    times = [1e6 * c.broken, 1e6 * c.start, 1e3 * c.branched, 1e6 * c.passed(c.branched)]
    return [*times, 1e6 * c.passed(c.end - _THROUGH * c.size), r.median, *r.fastest, r.inflation, r.share]


_DIGITS = (1, 1, 1, 1, 1, 2, 2, 2, 2, 2)
_HEAD = (
    "breaks, us", "opens, us", "branches, mm", "us", "edge, us", "c / c_R", "largest, one crack", "largest",
    "area / straight", "work / G_c area",
)  # fmt: skip


def _cracks(runs: Sequence[Run]) -> str:
    rows: list[list[Cell]] = []
    for r in runs:
        cells = [_some(v, d) for v, d in zip(_columns(r), _DIGITS, strict=True)]
        rows.append([r.plan.name, r.tets, *cells, round(r.cpu, 1), r.worst])
    return table(["mesh", "tets", *_HEAD, "CPU s", "residual"], rows)


def scatter(what: str, runs: Sequence[Run]) -> str:
    """Returns a table of the mean and the scatter of the runs that have a value; ``what`` is the name of these runs."""
    values = np.array([[*_columns(r), 1e3 * r.energy.contact] for r in runs]).T
    some = [column[np.isfinite(column)] for column in values]
    rows: list[list[Cell]] = [["of", *(len(column) for column in some)]]
    for name, of in (("mean", np.mean), ("standard deviation", np.std), ("smallest", np.min), ("largest", np.max)):
        found = (float(of(column)) if len(column) else np.nan for column in some)
        rows.append([name, *(_some(v, d) for v, d in zip(found, (*_DIGITS, 3), strict=True))])
    return table([f"{len(runs)} {what}", *_HEAD, "contact, mJ"], rows)


def _bars(runs: Sequence[Run]) -> str:
    """Returns a table of the work of each bar over the work on the finest mesh."""
    finest = min(runs, key=lambda r: (r.plan.size, r.plan.seed is not None)).taken
    rows: list[list[Cell]] = []
    for r in runs:
        ratio, moved = 3.056e-4 / r.plan.size, "" if r.plan.seed is None else "moved"
        cells: list[Cell] = [f"s_0 / {ratio:.0f} {moved}".rstrip(), r.tets, f"{r.taken / finest:.3f}", r.fragments]
        rows.append([*cells, r.steps, round(r.cpu, 1), r.worst])
    return table(["element", "tets", "E / E finest", "fragments", "steps", "CPU s", "residual"], rows)
