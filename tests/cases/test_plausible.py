"""Warnings about probable errors of units: bare numbers, unusual constants, speeds, sizes and positions; shipped cases
have no such warning.
"""

import math
import time
from typing import Any

import pytest

from conoid.cases.estimates.estimate import estimate
from conoid.cases.load import parse_case, read_case, read_data, resolved_json, shipped, toml_data
from conoid.cases.model.schema import Case
from conoid.cases.reading.library import library
from conoid.cases.shapes.placed import velocity
from conoid.cases.warnings.driven import passing
from conoid.cases.warnings.plausible import STIFFENING, bare_numbers, doubts, linear_error

from .scenes import rod

TARGET = """
name = "target"
run.end_time = "10 us"
[[parts]]
name = "ball"
material = "steel"
velocity = ["0 m/s", "0 m/s", "-500 m/s"]
mesh = { shape = "sphere", radius = "2 mm", centre = [0, 0, "3 mm"], element_size = "1 mm" }
[[parts]]
name = "plate"
material = "steel"
[parts.mesh]
shape = "plate"
base = [0, 0, "-5 mm"]
width = "20 mm"
height = "20 mm"
thickness = "5 mm"
element_size = "1 mm"
"""


def warnings_of(data: dict[str, Any]) -> dict[str, str]:
    """Returns the warnings of a case, by key."""
    case = parse_case(data)
    odd = doubts(data, case, estimate(case))
    assert len({each.key for each in odd}) == len(odd)
    return {each.key: f"{each.value}: {each.message}" for each in odd}


def target(**changes: Any) -> dict[str, Any]:
    """Returns the case of a ball and a plate; arguments such as ``plate__mesh`` replace keys below ``plate``."""
    data = toml_data(TARGET)
    for key, value in changes.items():
        part, _, table = key.partition("__")
        found = data["parts"][0 if part == "ball" else 1] if part in ("ball", "plate") else data[part]
        (found[table] if table == "mesh" else found).update(value)
    return data


LINEAR = {"fast_fragment": [0, 1], "long_rod": [0, 1]}
"""Shipped cases with parts that are hit fast without an equation of state: one case tests contact only, and the source
of the other case has no equation of state."""
CRUSHED = {"glass_ball_cohesive", "glass_steel_bar", "glass_steel_demo"}
"""Shipped cases whose glass may be compressed beyond Griffith's criterion: in the source of the case the glass breaks
in tension only."""


@pytest.mark.parametrize("name", sorted(shipped()))
def test_a_shipped_case_gets_only_warnings_about_values_missing_in_its_paper(name: str) -> None:
    path = shipped()[name]
    case = read_case(path)
    found = doubts(read_data(path), case, estimate(case))
    linear = [each.key for each in found if "without eos: linear pressure is some" in each.message]
    assert linear == [f"parts[{i}].material" for i in LINEAR.get(name, [])]
    crushed = [each.key for each in found if "Griffith 1924" in each.message]
    assert crushed == ["materials.soda_lime.strength"] * (name in CRUSHED)
    assert len(found) == len(linear) + len(crushed)


@pytest.mark.parametrize("name", sorted(library()))
def test_a_material_of_the_library_gets_no_warning(name: str) -> None:
    made = library()[name].model_dump(mode="json", exclude_none=True)
    data = {**rod("parts[0].material=own"), "materials": {"own": made}}
    assert [key for key in warnings_of(data) if "taken for" not in warnings_of(data)[key]] == []


