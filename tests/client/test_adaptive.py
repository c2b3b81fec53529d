"""Adaptive sweeps of runs whose result is a known function: bracket, curve, rounds, the file, errors of users."""

import json
import math
import random
import statistics
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import pytest

from conoid.cases.load import CaseError
from conoid.cases.outcome import Measured, Outcome, to_json
from conoid.cases.output.search import Search
from conoid.cases.run import State
from conoid.client.errors import ClientError, MissingError, UsageError
from conoid.client.remote.http import Me
from conoid.client.remote.run_info import RunInfo
from conoid.client.sweeps.adaptive import found_by
from conoid.client.sweeps.adaptive_result import Found, read, table
from conoid.client.sweeps.ballistic import Fit, course, residual_velocity
from conoid.client.sweeps.bracket import Bracket, Sample, between, bracket, widest
from conoid.client.sweeps.fitting import fitted, unfitted
from conoid.client.sweeps.goal import Goal, Span, span_of, spans_of, tolerance_of
from conoid.client.sweeps.reporting import Reported

KEY = "parts[0].velocity[2]"
NO_LAW = "the results above the limit do not follow the law of Lambert and Jonas"
CASE = {
    "name": "shot",
    "parts": [{
        "name": "core", "material": "tungsten_alloy", "velocity": ["0 m/s", "0 m/s", "1 m/s"],
        "mesh": {"shape": "sphere", "centre": [0, 0, 0], "radius": "3 mm", "element_size": "1 mm"},
    }],
    "probes": [{"name": "left", "part": "core", "field": "velocity_z"}],
    "run": {"end_time": "1 us"},
}  # fmt: skip


def lambert_jonas(limit: float, a: float, p: float) -> Callable[[float], float]:
    return lambda v: a * max(abs(v) ** p - limit**p, 0.0) ** (1.0 / p)


