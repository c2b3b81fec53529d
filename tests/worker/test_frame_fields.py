"""Requested fields of frames: strains and rates are compared with matrix functions of scipy, the contact pressure is
compared by its sum."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.linalg import logm

from conoid.cases.load import CaseError, parse_case
from conoid.cases.model import schema
from conoid.worker import step
from conoid.worker.output import frames
from conoid.worker.output.wanted import wanted
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved
from .kernels import STEEL, Floats, build, run, scene
from .meshes import block
from .simulations import kept_again, on

ALL = ("density", "strain", "strain_rate", "contact_pressure")
MESH = block((3, 2, 2), 1e-3, seed=6)


def asking(case: schema.Case, fields: tuple[str, ...], count: int = 4) -> schema.Case:
    chosen = case.run.model_copy(update={"fields": fields, "frames": count})
    return case.model_copy(update={"run": chosen})


def written(sim: Simulation, folder: Path, index: int = 1) -> dict[str, Floats]:
    """Returns the fields of a frame on rank 0, and an empty result on other ranks."""
    folder.mkdir(exist_ok=True)
    path = frames.write(folder, index, sim.clock.t, sim.model, sim.comm, wanted=wanted(sim, index))
    if path is None:
        return {}
    with h5py.File(folder / path) as file:
        root = file["VTKHDF"]
        data = {name: each[...] for group in ("CellData", "PointData") for name, each in root[group].items()}
        units = {name: each.attrs.get("unit", "") for name, each in root["CellData"].items()}
        assert {"density": "kg/m^3", "strain": "1", "strain_rate": "1/s"}.items() <= units.items()
        return data


def test_strain_rate_and_density_are_those_of_the_deformation(tmp_path: Path) -> None:
    """A body is sheared, stretched and rotated: its strain is ln V by scipy's matrix logarithm, and the rate d follows
    from the velocity gradient."""
    random = np.random.default_rng(3)
    change, rate = np.eye(3) + 0.4 * random.normal(size=(3, 3)), 1e4 * random.normal(size=(3, 3))
    assert np.linalg.det(change) > 0.1
    sim = build(asking(scene(STEEL), ALL[:3]), [MESH])
    nodes = sim.model.nodes
    nodes.x[:] = nodes.x0 @ change.T
    nodes.v[:] = nodes.x @ rate.T
    found = written(sim, tmp_path)
    strain = 0.5 * np.real(logm(change @ change.T))
    parts = [strain[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))]
    d = 0.5 * (rate + rate.T)
    for values, tensor in ((found["effective_strain"], strain), (found["strain_rate"], d)):
        deviator = tensor - np.trace(tensor) / 3.0 * np.eye(3)
        assert values == pytest.approx(np.sqrt(2.0 / 3.0 * (deviator**2).sum()), rel=1e-6)
    assert found["strain"] == pytest.approx(np.tile(parts, (len(MESH.tets), 1)), rel=1e-5, abs=1e-6)
    assert found["density"] == pytest.approx(7850.0 / np.linalg.det(change), rel=1e-6)
    assert "contact_pressure" not in found


def test_a_body_that_turns_has_no_strain(tmp_path: Path) -> None:
    spin = {"rate": (0.0, 0.0, 1e4), "centre": (0.0, 0.0, 0.0)}
    turning = {"kind": "rotation", "spin": spin}
    sim = build(asking(scene(STEEL, end=5e-5, boundaries=(turning,)), ALL[:3]), [MESH])
    run(sim)
    assert abs(sim.model.nodes.x[:, 0] - MESH.points[:, 0]).max() > 5e-4
    found = written(sim, tmp_path)
    assert np.abs(found["strain"]).max() < 1e-7
    assert found["strain_rate"].max() < 1e4 * 1e-3


@pytest.mark.parametrize(
    ("upper", "wall"), [({}, {}), ({"rigid": schema.Rigid()}, {"mass": 1e9})], ids=["deformable", "rigid"]
)
def test_the_pressure_of_contact_carries_the_weight(
    upper: dict[str, Any], wall: dict[str, Any], tmp_path: Path
) -> None:
    """One rank and three ranks give the same bit patterns. A block lies on another block, which lies on a wall; gravity
    presses both blocks on the wall, and the blocks are damped. The contact pressure is the mean over the time between
    two frames; the run continues from a checkpoint. The upper block may be rigid, and the wall may be a moving wall.
    """
    base = block((3, 3, 1), 1e-3, shake=0.0)
    boundaries: tuple[dict[str, Any], ...] = (
        {"kind": "wall", "point": (0.0, 0.0, 0.0), "normal": (0.0, 0.0, 1.0), **wall},
        {"kind": "gravity", "acceleration": (0.0, 0.0, -1e6)},
    )
    case = meeting_of([{}, upper], end=4e-5, boundaries=boundaries, viscosity={"linear": 1.0})
    case = asking(case, ALL)
    meshes = [base, moved(base, (0.0, 0.0, 1e-3))]
    weight = 7850.0 * 9e-9 * 1e6

    def work(sim: Simulation) -> tuple[bytes, list[float]]:
        step.prepare(sim)
        measured, folder = list[float](), tmp_path / f"{sim.comm.size}"
        data: dict[str, Floats] = {}
        while not sim.clock.done:
            step.first_half(sim)
            if sim.clock.frame_due:
                data = written(sim, folder, sim.clock.frame)
                sim.clock.frame += 1
            step.second_half(sim)
            if sim.clock.frame == 3 and not measured:
                measured.append(0.0)
                sim = kept_again(sim, case, folder)
        step.first_half(sim)
        data = written(sim, folder, 4)
        sim.free()
        if not data:
            return b"", []
        pressure = data["contact_pressure"].astype(float)
        lower, upper = np.arange(len(base.points)), np.arange(len(base.points), len(pressure))
        return b"".join(data[name].tobytes() for name in sorted(data) if name != "rank"), [
            _force(pressure, base.points, base.tets, lower, 0.0),
            _force(pressure, base.points, base.tets, lower, 1e-3),
            _force(pressure, base.points, base.tets, upper, 0.0),
        ]

    (bits, found), (others, _) = (on(ranks, case, meshes, work)[0] for ranks in (1, 3))
    assert bits == others
    assert found == pytest.approx([2.0 * weight, weight, weight], rel=0.03)


def _force(pressure: Floats, points: Floats, tets: "np.ndarray", nodes: "np.ndarray", height: float) -> float:
    """Returns the force on the face at the given height, from the pressure and the areas of its nodes."""
    total = 0.0
    for tet in tets:
        face = [n for n in tet if abs(points[n, 2] - height) < 1e-9]
        if len(face) == 3:
            a, b, c = (points[n] for n in face)
            total += float(np.linalg.norm(np.cross(b - a, c - a))) / 6.0 * sum(pressure[nodes[n]] for n in face)
    return total


def test_fields_that_cannot_be_are_refused() -> None:
    bar = {"shape": "box", "low": [0, 0, 0], "high": [1, 1, 1], "element_size": 0.5}
    data: dict[str, Any] = {
        "name": "x", "run": {"end_time": 1e-6}, "parts": [{"name": "bar", "material": "copper", "mesh": bar}],
    }  # fmt: skip
    for fields, says in (
        (["contact_pressure"], "the case has neither contact between parts nor a wall"),
        (["density", "density"], "is listed twice"),
        (["densty"], "density"),
    ):
        with pytest.raises(CaseError, match=says):
            parse_case({**data, "run": {"end_time": 1e-6, "fields": fields}})
