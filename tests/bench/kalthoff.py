"""Plate of Kalthoff and Winkler: an impact between two edge cracks loads the cracks in shear. The study measures the
direction, the time and the speed of the crack.

The command ``python -m tests.bench.kalthoff`` runs all meshes, one after the other. The model is half of the plate, one
layer of tets between two planes of symmetry (plane strain). The meshes, the slit and the measurement of the crack are
the functions of cracks.py.
"""

import pathlib as files
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from conoid.worker.model.state import Floats

from .cracks import Crack, Kind, Plan, Run, rayleigh, watch
from .table import Cell, table

CASE = """
name = "kalthoff"
[materials.maraging]
density = 8000
elastic = { young = 190e9, poisson = 0.3 }
brittle = { strength = 844e6, energy = 22.13e3 }
[[parts]]
name = "plate"
material = "maraging"
fracture = { model = "cohesive", delay = 0 }
[parts.mesh]
shape = "plate"
base = ["50 mm", "25 mm", 0]
width = "100 mm"
height = "100 mm"
thickness = "1 mm"
generator = "structured"
element_size = "1 mm"
slit = { axis = "y", at = 0, low = [0, 0], high = ["10 mm", "50 mm"] }
[[boundaries]]
kind = "symmetry"
axis = "y"
at = "-25 mm"
[[boundaries]]
kind = "symmetry"
axis = "z"
[[boundaries]]
kind = "symmetry"
axis = "z"
at = "1 mm"
[[boundaries]]
kind = "velocity"
low = ["-0.1 mm", "-25.1 mm", -1]
high = ["0.1 mm", "-0.5 mm", 1]
x = "16.5 m/s"
[numerics]
pressure = "standard"
[run]
end_time = "90 us"
frames = 0
"""
"""Steel 18Ni1900 with the constants of published computations of this test, recalled and not checked. The projectile
is of the same steel and as wide as the distance between the slits; hence the speed of the impact face is half of 33
m/s."""
TIP = 50e-3
"""Coordinate x of the tip of the slit, m; the coordinate y of the tip is 0."""
_NEAR = 20e-3
"""Distance from the tip to which the first part of the crack extends, m."""
_PUBLISHED: tuple[Cell, ...] = (
    "published",
    None,
    None,
    "22 to 29",
    "65 to 70",
    "58 to 70",
    None,
    "0.4 to 0.7",
    None,
    None,
    None,
    None,
)
"""Results of the experiment and of computations with extended elements, cohesive zones and phase fields, recalled and
not checked."""


@dataclass(frozen=True)
class Path:
    """Crack of a run; positions are relative to the tip of the slit. Only facets that open ahead of the slit and above
    the slit belong to the crack."""

    run: Run

    @property
    def crack(self) -> Crack:
        """Open facets of the crack."""
        return self.run.crack

    @cached_property
    def away(self) -> Floats:
        """Positions (m, 2) of the open facets relative to the tip, m."""
        return np.asarray(self.crack.centre[:, :2] - np.array([TIP, 0.0]))

    @cached_property
    def distance(self) -> Floats:
        """Distances (m,) of the open facets from the tip, m."""
        return np.asarray(np.hypot(*self.away.T))

    @cached_property
    def upwards(self) -> "np.ndarray":
        """Flags (m,): True if a facet belongs to the crack from the slit, False if it belongs to a crack from another
        border.
        """
        return np.asarray((self.away[:, 1] > -2.0 * self.run.plan.size) & (self.away[:, 0] > -0.5 * TIP))

    def angle(self, most: float) -> float:
        """Returns the angle between the crack and the direction of the slit, degrees: the principal axis of the open
        area through the tip, up to the distance ``most``, m."""
        taken = self.upwards & (self.distance <= most)
        if not taken.any():
            return float("nan")
        x, y = self.away[taken].T
        area = self.crack.area[taken]
        return float(np.degrees(0.5 * np.arctan2(2.0 * area @ (x * y), area @ (x * x - y * y)))) % 180.0

    @cached_property
    def reach(self) -> float:
        """Distance of the crack tip from the tip of the slit at the end of the run, m."""
        return float(self.distance[self.upwards].max(initial=0.0))

    @cached_property
    def speed(self) -> float:
        """Crack speed, m/s: slope of a straight line through the path of the front from 5 mm to 0.9 of its length."""
        order = np.lexsort((-self.distance, self.crack.time))
        order = order[self.upwards[order]]
        r, t = self.distance[order], self.crack.time[order]
        front = r > np.concatenate([[0.0], np.maximum.accumulate(r)[:-1]])
        taken = front & (r > 5e-3) & (r < 0.9 * self.reach)
        if taken.sum() < 4:
            return float("nan")
        since = t[taken] - t[taken].mean()
        return float(since @ (r[taken] - r[taken].mean()) / (since @ since))

    @cached_property
    def share(self) -> float:
        """Fraction of the open area that lies within 10 degrees of the angle; the rest is branches and fragments beside
        the crack."""
        turned = np.degrees(np.arctan2(self.away[:, 1], self.away[:, 0]))
        near = self.upwards & (np.abs(turned - self.angle(1.0)) < 10.0)
        return float(self.crack.area[near].sum() / self.crack.area.sum()) if len(self.distance) else float("nan")

    @property
    def columns(self) -> tuple[float, ...]:
        """Returns the columns of the table: time of the first broken and of the first open facet, us; angle, and angle
        near the slit, degrees; length, mm; speed over c_R; fraction of the open area."""
        c = self.crack
        relative = self.speed / rayleigh(self.run.made)
        return (
            1e6 * c.broken, 1e6 * c.start, self.angle(1.0), self.angle(_NEAR), 1e3 * self.reach, relative, self.share
        )  # fmt: skip


