"""Selections of regions in meshes that are turned, moved, scaled and rounded, compared with counts in integers."""

import random
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from conoid.cases.load import CaseError, parse_case
from conoid.cases.model.schema import Case, Prescribed
from conoid.cases.shapes.loaded import loads
from conoid.worker.errors import InputError
from conoid.worker.mesh.model import TetMesh
from conoid.worker.mesh.scale import scaled
from conoid.worker.mesh.structured import structured
from conoid.worker.model.loads import Load
from conoid.worker.scene import assembly, conditions, selection
from conoid.worker.scene.assembly import Whole

from .kernels import build

SIX_DIGITS, SINGLE = (np.vectorize(lambda x: float(f"{x:.6g}")), lambda x: np.float64(np.float32(x)))
PRESSURE = {"kind": "traction", "pressure": "100 MPa"}
PUSH = {"kind": "velocity", "x": "10 m/s"}
METAL = {"density": "8000 kg/m^3", "elastic": {"young": "200 GPa", "poisson": 0.3}}
PER_MM = {"m": Decimal("0.001"), "cm": Decimal("0.1"), "mm": Decimal(1), "um": Decimal(1000), "nm": Decimal(1000000)}


def case_of(mesh: dict[str, Any], *boundaries: dict[str, Any], **part: Any) -> Case:
    return parse_case({
        "name": "selected", "materials": {"m": METAL}, "boundaries": boundaries, "run": {"end_time": "1 us"},
        "contact": "none", "probes": part.pop("probes", []),
        "parts": [{"name": "body", "material": "m", "mesh": mesh, **part}],
    })  # fmt: skip


def whole_of(case: Case, mesh: TetMesh | None = None) -> Whole:
    made = structured(case.parts[0].mesh) if mesh is None else mesh  # type: ignore[arg-type]
    with patch.object(assembly, "build_mesh", lambda *_, **__: made):
        return assembly.assemble(case, Path())


def held(case: Case, whole: Whole, number: int = 0) -> int:
    spec = case.boundaries[number]
    assert isinstance(spec, Prescribed)
    return int(selection.inside(spec, whole.points, whole.node_part, whole.near.slack).sum())


def faces(whole: Whole, number: int = 0) -> int:
    return len(whole.loads[number].tets) // 3


