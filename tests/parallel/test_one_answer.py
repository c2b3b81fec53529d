"""One answer for any number of ranks: the digest and the history, to the bit."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from conoid.cases import layout, load
from conoid.cases.outcome import Outcome, from_json

from .launching import command, ended

pytestmark = pytest.mark.slow

RANKS = (1, 2, 3, 4, 7)
SHORT = {
    "demo": "1 us",
    "elastic_bar_confined": "1.5 us",
    "elastic_bar_wall": "1.5 us",
    "free_spin": "10 us",
    "plastic_bar_wave": "1.5 us",
    "plastic_wave": "1.5 us",
    "shock_copper": "0.5 us",
    "shock_tungsten": "0.3 us",
    "spinning_cube": "20 us",
    "taylor_42crmo4": "1.5 us",
    "taylor_copper": "1.5 us",
    "taylor_copper_split": "1.5 us",
}
"""End times at which every shipped case has taken some fifty steps."""
FORMS = ("standard", "nodal", "split")
STRENGTHS = {
    "elastic": "",
    "hardening": """
[materials.NAME.strength]
model = "linear_hardening"
yield_stress = "50 MPa"
hardening = "1 GPa"
""",
    "johnson_cook": """
[materials.NAME.strength]
model = "johnson_cook"
A = "50 MPa"
B = "300 MPa"
n = 0.3
C = 0.02
m = 1.1
melt_temperature = "1400 K"
specific_heat = "400 J/kg/K"
""",
}
EQUATIONS = {
    "linear": "",
    "mie": """
[materials.NAME.eos]
model = "mie_gruneisen"
c0 = "3940 m/s"
S = 1.49
gamma0 = 1.96
""",
}


def everything() -> str:
    """Six bars of every strength and equation of state fly, spin and hit a tilted wall; one mesh is unstructured."""
    text = """
name = "everything"
[run]
end_time = "6 us"
frames = 3
samples = 40
[[boundaries]]
kind = "wall"
point = ["0 mm", "0 mm", "-0.02 mm"]
normal = [0.02, -0.01, 1.0]
"""
    for number, (strength, equation) in enumerate((s, e) for s in STRENGTHS for e in EQUATIONS):
        name, x = f"{strength}_{equation}", 6 * number
        text += f"""
[materials.{name}]
density = "8930 kg/m^3"
elastic.young = "117 GPa"
elastic.poisson = 0.35
{(STRENGTHS[strength] + EQUATIONS[equation]).replace("NAME", name)}
[[parts]]
name = "{name}"
material = "{name}"
velocity = ["10 m/s", "0 m/s", "-200 m/s"]
[parts.spin]
centre = ["{x} mm", "0 mm", "2 mm"]
rate = ["0 rad/s", "0 rad/s", "2000 rad/s"]
[parts.mesh]
shape = "cylinder"
base = ["{x} mm", "0 mm", "0.2 mm"]
radius = "2 mm"
length = "4 mm"
element_size = "0.8 mm"
generator = "{"gmsh" if number == 4 else "structured"}"
split = {5 + number % 2}
[[probes]]
name = "p{number}"
part = "{name}"
field = "internal_energy"
low = ["-1 m", "-1 m", "-1 m"]
high = ["1 m", "1 m", "1 m"]
"""
    return text


def batch(folder: Path, case: Path) -> dict[str, list[str]]:
    """The worker's arguments for every run, by the name of its folder."""
    runs = {
        name: [name, "--set", f"run.end_time={end}", "--set", "run.frames=0", "--set", "run.samples=10"]
        for name, end in SHORT.items()
    }
    runs |= {f"everything_{form}": [str(case), "--set", f"numerics.pressure={form}"] for form in FORMS}
    return {
        name: [*words, "--set", "reference=[]", "--out", str(folder / name)] for name, words in sorted(runs.items())
    }


Answers = Callable[[int, str], Path]


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Answers:
    """The folder of a run by the number of ranks and the name; the runs of one number are done at the first call."""
    root = tmp_path_factory.mktemp("answers")
    case = root / "everything.toml"
    case.write_text(everything(), encoding="utf-8")
    done: set[int] = set()

    def folder(ranks: int, name: str) -> Path:
        place = root / str(ranks)
        if ranks not in done:
            place.mkdir()
            (place / "runs.json").write_text(json.dumps(list(batch(place, case).values())), encoding="utf-8")
            program = Path(__file__).with_name("many.py")
            finished = ended(command(ranks, str(place / "runs.json"), module=[str(program)]))
            assert finished.returncode == 0, finished.stderr
            done.add(ranks)
        return place / name

    return folder


def outcome(folder: Path) -> Outcome:
    return from_json((folder / layout.OUTCOME).read_bytes())


NAMES = sorted([*SHORT, *(f"everything_{form}" for form in FORMS)])


def test_every_shipped_case_is_here() -> None:
    assert set(SHORT) == set(load.shipped())


@pytest.mark.parametrize("ranks", RANKS[1:])
@pytest.mark.parametrize("name", NAMES)
def test_the_answer_is_the_same_on_any_number_of_ranks(name: str, ranks: int, answers: Answers) -> None:
    one, many = answers(1, name), answers(ranks, name)
    first, other = outcome(one), outcome(many)
    assert (first.state, other.state) == ("succeeded", "succeeded")
    assert (first.ranks, other.ranks) == (1, ranks)
    assert other.digest == first.digest
    assert (other.steps, other.time, other.energy) == (first.steps, first.time, first.energy)
    assert (many / layout.HISTORY).read_bytes() == (one / layout.HISTORY).read_bytes()


@pytest.mark.parametrize("name", NAMES)
def test_the_runs_are_worth_comparing(name: str, answers: Answers) -> None:
    """Dozens of steps, and energy that went somewhere; several ranks share the work."""
    end = outcome(answers(1, name))
    assert end.steps >= 40
    assert len(end.digest) == 64
    assert end.energy is not None
    if name.startswith("everything"):
        assert end.energy.plastic > 0.01 * end.energy.initial
        assert end.energy.elastic > 0.001 * end.energy.initial
        assert end.energy.contact != 0.0
    assert len(outcome(answers(7, name)).phases["elements"]) == 7


def test_other_runs_have_other_digests(answers: Answers) -> None:
    assert len({outcome(answers(1, name)).digest for name in NAMES}) == len(NAMES)


def test_the_answer_is_the_same_again(answers: Answers, tmp_path: Path) -> None:
    """Twice the same run, started by the plain command line."""
    words = batch(tmp_path, Path())["shock_copper"]
    assert ended(command(2, *words)).returncode == 0
    assert outcome(tmp_path / "shock_copper").digest == outcome(answers(1, "shock_copper")).digest
