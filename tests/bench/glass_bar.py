"""The glass bar of the paper: position of the failure front, swelling of the glass behind the front, number of nodes
and fragments over time.

The command ``python -m tests.bench glass_bar`` runs the shipped case with coarser elements. The command
``python -m tests.bench.glass_bar FOLDER PNG`` reads a finished run with the element size of the paper, and draws the
bar at four times.
"""

import csv
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np
import numpy.typing as npt
from PIL import Image

from conoid.cases import messages
from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import fragments, history, layout

from .table import Cell, table

Floats = npt.NDArray[np.float64]
SIZES = ("2.4 mm", "1.8 mm", "1.2 mm")
"""Element sizes of the runs; the case has 0.9 mm."""
LENGTH, RADIUS, SOUND = 170e-3, 6.35e-3, 5367.0
"""Length and radius of the glass bar, m; its bar wave speed sqrt(E / rho), m/s."""
_SLICE = 5e-3
"""Thickness of the slices in which nodes are counted, m."""
_FAILED = 1.1
"""Ratio of the present to the initial number of nodes in a slice, above which the slice has failed. The failure front
is at the end of the failed slices that are connected to the impact face."""
_EVERY = 10e-6
"""Time between two rows of the table, s."""
_BEHIND = 3e-6
"""Time after the passage of the failure front from which means are taken, s."""
_LOADED = 39e-6
"""Time until which the steel bar pushes, s: its own wave returns after 2 * 100 mm / 5048 m/s."""
_DRAWN = (10e-6, 30e-6, 60e-6, 110e-6)
"""Times of the drawn frames, s."""


@dataclass(frozen=True)
class Moment:
    """Frame of the bar, SI units."""

    time: float
    front: float
    """Distance of the failure front from the impact face."""
    nodes: int
    """Number of nodes of the glass."""
    swelling: float
    """Mean radius of the rim behind the failure front over the initial radius; 1 without a front."""
    outward: float
    """Mean radial velocity of the rim behind the failure front."""
    pieces: fragments.Summary
    """Fragments of the glass."""


@dataclass(frozen=True)
class Bar:
    """Results of a run."""

    size: str
    outcome: Outcome
    course: list[Moment]
    work: list[tuple[float, int, float]]
    """Periods between two reports, each with the time at its end, s, its number of steps, and the CPU time of all ranks
    without waiting, s."""


def measure(sizes: Sequence[str], ranks: int = 2) -> Iterator[Bar]:
    """Runs the shipped case with the given element sizes, one run after the other."""
    for size in sizes:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place) / "run"
            given = [f"parts[{k}].mesh.element_size={size}" for k in range(2)] + [f"run.ranks={ranks}"]
            words = [word for each in given for word in ("--set", each)]
            launch = [str(Path(sys.executable).with_name("mpiexec")), "-n", str(ranks), sys.executable, "-m", "mpi4py"]
            run = ["-m", "conoid.worker", "glass_steel_bar", "--out", str(folder), *words]
            subprocess.run([*launch, *run], check=True, capture_output=True)
            yield read(size, folder)


def read(size: str, folder: Path) -> Bar:
    """Reads the folder of a run."""
    frames = sorted((folder / layout.FRAMES).glob("*.vtkhdf"))
    with h5py.File(frames[0]) as file:
        start = _glass(file)[0][:, 2]
    outcome = from_json((folder / layout.OUTCOME).read_bytes())
    moments = [moment(folder, index, frame, start) for index, frame in enumerate(frames)]
    return Bar(size, outcome, moments, _work(folder))


def _work(folder: Path) -> list[tuple[float, int, float]]:
    journal = [messages.from_json(line) for line in (folder / layout.JOURNAL).read_bytes().splitlines()]
    return [
        (load.t, load.steps, sum(sum(phase) for phase in load.phases.values()) - sum(load.waiting))
        for load in journal if isinstance(load, messages.Load)
    ]  # fmt: skip


def _glass(file: h5py.File) -> tuple[Floats, Floats, Floats]:
    """Returns initial positions, positions and velocities of the nodes of the glass, (n, 3)."""
    mesh = file["VTKHDF"]
    glass = np.unique(mesh["Connectivity"][:].reshape(-1, 4)[mesh["CellData/part"][:] == 1])
    x = mesh["Points"][:][glass]
    return x - mesh["PointData/displacement"][:][glass], x, mesh["PointData/velocity"][:][glass]


def front_of(z: Floats, start: Floats) -> float:
    """Returns the distance from the impact face up to which nodes have separated, m. The arguments are the initial
    axial positions of all present nodes, and those of the initial nodes.
    """
    cuts = np.arange(0.0, LENGTH + _SLICE / 2.0, _SLICE)
    cuts[0], cuts[-1] = -np.inf, np.inf
    growth = np.histogram(z, cuts)[0] / np.histogram(start, cuts)[0]
    return _SLICE * int(np.argmin(np.append(growth > _FAILED, False)))


def moment(folder: Path, index: int, frame: Path, start: Floats) -> Moment:
    """Reads a frame; ``start`` has the initial axial positions of the nodes of the glass."""
    with h5py.File(frame) as file:
        x0, x, v = _glass(file)
    time = _time(frame)
    front = front_of(x0[:, 2], start)
    rim = (np.hypot(x0[:, 0], x0[:, 1]) > 0.97 * RADIUS) & (x0[:, 2] < front)
    radius = np.hypot(x[rim, 0], x[rim, 1])
    outward = (x[rim, :2] * v[rim, :2]).sum(axis=1) / np.maximum(radius, 1e-9)
    lines = [line for line in fragments.read(fragments.path(folder, index)) if line["part"] == "glass"]
    columns = [[line[name] for line in lines] for name in ("tets", "mass", "extent")]
    return Moment(
        time, front, len(x), float(radius.mean() / RADIUS) if front else 1.0, float(outward.mean()) if front else 0.0,
        fragments.summary(*columns),  # type: ignore[arg-type]
    )  # fmt: skip