def plan(kind: Kind, size: float, seed: int | None = None, *words: str, straight: bool = True) -> Plan:
    """Plan of a run: a mesh of the plate that is one element thick, with the element size ``size``, m, further
    assignments, and whether the slit is smooth.
    """
    return Plan("kalthoff", size, kind, seed, (f"boundaries[2].at={size}", *words), CASE, straight)


FINE = 1.25e-3
RANDOM = tuple(plan("random", FINE, seed) for seed in range(5))
LATTICES = (
    plan("structured", FINE), plan("structured", FINE, None, "parts[0].mesh.split=5"), plan("structured", FINE, 0),
    plan("gmsh", FINE, None, 'contact="none"'),
)  # fmt: skip
OTHERS = (
    plan("random", 2.5e-3, 0), plan("random", 1e-3, 0),
    plan("random", FINE, 0, "parts[0].fracture.shear_weight=0.1"), plan("random", FINE, 0, 'contact="none"'),
    plan("random", FINE, 0, straight=False),
)  # fmt: skip
SHOWN = (RANDOM[0], RANDOM[3], OTHERS[4], LATTICES[0], LATTICES[1], LATTICES[3])
"""Plans whose cracks are drawn."""
_SHOWN = {"split=5": "5 tets a cell", "shear_weight": "shear counts a tenth", "contact": "sides do not meet"}
"""Names of the assignments in the table."""
_DIGITS = (1, 1, 1, 1, 1, 2, 2)
_HEAD = ("breaks, us", "opens, us", "angle, deg", "to 20 mm", "reach, mm", "c / c_R", "within 10 deg")


def measure(plans: Iterable[Plan]) -> Iterator[Path]:
    """Runs the plans one after the other."""
    for some in plans:
        yield Path(watch(some))


def name(some: Plan) -> str:
    """Returns the name of the plan in tables."""
    variants = [text for key, text in _SHOWN.items() if any(key in word for word in some.words)]
    rough = some.kind == "gmsh" or not some.straight
    return ", ".join([some.name, *variants, *(["rough slit"] if rough else [])])


def report(paths: Sequence[Path]) -> str:
    """Returns tables of the results beside the published results, and of the scatter of the random meshes of one
    element size.
    """
    rows: list[list[Cell]] = [list(_PUBLISHED)] + [
        [name(p.run.plan), p.run.tets, *_texts(p.columns), p.run.steps, round(p.run.cpu), p.run.worst] for p in paths
    ]
    head = ["mesh", "tets", *_HEAD, "steps", "CPU s", "residual"]
    values = np.array([p.columns for p in paths if p.run.plan in RANDOM])
    of = (("mean", np.mean), ("standard deviation", _deviation), ("smallest", np.min), ("largest", np.max))
    scatter: list[list[Cell]] = [[word, *_texts(f(values, axis=0))] for word, f in of] if len(values) > 1 else []
    return f"{table(head, rows)}\n\n{table([f'{len(values)} random meshes', *_HEAD], scatter)}"


def _deviation(values: Floats, axis: int) -> Floats:
    """Returns the scatter of a sample."""
    return np.asarray(np.std(values, axis=axis, ddof=1))


def _texts(values: Iterable[float]) -> list[Cell]:
    return [f"{v:.{d}f}" if np.isfinite(v) else None for v, d in zip(values, _DIGITS, strict=True)]


def draw(paths: Sequence[Path], out: files.Path) -> None:
    """Draws the open facets of the plans in SHOWN as a PNG."""
    from . import plot

    plot.paths([p.run for p in paths if p.run.plan in SHOWN], out, (-25.0, 75.0))


def main() -> int:
    """Runs every mesh; prints a line after each run and the tables at the end, and draws a picture in build/bench."""
    paths = []
    for path in measure((*RANDOM, *LATTICES, *OTHERS)):
        paths.append(path)
        print(name(path.run.plan), *_texts(path.columns), round(path.run.cpu), file=sys.stderr, flush=True)
    print(report(paths))
    out = files.Path("build", "bench")
    out.mkdir(parents=True, exist_ok=True)
    draw(paths, out / "kalthoff.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
