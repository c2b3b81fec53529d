"""What breaks, breaks alike on any number of ranks: digest, history and counts, to the bit."""

from collections.abc import Callable
from pathlib import Path

import pytest

from conoid.cases import layout
from conoid.cases.outcome import Outcome, from_json

from .launching import together

RANKS = (2, 3, 4, 7)
CASE = Path(__file__).with_name("breaking.toml")
"""A cohesive plate of stone, held at one edge, and a brittle block that hits it and the wall below; a metal rod erodes
on top. Gravity, a symmetry plane, friction, scatter of strength with and without area."""
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
}
FAST = "nodal"
"""The scene that is compared in seconds, on two ranks."""
TRACTION = """
[[boundaries]]
kind = "traction"
parts = ["plate"]
low = ["-1 mm", "2.9 mm", "-1 mm"]
high = ["9 mm", "3.1 mm", "9 mm"]
stress = ["20 MPa", "150 MPa", "0 Pa"]
"""
Answers = Callable[[int, str], Path]


def arguments(name: str, root: Path, folder: Path) -> list[str]:
    """The worker's; the case of the scene lies in ``root``."""
    case = root / f"{name}.toml"
    case.write_text(CASE.read_text(encoding="utf-8") + (TRACTION if name == "traction" else ""), encoding="utf-8")
    return [str(case), *(word for change in SCENES[name] for word in ("--set", change)), "--out", str(folder / name)]


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Answers:
    """The folder of a run by the number of ranks and the scene; done at the first call, together with its like."""
    root = tmp_path_factory.mktemp("breaking")

    def folder(ranks: int, name: str) -> Path:
        place = root / str(ranks)
        if not (place / name).exists():
            alike = [name] if name == FAST else [n for n in SCENES if n != FAST]
            together(ranks, place, [arguments(n, root, place) for n in alike])
        return place / name

    return folder


def outcome(folder: Path) -> Outcome:
    return from_json((folder / layout.OUTCOME).read_bytes())


def marks(name: str, ranks: int = 1) -> list[pytest.MarkDecorator]:
    return [] if name == FAST and ranks < 3 else [pytest.mark.slow]


@pytest.mark.parametrize(
    ("name", "ranks"), [pytest.param(name, n, marks=marks(name, n)) for n in RANKS for name in SCENES]
)
def test_what_breaks_is_the_same_on_any_number_of_ranks(name: str, ranks: int, answers: Answers) -> None:
    one, many = answers(1, name), answers(ranks, name)
    first, other = outcome(one), outcome(many)
    assert (first.state, other.state) == ("succeeded", "succeeded")
    assert (first.ranks, other.ranks) == (1, ranks)
    assert other.digest == first.digest
    assert (other.steps, other.energy, other.eroded) == (first.steps, first.energy, first.eroded)
    assert other.fragments == first.fragments
    assert (many / layout.HISTORY).read_bytes() == (one / layout.HISTORY).read_bytes()


@pytest.mark.parametrize("name", [pytest.param(name, marks=marks(name)) for name in SCENES])
def test_the_scenes_break_thoroughly(name: str, answers: Answers) -> None:
    end = outcome(answers(1, name))
    assert end.steps >= 30
    assert end.fragments is not None
    assert end.fragments > 50
    assert end.eroded > 20
    assert end.energy is not None
    assert end.energy.residual < 1e-3
    assert end.energy.contact != 0.0
    assert (end.energy.friction > 0.0) == (name != "smooth")
