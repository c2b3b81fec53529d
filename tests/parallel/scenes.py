"""The scene with fracture, and its variants, for tests of several ranks."""

from pathlib import Path

CASE = Path(__file__).with_name("breaking.toml")
"""Case: a cohesive plate of stone, held at one edge, and a brittle block that hits the plate and the wall below; a
metal rod above the plate and the block erodes. The scene has gravity, a symmetry plane, friction, and scatter of
strength with and without area."""
SCENES = {
    "nodal": [],
    "standard": ["numerics.pressure=standard"],
    "split": ["numerics.pressure=split"],
    "smooth": ["contact.friction=0.0"],
    "instant": ["parts[0].fracture.model=instant", "parts[0].fracture.delay=0"],
    "cohesive": ["parts[1].fracture.model=cohesive", "parts[1].fracture.delay=0"],
    "box": ["contact.domain=box"],
    "ordered": ["parts[0].fracture.order=local_maximum", "parts[1].fracture.order=local_maximum"],
    "no_edges": ["contact.edges=false"],
    "nodes": ["parts[0].fracture.traction=nodes", "parts[1].fracture.traction=nodes"],
    "traction": [],
    "pressure": [],
}
FAST = "nodal"
"""Variant of the scene with fracture that is compared in the fast tests, on two ranks."""
TRACTION = """
[[boundaries]]
kind = "traction"
parts = ["plate"]
low = ["-1 mm", "2.9 mm", "-1 mm"]
high = ["9 mm", "3.1 mm", "9 mm"]
stress = ["20 MPa", "150 MPa", "0 Pa"]
"""
PRESSURE = """
[[boundaries]]
kind = "traction"
parts = ["plate"]
low = ["-1 mm", "2.9 mm", "-1 mm"]
high = ["9 mm", "3.1 mm", "9 mm"]
pressure = "150 MPa"
follows = true
"""
_LOADS = {"traction": TRACTION, "pressure": PRESSURE}


def arguments(name: str, root: Path, folder: Path) -> list[str]:
    """Returns the arguments of the worker; the case of the scene is in the folder ``root``."""
    case = root / f"{name}.toml"
    case.write_text(CASE.read_text(encoding="utf-8") + _LOADS.get(name, ""), encoding="utf-8")
    return [str(case), *(word for change in SCENES[name] for word in ("--set", change)), "--out", str(folder / name)]