@pytest.mark.parametrize(
    ("override", "key", "message"),
    [
        ("run.end_time=80", "run.end_time", "80: no unit, taken for 80 s"),
        ("run.end_time='80'", "run.end_time", "80: no unit, taken for 80 s"),
        ("parts[0].velocity=[0, 0, -210]", "parts[0].velocity", "[0, 0, -210]: no unit, taken for m/s"),
        ("parts[0].mesh.radius=0.003", "parts[0].mesh.radius", "0.003: no unit, taken for 0.003 m"),
        ("parts[0].turn={axis='z', angle=45}", "parts[0].turn.angle", "45: no unit, taken for 45 rad"),
        ("boundaries[0].point=[0, 0, -1]", "boundaries[0].point", "[0, 0, -1]: no unit, taken for m"),
        ("reference[0].value=0.03", "reference[0].value", "0.03: no unit, taken for 0.03 m"),
        ("run.checkpoint_every=60", "run.checkpoint_every", "60: no unit, taken for 60 s"),
        (
            "materials.own={density=7850, elastic={young='1 GPa', poisson=0.3}}",
            "materials.own.density",
            "7850: no unit",
        ),
        ("parts[0].temperature=300", "parts[0].temperature", "300: no unit, taken for 300 K"),
    ],
)
def test_a_warning_about_a_bare_number_names_the_assumed_unit(override: str, key: str, message: str) -> None:
    changes = [override, "parts[0].mesh.sector=full"] if "turn" in override else [override]
    found = {each.key: f"{each.value}: {each.message}" for each in bare_numbers(rod(*changes))}
    assert list(found) == [key]
    assert found[key].startswith(message)


@pytest.mark.parametrize(
    "override",
    [
        "run.end_time=80 us", "parts[0].velocity=[0, 0, 0]", "run.ranks=2", "numerics.dt_safety=0.5", "contact=none",
        "boundaries[0].normal=[0, 0, 5]", "boundaries[2].at=0", "contact={friction=0.3}",
    ],
)  # fmt: skip
def test_zero_and_what_has_no_unit_may_be_bare(override: str) -> None:
    assert bare_numbers(rod(override)) == []


@pytest.mark.parametrize(("time", "warnings"), [("2 us", []), (2e-6, ["boundaries[3].course[1]"])])
def test_the_factor_of_a_course_has_no_unit(time: object, warnings: list[str]) -> None:
    course = [["0 us", 0], [time, 1], ["3 us", 0.5]]
    driven = {"kind": "velocity", "parts": ["bar"], "x": "1 m/s", "course": course}
    data = rod()
    data["boundaries"] = [*data["boundaries"], driven]
    assert [each.key for each in bare_numbers(data)] == warnings


def test_a_case_in_si_gets_one_warning_a_key() -> None:
    case = parse_case(rod())
    found = [each.key for each in bare_numbers(Case.model_validate_json(resolved_json(case)).model_dump(mode="json"))]
    assert len(found) == len(set(found))
    assert "materials.steel.elastic.young" in found
    assert "parts[0].mesh.radius" in found


def test_a_valid_scene_gets_no_warning() -> None:
    assert warnings_of(target()) == {}


@pytest.mark.parametrize(
    ("changes", "key", "message"),
    [
        ({"run": {"end_time": "80 s"}}, "run.max_steps", "will be reached before run.end_time, 80 s"),
        ({"run": {"end_time": "8 s", "max_steps": 10**9}}, "run.end_time", "hours of core time"),
        ({"run": {"end_time": "10 ns"}}, "run.end_time", "is shorter than the first time step"),
        ({"ball": {"velocity": [0, 0, "-500 km/s"]}}, "parts[0].velocity", "faster than waves in steel, 5.86e+03 m/s"),
        ({"ball": {"temperature": "20 K"}}, "parts[0].temperature", "a temperature of 20 is below 100"),
        ({"ball__mesh": {"centre": [0, 0, "3 m"]}}, "parts[0].velocity", "'ball' meets nothing before 0.006 s"),
        ({"ball": {"velocity": [0, 0, "500 m/s"]}}, "parts[0].velocity", "'ball' meets nothing at all; the run"),
        ({"plate__mesh": {"width": "20 km", "height": "20 km", "element_size": "5 mm"}}, "parts[1].mesh",
         "an extent of 2e+04 is above 5"),
        ({"plate__mesh": {"width": "20 m", "height": "20 m", "element_size": "5 mm"}}, "parts[0].mesh",
         "'plate' is 5000 times as large as 'ball', which has 0.004 m"),
    ],
)  # fmt: skip
def test_what_is_odd(changes: dict[str, Any], key: str, message: str) -> None:
    found = warnings_of(target(**changes))
    assert message in found[key], found


