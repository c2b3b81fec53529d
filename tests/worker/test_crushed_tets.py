"""Tets that lose most of their volume under averaged pressures: each sees its own from then on, and nothing jumps."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.worker import digest, state, step
from conoid.worker.elements.flat import LEAST
from conoid.worker.probes import tet_volumes
from conoid.worker.simulation import Simulation

from .kernels import COPPER, COPPER_GAS, Form, Patch, build, run, scene
from .meshes import Floats, block
from .simulations import kept_again, on

AVERAGED: tuple[Form, ...] = ("nodal", "split")
HOT = COPPER.model_copy(update={"eos": COPPER_GAS.eos})
"""Copper that flows, whose heat is pressure."""
WALL = {"kind": "wall", "point": (0.0, 0.0, 0.0), "normal": (0.0, 0.0, 1.0)}
MESH = block((4, 4, 4), 1e-3, seed=1)
THROWN: dict[str, Any] = {"end": 3e-6, "velocity": (0.0, 0.0, -1500.0), "boundaries": (WALL,), "viscosity": {}}
"""Against a wall, so fast that corners of the block jet along it."""


def marked(sim: Simulation) -> int:
    return sum(int(body.flat.sum()) for body in sim.model.blocks)


@pytest.mark.parametrize("form", AVERAGED)
def test_a_crushed_tet_resists_with_its_own_volume(form: Form) -> None:
    """With the mean of nodes alone 0.00002 of a volume was left (``split``: 0.047), after 3,534 steps (632)."""
    sim, least = build(scene(COPPER, form, **THROWN), [MESH]), [1.0]
    (body,) = sim.model.blocks
    start = tet_volumes(body.tets, sim.model.nodes.x0)

    def look(sim: Simulation, before: Floats) -> None:
        least.append(float((tet_volumes(body.tets, sim.model.nodes.x) / start).min()))
        if sim.clock.step % 50 == 0:
            sim.ledger.close(before)

    run(sim, look)
    assert 0 < marked(sim) < 20
    assert 0.5 * LEAST < min(least) < LEAST
    assert sim.ledger.worst < 1e-4
    assert sim.clock.step < 500


@pytest.mark.parametrize("form", AVERAGED)
def test_its_pressure_goes_on_from_where_it_is(form: Form) -> None:
    """In the step in which it is marked the pressure changes by the bulk modulus times its own volume strain alone."""
    sim, jumps = build(scene(COPPER, form, **THROWN), [MESH]), list[Floats]()
    (body,) = sim.model.blocks
    bulk = COPPER.elastic.young / (3.0 - 6.0 * COPPER.elastic.poisson)
    flat, seen, own = body.flat.copy(), body.row(state.PRESSURE), tet_volumes(body.tets, sim.model.nodes.x0)

    def look(sim: Simulation, before: Floats) -> None:
        nonlocal flat, seen, own
        pressure, volume = body.row(state.PRESSURE), tet_volumes(body.tets, sim.model.nodes.x)
        jumps.append(((pressure - seen) / bulk + np.log(volume / own))[body.flat & ~flat])
        flat, seen, own = body.flat.copy(), pressure, volume

    run(sim, look)
    assert sum(map(len, jumps)) > 5
    assert np.abs(np.concatenate(jumps)).max() < 1e-5


def test_its_heat_goes_on_from_where_it_is() -> None:
    """From the step on in which it is marked it grows by the tet's own work, a step behind as that of all."""
    sim, differ = build(scene(HOT, "nodal", **THROWN), [MESH]), list[Floats]()
    (body,) = sim.model.blocks
    bulk = HOT.density * COPPER_GAS.eos.c0**2  # type: ignore[union-attr]
    last = [body.row(state.HEAT), body.row(state.TOLD)]

    def look(sim: Simulation, before: Floats) -> None:
        now = [body.row(state.HEAT), body.row(state.TOLD)]
        told = (now[1] - last[1]) * HOT.density / bulk / body.row(state.MASS)
        differ.append((now[0] - last[0] - told)[body.flat])
        last[:] = now

    run(sim, look)
    assert marked(sim) > 2
    assert np.abs(np.concatenate(differ)).max() < 1e-12


def ended(sim: Simulation, folder: Path | None, form: Form) -> tuple[str | None, int]:
    """The digest after 160 steps, kept and resumed after 120 where there is a ``folder``; tets marked by then."""
    step.prepare(sim)
    for number in range(160):
        if number == 120:
            marks = int(sim.comm.sum(np.array([marked(sim)]))[0])
            sim = kept_again(sim, sim.case, folder) if folder is not None else sim
        step.first_half(sim)
        step.second_half(sim)
    return digest.digest(sim.model, sim.comm, [sim.elements.pressure] if form == "split" else []), marks


@pytest.mark.parametrize("form", AVERAGED)
def test_the_mark_travels_between_ranks_and_through_checkpoints(form: Form, tmp_path: Path) -> None:
    case = scene(HOT, form, **THROWN)
    whole = ended(build(case, [MESH]), None, form)
    assert whole[1] > 0
    for ranks in (1, 2, 3):
        kept = on(ranks, case, [MESH], lambda sim: ended(sim, tmp_path / str(sim.comm.size), form))
        assert kept[0] == whole


def test_an_even_compression_has_one_pressure() -> None:
    """Of tets that are marked from the start, and of those that are on the way."""
    sim = build(scene(COPPER, "nodal"), [MESH])
    (body,) = sim.model.blocks
    body.flat[::7] = True
    nodes = sim.model.nodes
    for _ in range(300):
        nodes.v[:] = -1.6e5 * nodes.x
        nodes.x += 1e-8 * nodes.v
        sim.elements.advance(1e-8, sim.next_scale())
        sim.elements.finish()
    pressure = body.row(state.PRESSURE)
    assert body.flat.all()
    assert np.ptp(pressure) < 1e-4 * pressure.max()


@pytest.mark.parametrize("when", ["never", "half way"])
def test_a_mark_takes_energy_and_gives_none(when: str) -> None:
    """There and back: with a mark that is set in between the nodes have done work, without one none."""
    patch = Patch(MESH, COPPER, "nodal")
    nodes = patch.nodes
    away = 1e-8 * np.random.default_rng(3).standard_normal(nodes.x.shape)
    most = 0.0
    for way in (1.0, -1.0):
        for _ in range(20):
            nodes.v[:] = way * away / 1e-8
            nodes.x += way * away
            patch.advance(1e-8)
        most = max(most, float(patch.get(state.WORK).sum()))
        patch.block.flat[::5] = when != "never"
    work = float(patch.get(state.WORK).sum())
    assert work > 0.02 * most if when != "never" else abs(work) < 1e-3 * most
