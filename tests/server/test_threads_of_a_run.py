"""Threads of a run whose case gives none: all slots of the server, as far as its tets can occupy them."""

import json
import tomllib
from pathlib import Path

import pytest

from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.server.intake.reading import Question, read
from conoid.server.requests.limits import Limits

from .running import TOML, Running, case_text
from .sweep_bodies import handed_in

FINE = case_text(wait="/nowhere").replace('"0.5 mm"', '"0.1 mm"').replace("threads = 1\n", "")
"""A case of 24,000 tets without a number of threads."""


@pytest.mark.parametrize(
    ("slots", "ranks", "site", "tets", "threads"),
    [
        (2, 1, None, 24_000, 2), (64, 1, None, 24_000, 8), (64, 3, None, 24_000, 3), (5, 2, None, 24_000, 2),
        (64, 1, None, 192, 1), (64, 2, 5, 192, 5), (4, 2, 5, 24_000, 2), (2, 1, 1, 24_000, 1),
    ],
)  # fmt: skip
def test_a_case_without_threads_gets_all_slots_that_its_tets_can_occupy(
    slots: int, ranks: int, site: int | None, tets: int, threads: int
) -> None:
    """``site``: threads in the settings of the site."""
    text = FINE.replace("ranks = 1", f"ranks = {ranks}")
    text = text if tets > 192 else text.replace('"0.1 mm"', '"0.5 mm"')
    most = Limits(slots, None, None, None, core_seconds=1000.0, wall_time=None, threads=site)
    given, own = (
        read(Question(body=each.encode(), json=False, limits=most)).reading
        for each in (text.replace("[run]", "[run]\nthreads = 1"), text)
    )
    assert own is not None
    assert given is not None
    assert (own.estimate["elements"], own.threads, given.threads) == (tets, threads, 1)
    assert json.loads(own.resolved)["run"]["threads"] == threads
    assert own.wall_time == pytest.approx(1000.0 / (ranks * threads)), "core seconds are those of all its cores"
    assert (own.estimate["seconds"] < given.estimate["seconds"]) == (threads > 1)


def test_a_run_alone_uses_all_slots_and_a_point_of_a_sweep_one(server: Running, tmp_path: Path) -> None:
    text = FINE.replace("/nowhere", str(tmp_path / "go"))
    run = server.ann.submit(text)
    assert server.ann.wait_for(run, State.RUNNING)["threads"] == 2
    body = {"case": tomllib.loads(text), "points": [{"run.end_time": "2 us"}, {"run.end_time": "3 us"}]}
    swept = [point["run"]["id"] for point in handed_in(server.ann, json.dumps(body).encode())["points"]]
    labelled = server.ann.http.post("/v1/runs?label=sweep=a", content=text, headers=TOML).json()["id"]
    assert [server.ann.show(each)["threads"] for each in (*swept, labelled)] == [1, 1, 1]
    (tmp_path / "go").touch()
    for each, threads in ((run, 2), *((each, 1) for each in (*swept, labelled))):
        server.ann.wait_for(each)
        lines = map(json.loads, (server.ann.runs / each / layout.JOURNAL).read_text().splitlines())
        assert [line.get("threads", 1) for line in lines if line["type"] == "started"] == [threads]