class Scene:
    """A block of cubes at any position, rotated by quarter turns, and a box whose sides are planes of nodes of the
    block; mm, exact."""

    def __init__(self, seed: int) -> None:
        rng = random.Random(seed)
        self.unit = rng.choice(list(PER_MM))
        self.size = Decimal(rng.choice(["0.1", "0.3", "0.7", "1.1", "0.05"]))
        far = rng.choice([1, 300, 10_000])
        self.cells = [rng.randint(1, 4) for _ in range(3)]
        self.low = [far * rng.randint(-9, 9) * self.size / 10 for _ in range(3)]
        self.axis, self.quarters = rng.choice("xyz"), rng.randint(0, 3)
        self.centre = [rng.randint(-9, 9) * self.size for _ in range(3)]
        self.first = [rng.randint(0, n) for n in self.cells]
        self.last = [rng.randint(a, n) for a, n in zip(self.first, self.cells, strict=True)]
        thin = rng.randrange(3)
        if rng.random() < 0.5:  # the box is a layer without thickness, on the surface
            self.first[thin] = self.last[thin] = rng.choice([0, self.cells[thin]])

    def written(self, point: list[Decimal]) -> list[str]:
        return [f"{(x * PER_MM[self.unit]).normalize():f} {self.unit}" for x in point]

    def place(self, planes: list[int]) -> list[Decimal]:
        """Returns the position of the node with the given numbers after the rotation."""
        x = [a + k * self.size for a, k in zip(self.low, planes, strict=True)]
        i, j = (("xyz".index(self.axis) + k) % 3 for k in (1, 2))
        for _ in range(self.quarters):
            x[i], x[j] = self.centre[i] - (x[j] - self.centre[j]), self.centre[j] + (x[i] - self.centre[i])
        return x

    @property
    def box(self) -> dict[str, Any]:
        corners = list(zip(self.place(self.first), self.place(self.last), strict=True))
        return {"low": self.written([min(c) for c in corners]), "high": self.written([max(c) for c in corners])}

    @property
    def nodes(self) -> int:
        return int(np.prod([b - a + 1 for a, b in zip(self.first, self.last, strict=True)]))

    @property
    def faces(self) -> int:
        found = 0
        for d in range(3):
            i, j = (d + 1) % 3, (d + 2) % 3
            ends = (self.first[d] == 0) + (self.last[d] == self.cells[d])
            found += 2 * ends * (self.last[i] - self.first[i]) * (self.last[j] - self.first[j])
        return found

    def case(self, *boundaries: dict[str, Any], file: bool = False) -> Case:
        high = [a + n * self.size for a, n in zip(self.low, self.cells, strict=True)]
        size = self.written([self.size])[0]
        turn = {"axis": self.axis, "angle": f"{90 * self.quarters} deg", "centre": self.written(self.centre)}
        mesh = {"shape": "box", "low": self.written(self.low), "high": self.written(high), "element_size": size}
        if file:
            mesh = {"shape": "file", "path": "a.inp", "unit": f"1 {self.unit}"}
        else:
            mesh["generator"] = "structured"
        return case_of(mesh, *boundaries, turn=turn)

    def file(self, rounded: Any) -> TetMesh:
        """Returns the mesh in the form of a file: rounded coordinates in the unit of the file."""
        made = structured(self.case().parts[0].mesh)  # type: ignore[arg-type]
        numbers = [[x * PER_MM[self.unit] for x in point] for point in self._points(made)]
        return TetMesh(scaled(rounded(np.array(numbers, float)), 1e-3 / float(PER_MM[self.unit])), made.tets)

    def _points(self, made: TetMesh) -> list[list[Decimal]]:
        lows = [float(x) / 1000 for x in self.low]
        planes = np.rint((made.points - lows) / (float(self.size) / 1000)).astype(int)
        return [[a + int(k) * self.size for a, k in zip(self.low, row, strict=True)] for row in planes]


@pytest.mark.parametrize("seed", range(60))
def test_a_box_from_plane_to_plane_has_all_nodes_and_faces_between_them(seed: int) -> None:
    """The selection in the mesh is equal to the selection of ``validate``, for any position of the body and any unit of
    the file."""
    made = Scene(seed)
    boundaries = [{**PUSH, **made.box}, *([{**PRESSURE, **made.box}] if made.faces else [])]
    case = made.case(*boundaries)
    whole = whole_of(case)
    assert held(case, whole) == made.nodes
    expected = {load.boundary: load for load in loads(case)}
    assert (expected[0].nodes, expected[0].exact) == (made.nodes, True)
    if made.faces:
        area = made.faces / 2 * (float(made.size) * 1e-3) ** 2
        assert faces(whole) == made.faces == expected[1].faces
        assert expected[1].area == pytest.approx(area, rel=1e-7)
    assert whole.warnings == []


@pytest.mark.parametrize("seed", range(60, 100))
@pytest.mark.parametrize("rounded", [SIX_DIGITS, SINGLE], ids=["six_digits", "single"])
def test_files_of_few_digits_have_all_nodes_and_faces_between_planes(seed: int, rounded: Any) -> None:
    made = Scene(seed)
    if max(map(abs, made.low)) > 1000 * made.size:
        made.low = [x / 100 for x in made.low]
    case = made.case({**PUSH, **made.box}, *([{**PRESSURE, **made.box}] if made.faces else []), file=True)
    whole = whole_of(case, made.file(rounded))
    assert held(case, whole) == made.nodes
    assert made.faces == 0 or faces(whole) == made.faces
    assert whole.warnings == []


