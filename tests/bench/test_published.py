"""Tests of the table and the chart of the comparison with the paper."""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from conoid.client.studies.projection import Network, Projection
from conoid.client.studies.study import Study, to_json

from .published import compared, drawn, main


def run(ranks: int, time: float) -> Projection:
    """Returns a run of ``time`` s without waiting."""
    return Projection(
        ranks=ranks, steps=1, windows=1, wall=time, work=time, longest=time, longest_coarse=time, messages=0.0,
        collectives=0.0, phases={}, messages_sent=0.0, bytes_sent=0.0, collectives_made=0.0, bytes_shared=0.0,
        rebalances=0, digest="abc",
    )  # fmt: skip


def study(case: str = "long_rod") -> Study:
    return Study(case, (), 1, Network(latency=1e-6, bandwidth=1e9), (run(1, 4.0), run(2, 3.0)))


def test_the_table_has_both() -> None:
    lines = compared(study()).splitlines()
    assert lines[0] == "`long_rod`: Moon, Kim and Lee, fig. 14, with no rebalances"
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[4:]]
    assert rows == [["2", "-", "1.33", "-", "66.7"], ["32", "23.79", "-", "74.3", "-"]]


@pytest.mark.parametrize(
    ("case", "values"), [("long_rod", ["23.79"]), ("glass_steel_bar", ["12.32", "18.74"]), ("demo", [])]
)
def test_the_chart_has_the_papers_points(case: str, values: list[str]) -> None:
    tree = ElementTree.fromstring(drawn(study(case)))
    texts = [e.text or "" for e in tree.iter("{http://www.w3.org/2000/svg}text")]
    assert [text for text in texts if re.fullmatch(r"\d+\.\d\d", text)] == [*values, "1.33"]
    assert any("Moon, Kim and Lee" in text for text in texts) == bool(values)


def test_a_folder_is_read_and_drawn_into(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scale.json").write_bytes(to_json(study()))
    main(tmp_path)
    assert "23.79" in capsys.readouterr().out
    assert (tmp_path / "published.svg").read_text().startswith("<svg")
