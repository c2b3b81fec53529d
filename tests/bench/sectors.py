"""Comparison of a quarter, a half and the whole of a rod that erodes in a target: the command is
``python -m tests.bench.sectors [SIZE] [RUNS]``.

A rod of tungsten alloy, 5 x 20 mm, hits a cylinder of 4340 steel, 40 x 45 mm, at 1.5 km/s. The rod and the target erode
at a strain of 1.5. The argument ``SIZE`` is the element size, mm, by default 1.

The program gmsh makes each mesh. The meshes of the half and of the whole (``full``) are made both aligned with the
quarter (``mesh.aligned``) and not aligned. The mesh of ``mirrored``, a whole body, consists of the quarter and its
mirror images. Each mesh is run ``RUNS`` times, by default three times, with time steps that differ by 1 %. In one
series nodes without tets are removed after a contact, in the other series they remain as particles.

The table has the mean and the standard error of the depth of the hole after 60 us. From the last run the table has a
fraction of the mass of nodes without tets within the radius of the rod: the fraction within a quarter of SIZE of the
axis. Removed nodes count at the place of their contact. The table also has this fraction for a uniform distribution
over the radius, and the remaining momentum of the rod along the axis.
"""

import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from conoid.cases.load import parse_case
from conoid.cases.model import schema
from conoid.worker import simulation, step
from conoid.worker.gauges import penetration, reference
from conoid.worker.mesh.build import build
from conoid.worker.mesh.model import TetMesh
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.scene import assembly
from conoid.worker.simulation import Simulation

MM = 1e-3
ROD = 2.5 * MM
IMAGES = {"quarter": 4, "half": 2, "full": 1}
MESHES = "quarter", "half", "full", "half, not aligned", "full, not aligned", "mirrored"


def case_of(
    sector: str, size: float, end: float = 60e-6, rod: float = 20 * MM,
    target: tuple[float, float] = (20 * MM, 45 * MM), strain: float = 1.5, nodes: str = "strike", safety: float = 0.9,
    **keys: Any,
) -> schema.Case:  # fmt: skip
    """Returns the case with the length of the ``rod``, the radius and the length of the ``target``, m, the ``strain``
    of erosion, the treatment of free ``nodes``, the ``safety`` of the time step, and further ``keys`` of both meshes.
    """

    def part(name: str, material: str, speed: float, low: float, radius: float, length: float) -> dict[str, Any]:
        mesh = {
            "shape": "cylinder", "base": [0.0, 0.0, low], "radius": radius, "length": length, "sector": sector,
            "element_size": size, **keys,
        }  # fmt: skip
        return {
            "name": name, "material": material, "velocity": [0.0, 0.0, speed], "temperature": 298.0,
            "erosion": {"plastic_strain": strain, "nodes": nodes}, "mesh": mesh,
        }  # fmt: skip

    parts = [
        part("rod", "tungsten_alloy", 1500.0, -rod, ROD, rod),
        part("target", "steel_4340", 0.0, 0.0, *target),
    ]
    if keys.get("generator") != "structured":
        parts[1]["mesh"]["grading"] = {"axis": "z", "near": 4 * MM, "far": 18 * MM, "far_size": 4 * MM}
    planes = [{"kind": "symmetry", "axis": axis} for axis in {"quarter": "xy", "half": "x", "full": ""}[sector]]
    depth = {
        "quantity": "penetration", "part": "rod", "axis": "z", "value": 25 * MM, "tolerance": 25 * MM, "source": "-",
    }  # fmt: skip
    return parse_case({
        "name": "sectors", "parts": parts, "boundaries": planes, "run": {"end_time": end, "frames": 0},
        "numerics": {"dt_safety": safety}, "reference": [depth],
    })  # fmt: skip


def images(mesh: TetMesh, axes: tuple[int, ...]) -> TetMesh:
    """Returns the mesh with its mirror images at the planes across the given axes; nodes on the planes are shared."""
    x, tets = mesh.points.copy(), mesh.tets
    for axis in axes:
        on = np.abs(x[:, axis]) < 1e-9
        x[on, axis] = 0.0
        image = x[~on]
        image[:, axis] *= -1.0
        number = np.where(on, np.arange(len(x)), len(x) + np.cumsum(~on) - 1)
        x = np.concatenate([x, image])
        tets = np.concatenate([tets, number[tets][:, [0, 2, 1, 3]].astype(tets.dtype)])
    return TetMesh(np.ascontiguousarray(x), np.ascontiguousarray(tets))