@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize(("angle", "base"), [(0, 0.0), (37, 10.0), (90, -3.3), (211, 0.7)])
def test_a_bore_and_an_end_are_whole_after_a_turn_round_their_line(axis: str, angle: int, base: float) -> None:
    d = "xyz".index(axis)
    start, far = [0.0] * 3, [base] * 3
    start[d] = base
    tube = {"shape": "tube", "axis": axis, "inner_radius": 5e-3, "radius": 8e-3, "length": 6e-3, "base": far,
            "element_size": 1e-3, "generator": "structured"}  # fmt: skip
    low, high = ([b + sign * 9e-3 for b in far] for sign in (-1, 1))
    low[d] = high[d] = base + 6e-3
    boundaries: list[dict[str, Any]] = [
        {**PRESSURE, "cylinder": {"axis": axis, "base": far, "radius": 5e-3}},
        {**PRESSURE, "low": low, "high": high},
        {**PRESSURE, "cylinder": {"axis": axis, "base": far, "inner_radius": 8e-3, "radius": 8e-3}},
    ]
    case = case_of(tube, *boundaries, turn={"axis": axis, "angle": f"{angle} deg", "centre": far})
    whole = whole_of(case)
    around = 4 * round(np.pi / 4 * 13)
    assert [faces(whole, k) for k in range(3)] == [2 * around * 6, 2 * around * 3, 2 * around * 6]
    assert whole.warnings == []


def test_a_turned_bar_is_pressed_on_its_whole_end() -> None:
    bar = {"shape": "box", "low": ["-1 mm", "-1 mm", 0], "high": ["1 mm", "1 mm", "4 mm"], "element_size": "0.5 mm"}
    end = {"low": ["4 mm", "-1 mm", "-1 mm"], "high": ["4 mm", "1 mm", "1 mm"]}
    case = case_of({**bar, "generator": "structured"}, {**PRESSURE, **end}, turn={"axis": "y", "angle": "90 deg"})
    load = whole_of(case).loads[0]
    assert isinstance(load, Load)
    force = load.force.sum(axis=0)
    assert force == pytest.approx([-400.0, 0.0, 0.0], abs=1e-9)


BOX = {"shape": "box", "low": [0, 0, 0], "high": [2e-3, 2e-3, 1e-3], "element_size": 1e-3, "generator": "structured"}
SHEAR = {"kind": "traction", "stress": [0, 0, 1e8]}
CUTS = [{"kind": "symmetry", "axis": axis} for axis in "xy"]


@pytest.mark.parametrize(
    ("sector", "more", "expected"),
    [
        ("half", {}, 14.0),
        ("quarter", {}, 12.0),
        ("quarter", {"low": [0, 0, 0], "high": [2e-3, 1e-3, 1e-3]}, 5.0),
        ("half", {"low": [0, 0, 0], "high": [0, 2e-3, 1e-3]}, 0.0),
    ],
)
def test_no_traction_loads_the_cut_of_a_sector(sector: str, more: dict[str, Any], expected: float) -> None:
    """The surface of a box of 2 x 2 x 1 mm without its faces on planes of symmetry, mm^2."""
    planes = CUTS[: 1 if sector == "half" else 2]
    case = case_of({**BOX, "sector": sector}, {**SHEAR, **more}, *planes)
    assert loads(case)[0].area == pytest.approx(1e-6 * expected, abs=1e-15)
    if not expected:
        with pytest.raises(InputError, match=r"acts on no face; .*; faces on a plane of symmetry carry no load$"):
            whole_of(case)
        return
    whole = whole_of(case)
    load = whole.loads[0]
    assert isinstance(load, Load)
    assert load.force.sum(axis=0) == pytest.approx([0.0, 0.0, 1e2 * expected], rel=1e-12)
    assert not whole.warnings


def test_a_traction_on_a_bonded_interface_is_reported(tmp_path: Path) -> None:
    """The interface of two boxes of 2 x 2 x 1 mm is loaded on both sides, 2 x 4 mm^2."""
    upper = {**BOX, "low": [0, 0, 1e-3], "high": [2e-3, 2e-3, 2e-3], "element_size": 5e-4}
    data = {
        "name": "two", "materials": {"m": METAL}, "run": {"end_time": "1 us"}, "boundaries": [SHEAR],
        "parts": [{"name": name, "material": "m", "mesh": mesh} for name, mesh in (("a", BOX), ("b", upper))],
        "bond": [{"kind": "tied", "parts": ["a", "b"]}],
    }  # fmt: skip
    message = "boundaries[0]: 8 mm^2 of its faces are bonded to another part"
    whole = assembly.assemble(parse_case(data), tmp_path)
    assert [each.startswith(message) for each in whole.warnings] == [True]
    side = {**SHEAR, "low": [0, 0, 0], "high": [0, 2e-3, 2e-3]}
    assert not assembly.assemble(parse_case({**data, "boundaries": [side]}), tmp_path).warnings


