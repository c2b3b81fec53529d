"""A run that no solver computed: a snapshot with a given number of triangles, and a journal with a given number of
events.
"""

import hashlib
import itertools
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from conoid.cases import messages
from conoid.cases.output import layout
from conoid.cases.output.snapshot import Column, Field, Header, pack
from conoid.cases.run import State
from tests.server.visitor import OWNER

_AROUND = 20
"""Number of triangles of a fragment; each fragment is an icosahedron."""
_GOLDEN = (1.0 + 5.0**0.5) / 2.0
_SPAN = 0.1
"""Edge of the box that contains the fragments, m."""
_END = 1e-3
"""End time of the run, s."""


def blob(n: int, triangles: int, t: float) -> bytes:
    """Returns a snapshot of icosahedra on a grid; each icosahedron is a fragment."""
    fragments = triangles // _AROUND
    points, faces = _icosahedron()
    side = int(np.ceil(fragments ** (1.0 / 3.0)))
    cells = np.array(list(itertools.islice(itertools.product(range(side), repeat=3), fragments)))
    centres = (cells + 0.5) / side
    places = centres[:, None, :] + 0.4 / side * points
    rows = np.arange(fragments)
    tinted = np.repeat(rows, _AROUND)
    arrays = {
        "positions": np.round(65535 * places).reshape(-1, 3).astype(np.uint16),
        "triangles": (len(points) * rows[:, None, None] + faces).reshape(-1, 3).astype(np.uint32),
        "vertex_fragment": np.repeat(rows, len(points)).astype(np.uint32),
        "triangle_rank": (tinted % 2).astype(np.uint16), "triangle_part": (tinted % 2).astype(np.uint8),
        "field:speed": (tinted % 256).astype(np.uint8), "fragment_id": rows.astype(np.int64),
        "fragment_mass": np.geomspace(1e-3, 1e-9, fragments), "fragment_tets": np.full(fragments, 20, np.uint32),
        "fragment_size": np.geomspace(1e-2, 1e-4, fragments).astype(np.float32),
        "fragment_centre": (_SPAN * centres).astype(np.float32),
        "fragment_velocity": np.ones((fragments, 3), np.float32),
        "fragment_birth": np.zeros(fragments, np.float32),
    }  # fmt: skip
    header = Header(
        n=n, step=1000 * n, t=t, box=((0.0, 0.0, 0.0), (_SPAN, _SPAN, _SPAN)), ranks=2, parts=["bar", "glass"],
        tets=_AROUND * fragments, surface_triangles=_AROUND * fragments, fragments_total=fragments,
        fragments_listed=fragments, fields={"speed": Field(unit="m/s", low=0.0, high=255.0)},
    )  # fmt: skip
    return pack(header, {name: _column(values) for name, values in arrays.items()})


def _column(values: "np.ndarray[Any, Any]") -> Column:
    return Column(values.dtype.name, values.shape, values.tobytes())


def _icosahedron() -> tuple["np.ndarray[Any, Any]", "np.ndarray[Any, Any]"]:
    """Returns the corners of an icosahedron on the unit sphere (12, 3), and its faces (20, 3), each with three
    neighbouring corners.
    """
    signs = itertools.product((-1.0, 1.0), (-_GOLDEN, _GOLDEN))
    points = np.array([np.roll((0.0, a, b), turn) for a, b in signs for turn in range(3)])
    near = np.linalg.norm(points[:, None] - points, axis=2) < 2.1
    faces = [
        f for f in itertools.combinations(range(12), 3) if near[f[0], f[1]] and near[f[1], f[2]] and near[f[0], f[2]]
    ]
    return points / np.linalg.norm(points[0]), np.array(faces)


def take(made: Path, runs: Path) -> None:
    """Copies a finished run without its frames into a folder of runs."""
    shutil.copytree(made, runs / made.name, ignore=shutil.ignore_patterns("frames", "checkpoints"))


def lay(folder: Path, made_of: Path, events: int, triangles: int, ranks: int = 2) -> None:
    """Creates the folder of a finished run with the case of ``made_of``, other events and one snapshot."""
    shutil.copytree(
        made_of, folder, ignore=shutil.ignore_patterns("frames", "checkpoints", "snapshots", layout.JOURNAL)
    )
    submission = json.loads((folder / layout.SUBMISSION).read_text())
    (folder / layout.SUBMISSION).write_text(
        json.dumps({**submission, "id": folder.name, "owner": OWNER, "idempotency_key": None, "ranks": ranks})
    )
    place = layout.snapshot(folder, 0)
    place.parent.mkdir()
    place.write_bytes(blob(0, triangles, _END))
    with (folder / layout.JOURNAL).open("wb", 1 << 20) as file:
        for seq, message in enumerate(_journal(folder.name, events, place, ranks), 1):
            file.write(messages.to_json(message).replace(b'"seq":0', b'"seq":%d' % seq, 1) + b"\n")


def _journal(run: str, events: int, snapshot: Path, ranks: int) -> Iterator[messages.AnyMessage]:
    for state in (State.ACCEPTED, State.QUEUED, State.STARTING, State.RUNNING):
        yield messages.Status(run=run, wall=1000.0, state=state)
    steps = events // 3
    for k in range(steps):
        at: dict[str, Any] = {"run": run, "step": 10 * k, "t": _END * k / steps, "wall": 1000.0 + 0.25 * k}
        yield messages.Counts(
            **at, elements=100_000, nodes=20_000 + k, shared=400, fragments=1 + k,
            elements_per_rank=[100_000 // ranks] * ranks,
            facets=2 * k,
        )  # fmt: skip
        yield messages.Progress(
            **at, end_time=_END, dt=1e-9, limiter="stability: tet 4711 of glass", eta=1.0, updates_per_second=3e6,
            energy=messages.Energy(
                kinetic=350.0 - 1e-4 * k, elastic=12.0, plastic=3.0, viscous=0.5, contact=0.1, external=0.0,
                initial=366.0, residual=1e-6,
            ),
        )  # fmt: skip
        phases = {
            name: [1e-3 + 1e-5 * ((k + 3 * rank) % 17) for rank in range(ranks)]
            for name in ("elements", "nodes", "contact", "exchange", "fracture")
        }
        yield messages.Load(**at, phases=phases, imbalance=1.0 + 0.01 * (k % 9), steps=10, waiting=[2e-4] * ranks)
    data = snapshot.read_bytes()
    yield messages.Snapshot(
        run=run, step=10 * steps, t=_END, wall=1000.0 + 0.25 * steps, n=0, bytes=len(data),
        path=f"{layout.SNAPSHOTS}/{snapshot.name}", triangles=1, fragments=1,
        sha256=hashlib.sha256(data).hexdigest(), cause="end",
    )  # fmt: skip
    yield messages.Status(run=run, wall=1000.0 + 0.25 * steps, state=State.SUCCEEDED)