def report(bars: Sequence[Bar]) -> str:
    """Returns a table with one row for each run, and a table over time of the run with the finest mesh."""
    head = ["size", "tets", "nodes at first", "nodes", "ratio", "front stops at, mm", "its speed to 50 mm, mm/us",
            "rim, m/s", "pieces", "dust, of the mass", "residual", "wall s", "CPU s", "M upd/s"]  # fmt: skip
    return f"{table(head, [_row(bar) for bar in bars])}\n\n{bars[-1].size}:\n\n{course(bars[-1])}"


def waves(folder: Path) -> str:
    """Returns the peaks, and the means behind the wave front, at the probes before the release wave arrives from the
    far end.
    """
    with (folder / layout.HISTORY).open(encoding="utf-8") as file:
        named = [{history.split(name)[0]: text for name, text in line.items()} for line in csv.DictReader(file)]
    lines = [{name: float(text) for name, text in line.items() if name != "limiter"} for line in named]
    rows: list[list[Cell]] = []
    for place in (20, 40, 80, 120):
        arrival, back = 1e-3 * place / SOUND, (2.0 * LENGTH - 1e-3 * place) / SOUND
        some = [line for line in lines if arrival + _BEHIND < line["t"] < min(back, _LOADED) - 1e-6]
        stress, speed = ([line[f"{name}_{place}"] for line in some] for name in ("stress", "speed"))
        rows.append([place, -1e-9 * min(stress), -1e-9 * float(np.mean(stress)), max(speed), float(np.mean(speed))])
    return table(["mm", "stress, GPa, peak", "mean", "speed, m/s, peak", "mean"], rows)


def _row(bar: Bar) -> list[Cell]:
    out, last = bar.outcome, bar.course[-1]
    past = next((m for m in bar.course if m.front >= 50e-3), None)
    pieces = last.pieces
    return [
        bar.size, out.elements, out.nodes_initial, out.nodes, (out.nodes or 0) / (out.nodes_initial or 1),
        1e3 * arrested(bar.course), 1e-3 * past.front / past.time if past else None, last.outward, pieces.fragments,
        pieces.dust_share,
        out.worst_residual, out.elapsed, out.cpu,
        1e-6 * out.element_updates_per_second,
    ]  # fmt: skip


def arrested(moments: Sequence[Moment]) -> float:
    """Returns the position of the failure front at the time at which the wave returned from the far end, m."""
    return max((m.front for m in moments if m.time < LENGTH / SOUND), default=0.0)


def course(bar: Bar) -> str:
    """Returns a table over time; the column M upd/s has the element updates per CPU second since the previous row, in
    millions.
    """
    head = ["t, us", "front, mm", "speed, mm/us", "rim radius", "rim, m/s", "glass nodes", "pieces", "dust", "largest",
            "M upd/s"]  # fmt: skip
    chosen = [bar.course[0]]
    for each in bar.course[1:]:
        if each.time >= chosen[-1].time + 0.999 * _EVERY:
            chosen.append(each)
    rows: list[list[Cell]] = []
    for before, m in pairwise(chosen):
        speed = 1e-3 * (m.front - before.front) / (m.time - before.time)
        spent = [(steps, cpu) for time, steps, cpu in bar.work if before.time < time <= m.time]
        steps, cpu = (sum(column) for column in zip(*spent, strict=True))
        rows.append([
            1e6 * m.time, 1e3 * m.front, speed, m.swelling, m.outward, m.nodes, m.pieces.fragments, m.pieces.dust,
            m.pieces.largest_share, 1e-6 * (bar.outcome.elements or 0) * steps / cpu,
        ])  # fmt: skip
    return table(head, rows)


def as_data(bars: Sequence[Bar]) -> list[dict[str, object]]:
    """Returns the results as data for bench.json."""
    return [{"size": bar.size, "course": [asdict(m) for m in bar.course]} for bar in bars]


def draw(folder: Path, png: Path) -> None:
    """Draws the bars at four times, side by side, coloured by fragment."""
    views = []
    with tempfile.TemporaryDirectory() as place:
        for time in _DRAWN:
            frames = sorted((folder / layout.FRAMES).glob("*.vtkhdf"))
            index = min(range(len(frames)), key=lambda k: abs(_time(frames[k]) - time))
            out = Path(place) / "view.png"
            words = ["view", str(folder), "--field", "fragment", "--frame", str(index), "--size", "900", "1500"]
            subprocess.run([str(Path(sys.executable).with_name("conoid")), *words, "--out", str(out)], check=True)
            with Image.open(out) as image:
                views.append(image.convert("RGB").crop((260, 110, 640, 1340)).resize((228, 738)))
    sheet = Image.new("RGB", (228 * len(views), 738))
    for k, view in enumerate(views):
        sheet.paste(view, (228 * k, 0))
    sheet.quantize(128).save(png, optimize=True)


def _time(frame: Path) -> float:
    with h5py.File(frame) as file:
        return float(file["VTKHDF/FieldData/time"][0])


if __name__ == "__main__":
    print(report([read(Path(sys.argv[1]).name, Path(sys.argv[1]))]), waves(Path(sys.argv[1])), sep="\n\n")
    if len(sys.argv) > 2:
        draw(Path(sys.argv[1]), Path(sys.argv[2]))
