"""Unions, differences and intersections of shapes."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from conoid.cases.load import CaseError, parse_case
from conoid.cases.model.bodies import Mesh
from conoid.cases.model.solids import Combination, Difference, Intersection, Union
from conoid.cases.shapes.combined import box_of, combined_size, inside
from conoid.worker.errors import MeshError
from conoid.worker.mesh.build import build
from conoid.worker.mesh.model import TetMesh, check
from conoid.worker.mesh.occ.solids import measured

from .quality import face_counts
from .trees import tree

HERE = Path(__file__).parent
SIZE, POINTS = 0.12, 20_000
CORE = {"shape": "ogive", "radius": 0.3, "crh": 3.0, "shank": 0.6}
JACKET = {"shape": "ogive", "radius": 0.5, "crh": 3.0, "shank": 0.9, "base": [0.0, 0.0, -0.2]}


def combination(request: dict[str, Any], **more: Any) -> Combination:
    made: Mesh = TypeAdapter[Mesh](Mesh).validate_python({"element_size": SIZE, **request, **more})
    assert isinstance(made, Union | Difference | Intersection)
    return made


def made(body: Combination) -> TetMesh:
    """Returns the mesh of a body, made in this process to save the time of a child process."""
    return check(measured(body, {}, "mesh"))


def by_chance(body: Combination, seed: int) -> tuple[float, float]:
    """Returns a Monte Carlo estimate of the volume, m^3, that is inside according to ``cases``, and the standard
    deviation of the estimate.
    """
    holds, box = inside(body), box_of(body)
    assert holds is not None
    low, high = np.array(box or ((-2.0,) * 3, (2.0,) * 3))
    if (low >= high).any():
        return 0.0, 0.0
    points = np.random.default_rng(seed).uniform(low, high, (POINTS, 3)).tolist()
    share = sum(holds((x, y, z)) for x, y, z in points) / POINTS
    whole = float((high - low).prod())
    return whole * share, whole * math.sqrt(share * (1.0 - share) / POINTS)


def assert_volume(seed: int) -> None:
    """The volume of the mesh agrees with the Monte Carlo estimate, up to the deviation of the estimate and to the
    volume that facets cut off round bodies.
    """
    body = combination(tree(seed))
    volume, off = by_chance(body, seed)
    if volume < 1e-3:
        return
    mesh = made(body)
    assert mesh.volumes().sum() == pytest.approx(volume, abs=5.0 * off + 0.06 * volume), seed
    assert set(face_counts(mesh.tets).tolist()) == {1, 2}


@pytest.mark.parametrize("seed", range(24))
def test_the_volume_of_a_combination_made_at_random(seed: int) -> None:
    assert_volume(seed)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_the_volumes_of_two_hundred_combinations_made_at_random() -> None:
    for seed in range(24, 224):
        assert_volume(seed)


def test_inclusion_and_exclusion() -> None:
    """Volumes of meshes fulfil |A or B| = |A| + |B| - |A and B| = |A - B| + |B|, at second order of the element
    size.
    """
    pair = [
        {"shape": "sphere", "radius": 0.6},
        {"shape": "cone", "radius": 0.5, "length": 1.2, "base": [0.2, 0.1, 0.0]},
    ]
    volumes = {kind: made(combination({"shape": kind, "of": pair}, element_size=0.06)).volumes().sum() for kind in
               ("union", "intersection", "difference")}  # fmt: skip
    ball, cone = 4.0 / 3.0 * math.pi * 0.6**3, math.pi / 3.0 * 0.25 * 1.2
    assert volumes["union"] + volumes["intersection"] == pytest.approx(ball + cone, rel=5e-3)
    assert volumes["difference"] + cone == pytest.approx(volumes["union"], rel=5e-3)


def test_a_jacket_round_a_core_and_its_sectors() -> None:
    """The cavity exists in the mesh; a quarter of the body has a quarter of the volume, with nodes exactly on its
    planes.
    """
    shape = {"shape": "difference", "of": [JACKET, CORE]}
    whole, quarter = (made(combination(shape, element_size=0.08, sector=each)) for each in ("full", "quarter"))
    nose = {radius: _ogive(radius) for radius in (0.5, 0.3)}
    exact = nose[0.5] + math.pi * 0.25 * 0.9 - nose[0.3] - math.pi * 0.09 * 0.6
    assert whole.volumes().sum() == pytest.approx(exact, rel=0.02)
    assert 4.0 * quarter.volumes().sum() == pytest.approx(whole.volumes().sum(), rel=5e-3)
    for direction in (0, 1):
        away = quarter.points[:, direction]
        assert ((away == 0.0) | (away > 1e-4)).all()
        assert (away == 0.0).sum() > 50


def _ogive(radius: float) -> float:
    """Returns the volume of a tangent nose of calibre radius head 3, m^3, by the integral of its outline."""
    rho, length = 6.0 * radius, 2.0 * radius * math.sqrt(2.75)
    z = np.linspace(0.0, length, 100_001)
    return float(np.trapezoid(math.pi * (np.sqrt(rho**2 - z**2) - (rho - radius)) ** 2, z))


def test_a_solid_turned_or_elsewhere_is_the_same_solid() -> None:
    """Each operand has its own rotation, and a combination inside of another combination is rotated as a whole."""
    hole = {"shape": "cylinder", "radius": 0.2, "length": 2.0, "base": [0.0, 0.0, -1.0]}
    block = {"shape": "box", "low": [-0.5, -0.4, -0.3], "high": [0.5, 0.4, 0.3]}
    turn = {"axis": "y", "angle": 0.7, "centre": [0.3, 0.0, 0.1]}
    inner = {"shape": "difference", "of": [block, hole]}
    far = {"shape": "box", "low": [1.2, 0.0, 0.0], "high": [1.7, 0.5, 0.5]}
    plain = combination({"shape": "union", "of": [inner, far]})
    turned = combination({"shape": "union", "of": [{**inner, "turn": turn}, far]})
    volumes = [made(each).volumes().sum() for each in (plain, turned)]
    assert volumes[1] == pytest.approx(volumes[0], rel=2e-3)
    assert by_chance(turned, 1)[0] == pytest.approx(volumes[1], rel=0.1)


def test_the_same_combination_has_the_same_bits_and_is_kept_by_content() -> None:
    body = combination({"shape": "difference", "of": [JACKET, CORE]}, sector="quarter")
    one, other = build(body, HERE), made(body)
    assert np.array_equal(made(body).points, other.points)
    assert np.array_equal(np.sort(one.points, axis=0), np.sort(other.points, axis=0))


def test_short_edges_and_small_fillets_are_reported() -> None:
    notch = {"shape": "box", "low": [0.49, -1.0, 0.49], "high": [1.0, 1.0, 1.0]}
    round_hole = {"shape": "cylinder", "radius": 0.05, "length": 2.0, "base": [0.0, 0.0, -1.0]}
    block = {"shape": "box", "low": [-0.5, -0.5, -0.5], "high": [0.5, 0.5, 0.5]}
    mesh = made(combination({"shape": "difference", "of": [block, notch, round_hole]}))
    assert mesh.origin is not None
    short, small = mesh.origin.notes
    assert "4 of 21 edges are shorter than half of element_size, the shortest 10.0 mm" in short
    assert "1 of 9 faces are round with a radius below element_size, the smallest 50.0 mm" in small


def test_its_size_is_known_about_before_it_is_meshed() -> None:
    body = combination({"shape": "difference", "of": [JACKET, CORE]}, element_size=0.06)
    expected, mesh = combined_size(body), made(body)
    assert expected is not None
    assert expected.elements / len(mesh.tets) == pytest.approx(1.0, abs=0.3)
    assert 0.5 < expected.step_length / mesh.step_lengths().min() < 2.0


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        ({"shape": "intersection", "of": [JACKET, {**CORE, "base": [5.0, 0.0, 0.0]}]}, "mesh: the body is empty"),
        ({"shape": "difference", "of": [CORE, JACKET]}, "mesh: the body is empty"),
        ({"shape": "union", "of": [CORE, JACKET], "element_size": 1e-5}, "mesh.element_size = 1e-05 m: about"),
    ],
)
def test_what_cannot_be_meshed_is_refused_in_one_line(request_: dict[str, Any], message: str) -> None:
    with pytest.raises(MeshError) as refused:
        made(combination(request_))
    assert str(refused.value).startswith(message)


def _nested(depth: int) -> dict[str, Any]:
    return CORE if depth == 0 else {"shape": "union", "of": [CORE, _nested(depth - 1)]}


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        ({"shape": "union", "of": [CORE]}, "parts[0].mesh.of: at least 2 are needed"),
        ({"shape": "union", "of": [CORE, {"shape": "blob"}]}, "parts[0].mesh.of[1].shape = 'blob': allowed: 'box'"),
        (
            {"shape": "union", "of": [CORE, {**CORE, "crh": None}]},
            "parts[0].mesh.of[1].crh: needs at least one of crh and nose",
        ),
        ({"shape": "union", "of": [CORE, {**CORE, "sector": "half"}]}, "parts[0].mesh.of[1].sector: unknown key"),
        (_nested(9), "parts[0].mesh.of: combinations are nested more than 8 deep"),
        ({"shape": "union", "of": [_nested(3)] * 60}, "parts[0].mesh.of: 240 shapes in all; allowed: up to 200"),
        ({"shape": "union", "of": [CORE, JACKET], "sector": "half"}, "parts[0].mesh.sector = 'half': needs a boundary"),
    ],
)
def test_a_combination_that_is_wrong_is_refused_under_its_key(mesh: dict[str, Any], message: str) -> None:
    part = {"name": "body", "material": "steel", "mesh": _written({"element_size": 0.1, **mesh})}
    with pytest.raises(CaseError) as refused:
        parse_case({"name": "one", "parts": [part], "run": {"end_time": 1e-6}})
    assert str(refused.value).startswith(message)
    assert "\n" not in str(refused.value)


def _written(mesh: Any) -> Any:
    """Returns the keys of a table whose values are not None."""
    if isinstance(mesh, dict):
        return {key: _written(value) for key, value in mesh.items() if value is not None}
    return [_written(each) for each in mesh] if isinstance(mesh, list) else mesh


@pytest.mark.parametrize(
    ("low", "message"), [((4, 4, 0), "edges"), ((4, 4, 4), "points"), ((4, 0, 0), ""), ((5, 0, 0), "")]
)
def test_solids_that_touch_only_in_an_edge_or_a_point_are_reported(low: tuple[int, int, int], message: str) -> None:
    boxes = [
        {"shape": "box", "low": [1e-3 * x for x in corner], "high": [1e-3 * (x + 4) for x in corner]}
        for corner in ((0, 0, 0), low)
    ]
    request = {"shape": "union", "of": boxes, "element_size": 2e-3}
    origin = measured(TypeAdapter[Mesh](Mesh).validate_python(request), {}, "mesh").origin  # type: ignore[arg-type]
    assert origin is not None
    assert [f"touch each other only in {message}, which" in note for note in origin.notes] == [True] * bool(message)
