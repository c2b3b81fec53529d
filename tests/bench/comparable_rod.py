"""A long rod of tungsten alloy with L/D = 10 hits a block of 4340 steel at 1.5 km/s; published results exist for this
impact.

The command ``python -m tests.bench.comparable_rod [NAME...]`` runs the named variants, or all variants. Each variant
differs from the first variant in one point. In the tables the nose is the foremost tet of the rod. Speeds in the tables
are means over the steady phase, and P is the depth of the hole at the end of the run.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
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

from .table import Cell, table

Floats = npt.NDArray[np.float64]
LENGTH, _RADIUS, _THICKNESS = 70e-3, 3.5e-3, 110e-3
"""Length and radius of the rod, thickness of the block, m."""
_STEADY = (20e-6, 60e-6)
"""Period in which the nose speed is fitted, s: after the entrance phase, and before the rod is short."""
_IMPACT = 1500.0
"""Impact speed, m/s."""
_PUBLISHED: tuple[Cell, ...] = ("Anderson and Walker 1991", *5 * (None,), "0.77", None, "1.055", "0.215", "1.27")
"""Published values of the nose speed and of P/L, recalled and not checked against the publication."""

CASE = """
name = "comparable_rod"
[[parts]]
name = "rod"
material = "tungsten_alloy"
velocity = [0, 0, "1500 m/s"]
erosion = { plastic_strain = 2.0 }
[parts.mesh]
shape = "cylinder"
base = [0, 0, "-70 mm"]
radius = "3.5 mm"
length = "70 mm"
sector = "quarter"
element_size = "1.4 mm"
[[parts]]
name = "block"
material = "steel_4340"
erosion = { plastic_strain = 2.0 }
[parts.mesh]
shape = "cylinder"
base = [0, 0, 0]
radius = "40 mm"
length = "110 mm"
sector = "quarter"
element_size = "1.4 mm"
grading = { axis = "z", near = "5 mm", far = "35 mm", far_size = "8 mm" }
[[boundaries]]
kind = "symmetry"
axis = "x"
[[boundaries]]
kind = "symmetry"
axis = "y"
[run]
end_time = "140 us"
frames = 28
samples = 140
snapshots = 0
"""
"""The rod is 7 mm thick and 70 mm long. Except for rate effects, P/L depends only on the ratio of the lengths. The
block has the size of the block in the case ``long_rod``."""
DAMAGE_OF_TUNGSTEN = {"D1": 0.0, "D2": 0.33, "D3": -1.5, "D4": 0.0, "D5": 0.0}
"""Damage constants by Johnson and Cook 1985, recalled and not checked against the publication; the library has the
constants of 4340 steel."""


@dataclass(frozen=True)
class Variant:
    """One run with changed keys of the case and changed constants of the strength of library materials."""

    name: str
    assignments: tuple[str, ...] = ()
    strengths: tuple[tuple[str, dict[str, Any]], ...] = ()


def eroding(parts: Sequence[int], **keys: object) -> tuple[str, ...]:
    """Returns assignments that replace the erosion by strain by another criterion."""
    inside = ", ".join(f"{key} = {value}" for key, value in keys.items())
    return tuple(f"parts[{k}].erosion={{{inside}}}" for k in parts)


def meshed(size: float) -> tuple[str, ...]:
    """Returns assignments of another element size near the axis, mm."""
    return tuple(f"parts[{k}].mesh.element_size={size:g} mm" for k in (0, 1))


def scaled(name: str, factor: float) -> tuple[tuple[str, dict[str, Any]], ...]:
    """Returns the constants A and B of a material, multiplied by ``factor``."""
    strength = library()[name].model_dump(exclude_none=True)["strength"]
    return ((name, {key: factor * strength[key] for key in ("A", "B")}),)


_BRITTLE = (("tungsten_alloy", {"damage": DAMAGE_OF_TUNGSTEN}),)
_BOTH = (0, 1)
VARIANTS = (
    Variant("1.4 mm, strain 2"),
    Variant("1 mm", meshed(1.0)),
    Variant("steps 1 % shorter", ("numerics.dt_safety=0.891",)),
    Variant("steps 2 % shorter", ("numerics.dt_safety=0.882",)),
    Variant("steps 3 % shorter", ("numerics.dt_safety=0.873",)),
    Variant("strain 1", eroding(_BOTH, plastic_strain=1.0)),
    Variant("strain 1.5", eroding(_BOTH, plastic_strain=1.5)),
    Variant("strain 3", eroding(_BOTH, plastic_strain=3.0)),
    Variant("rod by damage", eroding((0,), damage=1.0), _BRITTLE),
    Variant("block by damage", eroding((1,), damage=1.0, time_step=0.1)),
    Variant("both by damage", eroding(_BOTH, damage=1.0, time_step=0.1), _BRITTLE),
    Variant("strain 2, and damage", eroding(_BOTH, plastic_strain=2.0, damage=1.0), _BRITTLE),
    Variant("rod at strain 1.5", eroding((0,), plastic_strain=1.5)),
    Variant("block at strain 1.5", eroding((1,), plastic_strain=1.5)),
    Variant("1 mm, strain 1.5", (*meshed(1.0), *eroding(_BOTH, plastic_strain=1.5))),
    Variant("nodes removed", eroding(_BOTH, plastic_strain=2.0, nodes='"remove"')),
    Variant("particles for ever", eroding(_BOTH, plastic_strain=2.0, nodes='"particles"')),
    Variant("rod wha", ("parts[0].material=wha",)),
    Variant("rod 20 % stronger", (), scaled("tungsten_alloy", 1.2)),
    Variant("block 20 % weaker", (), scaled("steel_4340", 0.8)),
    Variant("block 60 mm wide", ("parts[1].mesh.radius=60 mm", "parts[1].mesh.grading.far=55 mm")),
    Variant("0.7 mm", meshed(0.7)),
)  # fmt: skip


@dataclass(frozen=True)
class Shot:
    """Result of a run: the outcome, the times of the frames, s, and the depth of the hole and the position of the nose
    in each frame, m.
    """

    variant: Variant
    outcome: Outcome
    time: Floats
    depth: Floats
    nose: Floats

    def speed(self, course: Floats) -> float:
        """Returns the speed of ``depth`` or ``nose``, m/s: the slope of a straight line through the steady phase."""
        taken = (self.time >= _STEADY[0]) & (self.time <= _STEADY[1]) & np.isfinite(course)
        since = self.time[taken] - self.time[taken].mean()
        return float(since @ course[taken] / (since @ since))


def run(variant: Variant, folder: Path) -> Shot:
    """Runs the variant in ``folder``, on one rank, by the command line of the worker."""
    case = folder / "case.json"
    case.write_text(json.dumps(data_of(variant)), encoding="utf-8")
    command = [sys.executable, "-m", "mpi4py", "-m", "conoid.worker", str(case), "--out", str(folder / "run")]
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=7200)
    outcome = from_json((folder / "run" / layout.OUTCOME).read_bytes())
    frames = sorted((folder / "run").glob(layout.frame(Path(), 0).parent.name + "/*.vtkhdf"))
    time, depth, nose = np.array([_look(frame) for frame in frames]).T
    return Shot(variant, outcome, time, depth, nose)


def data_of(variant: Variant) -> dict[str, Any]:
    """Returns the case of a variant."""
    data: dict[str, Any] = load.apply_overrides(load.toml_data(CASE), variant.assignments)
    data["materials"] = {name: _changed(name, keys) for name, keys in variant.strengths}
    return data


def _changed(name: str, keys: dict[str, Any]) -> dict[str, Any]:
    """Returns a material of the library with other constants of its strength."""
    made: dict[str, Any] = library()[name].model_dump(exclude_none=True)
    made["strength"].update(keys)
    return made


def _look(frame: Path) -> tuple[float, float, float]:
    """Returns the time of a frame, s, the depth of the hole and the position of the nose, m; NaN if the frame has no
    rod.
    """
    with h5py.File(frame) as file:
        grid = file["VTKHDF"]
        points, part, t = grid["Points"][:], grid["CellData/part"][:], float(grid["FieldData/time"][0])
        tets = grid["Connectivity"][:].reshape(-1, 4)
    block = part > 0
    rows = penetration.passed(points, tets[block].astype(np.uint32), part[block], 2, _RADIUS)
    thick = np.full((len(penetration.MEASURED), 2), _THICKNESS) * np.array([0.0, 1.0])
    rod = tets[part == 0]
    nose = float(points[rod, 2].max()) if len(rod) else float("nan")
    return t, penetration.depth(rows, thick, _RADIUS), nose


def measure(variants: Sequence[Variant]) -> Iterator[Shot]:
    """Runs the variants one after the other."""
    for variant in variants:
        with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder:
            yield run(variant, Path(folder))


def report(shots: Sequence[Shot]) -> str:
    """Returns a table of the variants; its first row has the published values. U / (V - U), with U of the hole, is the
    ratio of depth to consumed length in steady penetration. The rest of P/L results from the entrance phase, the end of
    the rod, and the penetration after the rod is consumed.
    """
    head = [
        "variant",
        "tets",
        "eroded",
        "steps",
        "CPU s",
        "residual",
        "nose km/s",
        "U km/s",
        "U / (V - U)",
        "the rest",
        "P/L",
    ]
    return table(head, [list(_PUBLISHED), *(_row(shot) for shot in shots)])


def _row(shot: Shot) -> list[Cell]:
    o, depth = shot.outcome, float(shot.depth[-1])
    name = shot.variant.name + ("" if o.state == "succeeded" else f" ({o.state})")
    numbers: list[Cell] = [o.elements, o.eroded, o.steps, round(o.cpu), o.worst_residual]
    nose, hole, whole = shot.speed(shot.nose), shot.speed(shot.depth), depth / LENGTH
    steady = hole / (_IMPACT - hole)
    texts = [f"{1e-3 * nose:.3f}", f"{1e-3 * hole:.3f}", f"{steady:.3f}", f"{whole - steady:.3f}", f"{whole:.3f}"]
    return [name, *numbers, *texts]


def main(names: Sequence[str]) -> int:
    """Runs the named variants, or all variants; prints a line after each run and the table at the end."""
    chosen = [variant for variant in VARIANTS if not names or variant.name in names]
    shots = []
    for shot in measure(chosen):
        shots.append(shot)
        print(*_row(shot), file=sys.stderr, flush=True)
    print(report(shots))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
