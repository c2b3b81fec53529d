"""Moving and curved walls, rigid bodies of nodes, and general contacts in decks of LS-DYNA and Radioss."""

from pathlib import Path

import pytest

from .deck_texts import lsdyna, r20, radioss, read, row

STEEL = ("*MAT_ELASTIC", row(1, "7.85E-9", 2.1e5, 0.3))
ELASTIC = ("/MAT/ELAST/1", "steel", r20("7.85E-9"), r20(2.1e5, 0.3))
ALL = ("/GRNOD/PART/5", "all", row(1))
CURVE = ("*DEFINE_CURVE", row(4), r20(0.0, 0.0), r20(0.01, 3000.0))
LSDYNA: dict[str, tuple[tuple[str, ...], dict[str, object]]] = {
    "a plane with a mass": (
        ("*RIGIDWALL_PLANAR_MOVING_ID", row(1), row(0), row(0, 0, -1, 0, 0, 1, 0.2), row("5.0E-3", 4000.0)),
        {"point": ["0 mm", "0 mm", "-1 mm"], "normal": [0.0, 0.0, 2.0], "friction": 0.2, "mass": "0.005 t",
         "velocity": ["0 mm/s", "0 mm/s", "4000 mm/s"]},
    ),
    "a driven sphere": (
        (*CURVE, "*RIGIDWALL_GEOMETRIC_SPHERE_MOTION", row(0), row(0, 0, 9), row(2.5), row(4, 0, 0, 0, -2)),
        {"shape": "sphere", "radius": "2.5 mm", "velocity": ["0 mm/s", "0 mm/s", "-3000 mm/s"],
         "course": [["0 s", 0.0], ["0.01 s", 1.0]]},
    ),
    "a cylinder": (
        ("*RIGIDWALL_GEOMETRIC_CYLINDER", row(0), row(0, -5, 0, 0, -5, 1), row(2.0)),
        {"shape": "cylinder", "axis": [0.0, 0.0, 1.0], "radius": "2 mm"},
    ),
}  # fmt: skip
RADIOSS: dict[str, tuple[tuple[str, ...], dict[str, object]]] = {
    "a plane with a mass": (
        ("/RWALL/PLANE/1", "anvil", row(3, 2, 5, 0), r20(0, 0.1), r20("5.0E-3", 0, -40, 0), r20(0, 0.0, 0)),
        {"point": ["0 mm", "1 mm", "0 mm"], "normal": [0.0, -1.0, 0.0], "friction": 0.1, "mass": "0.005 t",
         "velocity": ["0 mm/s", "-40 mm/s", "0 mm/s"]},
    ),
    "a sphere": (
        ("/RWALL/SPHER/1", "ball", row(0, 0, 5, 0), r20(0, 0, 3.0), r20(0, 0, -4)),
        {"shape": "sphere", "radius": "1.5 mm", "point": ["0 mm", "0 mm", "-4 mm"]},
    ),
    "a cylinder": (
        ("/RWALL/CYL/1", "roller", row(0, 0, 5, 0), r20(0, 0, 3.0), r20(0, 0, -4), r20(1, 0, -4)),
        {"shape": "cylinder", "radius": "1.5 mm", "axis": [1.0, 0.0, 0.0]},
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", LSDYNA)
def test_walls_of_lsdyna(tmp_path: Path, what: str) -> None:
    cards, wanted = LSDYNA[what]
    found = read(tmp_path, "a.k", lsdyna(*STEEL, *cards))
    assert found.refusals == []
    (wall,) = found.data["boundaries"]
    assert {key: wall.get(key) for key in wanted} == wanted


@pytest.mark.parametrize("what", RADIOSS)
def test_walls_of_radioss(tmp_path: Path, what: str) -> None:
    options, wanted = RADIOSS[what]
    found = read(tmp_path, "a_0000.rad", radioss(*ELASTIC, *ALL, *options), None)
    assert found.refusals == []
    (wall,) = found.data["boundaries"]
    assert {key: wall.get(key) for key in wanted} == wanted


PISTON = "/RWALL/PLANE/1", "piston", row(3, 2, 5, 0), r20(0, 0.1), r20(0, 0, 0, 0), r20(0, 3, 0)
GRIP = "/GRNOD/NODE/9", "grip", row(3)
PUSH = "/FUNCT/4", "push", r20(0, 0), r20(1e-3, 500)


def impvel(axis: str, number: int, *more: float) -> tuple[str, ...]:
    return f"/IMPVEL/{number}", "drive", f"{row(4)}{axis:>10}{row(0, 0, 9)}", r20(*(more or (1, 2)))


def test_a_wall_of_radioss_has_the_prescribed_motion_of_its_node(tmp_path: Path) -> None:
    found = read(tmp_path, "a_0000.rad", radioss(*ELASTIC, *ALL, *PISTON, *GRIP, *PUSH, *impvel("Y", 1)), None)
    assert found.refusals == []
    (wall,) = found.data["boundaries"]
    assert (wall["kind"], wall["velocity"]) == ("wall", ["0 mm/s", "1000 mm/s", "0 mm/s"])
    assert wall["course"] == [["0 s", 0.0], ["0.001 s", 1.0]]
    both = (*impvel("Y", 1), *impvel("X", 2))
    (wall,) = read(tmp_path, "a_0000.rad", radioss(*ELASTIC, *ALL, *PISTON, *GRIP, *PUSH, *both), None).data[
        "boundaries"
    ]
    assert wall["velocity"] == ["1000 mm/s", "1000 mm/s", "0 mm/s"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "NODE = 3: the wall moves with a node; give the wall a mass, or the node an /IMPVEL"),
        ((*GRIP, *PUSH, *impvel("Y", 1), *impvel("X", 2, 2, 1)), "NODE = 3: the components of the motion have several"),
    ],
)
def test_a_wall_whose_motion_is_unclear_is_refused(tmp_path: Path, options: tuple[str, ...], message: str) -> None:
    (line,) = read(tmp_path, "a_0000.rad", radioss(*ELASTIC, *ALL, *PISTON, *options), None).refusals
    assert message in line