class Firing:
    """A server whose runs have the result ``curve`` of the velocity; if the curve returns a text, the run fails with
    this message.
    """

    def __init__(self, curve: Callable[[float], float | str], slots: int = 1) -> None:
        self.curve, self.slots = curve, slots
        self.made: dict[str, RunInfo] = {}
        self.reports: list[Search] = []
        self.stop = False
        self.outbox: Any = self
        self.fired: list[float] = []
        self.most_at_once = self.open = 0

    def me(self) -> Me:
        return Me(owner="ann", slots={"total": self.slots, "used": 0})

    def put(self, kind: type[Reported], path: str, body: bytes, headers: Mapping[str, str]) -> Reported:
        assert path.startswith("/v1/sweeps/adaptive/")
        self.reports.append(msgspec.json.decode(body, type=Search))
        return Reported(id="s1", stop=self.stop)

    def runs(self, states: Sequence[str] = (), limit: int = 50) -> list[RunInfo]:
        return list(self.made.values())[-limit:]

    def ready(self, case: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
        return case

    def submit(self, case: Any, overrides: Any = (), key: str | None = None, *_: Any, **__: Any) -> Any:
        assert key is not None
        if key not in self.made:
            x = float(str(case["parts"][0]["velocity"][2]).split()[0])
            self.fired.append(x)
            self.made[key] = ended(f"r{len(self.made):03d}", self.curve(x))
        self.open += 1
        self.most_at_once = max(self.most_at_once, self.open)
        return Fired(self, self.made[key])


class Fired:
    """Run of the server ``Firing``."""

    def __init__(self, at: Firing, info: RunInfo) -> None:
        self.at, self.info, self.id = at, info, info.id

    def status(self) -> RunInfo:
        return self.info

    def wait(self) -> RunInfo:
        self.at.open -= 1
        return self.info


def ended(run: str, value: float | str) -> RunInfo:
    lost = isinstance(value, str)
    probes = [] if lost else [Measured(name="left", value=float(value), unit="m/s")]
    outcome = Outcome(state="failed" if lost else "succeeded", probes=probes, cpu=2.0)
    return RunInfo(
        id=run, owner="ann", name="shot", state=State.FAILED if lost else State.SUCCEEDED, ranks=1, submitted=0.0,
        message=str(value) if lost else "", outcome_json=msgspec.Raw(to_json(outcome)),
    )  # fmt: skip


def find(
    at: Firing, ends: Sequence[Any] = ("200 m/s", "800 m/s"), goal: str = "probe.left = 0", tolerance: Any = "5 m/s",
    *, out: Path | None = None, most: int = 40, at_once: int | None = None, case: Mapping[str, Any] = CASE,
) -> Found:  # fmt: skip
    return found_by(at, case, Path(), goal, [span_of(KEY, ends)], tolerance, at_once, most, out, lambda text: None)


@pytest.mark.parametrize("slots", [1, 2, 4])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_ballistic_limit_is_bracketed_and_fitted(slots: int, sign: float) -> None:
    law = lambert_jonas(413.7, 0.92, 2.6)
    at = Firing(lambda v: sign * law(v), slots)
    found = find(at, (f"{sign * 200} m/s", f"{sign * 800} m/s"))
    assert found.limit is not None
    assert found.uncertainty is not None
    assert found.reached
    assert abs(sign * found.limit - 413.7) <= found.uncertainty <= 2.5
    assert found.points == len(at.fired) <= {1: 9, 2: 12, 4: 16}[slots]
    assert at.most_at_once == slots if slots > 1 else at.most_at_once == 2
    assert found.fit is not None
    if found.fit.points >= 4:
        assert (found.fit.law, round(found.fit.factor, 3)) == ("Lambert and Jonas", 0.92)
        assert found.fit.limit == pytest.approx(413.7, abs=1e-3)
    assert found.cpu == 2.0 * found.points


def test_each_point_and_the_result_are_reported_to_the_server() -> None:
    law = lambert_jonas(413.7, 0.92, 2.6)
    at = Firing(lambda v: -law(1000.0 * v), 4)
    found = find(at, ("-0.2 km/s", "-0.8 km/s"), tolerance=0.005)
    first, *_, last = at.reports
    assert (first.points, first.over, first.low, first.high, first.tolerance) == ([], False, -800.0, -200.0, 5.0)
    assert sum(point.value is None for point in at.reports[1].points) == 4, "of a round, before any has ended"
    assert last.over
    assert (last.why, len(last.points), last.unit) == ("", found.points, "m/s")
    assert found.limit is not None
    assert last.bracket is not None
    assert sum(last.bracket) / 2 == pytest.approx(1000.0 * found.limit)
    assert last.curve is not None
    assert last.curve.limit == pytest.approx(-413.7, abs=1e-3)
    assert found.fit is not None
    assert found.fit.limit == pytest.approx(0.4137, abs=1e-6)
    assert last.curve.factor == pytest.approx(0.92, abs=1e-6)
    for x, y, _ in last.curve.course:
        assert y == pytest.approx(-law(x), abs=1e-3)
    assert min(x for x, *_ in last.curve.course) == -800.0


def test_the_error_along_a_curve_is_what_refits_of_scattered_points_give() -> None:
    chance, law = random.Random(2), lambert_jonas(400.0, 0.9, 2.0)
    x = [420.0, 480.0, 550.0, 620.0, 700.0, 800.0]
    made = Bracket(Sample(390.0, 0.0), Sample(420.0, 1.0))

    def scattered() -> Fit:
        shots = [Sample(390.0, 0.0), *(Sample(v, law(v) + chance.gauss(0.0, 3.0)) for v in x)]
        fit = residual_velocity(shots, made, 0.0)
        assert fit is not None
        return fit

    fits = [scattered() for _ in range(300)]
    at = [course(fit, 600.0, 700.0) for fit in fits]
    values_scattered, values = [line[1][2] for line in at], [line[1][1] for line in at]
    assert statistics.fmean(error for error in values_scattered if error is not None) == pytest.approx(
        statistics.stdev(values), rel=0.2
    )


def test_a_cancel_on_the_server_ends_it_and_the_next_command_goes_on(tmp_path: Path) -> None:
    at, out = Firing(lambert_jonas(413.7, 0.92, 2.6)), tmp_path / "shot.json"
    at.stop = True
    found = find(at, out=out)
    assert (found.fresh, found.reached, found.why.split(";")[0]) == (0, False, "the sweep was cancelled on the server")
    at.stop = False
    assert find(at, out=out).reached


def test_a_server_that_keeps_no_adaptive_sweeps_is_asked_for_runs_all_the_same() -> None:
    at = Firing(lambert_jonas(413.7, 0.92, 2.6))

    def put(*_: Any) -> Any:
        raise MissingError(404, {"detail": "no such route"})

    at.put = put  # type: ignore[assignment,method-assign]
    assert find(at).reached


def test_any_limit_of_any_curve_lies_in_its_bracket() -> None:
    chance = random.Random(3)
    for _ in range(12):
        limit, a, p = chance.uniform(201, 799), chance.uniform(0.6, 1.0), chance.uniform(1.5, 4.0)
        at = Firing(lambert_jonas(limit, a, p), chance.choice([1, 2, 3, 5]))
        found = find(at, tolerance="2 m/s")
        (low, _), (high, _) = found.ends
        assert low <= limit <= high
        assert high - low <= 2.0
        if found.fit is not None and found.fit.error is not None:
            assert abs(found.fit.limit - limit) < max(1e-3, 3.0 * found.fit.error)


def test_the_error_of_a_curve_through_points_that_scatter_is_what_they_scatter() -> None:
    law, chance = lambert_jonas(400.0, 0.9, 2.0), random.Random(1)
    at = Firing(lambda v: law(v) + (chance.gauss(0, 8) if v > 400 else 0.0), 4)
    found = find(at, tolerance="1 m/s")
    assert found.fit is not None
    assert found.fit.error is not None
    assert 0.1 < found.fit.error < 20.0
    assert abs(found.fit.limit - 400.0) < 4.0 * found.fit.error
    assert at.reports[-1].curve is not None
    assert (at.reports[-1].curve.limit, at.reports[-1].curve.error) == (found.fit.limit, found.fit.error)


def test_points_that_do_not_follow_the_law_have_no_curve() -> None:
    """Case: a free plate, which slow projectiles push along and only the fastest projectile perforates."""
    left = {20: 3.3, 26.7: 4.9, 30: 5.8, 33.3: 6.6, 40: 8.4, 60: 13.3, 80: 17.7, 140: 30.7, 200: 127.9}
    shots = [Sample(v, speed - 5.0) for v, speed in left.items()]
    made = bracket(shots)
    assert made is not None
    assert residual_velocity(shots, made, 5.0) is None
    goal, span = Goal(result="probe.left", threshold=5.0, unit="m/s"), Span(key=KEY, low=20.0, high=200.0, unit="m/s")
    assert (fitted(goal, span, shots, made), unfitted(goal, span, shots, made)) == (None, NO_LAW)
    few = [shot for shot in shots if not 30.0 < shot.x < 150.0]
    rough = bracket(few)
    assert rough is not None
    assert unfitted(goal, span, few, rough) == "fewer than 3 results above the limit"
    lines: list[str] = []
    at = Firing(lambda v: max(0.0, v - 500.0) ** 0.01)
    found_by(
        at, CASE, Path(), "probe.left = 0", [span_of(KEY, ("200 m/s", "800 m/s"))], "5 m/s", 1, 40, None, lines.append
    )
    assert lines[-1] == f"no fitted curve: {NO_LAW}"


def test_a_result_that_goes_through_a_threshold_has_a_line() -> None:
    found = find(Firing(lambda v: 0.5 * v - 260.0), goal="probe.left = -10 m/s", tolerance=20)
    assert found.fit is not None
    assert (found.fit.law, round(found.fit.limit, 6)) == ("line", 500.0)
    assert found.limit == pytest.approx(500.0, abs=found.uncertainty)


def test_a_range_without_a_crossing_is_reported_with_both_ends() -> None:
    found = find(Firing(lambda v: 0.0))
    assert not found.reached
    assert found.points == 2
    assert found.lines()[0] == (
        f"{KEY}: no probe.left = 0 m/s in the range: probe.left is 0 m/s at 200 m/s and 0 m/s at 800 m/s"
    )


def test_a_failed_point_is_gone_round_and_a_failed_end_ends_it() -> None:
    law = lambert_jonas(413.7, 0.92, 2.6)
    found = find(Firing(lambda v: "the energy residual" if v == 500.0 else law(v)))
    assert found.reached
    assert found.failed == 1
    assert "1 without a result" in found.lines()[-1]
    bad = find(Firing(lambda v: "the energy residual" if v > 799 else law(v)))
    assert not bad.reached
    assert f"the run at {KEY} = 800 m/s has no result: failed: the energy residual" in "\n".join(bad.lines())
    assert not find(Firing(lambda v: "broken" if 390 < v < 440 else law(v))).reached


def test_a_result_that_is_no_number_is_a_point_without_a_result() -> None:
    law = lambert_jonas(413.7, 0.92, 2.6)
    found = find(Firing(lambda v: math.nan if v == 500.0 else law(v)))
    assert (found.failed, found.reached) == (1, True)


def test_a_result_that_is_not_monotonic_is_reported() -> None:
    found = find(Firing(lambda v: float(v > 300) * float(not 500 < v < 700) * v, 7))
    assert found.changes > 1
    assert found.mixed is not None
    assert "not monotonic, or it scatters: the threshold is crossed 3 times between" in found.lines()[1]
    (low, _), (high, _) = found.ends
    assert low <= 300.0 <= high


def test_as_many_runs_as_are_allowed() -> None:
    at = Firing(lambert_jonas(413.7, 0.92, 2.6))
    found = find(at, most=4)
    assert len(at.fired) == 4
    assert not found.reached
    assert "the largest number of runs (--most) has been reached" in "\n".join(found.lines())


def test_the_same_sweep_goes_on_from_its_file(tmp_path: Path) -> None:
    out, law = tmp_path / "shot.json", lambert_jonas(413.7, 0.92, 2.6)
    find(Firing(law), out=out, most=4)
    again = Firing(law)
    found = find(again, out=out)
    assert found.reached
    assert found.points == 4 + len(again.fired)
    idle = Firing(law)
    assert find(idle, out=out).limit == found.limit
    assert idle.fired == []
    finer = Firing(law)
    assert find(finer, out=out, tolerance="0.5 m/s").points == found.points + len(finer.fired)
    columns = {column.title: column.values for column in table(read(out))}
    assert columns[f"{KEY} [m/s]"] == sorted(columns[f"{KEY} [m/s]"], key=float)  # type: ignore[arg-type]
    assert columns["probe.left [m/s]"][0] == 0.0


def test_a_failed_point_is_run_again_and_a_run_that_goes_on_is_not(tmp_path: Path) -> None:
    law, out = lambert_jonas(413.7, 0.92, 2.6), tmp_path / "shot.json"
    at = Firing(lambda v: "no disk" if v > 799 else law(v))
    assert not find(at, out=out).reached
    at.curve = law
    assert find(at, out=out).reached
    assert at.fired.count(800.0) == 2
    out.unlink()
    shots = len(at.fired)
    assert find(at, out=out).reached
    assert len(at.fired) == shots, "the server has them"


def test_another_case_or_goal_is_refused_with_the_key_that_changed(tmp_path: Path) -> None:
    out, law = tmp_path / "shot.json", lambert_jonas(413.7, 0.92, 2.6)
    find(Firing(law), out=out, most=2)
    other = json.loads(json.dumps(CASE))
    other["run"]["end_time"] = "2 us"
    with pytest.raises(
        ClientError, match=r"the case has changed since the first run: run.end_time was '1 us' and is '2 us'; choose"
    ):
        find(Firing(law), out=out, case=other)
    with pytest.raises(UsageError, match=r"contains another sweep, probe.left = 0 over"):
        find(Firing(law), out=out, goal="probe.left = 1 m/s")
    out.write_text("{}")
    with pytest.raises(UsageError, match="not a file of an adaptive sweep"):
        find(Firing(law), out=out)


def test_a_run_whose_folder_is_gone_is_made_again() -> None:
    at, real = Firing(lambert_jonas(413.7, 0.92, 2.6)), Firing.submit
    gone = set[str]()

    def submit(case: Any, overrides: Any = (), key: str | None = None, *more: Any, **words: Any) -> Any:
        if key is not None and key.endswith("-0"):
            gone.add(key)
            raise MissingError(410, {"detail": "gone"})
        return real(at, case, overrides, key, *more, **words)

    at.submit = submit  # type: ignore[method-assign]
    assert find(at).reached
    assert gone


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        ("probe.lift = 0", "--adaptive = 'probe.lift': unknown result; did you mean 'probe.left'"),
        ("probe.left", "write a result and its threshold"),
        ("probe.left = 3 mm", "--adaptive = '3 mm': '3 mm' has the wrong dimension; expected a speed"),
        ("digest = 3", "unknown result"),
    ],
)
def test_a_wrong_goal_is_refused_before_any_run(goal: str, words: str) -> None:
    at = Firing(lambda v: 0.0)
    with pytest.raises(CaseError, match=words):
        find(at, goal=goal)
    assert at.fired == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run.ranks=1"], "key that varies as KEY=LOW:HIGH"),
        ([f"{KEY}=200:200"], "both ends of the range are equal"),
        ([f"{KEY}=200 m/s:800 mm"], "two numbers of the same dimension"),
        ([f"{KEY}=200:800", "run.ranks=1,2"], "run.ranks has 2 values"),
    ],
)
def test_wrong_spans_are_refused(words: list[str], message: str) -> None:
    with pytest.raises(CaseError, match=message):
        spans_of(words)