@pytest.mark.parametrize(
    ("drive", "message"),
    [
        ({"z": "-100 m/s"}, "has no effect: along z boundaries[0] prescribes -100 m/s at the start"),
        ({"z": "-500 m/s", "course": [["0 us", 0], ["1 us", 1]]}, "prescribes 0 m/s at the start"),
        ({"z": "-500 m/s"}, None),
        ({"x": "3 m/s"}, None),
        ({"z": 0, "low": [0, 0, 0], "high": ["2 mm", "2 mm", "5 mm"]}, None),
    ],
)
def test_an_initial_velocity_that_a_boundary_replaces_is_reported(drive: dict[str, Any], message: str | None) -> None:
    found = warnings_of(target() | {"boundaries": [{"kind": "velocity", "parts": ["ball"], **drive}]})
    assert (message is not None) == ("parts[0].velocity[2]" in found)
    assert message is None or found["parts[0].velocity[2]"].endswith(message)


@pytest.mark.parametrize(
    ("part", "pull", "keys"),
    [
        ({}, ["-9 m/s^2", 0, 0], {"boundaries[1].acceleration[0]": "is accelerated the other way"}),
        ({}, [0, 0, "-9 m/s^2"], {}),
        ({"velocity": ["5 m/s", 0, 0]}, [0, 0, "1 m/s^2"], {"parts[0].velocity[0]": "moves the other way, and"}),
        ({"spin": {"centre": [0, 0, 0], "rate": [0, "9 rad/s", 0]}}, [0, 0, "1 m/s^2"], {"parts[0].spin.rate": "stop"}),
        ({"spin": {"centre": [0, 0, 0], "rate": ["9 rad/s", 0, 0]}}, [0, 0, "1 m/s^2"], {}),
    ],
)  # fmt: skip
def test_loads_and_motions_across_a_plane_of_symmetry_are_reported(
    part: dict[str, Any], pull: list[Any], keys: dict[str, str]
) -> None:
    mesh = {"shape": "box", "low": [0, 0, 0], "high": ["4 mm", "2 mm", "2 mm"], "element_size": "1 mm"}
    body = {"name": "a", "material": "steel_4340", "mesh": mesh, **part}
    planes = [{"kind": "symmetry", "axis": "x"}, {"kind": "gravity", "acceleration": pull}]
    found = warnings_of({"name": "a", "parts": [body], "boundaries": planes, "run": {"end_time": "1 us"}})
    across = {key: text for key, text in found.items() if "points across the plane of symmetry x = 0 m" in text}
    assert across.keys() == keys.keys()
    assert all(text in across[key] for key, text in keys.items())


def test_keys_without_effect_are_reported() -> None:
    data = target(ball__mesh={"split": 5}) | {"balance": {"every": 3, "alpha": 1.5}}
    found = warnings_of(data)
    assert found["balance.every"] == '3: has no effect without policy = "every"'
    assert found["balance.alpha"] == '1.5: has no effect without policy = "outside"'
    assert found["parts[0].mesh.split"] == '5: has no effect without generator = "structured"'
    assert not {"balance.every"} & warnings_of(data | {"balance": {"every": 3, "policy": "every"}}).keys()


def test_what_others_may_send_on_its_way_is_not_odd() -> None:
    """A ball flies away from the plate, and a second body beside the ball hits the plate: fragments may reach the ball,
    but not if the ball is a metre away.
    """
    data = target(ball={"velocity": [0, 0, "5 m/s"]})
    assert "'ball' meets nothing at all" in warnings_of(data)["parts[0].velocity"]
    beside = {**data["parts"][0], "name": "beside", "velocity": [0, 0, "-900 m/s"]}
    data["parts"].append({**beside, "mesh": {**beside["mesh"], "centre": ["7 mm", 0, "3 mm"]}})
    assert "parts[0].velocity" not in warnings_of(data)
    data["parts"][0] = {**data["parts"][0], "mesh": {**data["parts"][0]["mesh"], "centre": [0, 0, "1 m"]}}
    assert "'ball' meets nothing at all" in warnings_of(data)["parts[0].velocity"]


EOS = {"model": "mie_gruneisen", "c0": "4600 m/s", "S": 1.49, "gamma0": 2}