def mirrored(case: schema.Case) -> Simulation:
    """Returns a simulation of the whole body, whose mesh consists of the quarter and its mirror images."""

    def images_of(mesh: Any, *args: Any, **keys: Any) -> TetMesh:
        return images(build(mesh.model_copy(update={"sector": "quarter"}), *args, **keys), (0, 1))

    with patch.object(assembly, "build_mesh", images_of):
        return simulation.build(case, Path(), SerialComm())


@dataclass(frozen=True)
class End:
    """State at the end of a run; masses and momenta of the whole body."""

    depth: float
    """Depth of the hole, m."""
    rod: float
    """Momentum of the rod and its debris along the axis, without removed nodes, kg m/s."""
    target: float
    """Momentum of the target, kg m/s."""
    near: tuple[float, float]
    """Mass of nodes without tets within a quarter of an element of the axis, and within the radius of the rod, kg."""
    kinetic: float
    """Energy, J."""


def run(sim: Simulation) -> End:
    """Computes all steps to the end time."""
    step.prepare(sim)
    thick = reference.thicknesses(sim)
    while True:
        before = sim.model.nodes.v.copy()
        step.first_half(sim)
        if sim.clock.done:
            step.end(sim, before)
            return _end(sim, thick[0])
        step.second_half(sim)


def _end(sim: Simulation, thick: Any) -> End:
    nodes, (spec,) = sim.model.nodes, sim.case.reference
    mesh: Any = sim.case.parts[0].mesh
    many, rod = IMAGES[mesh.sector], nodes.part == 0
    loose = np.ones(nodes.n, bool)
    for block in sim.model.blocks:
        loose[block.tets] = False
    away = np.hypot(nodes.x[:, 0], nodes.x[:, 1])
    rows, radius = reference._passed(sim, spec)
    near = [float(many * nodes.mass[loose & (away < limit)].sum()) for limit in (0.25 * mesh.element_size, ROD)]
    momenta = many * nodes.mass * nodes.v[:, 2]
    return End(
        penetration.depth(rows, np.array(thick), radius), float(momenta[rod].sum()), float(momenta[~rod].sum()),
        (near[0], near[1]), float(0.5 * many * (nodes.mass * (nodes.v * nodes.v).sum(axis=1)).sum()),
    )  # fmt: skip


def ensemble(name: str, size: float, runs: int, nodes: str) -> str:
    """Returns a row of the table."""
    ends, began = [], time.process_time()
    sector, _, apart = ("full" if name == "mirrored" else name).partition(", ")
    for k in range(runs):
        case = case_of(sector, size * MM, nodes=nodes, safety=0.9 - 0.01 * k, aligned=not apart)
        sim = mirrored(case) if name == "mirrored" else simulation.build(case, Path(), SerialComm())
        tets = sim.model.elements_global
        ends.append(run(sim))
    depths, end = np.array([each.depth for each in ends]) / MM, ends[-1]
    error = f"{depths.std(ddof=1) / math.sqrt(runs):.2f}" if runs > 1 else "-"
    return (
        f"| {nodes} | {name} | {tets:,} | {(time.process_time() - began) / runs:.0f} | {depths.mean():.1f} | {error} | "
        f"{end.near[0] / end.near[1]:.1%} | {end.rod:.2f} |"
    )


def main(size: float = 1.0, runs: float = 3) -> None:
    """Prints the table."""
    print(f"Expected near the axis: {(0.25 * size * MM / ROD) ** 2:.1%}\n")
    print("| nodes | mesh | tets | CPU s a run | depth mm | +- | near the axis | momentum left, kg m/s |")
    print("| ----- | ---- | ---: | ----------: | -------: | -: | ------------: | --------------------: |")
    for nodes in ("strike", "particles"):
        for name in MESHES:
            print(ensemble(name, size, int(runs), nodes), flush=True)


if __name__ == "__main__":
    main(*(float(word) for word in sys.argv[1:3]))
