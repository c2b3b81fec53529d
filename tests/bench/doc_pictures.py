"""Pictures of bodies in the docs: the command ``python -m tests.bench.doc_pictures [NAME ...]`` runs the cases of the
named pictures and draws the pictures.

Without a name all pictures are drawn. Runs are kept in ``build/pictures``, so that a second call of the command only
draws. The option ``--list`` prints the names of the pictures and the cost of their runs.
"""

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conoid.client.errors import NotFoundError, UnfinishedError
from conoid.client.result import Result

ROOT = Path(__file__).parents[2]
DOCS, RUNS = ROOT / "docs", ROOT / "build" / "pictures"


@dataclass(frozen=True)
class Shown:
    """A picture of the docs: the case, the arguments of ``conoid view``, and the cost of the run."""

    out: str
    case: str
    field: str
    look: Mapping[str, Any]
    takes: str = "half a minute"


_THREE = {"time": ["60 us", "100 us", "150 us"], "size": (1500, 900)}
PICTURES = {
    "shapes": Shown("pictures/shapes.png", "shapes", "part", {"size": (1600, 720), "camera": "0.28,-1.2,0.8"}),
    "tutorial": Shown("pictures/tutorial.png", "tutorial", "fragment", {"mirror": "auto", "size": (1400, 900)}),
    "bullet": Shown(
        "tutorial/bullet/bullet.png", "tutorial/bullet/bullet_tile.toml", "plastic_strain",
        {"mirror": "y", "time": ["0 us", "20 us", "60 us"], "size": (1500, 500)},
    ),
    "long_rod": Shown(
        "pictures/long_rod.png", "long_rod", "plastic_strain", {"size": (1600, 700)}, takes="a quarter of an hour"
    ),
    "plugging": Shown(
        "pictures/plugging.png", "plugging_weldox", "plastic_strain",
        {"mirror": "y", "section": "x=0.0001", "camera": "x", "time": ["20 us", "40 us", "60 us"], "size": (1500, 800)},
        takes="some minutes",
    ),
    "glass_bar": Shown("pictures/glass_bar.png", "glass_steel_bar", "fragment", _THREE, takes="an hour"),
    "glass_bar_speed": Shown("pictures/glass_bar_speed.png", "glass_steel_bar", "speed", _THREE, takes="an hour"),
}  # fmt: skip

MM = 1e-3
_APART = 15.0
"""Distance between two shapes, mm. Chosen value for which no shape hides another shape."""


def shapes() -> dict[str, Any]:
    """Returns a case with one body of every shape; the bodies have equal size and are side by side."""
    return {
        "name": "shapes", "title": "The shapes of parts",
        "parts": [
            {"name": name, "material": "steel", "mesh": {"element_size": 0.9 * MM, **_placed(mesh, k)}}
            for k, (name, mesh) in enumerate(_BODIES.items())
        ],
        "run": {"end_time": 1e-9, "frames": 1, "snapshots": 0},
    }  # fmt: skip


