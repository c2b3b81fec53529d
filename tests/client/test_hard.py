"""The suite of hard cases: all cases are present and valid, and the verdicts agree with the limits."""

import pytest
from typer.testing import CliRunner

from conoid.cases.load import apply_overrides, parse_case, read_data
from conoid.cases.model.schema import Case
from conoid.cases.outcome import Check, Outcome
from conoid.cases.suite import Hard, drift, faults, is_free, suite
from conoid.client import cli
from conoid.client.commands.hard import Verdict, chosen, to_markdown
from conoid.client.errors import ClientError

GOOD = Outcome(state="succeeded", steps=10, elements=6, worst_residual=1e-6)


def case_of(hard: Hard) -> Case:
    return parse_case(apply_overrides(read_data(hard.path), hard.changes))


def named(name: str) -> Hard:
    (found,) = chosen(suite(), [name])
    return found


@pytest.mark.parametrize("hard", suite(), ids=lambda hard: hard.name)
def test_a_case_of_the_suite_is_valid(hard: Hard) -> None:
    assert case_of(hard).title


def test_every_file_of_the_suite_is_run_under_a_name_of_its_own() -> None:
    files = {path.stem for path in named("wedge").path.parent.glob("*.toml")}
    assert files <= {hard.case for hard in suite()}
    assert len({hard.name for hard in suite()}) == len(suite())


def test_a_run_that_ended_well_has_no_faults_and_every_fault_is_named() -> None:
    hard = named("wedge")
    assert faults(hard, GOOD, 1e-12) == []
    missed = Check(name="radius rod z", value=2.0, expected=1.0, tolerance=0.5, passed=False)
    bad = Outcome(state="failed", message="crushed", worst_residual=float("nan"), reference=[missed])
    assert [fault.split()[0] for fault in faults(hard, bad, 1e-3)] == ["failed:", "energy", "momentum", "radius"]


def test_a_case_whose_energy_is_made_must_be_refused_for_that_line() -> None:
    hard = named("closing_bore")
    text = f"the term {hard.refused} of the energy ledger has created 0.0213 of the largest energy"
    assert faults(hard, Outcome(state="failed", cause="energy", message=text, worst_residual=1e-6), None) == []
    for wrong in (GOOD, Outcome(state="failed", cause="energy", message="the energy residual", worst_residual=1e-6)):
        first = faults(hard, wrong, None)
        assert [fault.split(":")[0] for fault in first] == ["not refused for the energy that averaging creates"]


def test_momentum_drifts_over_the_motion_of_the_parts_not_over_its_sum() -> None:
    """Two equal parts collide: their momenta cancel, and the drift of the momentum of one part gives the value one
    half.
    """
    case = case_of(named("scissors"))
    assert is_free(case)
    one = 60.0 * 7850.0 * 2.85e-3 * 4e-3 * 2.5e-3
    assert drift(case, [(0.0, 0.0, 0.0), (0.0, 0.0, one)]) == pytest.approx(0.5)
    assert not is_free(case_of(named("three_walls")))


def test_cases_are_chosen_by_name_and_by_row() -> None:
    assert {hard.name for hard in chosen(suite(), ["H27", "wedge"])} == {"quarter_ball", "tile", "wedge"}
    assert len(chosen(suite(), [])) == len(suite())
    with pytest.raises(ClientError, match="H99"):
        chosen(suite(), ["H99"])


def test_the_table_lists_all_failures() -> None:
    text = to_markdown([Verdict(named("wedge"), "", GOOD, 1e-12, []), Verdict(named("tile"), "", GOOD, None, ["lost"])])
    assert "1 of 2 cases passed" in text
    assert "- **tile**: lost" in text


def test_the_list_runs_nothing() -> None:
    ended = CliRunner().invoke(cli.app, ["hard", "H27", "--list"])
    assert ended.exit_code == 0
    assert "bodies_on_planes" in ended.output
