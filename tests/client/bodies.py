"""Small frames and run folders in the form in which a worker writes them."""

import json
from itertools import permutations
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from conoid.cases.output import fragments, history

RADIUS, LENGTH = 3.2e-3, 32.4e-3


def quarter_bar(across: int = 4, along: int = 16) -> tuple[Any, Any]:
    """Returns points (n, 3) and tets (m, 4) of a quarter of a square bar; x and y of the points begin at 0."""
    axes = [np.linspace(0, RADIUS, across + 1)] * 2 + [np.linspace(0, LENGTH, along + 1)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(across + 1, across + 1, along + 1)
    tets = []
    for order in permutations(range(3)):
        corners, at = [(0, 0, 0)], [0, 0, 0]
        for axis in order:
            at[axis] = 1
            corners.append((at[0], at[1], at[2]))
        tet = [number[i : across + i, j : across + j, k : along + k].ravel() for i, j, k in corners]
        even = np.linalg.det(np.eye(3)[list(order)]) > 0
        tets.append(np.stack(tet if even else [tet[0], tet[2], tet[1], tet[3]], axis=-1))
    return points, np.concatenate(tets)


def write_frame(path: Path, t: float = 80e-6, leave_out: tuple[str, ...] = ()) -> None:
    """Writes a frame of the quarter bar with a widened foot, and all fields except the fields in ``leave_out``."""
    points, tets = quarter_bar()
    z = points[:, 2:] / LENGTH
    moved = points * np.concatenate([1 + 0.9 * np.exp(-7 * z), 1 + 0.9 * np.exp(-7 * z), 1 - 0.18 + 0 * z], axis=1)
    height = points[tets, 2].mean(axis=1) / LENGTH
    strain = 1.9 * np.exp(-8 * height)
    cells = {
        "part": np.zeros(len(tets), np.int32), "rank": (2 * height).astype(np.int32), "tet": np.arange(len(tets)),
        "pressure": 3e8 * np.cos(5 * height), "mises": 8e8 + 2e8 * strain, "plastic_strain": strain,
        "temperature": 293.15 + 300 * strain,
    }  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = (2, 3)
        root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", 16))
        for name, size in (("Points", len(points)), ("Cells", len(tets)), ("ConnectivityIds", tets.size)):
            root[f"NumberOf{name}"] = np.array([size])
        root["Points"], root["Connectivity"] = moved, tets.reshape(-1)
        root["Offsets"], root["Types"] = np.arange(0, tets.size + 1, 4), np.full(len(tets), 10, np.uint8)
        root["PointData/velocity"] = np.concatenate([0 * z, 0 * z, -190 * z], axis=1)
        root["PointData/displacement"] = moved - points
        for name, values in cells.items():
            if name not in leave_out:
                root[f"CellData/{name}"] = values
        root["FieldData/time"] = np.array([t])


def write_fragments(folder: Path, index: int, masses: list[float], t: float = 80e-6) -> None:
    """Writes a table of fragments with the given masses, kg; each fragment has ten tets per gram."""
    path = fragments.path(folder, index)
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = []
    for label, mass in enumerate(masses):
        row = dict.fromkeys(fragments.COLUMNS, "0.0")
        row |= {"t": repr(t), "label": str(label), "part": "rod", "tets": str(round(1e4 * mass)), "nodes": "4"}
        row |= {"mass": repr(mass), "extent": repr(mass ** (1 / 3))}
        rows.append(",".join(row[name] for name in fragments.COLUMNS))
    path.write_text("\n".join([",".join(fragments.header()), *rows]) + "\n")


LINE = dict.fromkeys(history.COLUMNS, "0.0") | {"limiter": "stability: tet 3 of rod"}


def write_history(folder: Path, **columns: list[float]) -> None:
    """Writes a history.csv with the given columns; all other columns are 0. The columns have the units that a worker
    writes; additional columns have m/s.
    """
    names = {**history.COLUMNS, **{name: "m/s" for name in columns if name not in history.COLUMNS}}
    lines = [",".join(history.header(names))]
    for row in zip(*columns.values(), strict=True):
        line = LINE | dict(zip(columns, map(repr, row), strict=True))
        lines.append(",".join(line[name] for name in names))
    (folder / "history.csv").write_text("\n".join(lines) + "\n")


def write_run(folder: Path) -> Path:
    """Writes the folder of a finished run: outcome, history, resolved case, two frames and the list of frames."""
    times = {"000000.vtkhdf": 0.0, "000007.vtkhdf": 80e-6}
    for name, t in times.items():
        write_frame(folder / "frames" / name, t)
    files = [{"name": name, "time": t} for name, t in times.items()]
    (folder / "frames" / "frames.vtkhdf.series").write_text(json.dumps({"file-series-version": "1.0", "files": files}))
    (folder / "history.csv").write_text(
        "step,t [s],dt [s],limiter,kinetic [J]\n0,0.0,8e-09,tet 1,12.5\n10,8e-05,7.5e-09,tet 9,12.25\n"
    )
    boundaries: list[dict[str, Any]] = [{"kind": "symmetry", "axis": axis, "at": 0.0, "parts": []} for axis in "xy"]
    boundaries.append({"kind": "wall", "name": "wall", "point": [0, 0, 0], "normal": [0, 0, 1], "parts": []})
    case = {"name": "bar", "title": "A steel bar", "parts": [{"name": "rod"}], "boundaries": boundaries}
    (folder / "case.resolved.json").write_text(json.dumps(case))
    check = {
        "name": "extent of rod",
        "value": 0.0265,
        "expected": 0.02654,
        "tolerance": 1e-4,
        "pass": True,
        "unit": "m",
    }
    outcome = {"state": "succeeded", "steps": 10, "time": 80e-6, "digest": "d" * 64, "reference": [check]}
    (folder / "outcome.json").write_text(json.dumps(outcome))
    return folder
