"""Number of fragments of a ring that is stretched until it breaks, and of a bar in one dimension, compared with two
published fits.

The command ``python -m tests.bench.ring`` prints two tables: bars of the program in ``tests/fracture/bar_1d.py``, and
rings of tets. The model of a ring is a quarter between two planes of symmetry; the numbers of fragments are those of
the whole ring.
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from conoid.cases import load
from conoid.worker import simulation
from conoid.worker.fracture import connectivity
from conoid.worker.parallel.comm import SerialComm

from ..fracture.bar_1d import Bar, Run, even, scattered
from ..worker.kernels import run
from .table import Cell, table

RADIUS = 20e-3
"""Mean radius of the ring, m."""
AROUND = 2.0 * np.pi * RADIUS / Bar().s_0
"""Circumference of the ring over s_0: 411."""
THICK = 0.1e-3
"""Side of the square cross-section, m: 0.33 s_0."""
_END = {0.1: 35.0, 0.3: 20.0, 1.0: 15.0}
"""End time over t_0; after this time hardly any fragment is added. The stress reaches the strength after 1 / x."""
_LEAST = 0.02
"""Mass of a fragment, relative to the mean published fragment mass, below which the fragment counts as a crumb."""
FINE = (12, 24, 48)
"""Numbers of elements of a bar per s_0."""
BARS = {
    "even to 1e-5": Bar(scatter=1e-5), "even to 1e-4": Bar(scatter=1e-4), "even to 1e-3": Bar(scatter=1e-3),
    "uniform over 1 %": Bar(scatter=1e-2), "Weibull, modulus 100": Bar(modulus=100.0),
}  # fmt: skip
_FITS = ("fit, even strength", "fit, 1 % scatter")

SCENE = """
name = "ring"
[materials.ceramic]
density = 2750
elastic = {{ young = 275e9, poisson = 0 }}
brittle = {{ strength = 300e6, energy = 100, scatter = {{ modulus = {modulus}, seed = {seed} }} }}
[[parts]]
name = "ring"
material = "ceramic"
stretch = {{ rate = [{rate}, {rate}, 0] }}
fracture = {{ model = "cohesive", delay = 0 }}
[parts.mesh]
shape = "tube"
sector = "quarter"
generator = "structured"
inner_radius = {inner}
radius = {outer}
length = {thick}
element_size = {size}
[[boundaries]]
kind = "symmetry"
axis = "x"
[[boundaries]]
kind = "symmetry"
axis = "y"
[numerics]
pressure = "standard"
dt_safety = 0.3
[run]
end_time = {end}
frames = 0
"""
"""The ceramic of ``tests/fracture/bar_1d.py``, with Poisson's ratio 0."""


@dataclass(frozen=True)
class Plan:
    """Parameters of a ring: rate over rate_0, element size, m, Weibull modulus of the strengths of its facets."""

    x: float
    size: float
    modulus: float
    seed: int = 0


@dataclass(frozen=True)
class Broken:
    """Result of a ring: number of fragments of the whole ring without crumbs, number of tets, CPU time, s."""

    plan: Plan
    fragments: float
    tets: int
    cpu: float


RINGS = (
    *(Plan(x, size, 100.0) for x in (0.1, 0.3) for size in (THICK, THICK / 2, THICK / 3)),
    *(Plan(x, THICK / 2, modulus) for x in (0.1, 0.3) for modulus in (1e3, 1e4)),
)


def broken(plan: Plan) -> Broken:
    """Runs a ring in this process."""
    bar, began = Bar(), time.process_time()
    keys = {"inner": RADIUS - THICK / 2, "outer": RADIUS + THICK / 2, "thick": THICK, "size": plan.size}
    text = SCENE.format(
        **keys, rate=plan.x * bar.rate_0, end=_END[plan.x] * bar.t_0, modulus=plan.modulus, seed=plan.seed
    )
    sim = run(simulation.build(load.parse_toml(text), Path(), SerialComm()))
    assert sim.fracture is not None
    assert sim.fracture.cohesion is not None
    found = np.concatenate(connectivity.labels(sim.model, sim.fracture.cohesion.facets.tets, sim.comm))
    _, tets = np.unique(found, return_counts=True)
    least = _LEAST * len(found) * scattered(plan.x) / (AROUND / 4)
    return Broken(plan, 4.0 * np.count_nonzero(tets > least), len(found), time.process_time() - began)


def bars() -> str:
    """Returns a table of bars: the number of fragments per length of the ring, for several distributions of strength
    and element sizes."""
    rows: list[list[Cell]] = []
    for x in (0.1, 0.3, 1.0):
        for name, bar in BARS.items():
            counts = [round(AROUND / bar_size(x, bar, elements)) for elements in FINE]
            rows.append([f"{x:g}", name, *counts, *_published(x)])
    return table(["x", "strengths", *(f"{n} in s_0" for n in FINE), *_FITS], rows)


def bar_size(x: float, bar: Bar, elements: int, length: float = 100.0) -> float:
    """Returns the mean size of the fragments over s_0, for three bars of the length ``length`` s_0 with ``elements``
    elements per s_0."""
    cracks = 0
    for seed in range(3):
        made = replace(bar, length=length * bar.s_0, elements=round(length * elements), seed=seed)
        stretched = Run(made, x * made.rate_0, share=0.9 if made.modulus else 0.999)
        while stretched.t < _END[x] * made.t_0:
            stretched.kick()
            stretched.move()
        cracks += stretched.failed
    return 3 * length / cracks


def report(rings: Sequence[Broken]) -> str:
    """Returns a table of rings."""
    rows: list[list[Cell]] = [
        [
            f"{ring.plan.x:g}", f"{ring.plan.modulus:g}", f"{ring.plan.size / Bar().s_0:.2f}", ring.tets,
            round(ring.fragments), *_published(ring.plan.x), round(ring.cpu),
        ]
        for ring in rings
    ]  # fmt: skip
    return table(["x", "modulus", "size / s_0", "tets", "fragments", *_FITS, "CPU s"], rows)


def _published(x: float) -> list[Cell]:
    """Returns the number of fragments of the ring by the two published fits."""
    return [round(AROUND / even(x)), round(AROUND / scattered(x))]


def main() -> int:
    """Prints the two tables, and a line after each ring."""
    print(bars(), flush=True)
    rings = []
    for plan in RINGS:
        rings.append(broken(plan))
        print(rings[-1], file=sys.stderr, flush=True)
    print(report(rings))
    return 0


if __name__ == "__main__":
    sys.exit(main())