def _placed(mesh: Mapping[str, Any], k: int) -> dict[str, Any]:
    """Returns the mesh of shape number k, moved to the position of the shape; for a combination, the operands are also
    moved.
    """
    x, y = _APART * MM * (k % 7), -_APART * MM * (k // 7)
    moved = {name: _moved(value, x, y) if name in _PLACES else value for name, value in mesh.items()}
    if "of" in mesh:
        moved["of"] = [_placed(one, k) for one in mesh["of"]]
    return moved


def _moved(place: Sequence[float], x: float, y: float) -> list[float]:
    return [MM * place[0] + x, MM * place[1] + y, MM * place[2]]


_PLACES = ("base", "centre", "low", "high")
_CYLINDER = {"shape": "cylinder", "base": [0, 0, 0], "radius": 2.2 * MM, "length": 14 * MM}
_BODIES: dict[str, dict[str, Any]] = {
    "box": {"shape": "box", "low": [-4, -4, 0], "high": [4, 4, 8]},
    "plate": {
        "shape": "plate", "base": [0, 0, 0], "width": 9 * MM, "height": 9 * MM, "thickness": 2 * MM,
        "element_size": 0.5 * MM,
    },
    "cylinder": {"shape": "cylinder", "base": [0, 0, 0], "radius": 4 * MM, "length": 9 * MM},
    "tube": {
        "shape": "tube", "base": [0, 0, 0], "inner_radius": 2.6 * MM, "radius": 4 * MM, "length": 9 * MM,
        "element_size": 0.7 * MM,
    },
    "sphere": {"shape": "sphere", "centre": [0, 0, 4.5], "radius": 4.5 * MM},
    "cone": {"shape": "cone", "base": [0, 0, 0], "radius": 4.5 * MM, "top_radius": 1 * MM, "length": 9 * MM},
    "ogive": {"shape": "ogive", "base": [0, 0, 0], "radius": 3.5 * MM, "crh": 2, "shank": 3 * MM},
    "hemisphere": {"shape": "hemisphere", "base": [0, 0, 0], "radius": 4.5 * MM},
    "spherical_cap": {"shape": "spherical_cap", "base": [0, 0, 0], "radius": 6 * MM, "height": 3.5 * MM},
    "ring_sector": {
        "shape": "ring_sector", "base": [0, 0, 0], "inner_radius": 2.4 * MM, "radius": 4.8 * MM, "length": 6 * MM,
        "start": "-30 deg", "angle": "250 deg",
    },
    "union": {
        "shape": "union", "centre": [0, 0, 0],
        "of": [{"shape": "sphere", "centre": [0, 0, 4.5], "radius": 4 * MM}, {**_CYLINDER, "length": 10 * MM}],
    },
    "difference": {
        "shape": "difference", "centre": [0, 0, 0],
        "of": [{"shape": "box", "low": [-4, -4, 0], "high": [4, 4, 8]}, {**_CYLINDER, "base": [0, 0, -2]}],
    },
    "intersection": {
        "shape": "intersection", "centre": [0, 0, 0],
        "of": [
            {"shape": "sphere", "centre": [0, 0, 4], "radius": 5 * MM},
            {"shape": "box", "low": [-3.6, -3.6, 0], "high": [3.6, 3.6, 8]},
        ],
    },
}  # fmt: skip


def case(shown: Shown) -> Path:
    """Returns the file of the case; a case in the text of a page is first written to a file."""
    RUNS.mkdir(parents=True, exist_ok=True)
    if shown.case == "shapes":
        (RUNS / "shapes.json").write_text(json.dumps(shapes()), encoding="utf-8")
        return RUNS / "shapes.json"
    if shown.case == "tutorial":
        text = (DOCS / "tutorial" / "first_case.md").read_text(encoding="utf-8")
        (RUNS / "tile.toml").write_text("\n".join(re.findall(r"```toml\n(.*?)```", text, re.DOTALL)), encoding="utf-8")
        return RUNS / "tile.toml"
    return DOCS / shown.case if "/" in shown.case else ROOT / "cases" / "shipped" / f"{shown.case}.toml"


def ran(shown: Shown) -> Result:
    """Returns the run of a picture: the stored run, or a new run."""
    folder = RUNS / Path(shown.case).stem
    try:
        result = Result.open(folder)
        return result if result.outcome.state == "succeeded" else _run(shown, folder)
    except (NotFoundError, UnfinishedError):
        return _run(shown, folder)


def _run(shown: Shown, folder: Path) -> Result:
    shutil.rmtree(folder, ignore_errors=True)
    words = [sys.executable, "-m", "conoid.worker", str(case(shown)), "--out", str(folder)]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    return Result.open(folder)


def main() -> int:
    """Draws the requested pictures."""
    if "--list" in sys.argv:
        print(*(f"{name:16} {shown.takes}" for name, shown in PICTURES.items()), sep="\n")
        return 0
    for name in sys.argv[1:] or PICTURES:
        shown = PICTURES[name]
        drawn = ran(shown).view(shown.field, DOCS / shown.out, **shown.look)
        print(drawn.out, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