def test_spans_go_together_and_units_are_those_that_are_written() -> None:
    spans, constants = spans_of([f"{KEY}=200:800 m/s", "parts[1].velocity[2]=0.1:0.4 km/s", "run.end_time=40 us"])
    assert [(span.low, span.high, span.unit) for span in spans] == [(200, 800, "m/s"), (0.1, 0.4, "km/s")]
    assert spans[1].along(spans[0], 400.0) == "0.2 km/s"
    assert constants == {"run.end_time": "40 us"}
    assert [tolerance_of(given, spans[1]) for given in (None, 0.01, "5 m/s")] == [0.004, 0.01, 0.005]
    for wrong in ("0", "-1 m/s", "1 mm", "nan"):
        with pytest.raises(CaseError, match="--tolerance"):
            tolerance_of(wrong, spans[0])


def test_points_divide_what_is_left_as_evenly_as_can_be() -> None:
    assert between(0.0, 1.0, [], 3) == [0.25, 0.5, 0.75]
    assert between(0.0, 1.0, [0.5], 1) == [0.25]
    assert widest(0.0, 1.0, [0.2]) == 0.8
    found = bracket([Sample(1.0, 0.0), Sample(2.0, -3.0), Sample(3.0, None), Sample(4.0, 5.0)])
    assert found is not None
    assert (found.low.x, found.high.x) == (2.0, 4.0), "what bounces back is before the limit"
    assert bracket([Sample(1.0, 1.0), Sample(2.0, 3.0)]) is None


@pytest.mark.parametrize(("limit", "outside"), [(265.0, False), (-265.0, False), (272.1, True), (250.0, True)])
def test_a_curve_that_does_not_begin_in_the_bracket_is_reported(limit: float, outside: bool) -> None:
    fit = Fit(law="Lambert and Jonas", limit=limit, error=1.0, points=6, factor=1.0, exponent=2.0)
    found = Found(
        key="v", unit="m/s", goal=Goal(result="probe.speed", threshold=0.0, unit="m/s"), limit=-264.0,
        uncertainty=3.0, tolerance=10.0,
        ends=((-267.0, -0.6), (-261.0, 4.1)), changes=1, fit=fit, points=9, fresh=9, failed=0, cpu=1.0,
    )  # fmt: skip
    assert any("outside of the bracket" in line for line in found.lines()) == outside