@pytest.mark.parametrize(
    ("speed", "more", "low"),
    [(570.0, {}, None), (600.0, {}, "7 %"), (4000.0, {}, "33 %"), (4000.0, {"eos": EOS}, None)],
)
def test_an_impact_beyond_a_linear_pressure_is_reported(speed: float, more: dict[str, Any], low: str | None) -> None:
    """Steel has plane waves of 5,856 m/s and c0 = 4,607 m/s: the relative error of the pressure is (1.5 - 1/4) u / (c0
    + 1.5 u), with u half of the speed.
    """
    own = {"density": "7850 kg/m^3", "elastic": {"young": "200 GPa", "poisson": 0.3}} | more
    motion = {"material": "own", "velocity": [0, 0, f"-{speed} m/s"]}
    found = warnings_of({**target(ball=motion, plate={"material": "own"}), "materials": {"own": own}})
    assert list(found) == ([] if low is None else ["parts[0].material"])
    assert low is None or f"without eos: linear pressure is some {low} below" in found["parts[0].material"]


def test_a_linear_pressure_is_low_by_what_the_shock_relations_give() -> None:
    """Behind a shock of the speed U and the particle speed u the volume is V0 (1 - u / U), and by momentum p =
    density U u: the reference is -K ln J solved for U."""
    c0, u = 4600.0, 300.0
    shock = c0
    for _ in range(50):
        shock = c0 * math.sqrt(-math.log1p(-u / shock) * shock / u)
    whole = c0 + STIFFENING * u
    assert linear_error(c0, u) == pytest.approx(1.0 - shock / whole, rel=0.05)


FLOOR = {"kind": "wall", "point": [0, 0, "-5 mm"], "normal": [0, 0, 1]}
DOWN = {"kind": "velocity", "parts": ["plate"], "z": "-50 m/s"}
BELOW = {"low": ["-1 m", "-1 m", "-5 mm"], "high": ["1 m", "1 m", "-5 mm"]}


def warned(*boundaries: dict[str, Any]) -> dict[str, str]:
    return warnings_of({**target(), "boundaries": list(boundaries)})


@pytest.mark.parametrize(
    ("drive", "depth"),
    [
        (DOWN, "0.0005 m"),
        ({**DOWN, **BELOW}, "0.0005 m"),
        ({**DOWN, "course": [["0 us", 0], ["10 us", 1]]}, "0.00025 m"),
        ({**DOWN, "course": [["0 us", 1], ["5 us", 1], ["5.1 us", -1]]}, "0.00025"),
        ({"kind": "velocity", "parts": ["ball"], "x": 0}, "0.0005 m"),
    ],
)
def test_a_drive_into_a_wall_is_reported(drive: dict[str, Any], depth: str) -> None:
    """The ball moves along z. The wall does not act on the ball, because the x motion of the ball is prescribed: its
    lowest point moves from 1 mm to -4 mm.
    """
    part = drive["parts"][0]
    floor = FLOOR if part == "plate" else {**FLOOR, "point": [0, 0, "-3.5 mm"], "parts": ["ball"]}
    found = warned(floor, drive)["boundaries[1]"]
    assert found.startswith(f": nodes of {part!r} move {depth}")
    assert found.endswith("behind boundaries[0], a wall; walls do not stop driven nodes")


@pytest.mark.parametrize(
    "drive",
    [
        {**DOWN, "z": 0},
        {**DOWN, "z": "50 m/s"},
        {**DOWN, "parts": ["ball"], "z": "-100 m/s"},
        {**DOWN, "low": ["-1 m", "-1 m", "-4 mm"], "high": ["1 m", "1 m", "0 mm"]},
        {**DOWN, "z": "-500 m/s", "course": [["0 us", 0]]},
    ],
)
def test_a_drive_that_stays_before_a_wall_gets_no_warning(drive: dict[str, Any]) -> None:
    assert "boundaries[1]" not in warned(FLOOR, drive)


