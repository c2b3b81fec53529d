"""Long rod through six plates: the study measures the penetration for different meshes, speeds, erosion criteria,
pressure forms, friction coefficients and strengths.

Every run is the shipped case with a few changed keys, on two ranks. The runs of the study follow one after the other.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from conoid.cases import load
from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import layout
from conoid.cases.reading.library import library
from conoid.worker.gauges import penetration
from conoid.worker.mesh.faces import boundary_faces

from .table import Cell, table

Floats = npt.NDArray[np.float64]
PARTS = range(7)
LENGTH = 75.0
"""Length of the rod, mm."""
BANDS = {"1057 m/s": (0.60, 0.80), "1301 m/s": (0.85, 1.05), "1566.4 m/s": (1.00, 1.20)}
"""Ratio P/L of a tungsten rod in mild steel by the theory of Alekseevskii and Tate. The rod strength of 1.5 to 2 GPa
and the target resistance of 3 to 3.5 GPa are assumptions, not derived from the constants of the case."""
_RADIUS, _THICKNESS = 3.5e-3, 22e-3
"""Radius of the rod, and thickness of a plate, m."""
_CRATER = (6.0, 40.0)
"""Range of depths in which the diameter of the crater is measured, mm."""


@dataclass(frozen=True)
class Variant:
    """Plan of one run: changed keys of the shipped case."""

    name: str
    assignments: tuple[str, ...] = ()
    yields: tuple[tuple[str, float], ...] = ()
    """Names of materials with their constant A, GPa, if A differs from the library."""


def eroding(key: str, value: object) -> tuple[str, ...]:
    """Returns an assignment to the erosion of every part."""
    return tuple(f"parts[{k}].erosion.{key}={value}" for k in PARTS)


def meshed(size: float, **grading: float) -> tuple[str, ...]:
    """Returns assignments of another element size near the axis, mm."""
    sizes = [f"parts[{k}].mesh.element_size={size:g} mm" for k in PARTS]
    return *sizes, *(f"parts[{k}].mesh.grading.{key}={v:g} mm" for k in PARTS[1:] for key, v in grading.items())


def sector(name: str, *planes: str) -> tuple[str, ...]:
    """Returns assignments of another sector of every part, with planes of symmetry across the given axes."""
    bounds = ", ".join(f'{{kind="symmetry", axis="{axis}"}}' for axis in planes)
    return *(f"parts[{k}].mesh.sector={name}" for k in PARTS), f"boundaries=[{bounds}]"


COARSE = meshed(1.4)
SPEEDS = tuple(
    Variant(speed, (f"parts[0].velocity=['0 m/s', '0 m/s', '{speed}']", "run.end_time=180 us")) for speed in BANDS
)
MESHES = (
    Variant("2 mm", meshed(2.0)), Variant("1.4 mm", COARSE), Variant("1 mm"), Variant("0.7 mm", meshed(0.7)),
    Variant("1 mm, fine out to 8 mm", meshed(1.0, near=8.0)),
    Variant("2 mm, half", (*meshed(2.0), *sector("half", "x"))),
    Variant("2 mm, whole", (*meshed(2.0), *sector("full"))),
)  # fmt: skip
OTHERS = (
    Variant("erosion at 1.5", (*COARSE, *eroding("plastic_strain", 1.5))),
    Variant("erosion at 2.5", (*COARSE, *eroding("plastic_strain", 2.5))),
    Variant("erosion at 4", (*COARSE, *eroding("plastic_strain", 4.0))),
    Variant("time step of erosion 0.1", (*COARSE, *eroding("time_step", 0.1))),
    Variant("nodes removed", (*COARSE, *eroding("nodes", '"remove"'))),
    Variant("particles for ever", (*COARSE, *eroding("nodes", '"particles"'))),
    Variant("pressure standard", (*COARSE, 'numerics.pressure="standard"')),
    Variant("pressure split", (*COARSE, 'numerics.pressure="split"')),
    Variant("friction 0.1", (*COARSE, "contact.friction=0.1")),
    Variant("20 sweeps", (*COARSE, "contact.sweeps=20")),
    Variant("rod A 1.0 GPa", COARSE, (("wha", 1.0),)),
    Variant("rod A 1.51 GPa", COARSE, (("wha", 1.51),)),
    Variant("plates A 0.22 GPa", COARSE, (("mild_steel", 0.22),)),
    Variant("plates A 0.40 GPa", COARSE, (("mild_steel", 0.40),)),
    Variant("rod A 1.0, plates A 0.40 GPa", COARSE, (("wha", 1.0), ("mild_steel", 0.40))),
)


@dataclass(frozen=True)
class Moment:
    """Values of a frame: time, s; depth of the hole and ends of the rod, m; speed of the last 8 mm of the rod, m/s. A
    value is NaN if the frame has no rod.
    """

    t: float
    depth: float
    tail: float
    nose: float
    speed: float


@dataclass(frozen=True)
class Shot:
    """Results of a variant; lengths in mm."""

    variant: Variant
    outcome: Outcome
    depth: float
    crater: float
    """Mean diameter of the crater in the depths of _CRATER."""
    course: tuple[Moment, ...]
    """Values of each frame of the run."""


def measure(variants: Sequence[Variant], ranks: int = 2) -> Iterator[Shot]:
    """Runs the variants one after the other."""
    for variant in variants:
        with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder:
            yield run(variant, Path(folder), ranks)


def run(variant: Variant, folder: Path, ranks: int) -> Shot:
    """Runs the variant in ``folder``, by the command line of the worker."""
    data = load.apply_overrides(load.read_data(load.shipped_path("long_rod")), variant.assignments)
    data["materials"] = {name: _stronger(name, strength) for name, strength in variant.yields}
    case = folder / "case.json"
    case.write_text(json.dumps(data), encoding="utf-8")
    command = ["-m", "conoid.worker", str(case), "--out", str(folder / "run")]
    launch = [str(Path(sys.executable).with_name("mpiexec")), "-n", str(ranks), sys.executable, "-m", "mpi4py"]
    subprocess.run([*launch, *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=7200)
    outcome = from_json((folder / "run" / layout.OUTCOME).read_bytes())
    depth = next((c.value for c in outcome.reference if c.name.startswith("penetration")), float("nan"))
    frames = sorted((folder / "run").glob(layout.frame(Path(), 0).parent.name + "/*.vtkhdf"))
    return Shot(variant, outcome, 1e3 * depth, 1e3 * crater(frames[-1]), tuple(moment(frame) for frame in frames))


def _stronger(name: str, strength: float) -> dict[str, Any]:
    """Returns a material of the library with another constant A, GPa."""
    table: dict[str, Any] = library()[name].model_dump(exclude_none=True)
    table["strength"]["A"] = 1e9 * strength
    return table


def crater(frame: Path) -> float:
    """Returns the mean diameter of the hole in the plates of a frame, m, from the outward faces of the remaining tets.

    In each of nine sectors and slices the innermost faces are the wall of the hole. The result is the median over all
    sectors and slices, so that a flake in the hole has no effect.
    """
    with h5py.File(frame) as file:
        grid = file["VTKHDF"]
        points, part = grid["Points"][:], grid["CellData/part"][:]
        tets = grid["Connectivity"][:].reshape(-1, 4)[part > 0]
    centres: Floats = points[boundary_faces(tets)].mean(axis=1)
    radius, angle = np.hypot(centres[:, 0], centres[:, 1]), np.arctan2(centres[:, 1], centres[:, 0])
    sector = np.minimum((angle / (np.pi / 2) * 9).astype(int), 8)
    slices = np.linspace(*_CRATER, 10) * 1e-3
    walls = []
    for low, high in pairwise(slices):
        for k in range(9):
            there = radius[(centres[:, 2] > low) & (centres[:, 2] < high) & (sector == k)]
            if len(there):
                walls.append(there.min())
    return 2.0 * float(np.median(walls))


def moment(frame: Path) -> Moment:
    """Returns the values of rod and plates in a frame; the depth is that of the reference ``penetration``."""
    with h5py.File(frame) as file:
        grid = file["VTKHDF"]
        points, part, t = grid["Points"][:], grid["CellData/part"][:], float(grid["FieldData/time"][0])
        tets, velocity = grid["Connectivity"][:].reshape(-1, 4), grid["PointData/velocity"][:]
    plates = part > 0
    rows = penetration.passed(points, tets[plates].astype(np.uint32), part[plates], 2, _RADIUS)
    thick = np.full((len(penetration.MEASURED), len(PARTS)), _THICKNESS) * (np.arange(len(PARTS)) > 0)
    depth = penetration.depth(rows, thick, _RADIUS)
    rod = np.unique(tets[part == 0])
    if not len(rod):
        return Moment(t, depth, *3 * [float("nan")])
    z = points[rod, 2]
    speed = velocity[rod[z < z.min() + 8e-3], 2].mean()
    return Moment(t, depth, float(z.min()), float(z.max()), float(speed))


def course(moments: Sequence[Moment]) -> str:
    """Returns a table of the depth and the speed of the rod over time. The table has the rod strength from the
    deceleration of the tail and the target resistance at the nose. The equations of Alekseevskii and Tate are applied
    to 30 us around each row: Y = -rho L dV/dt, R = rho (V - U)^2 / 2 + Y - rho_t U^2 / 2.
    """
    rows: list[list[Cell]] = []
    for before, now, after in zip(moments, moments[3:], moments[6:], strict=False):
        dt, length = after.t - before.t, now.nose - now.tail
        inward, slowed = (after.nose - before.nose) / dt, (before.speed - after.speed) / dt
        strength = 17300.0 * length * slowed
        resistance = 0.5 * 17300.0 * (now.speed - inward) ** 2 + strength - 0.5 * 7870.0 * inward**2
        rows.append([
            round(1e6 * now.t), f"{1e3 * now.depth:.1f}", f"{1e3 * length:.1f}", round(now.speed), round(inward),
            f"{1e-9 * strength:.2f}", f"{1e-9 * resistance:.2f}",
        ])  # fmt: skip
    return table(["t us", "P mm", "rod mm", "V m/s", "U m/s", "Y GPa", "R GPa"], rows)


def report(shots: Sequence[Shot]) -> str:
    """Returns a table of all variants."""
    head = ["variant", "tets", "eroded", "steps", "wall s", "CPU s", "contact / elements", "residual", "P mm", "P/L",
            "crater mm"]  # fmt: skip
    return table(head, [_row(shot) for shot in shots])


def _row(shot: Shot) -> list[Cell]:
    o = shot.outcome
    share = sum(o.phases["contact"]) / sum(o.phases["elements"])
    return [
        shot.variant.name, o.elements, o.eroded, o.steps, round(o.elapsed - o.setup), round(o.cpu), round(share, 2),
        o.worst_residual, f"{shot.depth:.1f}", f"{shot.depth / LENGTH:.3f}", f"{shot.crater:.1f}",
    ]  # fmt: skip


def as_data(shots: Sequence[Shot]) -> list[dict[str, object]]:
    """Returns the results as data for JSON."""
    return [
        {"variant": s.variant.name, "depth": s.depth, "crater": s.crater, "wall": s.outcome.elapsed - s.outcome.setup,
         "cpu": s.outcome.cpu, "steps": s.outcome.steps, "tets": s.outcome.elements, "digest": s.outcome.digest}
        for s in shots
    ]  # fmt: skip
