"""Columns of history.csv for charts, read from the file and over HTTP."""

import csv
import math
import random
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.output import history, layout
from conoid.server.answers import columns
from conoid.server.answers.columns import Columns, extremes

from .running import Running

NAMES = {"step": "", "t": "s", "limiter": "", "push": "N"}


def write(path: Path, values: list[float], first: int = 0) -> None:
    """Appends lines with ``values`` in the column ``push``."""
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        if not first:
            writer.writerow(history.header(NAMES))
        rows = ([k, repr(1e-9 * k), "stability, tet 1", repr(v)] for k, v in enumerate(values, first))
        writer.writerows(rows)


def read(path: Path) -> Columns:
    found = Columns(path)
    found.catch_up()
    return found


def test_a_short_file_is_given_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / layout.HISTORY
    write(path, [3.0, -1.0, math.nan, 2.0])
    found = read(path)
    assert found.units == {"step": "", "t": "s", "push": "N"}
    values = found.values(["t", "push"], 10)
    assert values["t"] == [1e-9 * k for k in range(4)]
    assert values["push"] == [3.0, -1.0, pytest.approx(math.nan, nan_ok=True), 2.0]
    assert found.statistics()["push"] == {"unit": "N", "last": 2.0, "least": -1.0, "most": 3.0}


def test_no_peak_is_lost_however_long_the_file_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Spikes in single lines of history.csv, at random places, are read in pieces of random lengths and combined into
    few groups.
    """
    monkeypatch.setattr(columns, "_GROUPS", 64)
    lot, path = random.Random(7), tmp_path / layout.HISTORY
    found, sent = Columns(path), list[float]()
    for piece in (1, 63, 64, 65, 2, *(lot.randrange(1, 700) for _ in range(20))):
        values = [lot.gauss(0.0, 1.0) for _ in range(piece)]
        if lot.random() < 0.5:
            values[lot.randrange(piece)] = lot.choice((-1.0, 1.0)) * lot.uniform(1e3, 1e6)
        write(path, values, len(sent))
        sent += values
        found.catch_up()
        assert sum(map(len, found._kept)) <= 2 * 3 * 64
        shown = found.values(["t", "push"], 40)
        assert len(shown["t"]) == len(shown["push"]) <= 44
        assert (min(shown["push"]), max(shown["push"])) == (min(sent), max(sent))
        assert shown["t"] == sorted(shown["t"])
        assert (shown["t"][0], shown["t"][-1], shown["push"][-1]) == (0.0, 1e-9 * (len(sent) - 1), sent[-1])
        spike = max(range(len(sent)), key=lambda k: abs(sent[k]))
        at = max(range(len(shown["push"])), key=lambda k: abs(shown["push"][k]))
        assert abs(shown["t"][at] / 1e-9 - spike) <= 2 * len(sent) / 15
    assert found.lines == len(sent)


def test_extremes_keep_their_order_and_pass_over_what_is_no_number() -> None:
    assert extremes([2.0, math.nan, 5.0, -1.0]) == (5.0, -1.0)
    assert extremes([math.nan, 3.0]) == (3.0, 3.0)
    assert all(map(math.isnan, extremes([math.nan])))
    assert extremes([math.inf, -math.inf]) == (math.inf, -math.inf)


def test_a_rewritten_file_is_read_again(tmp_path: Path) -> None:
    """A run that continues from a checkpoint removes lines of history.csv and writes these lines again."""
    path = tmp_path / layout.HISTORY
    write(path, [1.0, 2.0, 9.0])
    found = read(path)
    beside = path.with_suffix(".part")
    write(beside, [1.0, 2.0])
    beside.rename(path)
    write(path, [3.0, 4.0], 2)
    found.catch_up()
    assert found.values(["push"], 10)["push"] == [1.0, 2.0, 3.0, 4.0]
    path.unlink()
    found.catch_up()
    assert (found.lines, found.values(["push"], 10)) == (0, {})


def test_a_long_file_is_read_in_bounded_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(columns, "_BLOCK", 256)
    monkeypatch.setattr(columns, "_AT_ONCE", 3)
    path = tmp_path / layout.HISTORY
    write(path, [float(k) for k in range(200)])
    found = read(path)
    assert found.behind
    assert 0 < found.lines < 30
    for _ in range(30):
        found.catch_up()
    assert (found.behind, found.lines) == (False, 200)


def test_damaged_lines_of_a_history_are_skipped(tmp_path: Path) -> None:
    path = tmp_path / layout.HISTORY
    write(path, [1.0])
    with path.open("ab") as file:
        file.write(b"half,a\r\n\xff\xfe\r\n2,x,limiter,4.0\r\n7,1e-9")
    found = read(path)
    assert found.lines == 2
    assert found.values(["push"], 9)["push"] == [1.0, 4.0]


def test_columns_over_http(server: Running) -> None:
    run = server.ann.submit(steps=1)
    server.ann.wait_for(run)
    place, path = f"/v1/runs/{run}/columns", server.ann.runs / run / layout.HISTORY
    path.unlink(missing_ok=True)
    assert shown(server, place) == {"lines": 0, "behind": False, "columns": {}, "values": {}}
    write(path, [5.0, math.nan, 7.0])
    columns = shown(server, place, name="push")
    assert columns["values"] == {"t": [0.0, 1e-9, 2e-9], "push": [5.0, None, 7.0]}
    assert columns["columns"]["push"] == {"unit": "N", "last": 7.0, "least": 5.0, "most": 7.0}
    assert shown(server, place)["values"] == {}
    assert list(shown(server, place, name="*")["values"]) == ["step", "t", "push"]
    answer = server.ann.http.get(place, params={"name": "pull"})
    assert (answer.status_code, answer.json()["pointer"]) == (400, "name")
    assert "step, t, push" in answer.json()["detail"]
    assert server.bob.http.get(place).status_code == 404
    tag = server.ann.http.get(place).headers["etag"]
    assert server.ann.http.get(place, headers={"If-None-Match": tag}).status_code == 304


def shown(server: Running, place: str, **query: Any) -> Any:
    answer = server.ann.http.get(place, params=query)
    assert answer.status_code == 200, answer.text
    return answer.json()