def test_the_surface_of_a_quarter_cylinder_is_estimated_without_its_cuts() -> None:
    round_body = {"shape": "cylinder", "radius": 2e-3, "length": 3e-3, "element_size": 0.5e-3, "sector": "quarter"}
    load = loads(case_of(round_body, SHEAR, *CUTS))[0]
    assert load.area == pytest.approx(1e-6 * (3.0 + 2.0) * np.pi, abs=load.spread)


def test_a_mesh_that_differs_from_the_expected_values_is_reported(caplog: pytest.LogCaptureFixture) -> None:
    """The selection would contain a whole end, but the mesh ends a third of an element before the selected plane."""
    caplog.set_level("INFO", "conoid.worker")
    bar = {"shape": "box", "low": [0, 0, 0], "high": [2e-3, 2e-3, 4e-3], "element_size": 5e-4}
    region = {"low": [0, 0, 3.9e-3], "high": [2e-3, 2e-3, 4.1e-3]}
    case = case_of({**bar, "generator": "structured"}, {**PUSH, **region})
    right, made = whole_of(case), structured(case.parts[0].mesh)  # type: ignore[arg-type]
    assert right.warnings == []
    assert "boundaries[0] drives 25 nodes; expected: 25 nodes" in caplog.text
    shorter = TetMesh(made.points * [1.0, 1.0, 0.975], made.tets)
    shorter.points[:, 0] += (shorter.points[:, 1] > 1.9e-3) * 2e-5  # one node of the layer is outside of the box
    (warning,) = whole_of(case, shorter).warnings
    assert warning.startswith("boundaries[0]: drives 24 nodes, but `conoid validate` predicts 25 nodes; check its box")


def test_a_layer_just_outside_is_reported() -> None:
    bar = {"shape": "box", "low": [0, 0, 0], "high": [2e-3, 2e-3, 4e-3], "element_size": 5e-4}
    box = {"low": [0, 0, 0], "high": [2e-3, 2e-3, 0.98e-3]}
    case = case_of({**bar, "generator": "structured"}, {**PUSH, **box})
    assert whole_of(case).warnings == [
        "boundaries[0]: 25 nodes lie outside of its region by less than a tenth of an edge and are not in it; move its "
        "border away from them"
    ]


def test_a_box_between_planes_is_refused_before_a_run_and_in_it() -> None:
    bar = {"shape": "box", "low": [0, 0, 0], "high": [2e-3, 2e-3, 4e-3], "element_size": 5e-4}
    between = {"low": [0, 0, 1.1e-3], "high": [2e-3, 2e-3, 1.4e-3]}
    for kind, what in ((PUSH, "node"), (PRESSURE, "face")):
        with pytest.raises(CaseError, match=rf"^boundaries\[0\]: no {what} of the bodies lies in the box"):
            case_of({**bar, "generator": "structured"}, {**kind, **between})
    file = case_of({"shape": "file", "path": "a.inp", "unit": "1 mm"}, {**PUSH, **between})
    with pytest.raises(InputError, match=r"^boundaries\[0\]: holds no node"):
        build(file, [structured(case_of({**bar, "generator": "structured"}).parts[0].mesh)])  # type: ignore[arg-type]


def test_a_selection_without_nodes_is_reported() -> None:
    bar = {
        "shape": "box",
        "low": [0, 0, 0],
        "high": [1e-3, 1e-3, 1e-3],
        "element_size": 5e-4,
        "generator": "structured",
    }
    other = {**bar, "low": [0, 0, 2e-3], "high": [1e-3, 1e-3, 3e-3]}
    case = parse_case({
        "name": "two", "materials": {"m": METAL}, "run": {"end_time": "1 us"}, "contact": "none",
        "parts": [{"name": n, "material": "m", "mesh": mesh} for n, mesh in (("one", bar), ("other", other))],
        "boundaries": [{**PUSH, "parts": ["one", "other"], "low": [0, 0, 0], "high": [1e-3, 1e-3, 1e-3]}],
    })  # fmt: skip
    meshes = iter([structured(part.mesh) for part in case.parts])  # type: ignore[arg-type]
    with patch.object(assembly, "build_mesh", lambda *_, **__: next(meshes)):
        (warning,) = assembly.assemble(case, Path()).warnings
    assert warning == "boundaries[0]: selects no node or face of part 'other', although it names this part"


