"""Number of cores that a process may use by control groups of both versions; words for ranks and threads."""

from pathlib import Path

import pytest

from conoid.cases.estimates import cores
from conoid.cases.figures import crew


def group(place: Path, **files: str) -> None:
    place.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (place / name.replace("__", ".")).write_text(text)


def quotas(folder: Path, own: str) -> list[float]:
    (folder / "own").write_text(own)
    return cores._quotas(folder / "groups", folder / "own")


def test_the_least_quota_of_a_group_and_of_those_above_it_counts(tmp_path: Path) -> None:
    group(tmp_path / "groups" / "user", cpu__max="400000 100000\n")
    group(tmp_path / "groups" / "user" / "job", cpu__max="max 100000\n")
    assert quotas(tmp_path, "0::/user/job\n") == [4.0]
    assert quotas(tmp_path, "0::/nowhere\n") == []


def test_the_root_group_of_a_container_has_its_quota(tmp_path: Path) -> None:
    group(tmp_path / "groups", cpu__max="250000 100000\n")
    assert quotas(tmp_path, "0::/\n") == [2.5]


def test_quotas_of_version_1(tmp_path: Path) -> None:
    group(tmp_path / "groups" / "cpu,cpuacct" / "a", cpu__cfs_quota_us="150000\n", cpu__cfs_period_us="100000\n")
    group(tmp_path / "groups" / "cpu,cpuacct", cpu__cfs_quota_us="-1\n", cpu__cfs_period_us="100000\n")
    assert quotas(tmp_path, "5:memory:/a\n4:cpu,cpuacct:/a\n") == [1.5]


@pytest.mark.parametrize(("quota", "number"), [(1.5, 1), (0.3, 1), (2.0, 2), (64.0, 3)])
def test_there_are_no_more_cores_than_the_quota_and_the_affinity(
    quota: float, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cores, "core_numbers", lambda: [0, 2, 5])
    monkeypatch.setattr(cores, "_quotas", lambda *_: [quota])
    assert cores.usable_cores() == number


def test_ranks_and_threads_in_words() -> None:
    assert [crew(1), crew(2), crew(1, 16), crew(4, 4)] == ["1 rank", "2 ranks", "1 rank x 16 threads",
                                                         "4 ranks x 4 threads"]  # fmt: skip
