"""Convergence studies of invented runs whose order, cost and scatter are known."""

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from conoid.cases.load import parse_case, read_data, shipped_path
from conoid.cases.messages import Energy
from conoid.cases.model.schema import Case
from conoid.cases.outcome import Check, Outcome
from conoid.client import cli
from conoid.client.columns import read_columns
from conoid.client.errors import ClientError
from conoid.client.studies import converged, pareto, trade
from conoid.client.studies.converged import Book
from conoid.client.studies.convergence import Done, series
from conoid.client.studies.quantities import Number, names, of_run
from conoid.client.studies.richardson import Trend
from conoid.client.studies.variants import SEEDS, Plan, Point, Variant, chaotic

NODAL, STANDARD = Variant("nodal", 0.9), Variant("standard", 0.9)
LENGTH, COUNT = Number("length", 0.0, "m", expected=2.0, tolerance=0.1), Number("broken, number", 0.0)


def case(name: str) -> Case:
    return parse_case(read_data(shipped_path(name)))


def run(variant: Variant, factor: float, length: float, cost: float, member: int = 0, broken: float = 0.0) -> Done:
    numbers = (Number("length", length, "m", 2.0, 0.1), Number("broken, number", broken))
    point = Point(variant, factor, member, {})
    return Done(point, "r", round(8000 / factor**3), round(100 / factor), cost, numbers)


def two_forms() -> list[Done]:
    """Returns points of convergence studies of two pressure forms. The value of the nodal form is 2 + 0.1 h^2 at a cost
    of h^-4. The standard form locks: its value converges to 1.5 with order 1, at half the cost.
    """
    nodal = [run(NODAL, h, 2.0 + 0.1 * h**2, 10.0 * h**-4) for h in (0.5, 1.0, 2.0)]
    return [*nodal, *(run(STANDARD, h, 1.5 + 0.25 * h, 5.0 * h**-4) for h in (0.5, 1.0, 2.0))]


def book(done: list[Done], members: int = 1, accuracy: float = 0.02) -> Book:
    return Book("made", (), NODAL, 1e-3, members, "steps", accuracy, done, series(done), done[0].numbers)


def test_a_study_finds_order_and_limit_of_each_variant() -> None:
    nodal, standard = series(two_forms())
    assert nodal.limits["length"].order == pytest.approx(2.0, rel=1e-4)
    assert nodal.limits["length"].value == pytest.approx(2.0, rel=1e-6)
    assert standard.limits["length"].value == pytest.approx(1.5, rel=1e-6)
    assert [mesh.size for mesh in nodal.meshes] == pytest.approx([0.5, 1.0, 2.0])


def test_a_form_that_crosses_the_truth_by_chance_is_not_called_accurate() -> None:
    """The value of the standard form is 2.0 at the element size h = 2 and converges to 1.5."""
    found = book(two_forms())
    number, goal = found.goals()["length"]
    assert goal.variant == NODAL
    assert goal.value == pytest.approx(2.0)
    assert trade.elsewhere(found.series, number, goal) == [STANDARD]
    errors = {(w.variant.form, w.mesh.factor): w.error for w in trade.worths(found.series, number, goal)}
    assert errors[("standard", 2.0)] == pytest.approx(0.5)
    assert errors[("nodal", 0.5)] == pytest.approx(0.0125, rel=1e-4)


def test_the_front_has_what_nothing_cheaper_beats() -> None:
    found = book(two_forms())
    line = trade.front(trade.worths(found.series, *found.goals()["length"]))
    assert [(w.variant.form, w.mesh.factor) for w in line] == [
        ("standard", 2.0), ("nodal", 2.0), ("nodal", 1.0), ("nodal", 0.5),
    ]  # fmt: skip
    assert [w.cost for w in line] == sorted(w.cost for w in line)


def test_the_advice_gives_the_gain_of_halving_and_the_cost_of_the_wanted_error() -> None:
    advice = book(two_forms()).advice()
    assert advice == (
        "nodal at 500 µm: length within 1.2 % for 2 min 40 s of CPU time; "
        "half of this size would give 0.94 % for 42 min 40 s"
    )
    assert "0.1 % would need about 141 µm and 6 h 56 min" in book(two_forms(), accuracy=1e-3).advice()


