"""The points of a sweep from words and files."""

from pathlib import Path

import pytest

from conoid.client.sweep import points_in, points_of


def test_keys_go_together_or_each_with_each() -> None:
    words = ["run.ranks=1,2", "run.end_time=1 us,2 us"]
    assert points_of(words) == [{"run.ranks": 1, "run.end_time": "1 us"}, {"run.ranks": 2, "run.end_time": "2 us"}]
    assert [tuple(point.values()) for point in points_of(words, grid=True)] == [
        (1, "1 us"), (1, "2 us"), (2, "1 us"), (2, "2 us")
    ]  # fmt: skip


def test_a_comma_in_a_list_or_in_quotes_divides_nothing() -> None:
    word = """parts[0].velocity=[0, 0, "-1 m/s"],[0, 0, '-2, m/s']"""
    assert points_of([word]) == [
        {"parts[0].velocity": [0, 0, "-1 m/s"]}, {"parts[0].velocity": [0, 0, "-2, m/s"]}
    ]  # fmt: skip


@pytest.mark.parametrize("words", [[], ["run.ranks"], ["run.ranks="], ["a=1,2", "b=1"]])
def test_wrong_words_are_refused(words: list[str]) -> None:
    with pytest.raises(ValueError, match="--set"):
        points_of(words)


def test_points_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("run.ranks,run.end_time\n1,1 us\n2,2 us\n")
    assert points_in(path)[1] == {"run.ranks": 2, "run.end_time": "2 us"}
    path.write_text("run.ranks,run.end_time\n1\n")
    with pytest.raises(ValueError, match="--list"):
        points_in(path)