BAR = {"shape": "box", "low": [0, 0, 0], "high": [2e-3, 2e-3, 2e-3], "element_size": 5e-4, "generator": "structured"}


def beside_a_plane(points: Any, at: str) -> tuple[int, tuple[str, ...]]:
    """Returns the number of nodes that start on a plane normal to x, and the warnings; the nodes are those of a bar
    from a file, given by its points, m.
    """
    made = structured(case_of(BAR).parts[0].mesh)  # type: ignore[arg-type]
    plane = {"kind": "symmetry", "axis": "x", "at": at}
    case = case_of({"shape": "file", "path": "a.inp", "unit": "1 mm"}, plane)
    sim = build(case, [TetMesh(points(made.points), made.tets)])
    heights = conditions.heights(case, case.boundaries[0], sim.model)  # type: ignore[arg-type]
    return int((heights == 0.0).sum()), sim.warnings


def test_nodes_just_off_a_plane_of_symmetry_are_reported() -> None:
    assert beside_a_plane(lambda x: x, "0 mm") == (25, ())
    on, (text, other) = beside_a_plane(lambda x: x + np.array([2e-6, 0.0, 0.0]), "0 mm")
    assert on == 0
    assert text.startswith("boundaries[0]: 25 nodes start up to 2e-06 m off this plane of symmetry, less than")
    assert other.startswith("boundaries[0]: no node starts on this plane of symmetry")


def test_a_file_whose_digits_are_few_lies_on_its_plane_of_symmetry() -> None:
    """A face at x = 1/3 m is written with six digits of a millimetre, and the plane is given with more digits."""
    shift = np.array([1000.0 / 3.0, 0.0, 0.0])
    assert beside_a_plane(lambda x: scaled(SIX_DIGITS(1e3 * x + shift), 1e-3), "333.333333 mm") == (25, ())


@pytest.mark.parametrize("angle", [0, 90, 180, 270])
def test_a_probe_has_the_centres_on_the_border_of_its_box(angle: int) -> None:
    """The tets whose centres lie on a plane are selected, for any rounding by a rotation."""
    bar = {
        "shape": "box",
        "low": [0, 0, 0],
        "high": [9e-4, 9e-4, 9e-4],
        "element_size": 3e-4,
        "generator": "structured",
    }
    turn = {"axis": "x", "angle": f"{angle} deg", "centre": [4.5e-4] * 3}
    for layer in (0.75e-4, 3.75e-4, 6.75e-4):
        box = {"low": [0, 0, layer], "high": [9e-4, 9e-4, layer]}
        case = case_of(bar, turn=turn, probes=[{"name": "p", "part": "body", "field": "pressure", **box}])
        sim = build(case, [structured(case.parts[0].mesh)])  # type: ignore[arg-type]
        heights = sim.model.nodes.x0[sim.model.blocks[0].tets].mean(axis=1)[:, 2]
        count = int((np.abs(heights - layer) < 1e-9).sum())
        assert sim.probes._tets[0].count(0) == count > 0


@pytest.mark.parametrize("unit", [1e-3, 1e-6, 0.01, 0.0254, 0.3048, 1.0, 1e3, 0.0003])
def test_coordinates_of_a_file_are_scaled_with_one_rounding(unit: float) -> None:
    rng = np.random.default_rng(3)
    points = np.concatenate([rng.normal(size=600) * 10.0 ** rng.integers(-6, 6, 600), np.arange(300) / 10.0])
    exact = [float(Fraction(x) * Fraction(repr(unit))) for x in points.tolist()]
    assert scaled(points.reshape(-1, 3), unit).reshape(-1).tolist() == exact