def test_many_drives_of_many_bodies_cost_little_time() -> None:
    """Two hundred plates have two hundred prescribed motions each: of 40,000 driven bodies only the first bodies are
    tested.
    """
    data = target()
    plate = data["parts"][1]
    bases = [[0, 0, f"{-10 * k - 5} mm"] for k in range(200)]
    data["parts"] = [{**plate, "name": f"p{k}", "mesh": {**plate["mesh"], "base": at}} for k, at in enumerate(bases)]
    drive = {"kind": "velocity", "z": "-1 m/s"}
    data["boundaries"] = [{**FLOOR, "point": [0, 0, "-3 m"]}, *[drive] * 200]
    case = parse_case(data)
    begin = time.perf_counter()
    assert list(passing(case)) == []
    assert time.perf_counter() - begin < 20.0


def test_two_driven_bodies_that_pass_through_each_other_are_reported() -> None:
    ball = {"kind": "velocity", "parts": ["ball"], "z": "-500 m/s"}
    held = {"kind": "velocity", "parts": ["plate"], "x": 0, "y": 0, "z": 0}
    message = "'ball' moves into 'plate', which boundaries[0] drives; contact does not change prescribed motion"
    assert warned(held, ball) == {"boundaries[1]": f": {message}"}
    assert warned(held, {**ball, "z": "-99 m/s"}).keys() == {"parts[0].velocity[2]"}
    assert warned({**held, **BELOW}, ball) == {}
    assert warned({"kind": "velocity", "parts": ["plate"], "x": 0}, ball) == {}


@pytest.mark.parametrize(
    ("material", "key", "message"),
    [
        ({"density": "7.85 kg/m^3"}, "density", "a density of 7.85 is below 10"),
        ({"elastic": {"young": "200 MPa", "poisson": 0.3}, "brittle": {"strength": "100 MPa", "energy": "8 J/m^2"}},
         "brittle.strength", "a tensile strength over Young's modulus of 0.5 is above 0.1"),
        ({"elastic": {"young": "200 Pa", "poisson": 0.3}}, "elastic.young", "a wave speed of 0.185 is below 20"),
        ({"strength": {"model": "linear_hardening", "yield_stress": "400 GPa"}}, "strength.yield_stress",
         "a yield stress over Young's modulus of 2 is above 0.1"),
        ({"brittle": {"strength": "100 MPa", "energy": "8 MJ/m^2"}}, "brittle.energy", "a fracture energy of 8e+06 is"),
        ({"eos": {"model": "mie_gruneisen", "c0": "457 m/s", "S": 1.5, "gamma0": 2}}, "eos.c0",
         "a bulk modulus, density c0^2, over that of elastic, of 0.00984 is below 0.5"),
        ({"spall": "50 MPa", "brittle": {"strength": "100 MPa", "energy": "8 J/m^2"}}, "spall",
         "pores open below brittle.strength, 1e+08 Pa: under tension from all sides no facet breaks"),
    ],
)  # fmt: skip
def test_constants_of_no_solid(material: dict[str, Any], key: str, message: str) -> None:
    steel = {"density": "7850 kg/m^3", "elastic": {"young": "200 GPa", "poisson": 0.3}}
    found = warnings_of({**target(ball={"material": "own"}), "materials": {"own": steel | material}})
    assert message in found[f"materials.own.{key}"], found


def test_mass_momentum_and_energy_of_a_part() -> None:
    ball, plate = estimate(parse_case(target())).parts
    assert ball.bulk is not None
    assert plate.bulk is not None
    mass = 7850.0 * 4.0 / 3.0 * math.pi * 2e-3**3
    assert ball.bulk.mass == pytest.approx(mass)
    assert ball.bulk.extent == pytest.approx((4e-3, 4e-3, 4e-3))
    assert ball.bulk.momentum == pytest.approx((0.0, 0.0, -500.0 * mass))
    assert ball.bulk.energy == pytest.approx(0.5 * mass * 500.0**2)
    assert (plate.bulk.momentum, plate.bulk.energy) == ((0.0, 0.0, 0.0), 0.0)


