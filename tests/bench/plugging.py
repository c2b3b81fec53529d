"""The plate of ``plugging_weldox`` at three impact speeds, on several meshes, compared with the published experiment;
further runs show the effect of single model choices.

The command ``python -m tests.bench.plugging [NAME...]`` runs the named variants, or all variants, on one rank, one
after the other.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from conoid.cases import load
from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import layout
from conoid.cases.reading.library import library

from .table import Cell, table

PUBLISHED = {399.6: 291.3, 285.4: 181.1, 244.2: 132.6}
"""Speeds of the projectile before and after the plate, m/s: Borvik and others 1999, recalled and not checked against
the publication."""
ENDS = {399.6: "60 us", 285.4: "90 us", 244.2: "110 us"}
"""End time of a run; by this time the projectile is through the plate, or counts as stopped."""
FINE = 0.4
"""Element size, mm, up to which fine tets fill a band of 0.45 mm on either side of the rim; for larger tets the width
of the band is 0.7 mm."""


@dataclass(frozen=True)
class Variant:
    """Plan of one run: the impact speed, m/s, changed keys of the case, and changed constants of the plate's
    strength.
    """

    name: str
    speed: float
    assignments: tuple[str, ...] = ()
    damage: tuple[tuple[str, float], ...] = ()
    strength: tuple[tuple[str, float], ...] = ()


def meshed(size: float) -> tuple[str, ...]:
    """Returns assignments of another element size below the rim of the projectile, mm. The band of fine tets is
    narrower for small tets, so that the number of fine tets halves.
    """
    band = ("parts[1].mesh.grading.near=0.45 mm",) if size <= FINE else ()
    return (f"parts[1].mesh.element_size={size:g} mm", *band)


_WIDE = (
    "parts[1].mesh.high=['100 mm', '100 mm', '12 mm']",
    "boundaries[2].low=['99.9 mm', '0 mm', '0 mm']", "boundaries[2].high=['100.1 mm', '100 mm', '12 mm']",
    "boundaries[3].low=['0 mm', '99.9 mm', '0 mm']", "boundaries[3].high=['99.8 mm', '100.1 mm', '12 mm']",
)  # fmt: skip
CURVE = tuple(
    Variant(f"{speed:g} m/s, {size:g} mm", speed, meshed(size))
    for size in (0.8, 0.6, 0.5, 0.4, 0.3)
    for speed in PUBLISHED
)
_COARSE = meshed(1.0)
CAUSES = (
    Variant("1 mm", 285.4, _COARSE),
    Variant("1 mm, damage takes no strength", 285.4, _COARSE, (("softening", 0.0),)),
    Variant("1 mm, pressure standard", 285.4, (*_COARSE, 'numerics.pressure="standard"')),
    Variant("1 mm, plate does not meet itself", 285.4, (*_COARSE, "contact.self_contact=[]")),
    Variant("1 mm, nodes removed", 285.4, (*_COARSE, 'parts[1].erosion.nodes="remove"')),
    Variant("1 mm, no heat", 285.4, _COARSE, (), (("taylor_quinney", 0.0),)),
    Variant("1 mm, friction 0.1", 285.4, (*_COARSE, "contact.friction=0.1")),
    Variant("1 mm, plate 200 mm wide", 285.4, (*_COARSE, *_WIDE)),
    Variant("1 mm, D2 30 % lower", 285.4, _COARSE, (("D2", 1.212),)),
    Variant("1 mm, projectile elastic", 285.4, (*_COARSE, "materials.arne.strength.yield_stress=20 GPa")),
)
"""Variants of the case; each variant differs from the first variant in one point."""


@dataclass(frozen=True)
class Shot:
    """Results of a variant, with the final speed of the projectile, m/s."""

    variant: Variant
    outcome: Outcome
    left: float


def data_of(variant: Variant) -> dict[str, Any]:
    """Returns the case of a variant."""
    given = (
        f"parts[0].velocity=['0 m/s', '0 m/s', '-{variant.speed:g} m/s']", f"run.end_time={ENDS[variant.speed]}",
        "run.ranks=1", "run.frames=0", "run.snapshots=0", *variant.assignments,
    )  # fmt: skip
    data: dict[str, Any] = load.apply_overrides(load.read_data(load.shipped_path("plugging_weldox")), given)
    plate: dict[str, Any] = library()["weldox_460e"].model_dump(exclude_none=True)
    plate["strength"].update(variant.strength)
    plate["strength"]["damage"].update(variant.damage)
    data["materials"]["weldox_460e"] = plate
    return data


def run(variant: Variant, folder: Path) -> Shot:
    """Runs the variant in ``folder``, by the command line of the worker."""
    case = folder / "case.json"
    case.write_text(json.dumps(data_of(variant)), encoding="utf-8")
    launch = [str(Path(sys.executable).with_name("mpiexec")), "-n", "1", sys.executable, "-m", "mpi4py"]
    command = ["-m", "conoid.worker", str(case), "--out", str(folder / "run")]
    subprocess.run([*launch, *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=7200)
    outcome = from_json((folder / "run" / layout.OUTCOME).read_bytes())
    return Shot(variant, outcome, next(-c.value for c in outcome.reference if c.name.startswith("speed_mean")))


def measure(variants: Sequence[Variant]) -> Iterator[Shot]:
    """Runs the variants one after the other."""
    for variant in variants:
        with tempfile.TemporaryDirectory(prefix="conoid-bench-") as folder:
            yield run(variant, Path(folder))


def extrapolated(speed: float, coarse: tuple[float, float], fine: tuple[float, float]) -> float:
    """Returns the residual speed, m/s, extrapolated to element size 0 from two pairs of element size and residual
    speed. The energy loss of the projectile is assumed to be linear in the element size, because the work of a shear
    band of the width of one tet is linear in this width.
    """
    (large, one), (small, two) = ((size, speed**2 - left**2) for size, left in (coarse, fine))
    lost = two - small * (one - two) / (large - small)
    return float(np.sqrt(max(speed**2 - lost, 0.0)))


def report(shots: Sequence[Shot]) -> str:
    """Returns a table; plastic work is that of plate and projectile, for all four quarters."""
    head = ["variant", "m/s", "tets", "eroded", "steps", "CPU s", "plastic kJ", "left m/s", "published", "off"]
    return table(head, [_row(shot) for shot in shots])


def _row(shot: Shot) -> list[Cell]:
    o, expected = shot.outcome, PUBLISHED[shot.variant.speed]
    plastic = 4e-3 * o.energy.plastic if o.energy is not None else float("nan")
    name = shot.variant.name + ("" if o.state == "succeeded" else f" ({o.state})")
    return [
        name, f"{shot.variant.speed:g}", o.elements, o.eroded, o.steps, round(o.cpu), f"{plastic:.2f}",
        round(shot.left), f"{expected:.0f}", f"{100 * (shot.left / expected - 1):+.0f} %",
    ]  # fmt: skip


def main(names: Sequence[str]) -> int:
    """Runs the named variants, or all variants; prints a line after each run and the table at the end."""
    shots = []
    for shot in measure([variant for variant in (*CURVE, *CAUSES) if not names or variant.name in names]):
        shots.append(shot)
        print(*_row(shot), file=sys.stderr, flush=True)
    print(report(shots))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