def test_scatter_gives_no_order_and_a_growing_error_is_reported() -> None:
    scatter = [-0.03, 0.0, 0.03]
    done = [
        run(NODAL, h, 2.0 + shake + 0.001 * h, 10.0 * h**-4, member, broken=round(100 / h) + member)
        for h in (0.5, 1.0, 2.0)
        for member, shake in enumerate(scatter)
    ]
    found = book(done, members=3)
    (only,) = found.series
    assert only.limits["length"].trend is Trend.SCATTERS
    assert only.limits["broken, number"].trend is Trend.DIVERGES
    text = converged.to_markdown(found)
    assert "No limit, within scatter: length." in text
    assert "No limit, does not converge: broken, number." in text
    assert "ensemble of 3 runs" in text
    assert found.advice().startswith("No quantity converges")


def test_a_reference_that_the_finest_mesh_lacks_is_skipped() -> None:
    """The box of the probe contains no centre of a tet on the finest mesh."""
    numbers = (Number("broken, number", 7.0),)
    finest = [Done(Point(NODAL, 0.5, 0, {}), "r", 64_000, 200, 160.0, numbers)]
    done = [run(NODAL, h, length, 10.0 * h**-4, broken=7.0) for h, length in ((1.0, 2.4), (2.0, 2.1), (4.0, 2.2))]
    found = Book("made", (), NODAL, 1e-3, 1, "steps", 0.02, done, series([*finest, *done]), done[0].numbers)
    assert (
        found.advice() == "No quantity converges on these meshes, so the study has no error to compare with the cost."
    )


def test_variants_on_one_mesh_are_distinguished_from_their_scatter() -> None:
    """A study of the time step on one mesh has no limit value; the result is the effect of the time step on a
    quantity.
    """
    shorter = Variant("nodal", 0.6)
    done = [
        run(variant, 1.0, length + 0.01 * member, 10.0, member, broken=100.0 + 3.0 * member + other)
        for variant, length, other in ((NODAL, 1.8, 0.0), (shorter, 2.0, 1.0))
        for member in range(3)
    ]
    found = book(done, members=3)
    text = converged.to_markdown(found)
    table = text.split("Between variants, on the finest mesh of each:")[1]
    rows = {cells[1]: cells[2:6] for line in table.splitlines() if len(cells := re.split(r" *\| *", line)) == 7}
    assert rows["length, m"] == ["1.81", "2.01", "10", "yes"]
    assert rows["broken, number"][2:] == ["0.96", "no"]
    assert found.advice().endswith(
        "to compare with the cost; the table of variants shows the differences between variants."
    )
    assert "nan" not in text


def test_a_count_that_has_settled_does_not_stand_for_a_reference_without_a_limit(tmp_path: Path) -> None:
    """A case is run and compared with its references; the picture has axes even if all errors are 0."""
    lengths = {0.5: 2.2, 1.0: 2.4, 2.0: 2.1}
    found = book([run(NODAL, h, length, 10.0 * h**-4, broken=7.0) for h, length in lengths.items()])
    assert found.leading() is None
    assert found.leading("broken") == "broken, number"
    assert found.advice().startswith("No quantity converges on these meshes")
    assert "length oscillates: 2.2 m at 500 µm, uncertain by" in found.advice()
    pareto.figure(found).savefig(tmp_path / "front.png")


def test_tables_and_json_have_every_mesh_and_name_what_failed() -> None:
    failed = Done(Point(NODAL, 4.0, 0, {}), "r", problem="failed: crushed")
    found = book([*two_forms(), failed])
    text = converged.to_markdown(found)
    assert "- nodal, dt_safety 0.9, sizes x 4: failed: crushed" in text
    assert "**Advice.** nodal at" in text
    data = json.loads(converged.to_json(found))
    assert [len(each["meshes"]) for each in data["series"]] == [3, 3]
    assert data["failed"][0]["problem"] == "failed: crushed"
    with pytest.raises(ClientError, match="no run has succeeded"):
        series([failed])


def test_the_picture_has_a_panel_a_quantity(tmp_path: Path) -> None:
    from conoid.client.studies import pareto

    drawn = pareto.figure(book(two_forms()))
    assert [axes.get_title() for axes in drawn.axes] == ["length"]
    drawn.savefig(tmp_path / "a.svg")


# Points ---------------------------------------------------------------------------------------------------------------