def test_a_body_that_spins_stretches_and_is_turned() -> None:
    """A bar of 2 x 4 x 20 mm is turned from z to x: the energies of spin and stretch are I w^2 / 2 with I = m (b^2 +
    c^2) / 12, and m k^2 a^2 / 24.
    """
    bar = {
        "shape": "box",
        "low": ["-1 mm", "-2 mm", "-10 mm"],
        "high": ["1 mm", "2 mm", "10 mm"],
        "element_size": "1 mm",
    }
    part: dict[str, Any] = {"name": "bar", "material": "steel", "mesh": bar, "turn": {"axis": "y", "angle": "90 deg"}}
    data = {"name": "bar", "run": {"end_time": "1 us"}, "parts": [part]}
    mass = 7850.0 * 2e-3 * 4e-3 * 20e-3
    part["spin"] = {"centre": [0, 0, 0], "rate": [0, 0, "1000 rad/s"]}
    (spun,) = estimate(parse_case(data)).parts
    assert spun.bulk is not None
    assert spun.bulk.extent == pytest.approx((20e-3, 4e-3, 2e-3))
    assert spun.bulk.energy == pytest.approx(0.5 * mass * (20e-3**2 + 4e-3**2) / 12.0 * 1e6, rel=5e-3)
    assert spun.bulk.momentum == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    del part["spin"]
    part["stretch"] = {"rate": ["100 1/s", 0, 0]}
    (stretched,) = estimate(parse_case(data)).parts
    assert stretched.bulk is not None
    assert stretched.bulk.energy == pytest.approx(mass * 1e4 * 20e-3**2 / 24.0, rel=5e-3)


def test_a_boundary_that_turns_a_part_gives_it_its_energy() -> None:
    case = read_case(shipped()["spinning_cube"])
    (cube,) = estimate(case).parts
    assert cube.bulk is not None
    assert cube.bulk.energy > 0.0


def test_velocity_is_that_of_the_worker() -> None:
    case = parse_case(rod("parts[0].spin={centre=[0, 0, 0], rate=[1, 2, 3]}", "parts[0].stretch={rate=[4, 5, 6]}"))
    x, y, z = velocity(case.parts[0], (0.1, 0.2, 0.3))
    assert (x, y, z) == pytest.approx((2 * 0.3 - 3 * 0.2 + 0.4, 3 * 0.1 - 1 * 0.3 + 1.0, -10.0 + 0.2 - 2 * 0.1 + 1.8))


def test_a_plane_of_symmetry_through_a_body_is_reported() -> None:
    """A plane on the surface of the body, or outside of it, gives no warning."""
    plane = {"kind": "symmetry", "axis": "x"}
    assert warnings_of({**target(), "boundaries": [{**plane, "at": "1 mm", "parts": ["plate"]}]}) == {
        "boundaries[0].at": "'0.001 m': goes through part 'plate', which lies between -0.01 and 0.01 m: each side "
        "is in contact with its own mirror image; model one side"
    }
    assert warnings_of({**target(), "boundaries": [{**plane, "at": "10 mm", "parts": ["plate"]}]}) == {}


@pytest.mark.parametrize(("side", "warned"), [(0.0, True), (0.3, True), (1.0, False)])
def test_a_probe_box_smaller_than_a_tet_is_reported(side: float, warned: bool) -> None:
    """A tet with an edge of 1 mm has a volume of some 0.12 mm^3."""
    box = {"low": [0, 0, "-3 mm"], "high": [f"{side} mm", f"{side} mm", f"{side - 3.0} mm"]}
    probe = {"name": "p", "part": "plate", "field": "pressure", **box}
    odd = warnings_of({**target(), "probes": [probe]})
    assert list(odd) == (["probes[0]"] if warned else [])
    assert all("if no tet has its centre there, the run does not start" in each for each in odd.values())


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"numerics": {"pressure": "split"}}, True),
        ({"numerics": {"pressure": "nodal"}}, False),
        ({"numerics": {"pressure": "split"}, "material": "copper_ofhc"}, False),
    ],
    ids=["elastic", "nodal", "flows"],
)  # fmt: skip
def test_the_form_split_is_named_where_a_part_may_stay_elastic(changes: dict[str, Any], named: bool) -> None:
    """The pressure form ``split`` damps elastic motion; tests/verification/test_pressure_modes.py measures the
    damping.
    """
    data = target() | {"numerics": changes["numerics"]}
    for part in data["parts"]:
        part["material"] = changes.get("material", part["material"])
    assert ("numerics.pressure" in warnings_of(data)) == named
