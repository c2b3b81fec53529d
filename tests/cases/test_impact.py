"""Impact speeds of bodies, and the number of contact sweeps at these speeds."""

from typing import Any

import pytest

from conoid.cases.estimates.impact import impact_speeds, pressed, sweeps
from conoid.cases.load import parse_case
from conoid.cases.model.schema import Case

BRITTLE = {"density": 2500, "elastic": {"young": 72e9, "poisson": 0.22}, "brittle": {"strength": 60e6, "energy": 5}}
TOUGH = {**BRITTLE, "strength": {"model": "linear_hardening", "yield_stress": 200e6, "hardening": 0}}


def meeting(speed: float, contact: dict[str, Any] | None = None, **other: Any) -> Case:
    """Returns a case of a moving block of steel and a block at rest; the wave speed is 5,917 m/s."""
    cube = {"shape": "box", "low": [0, 0, 0], "high": [1e-3] * 3, "element_size": 5e-4}
    away = {**cube, "low": [0, 0, 2e-3], "high": [1e-3, 1e-3, 3e-3]}
    return parse_case(
        {
            "name": "two", "run": {"end_time": 1e-6}, "contact": contact or {},
            "materials": {"glass": BRITTLE, "tough": TOUGH},
            "parts": [
                {"name": "a", "material": "steel", "mesh": cube, "velocity": [0, 0, speed]},
                {"name": "b", "material": "steel", "mesh": away, **other},
            ],
        }
    )  # fmt: skip


@pytest.mark.parametrize(
    ("case", "least", "most"),
    [
        (meeting(1100.0), 5, 80),
        (meeting(1300.0), 10, 80),
        (meeting(600.0, velocity=[0, 0, -700.0]), 10, 80),
        (meeting(1300.0, velocity=[0, 0, 1300.0]), 5, 80),
        (meeting(100.0, {"restitution": 1}), 40, 80),
        (meeting(1300.0, {"sweeps": 3}), 3, 3),
        (meeting(650.0, material="glass", fracture={}), 5, 80),
        (meeting(550.0, {"restitution": 1}, material="glass", fracture={}), 40, 80),
    ],
)
def test_fast_collisions_get_more_sweeps(case: Case, least: int, most: int) -> None:
    """The limit of the impact speed is a fifth of the wave speed."""
    assert sweeps(case) == (least, most)


def test_parts_that_are_pressed_together_and_break_get_more_sweeps() -> None:
    """A prescribed motion or a traction presses parts together while it acts. Parts that cannot break, and a prescribed
    motion of a single part, need no additional sweeps.
    """
    ram = {"kind": "velocity", "parts": ["b"], "z": -1.0}
    slow = meeting(1.0, material="glass", fracture={})
    assert [sweeps(bounded(slow, boundary)).least for boundary in (ram, {**ram, "z": 0.0})] == [40, 5]
    assert sweeps(bounded(meeting(1.0), ram)).least == 5
    alone = slow.model_copy(update={"parts": slow.parts[1:]})
    assert sweeps(bounded(alone, {"kind": "velocity", "low": [-1, -1, -1], "high": [1, 1, 1], "z": -1.0})).least == 5


def test_a_traction_presses_what_is_at_rest() -> None:
    """All nodes are at rest at the start, and all nodes have a prescribed motion later."""
    rest = meeting(0.0, material="glass", fracture={})
    pushed = {"kind": "traction", "parts": ["b"], "pressure": 1e8}
    assert sweeps(bounded(rest, pushed)).least == 40
    alone = rest.model_copy(update={"parts": rest.parts[1:]})
    assert sweeps(bounded(alone, pushed)).least == 5


def test_bodies_are_pressed_together_at_a_tenth_of_the_speed_of_waves() -> None:
    assert [pressed(meeting(speed)) for speed in (550.0, 650.0)] == [[False, False], [True, True]]
    assert pressed(meeting(650.0, material="glass", fracture={})) == [True, True]


def test_what_flows_is_pressed_where_the_impact_has_more_than_its_flow_stress() -> None:
    """The limit of the impact speed for 4340 with a flow stress of 1.07 GPa at a strain of 0.1 is 53 m/s; elastic and
    breaking parts have no such limit.
    """
    assert [pressed(meeting(speed, material="steel_4340")) for speed in (52.0, 55.0)] == [[False, False], [False, True]]
    assert pressed(meeting(100.0, material="tough")) == [False, True]
    assert pressed(meeting(100.0, material="tough", fracture={})) == [False, False]


def bounded(case: Case, boundary: dict[str, Any]) -> Case:
    return parse_case({**case.model_dump(mode="json", exclude_none=True), "boundaries": [boundary]})


def test_a_wall_is_met_at_the_speed_of_the_part() -> None:
    walled = bounded(
        meeting(100.0, velocity=[0, 0, 100.0]), {"kind": "wall", "point": [0, 0, -1.0], "normal": [0, 0, 1]}
    )
    assert impact_speeds(walled) == [100.0, 100.0]
    assert impact_speeds(walled, walls=False) == [0.0, 0.0]


@pytest.mark.parametrize(
    ("drive", "speed"),
    [
        ({"z": -700.0, "parts": ["b"]}, 1300.0),
        ({"z": -700.0, "parts": ["b"], "course": [[0, 0], [1e-6, 0.5]]}, 950.0),
        ({"z": 700.0, "parts": ["b"], "low": [0, 0, 2e-3], "high": [1e-3, 1e-3, 2e-3]}, 600.0),
        ({"z": 600.0, "parts": ["b"]}, 0.0),
        ({"x": 800.0, "parts": ["a"]}, 1000.0),
    ],
)
def test_a_driven_part_has_the_speed_of_its_drive(drive: dict[str, Any], speed: float) -> None:
    """The prescribed motion acts on a box of a body in addition to the velocity of the body, or replaces this velocity
    on the whole body.
    """
    assert impact_speeds(bounded(meeting(600.0), {"kind": "velocity", **drive})) == pytest.approx([speed] * 2)


def test_a_rotating_body_has_the_speed_of_its_rim() -> None:
    """A cube of 1 mm rotates about its edge along z at 1e6 rad/s: its corners have up to 1,000 m/s along x and y."""
    spin = {"centre": [0, 0, 0], "rate": [0, 0, 1e6]}
    case = meeting(0.0).model_dump(mode="json", exclude_none=True)
    case["parts"][0]["spin"] = spin
    assert impact_speeds(parse_case(case)) == pytest.approx([1414.2] * 2, rel=1e-4)
    driven = bounded(meeting(300.0), {"kind": "rotation", "parts": ["a"], "spin": spin})
    assert impact_speeds(driven) == pytest.approx([1414.2] * 2, rel=1e-4)