def test_points_scale_every_generated_mesh_and_come_with_the_dearest_first() -> None:
    points = Plan((2.0, 1.0), ("nodal", "split"), (0.9, 0.45)).points(case("bar_on_bar"))
    assert len(points) == 8
    assert points[0].factor == 1.0
    changes = points[-1].changes
    assert changes["parts[1].mesh.element_size"] == pytest.approx(2e-3)
    assert (changes["numerics.pressure"], changes["run.frames"]) == ("split", 0)


def test_an_ensemble_varies_steps_or_seeds() -> None:
    steps = Plan((1.0,), members=3).points(case("spall_glass"))
    assert [p.changes["numerics.dt_safety"] for p in steps] == pytest.approx([0.9, 0.9 * 0.999, 0.9 * 0.99])
    seeds = Plan((1.0,), members=3, vary=SEEDS).points(case("stretched_bar"))
    varied = [key for key in seeds[2].changes if key.endswith("scatter.seed")]
    assert seeds[2].changes[varied[0]] == seeds[0].changes[varied[0]] + 2
    with pytest.raises(ClientError, match="vary steps"):
        Plan((1.0,), members=2, vary=SEEDS).points(case("spall_glass"))


def test_a_case_without_generated_meshes_is_refused() -> None:
    with pytest.raises(ClientError, match="no part has a generated mesh"):
        Plan((1.0, 2.0)).points(case("two_tets"))


def test_what_breaks_or_wears_is_chaotic() -> None:
    assert [chaotic(case(name)) for name in ("spall_glass", "long_rod", "taylor_copper")] == [True, True, False]


def test_the_numbers_of_a_run_are_references_probes_and_shares_of_energy() -> None:
    energy = Energy(kinetic=6.0, elastic=3.0, plastic=0.0, viscous=0.0, contact=1.0, external=0.0, initial=10.0,
                    residual=0.0)  # fmt: skip
    checks = [Check(name=name, value=1.0, expected=1.0, tolerance=0.1, passed=True, unit="m")
              for name in ("extent rod z", "extent rod z", "worst_residual")]  # fmt: skip
    columns = read_columns("t [s],middle_stress [Pa]\n0,1\n1,-5\n2,1\n")
    found = of_run(case("bar_on_bar"), Outcome(state="succeeded", energy=energy, reference=checks), columns)
    assert {n.name: n.value for n in found} == {
        "extent rod z": 1.0, "extent rod z (2)": 1.0, "mean of middle_stress": -1.0, "peak of middle_stress": -5.0,
        "end of middle_stress": 1.0,
        "kinetic energy, share": 0.6, "elastic energy, share": 0.3, "contact energy, share": 0.1,
    }  # fmt: skip


@pytest.mark.parametrize("name", ["bar_on_bar", "plugging_weldox", "glass_ball_cohesive"])
def test_the_quantity_of_the_advice_is_checked_before_any_run(name: str) -> None:
    made = case(name)
    energy = Energy(kinetic=6.0, elastic=3.0, plastic=1.0, viscous=1.0, contact=1.0, external=0.0, initial=10.0,
                    residual=0.0)  # fmt: skip
    checks = [Check(name=each.title, value=1.0, expected=1.0, tolerance=0.1, passed=True) for each in made.reference]
    head = ",".join(["t [s]", *(f"{probe.name} [Pa]" for probe in made.probes)])
    columns = read_columns("\n".join([head, ",".join("1" for _ in head.split(","))]) + "\n")
    outcome = Outcome(state="succeeded", energy=energy, reference=checks, broken=1, fragments=2, eroded=3)
    assert {number.name for number in of_run(made, outcome, columns)} <= set(names(made))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--meshes", "1,x"], "--meshes"), (["--meshes", "1,,2"], "--meshes"), (["--meshes", "1,1"], "each once"),
        (["--forms", "nodal,cubic"], "--forms"), (["--forms", "nodal,"], "--forms"),
        (["--vary", "moods"], "--vary"), (["--quantity", "nope"], "--quantity = 'nope': no such quantity; allowed: "),
    ],
)  # fmt: skip
def test_options_that_mean_nothing_are_refused(words: list[str], message: str) -> None:
    ended = CliRunner().invoke(cli.app, ["converge", "bar_on_bar", *words])
    assert ended.exit_code == 2
    assert message in ended.output
