"""One answer for any number of ranks: the digest and the history are equal, to the last bit. The numbers of ranks are
1, 2, 3, 4 and 7; the cases are every shipped case for some fifty steps, and a scene with all features in each pressure
form.
"""

from collections.abc import Callable
from pathlib import Path

import pytest

from conoid.cases import load
from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import layout

from .launching import command, ended, together

RANKS = (2, 3, 4, 7)
QUICK = 3
"""Number of ranks on which the fast tests compare the scenes of this folder with one rank; other numbers are part of
the slow tests."""
SHORT = {
    "bar_on_bar": "3 us",
    "bonded_tile": "1.8 us",
    "branching_plate": "9 us",
    "breathing_facet": "30 us",
    "crossed_bars": "2 us",
    "demo": "1 us",
    "dissimilar_bars": "3 us",
    "elastic_bar_confined": "1.5 us",
    "elastic_bar_wall": "1.5 us",
    "fast_fragment": "0.3 us",
    "free_spin": "10 us",
    "free_tets": "5 us",
    "glass_steel_bar": "1.5 us",
    "glass_ball_cohesive": "2 us",
    "glass_ball_jh2": "2 us",
    "glass_steel_demo": "4 us",
    "hertz_spheres": "0.2 us",
    "imported_taylor": "1.5 us",
    "long_rod": "2 us",
    "newton_cradle": "2 us",
    "plastic_bar_wave": "1.5 us",
    "plastic_wave": "1.5 us",
    "plate_stack": "3.5 us",
    "plugging_weldox": "3 us",
    "rigid_ball": "0.45 us",
    "shock_copper": "0.5 us",
    "shock_tungsten": "0.3 us",
    "sliding_block": "1.4 ms",
    "spall_glass": "2.15 us",
    "spinning_cube": "20 us",
    "stretched_bar": "0.09 us",
    "taylor_42crmo4": "1.5 us",
    "taylor_copper": "1.5 us",
    "taylor_copper_split": "1.5 us",
    "triaxial_glass": "4 us",
    "two_tets": "0.3 ms",
}
"""End times at which each shipped case has made some fifty steps."""
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
    "mohr_coulomb": """
[materials.NAME.strength]
model = "mohr_coulomb"
cohesion = "50 MPa"
friction_angle = "40 deg"
strength_cap = "500 MPa"
failure_strain = 0.02
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
    """Case: eight bars with all strength laws and equations of state move, spin and hit a tilted wall; one mesh is
    unstructured.
    """
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


EVERYTHING = [f"everything_{form}" for form in FORMS]
COLLIDING = ["colliding_arbitrary", "colliding_box"]
"""Case: four bodies collide, rotate and slide on each other, with each contact domain (colliding.toml)."""
ERODING = ["eroding_arbitrary", "eroding_box"]
"""Case: a rod perforates two plates and hundreds of tets erode, with each contact domain (eroding.toml)."""
SHEDDING = "shedding"
"""Case: a slab under pressure breaks until no part carries the pressure any more (shedding.toml)."""
SCENES = [*EVERYTHING, *COLLIDING, *ERODING, SHEDDING]
NAMES = sorted([*SHORT, *SCENES])


def arguments(name: str, folder: Path) -> list[str]:
    """Returns the arguments of the worker for a run, by the name of the run; ``everything.toml`` is beside the
    folder.
    """
    words = ["run.frames=0", "run.samples=10", f"run.end_time={SHORT.get(name, '')}", "reference=[]"]
    case = name
    if name in EVERYTHING:
        case, words = str(folder.parent / "everything.toml"), [f"numerics.pressure={name.partition('_')[2]}"]
    if name in [*COLLIDING, *ERODING, SHEDDING]:
        file, _, domain = name.partition("_")
        case, words = str(Path(__file__).with_name(f"{file}.toml")), [f"contact.domain={domain or 'arbitrary'}"]
    sets = [word for change in words for word in ("--set", change)]
    return [case, *sets, "--out", str(folder / name)]


Answers = Callable[[int, str], Path]


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Answers:
    """Returns the folder of a run by the number of ranks and the name; the run is made at the first call, together with
    all runs on the same number of ranks.
    """
    root = tmp_path_factory.mktemp("answers")
    (root / "everything.toml").write_text(everything(), encoding="utf-8")

    def folder(ranks: int, name: str) -> Path:
        place = root / str(ranks)
        if not (place / name).exists():
            alike = SCENES if name in SCENES else [n for n in sorted(SHORT) if ranks <= TETS.get(n, ranks)]
            together(ranks, place, [arguments(each, place) for each in alike])
        return place / name

    return folder


def outcome(folder: Path) -> Outcome:
    return from_json((folder / layout.OUTCOME).read_bytes())


TETS = {"two_tets": 2, "breathing_facet": 2}
"""Numbers of tets of the cases that have fewer tets than the largest number of ranks."""


def slowly(name: str, ranks: int = 1) -> list[pytest.MarkDecorator]:
    """Returns the pytest marks of a comparison."""
    return [] if name in SCENES and ranks in (1, QUICK) else [pytest.mark.slow]


def test_every_shipped_case_is_here() -> None:
    assert set(SHORT) == set(load.shipped())


@pytest.mark.parametrize(
    ("name", "ranks"),
    [pytest.param(name, n, marks=slowly(name, n)) for n in RANKS for name in NAMES if n <= TETS.get(name, n)],
)
def test_the_answer_is_the_same_on_any_number_of_ranks(name: str, ranks: int, answers: Answers) -> None:
    one, many = answers(1, name), answers(ranks, name)
    first, other = outcome(one), outcome(many)
    assert (first.state, other.state) == ("succeeded", "succeeded")
    assert (first.ranks, other.ranks, len(other.phases["elements"])) == (1, ranks, ranks)
    assert other.digest == first.digest
    assert (other.steps, other.time, other.energy) == (first.steps, first.time, first.energy)
    assert (other.eroded, other.reference) == (first.eroded, first.reference)
    assert (other.inside, other.deepest, other.warnings) == (first.inside, first.deepest, first.warnings)
    assert (other.overlapping, other.overlap) == (first.overlapping, first.overlap)
    assert (many / layout.HISTORY).read_bytes() == (one / layout.HISTORY).read_bytes()


@pytest.mark.parametrize("name", [pytest.param(name, marks=slowly(name)) for name in NAMES])
def test_the_runs_are_worth_comparing(name: str, answers: Answers) -> None:
    """Each compared run has dozens of steps, and energy in several terms of the energy ledger."""
    end = outcome(answers(1, name))
    assert (end.steps or 0) >= 40
    assert len(end.digest) == 64
    assert end.energy is not None
    if name in SCENES:
        assert end.energy.plastic > 0.01 * end.energy.initial
        assert end.energy.contact != 0.0
    if name in EVERYTHING + COLLIDING:
        assert end.energy.elastic > 0.001 * end.energy.initial
    if name in COLLIDING:
        assert end.energy.contact > 0.001 * end.energy.initial
        assert end.energy.friction > 0.001 * end.energy.initial
    if name in ERODING:
        assert 300 < (end.eroded or 0) < (end.elements or 0) - 300
        assert end.energy.eroded > 0.01 * end.energy.initial
        assert end.energy.friction > 0.001 * end.energy.initial
        assert 0.001 < end.reference[0].value < 0.005


@pytest.mark.slow
def test_other_runs_have_other_digests(answers: Answers) -> None:
    """The ghost nodes and faces of a rank have no effect on the digest."""
    digests = {name: outcome(answers(1, name)).digest for name in NAMES}
    assert len(set(digests.values())) == len(NAMES) - 2
    assert len({digests[name] for name in COLLIDING}) == len({digests[name] for name in ERODING}) == 1


def test_the_answer_is_the_same_again(answers: Answers, tmp_path: Path) -> None:
    """The same run is made twice by the command line of the worker."""
    (tmp_path / "everything.toml").write_text(everything(), encoding="utf-8")
    assert ended(command(QUICK, *arguments(EVERYTHING[0], tmp_path / "again"))).returncode == 0
    assert outcome(tmp_path / "again" / EVERYTHING[0]).digest == outcome(answers(QUICK, EVERYTHING[0])).digest
