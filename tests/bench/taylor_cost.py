"""Mean cost of a Johnson-Cook tet over a Taylor bar of about 140,000 tets, without a run of the whole fine bar.

A coarse bar runs to its end. At several stages of the run, with equal numbers of steps between two stages, the mesh of
the coarse bar is refined twice, with velocities and state, and some steps of this fine bar are timed. The mean speed of
the fine bar is the harmonic mean over the stages.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from conoid.cases import load
from conoid.cases.model import schema
from conoid.worker import step
from conoid.worker.mesh.build import build as build_mesh
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model import rows, state

from .gather_scatter import GatherScatter
from .refine import Refined, refined
from .scene import SAMPLE_EVERY, Form, Ride
from .stopwatch import take_turns
from .table import Cell, table

_BAR = "taylor_42crmo4"
_SIZE = "0.97 mm"
_EXTENSIVE = (rows.WORK, rows.WORK_VISCOUS, rows.WORK_PLASTIC, rows.VOLUME_FLUX)
_KEPT = (rows.MASS,)
_KEEP_EVERY = 100


@dataclass(frozen=True)
class Stage:
    """Speeds of the fine bar at one stage of the run, in millions of element updates per CPU second."""

    form: str
    share: float
    """Fraction of the steps of the run that belongs to the stage."""
    time: float
    tets: int
    yielding: float
    best: float
    median: float
    spread: float
    limit: float


@dataclass(frozen=True)
class Moment:
    """State of the coarse bar at some step."""

    time: float
    x: state.Floats
    v: state.Floats
    rows: list[state.Floats]


def measure(form: Form = "nodal", stages: int = 10, rounds: int = 2) -> list[Stage]:
    """Measures the bar in a pressure form at ``stages`` stages of its run."""
    case = _case(form)
    coarse = build_mesh(case.parts[0].mesh, Path())
    moments = _history(case, coarse)
    once = refined(coarse)
    twice = refined(once.mesh)
    picked = [(i + 0.5) / stages for i in range(stages)]
    return [_stage(case, share, moments[int(share * len(moments))], once, twice, rounds) for share in picked]


def _case(form: Form) -> schema.Case:
    overrides = [f"parts[0].mesh.element_size={_SIZE}", "parts[0].mesh.generator=gmsh", f"numerics.pressure={form}"]
    return load.parse_case(load.apply_overrides(load.read_data(load.shipped_path(_BAR)), [*overrides, "run.frames=0"]))


def _history(case: schema.Case, mesh: TetMesh) -> list[Moment]:
    ride = Ride(case, mesh)
    sim, moments = ride.sim, []
    while not sim.clock.done:
        if sim.clock.step % _KEEP_EVERY == 0:
            block, nodes = sim.model.blocks[0], sim.model.nodes
            rows = [block.row(row) for row in range(block.state.shape[1])]
            moments.append(Moment(sim.clock.t, nodes.x.copy(), nodes.v.copy(), rows))
        step.first_half(sim)
        step.second_half(sim)
    return moments


def _stage(case: schema.Case, share: float, moment: Moment, once: Refined, twice: Refined, rounds: int) -> Stage:
    ride = Ride(case, twice.mesh)
    _put(ride, moment, once, twice)
    ride.steps(SAMPLE_EVERY)
    yielding = ride.yielding()
    kernel = GatherScatter(ride.sim)
    times = take_turns({"step": lambda: ride.steps(SAMPLE_EVERY), "limit": lambda: kernel.sweeps(SAMPLE_EVERY)}, rounds)
    updates = ride.tets * SAMPLE_EVERY * 1e-6
    return Stage(
        case.numerics.pressure, share, moment.time, ride.tets, yielding, updates / times["step"].best,
        updates / times["step"].median, times["step"].spread, updates / times["limit"].best,
    )  # fmt: skip


def _put(ride: Ride, moment: Moment, once: Refined, twice: Refined) -> None:
    """Copies velocities and state of the coarse bar to the fine bar, and computes the forces."""
    nodes, block = ride.sim.model.nodes, ride.sim.model.blocks[0]
    nodes.x[:] = twice.nodal(once.nodal(moment.x))
    nodes.v[:] = twice.nodal(once.nodal(moment.v))
    parent = once.parent[twice.parent]
    for row, values in enumerate(moment.rows):
        if row not in _KEPT:
            block.state[:, row, :] = state.chunked(values[parent] / (64.0 if row in _EXTENSIVE else 1.0))
    step.prepare(ride.sim)


def mean_speed(stages: Sequence[Stage]) -> tuple[float, float]:
    """Returns best and median speed, millions of element updates per CPU second, averaged over the run."""
    best, median = (len(stages) / sum(1.0 / rate for rate in rates) for rates in _rates(stages))
    return best, median


def _rates(stages: Sequence[Stage]) -> tuple[list[float], list[float]]:
    return [s.best for s in stages], [s.median for s in stages]


def report(stages: Sequence[Stage]) -> str:
    """Returns a table of the stages, and the mean over the stages."""
    rows: list[list[Cell]] = [
        [
            f"{s.share:.0%}", f"{s.time * 1e6:.1f}", f"{s.yielding:.0%}", f"{s.best:.2f} ({s.median:.2f})",
            f"{s.spread:.0%}", f"{s.limit:.0f}",
        ]
        for s in stages
    ]  # fmt: skip
    best, median = mean_speed(stages)
    head = ["of the steps", "at us", "yielding", "M updates / CPU-s, best (median)", "spread", "gather-scatter"]
    return (
        f"{_BAR}, {stages[0].form}, {stages[0].tets:,} tets\n\n{table(head, rows)}\n\n"
        f"Mean over the run: {best:.2f} (median {median:.2f}) million element-updates per CPU-second.\n"
    )