@pytest.mark.parametrize(
    ("cards", "message"),
    [
        (("*RIGIDWALL_PLANAR_FINITE", row(0), row(0, 0, -1, 0, 0, 1), row(1, 0, 0, 9, 9)), "a finite rigid wall"),
        (
            ("*RIGIDWALL_PLANAR_MOVING", row(0), row(0, 0, -1, 0, 0, 1), row(0, 40.0)),
            "V0 = 40.0: the wall has a speed and no MASS",
        ),
        (("*RIGIDWALL_GEOMETRIC_CYLINDER", row(0), row(0, 0, 0, 0, 0, 1), row(2, 9.0)), "LENCYL = 9.0: the cylinder"),
        (("*RIGIDWALL_GEOMETRIC_PRISM", row(0), row(0, 0, 0, 0, 0, 1), row(1, 0, 0, 9)), "a finite rigid wall"),
        (("*CONSTRAINED_NODAL_RIGID_BODY", row(1, 0, 3)), "a rigid body of nodes; parts[].rigid makes a whole part"),
    ],
)
def test_walls_that_end_and_rigid_bodies_of_nodes_refuse(tmp_path: Path, cards: tuple[str, ...], message: str) -> None:
    (line,) = read(tmp_path, "a.k", lsdyna(*STEEL, *cards)).refusals
    assert message in line


def rbody(mass: float = 0.0) -> tuple[str, ...]:
    """Returns a rigid body whose main node is 9, and the restraint of the main node."""
    head = f"{row(9, 0, 0, 0)}{mass:>20}{row(5, 0, 0, 0)}"
    return (
        *ELASTIC,
        *ALL,
        "/GRNOD/NODE/9",
        "main",
        row(9),
        "/RBODY/1",
        "body",
        head,
        r20(0, 0, 0),
        r20(0, 0, 0),
        row(0),
    )


def test_a_rigid_body_of_all_nodes_of_a_part_is_held_by_its_main_node(tmp_path: Path) -> None:
    held = ("/BCS/1", "guide", f"{'110 111':>10}{row(0, 9)}")
    found = read(tmp_path, "a_0000.rad", radioss(*rbody(), *held), None)
    assert found.refusals == []
    assert found.data["parts"][0]["rigid"] is True
    (moved,) = found.data["boundaries"]
    assert moved["kind"] == "velocity"
    assert {axis: moved.get(axis) for axis in "xyz"} == {"x": "0 mm/s", "y": "0 mm/s", "z": None}
    refusals = read(tmp_path, "a_0000.rad", radioss(*rbody(1e-3), *held), None).refusals
    assert len(refusals) == 1
    assert "MASS = 0.001: mass and inertia in addition to those of the mesh" in refusals[0]
    refusals = read(
        tmp_path, "a_0000.rad", radioss(*rbody(), held[0], held[1], f"{'110 000':>10}{row(0, 9)}"), None
    ).refusals
    assert "a rigid body with fixed axes and free rotations" in refusals[0]


@pytest.mark.parametrize("kind", ["TYPE24", "TYPE25"])
def test_a_general_contact_of_radioss(tmp_path: Path, kind: str) -> None:
    lines = row(7, 0, 4), row(0), r20(0, 0), f"{r20(0, 0.15)}{'':20}{r20(0, 0)}"
    surface = "/SURF/PART/EXT/7", "skin", row(1)
    found = read(tmp_path, "a_0000.rad", radioss(*ELASTIC, *surface, f"/INTER/{kind}/1", "all", *lines), None)
    assert found.refusals == []
    assert found.data["contact"] == {"self_contact": ["body"], "friction": 0.15}
    late = (*lines[:3], f"{r20(0, 0.15)}{'':20}{r20(1e-6, 0)}")
    refusals = read(
        tmp_path, "a_0000.rad", radioss(*ELASTIC, *surface, f"/INTER/{kind}/1", "all", *late), None
    ).refusals
    assert "TSTART = 1e-06: the contact begins after the start" in refusals[0]
