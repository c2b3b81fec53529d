"""H5, H20: after every event the mesh equals that of plain Python, and forces and masses belong to the right nodes."""

import math
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
import pytest

from conoid.cases import load
from conoid.worker import simulation
from conoid.worker.mesh.faces import FACES, across
from conoid.worker.model.rows import MASS
from conoid.worker.model.state import INTACT, Ints
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.simulation import Simulation

from ..worker.kernels import run
from ..worker.meshes import Floats

SCENE = """
name = "burst"
[materials.glass]
density = 2500
elastic = {{ young = 72e9, poisson = 0.22 }}
brittle = {{ strength = 60e6, energy = 5.0, scatter = {{ modulus = 4 }} }}
[[parts]]
name = "block"
material = "glass"
stretch = {{ rate = [6e3, 5e3, 4e3] }}
fracture = {{ model = "{model}", delay = 0 }}
mesh = {{ shape = "box", low = [0, 0, 0], high = [4e-3, 3e-3, 3e-3], generator = "structured", element_size = 1e-3 }}
[numerics]
pressure = "{form}"
dt_safety = 0.3
[run]
end_time = "2 us"
frames = 0
"""


def burst(model: str, form: str) -> Simulation:
    """Returns a block that is stretched in all directions until it shatters."""
    case = load.parse_toml(SCENE.format(model=model, form=form))
    return simulation.build(case, Path(), SerialComm())


def components(tets: Ints, joined: list[tuple[int, int]]) -> int:
    """Returns the number of pieces into which the pairs ``joined`` connect ``tets``."""
    root = {int(t): int(t) for t in tets}

    def find(t: int) -> int:
        while root[t] != t:
            t = root[t]
        return t

    for one, two in joined:
        root[find(one)] = find(two)
    return len({find(t) for t in root})


def check_topology(sim: Simulation, before: Ints) -> None:
    """Checks the topology of the mesh; ``before`` (n, 4): the tets of the unbroken mesh, by local nodes."""
    nodes, block = sim.model.nodes, sim.model.blocks[0]
    tets = block.tets.astype(np.int64)
    assert np.array_equal(nodes.id, np.arange(sim.model.nodes_global))
    assert np.array_equal(np.unique(tets), np.arange(nodes.n))
    star: defaultdict[int, list[int]] = defaultdict(list)
    for t, corners in enumerate(tets):
        for a in corners:
            star[int(a)].append(t)
    behind = across(before.astype(np.int32))
    place = {int(i): t for t, i in enumerate(block.id)}
    assert np.array_equal(np.argsort(block.id[np.argsort(block.id)]), np.arange(len(tets)))
    bonds: defaultdict[int, list[tuple[int, int]]] = defaultdict(list)
    apart = np.zeros((len(tets), 4), bool)
    for t in range(len(tets)):
        for f in range(4):
            if behind[t, f] < 0:
                assert block.across[t, f] < 0
                continue
            other, back = divmod(int(behind[t, f]), 4)
            assert place[int(block.across[t, f]) // 4] == other
            assert block.bond[t, f] == block.bond[other, back]
            mine, theirs = set(tets[t, FACES[f]]), set(tets[other, FACES[back]])
            if block.bond[t, f] == INTACT:
                assert mine == theirs
                for a in mine:
                    bonds[int(a)].append((t, other))
            apart[t, f] = mine != theirs
    for a, around in star.items():
        assert components(np.array(around), bonds[a]) == 1
    faces = tets[:, FACES][(block.across < 0) | apart]
    edges = Counter(tuple(sorted((int(f[i]), int(f[i - 1])))) for f in faces for i in range(3))
    assert all(count % 2 == 0 for count in edges.values())
    mass = np.zeros(nodes.n)
    np.add.at(mass, tets, 0.25 * block.row(MASS)[:, None])
    assert nodes.mass == pytest.approx(mass, rel=1e-12)


@pytest.mark.parametrize("model", ["instant", "cohesive"])
def test_a_shattering_block_stays_a_mesh(model: str) -> None:
    sim, events, seen, first = burst(model, "standard"), 0, 0, math.nan
    before = sim.model.blocks[0].tets.astype(np.int64)
    mass = float(sim.model.nodes.mass.sum())

    def look(sim: Simulation, _: Floats) -> None:
        nonlocal events, seen, first
        assert sim.fracture is not None
        if sim.fracture.broken > seen:
            first = first if events else sim.clock.t
            seen, events = sim.fracture.broken, events + 1
            check_topology(sim, before)
            assert float(sim.model.nodes.mass.sum()) == pytest.approx(mass, rel=1e-12)

    nodes = sim.model.nodes.n
    run(sim, look)
    print(f"{events} events, {seen} facets, {nodes} -> {sim.model.nodes.n} nodes of {4 * len(before)}")
    assert events > 5
    assert sim.fracture is not None
    assert sim.fracture.first == first > 0.0
    assert sim.model.nodes.n > 2 * nodes


@pytest.mark.parametrize("form", ["standard", "nodal", "split"])
@pytest.mark.parametrize("model", ["instant", "cohesive"])
def test_forces_after_an_event_are_those_of_the_separated_mesh(model: str, form: str) -> None:
    """Forces transferred in integers equal a new sum over the separated mesh, to the last quantum; the forces of copies
    and parent add up to the previous force of the parent.
    """
    sim, seen, worst = burst(model, form), 0, 0.0
    origin: Ints = np.arange(sim.model.nodes.n)

    def look(sim: Simulation, _: Floats) -> None:
        nonlocal seen, origin, worst
        assert sim.fracture is not None
        nodes = sim.model.nodes
        if sim.fracture.broken == seen:
            return
        seen = sim.fracture.broken
        handed = nodes.force.copy()
        sim.elements.again(nodes.scale)
        sim.elements.finish()
        worst = max(worst, float(np.abs(handed - nodes.force).max()) / max(float(np.abs(handed).max()), 1.0))
        nodes.force[:] = handed

    run(sim, look)
    print(f"{seen} facets, largest difference {worst:.1e} of the largest force")
    assert seen > 50
    assert worst == 0.0
