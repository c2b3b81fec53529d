"""Snapshots of a run agree with the tables of the run on any number of ranks; the snapshots in the journal of a killed
run are complete.
"""

import csv
import hashlib
import os
import signal
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from conoid.cases.messages import Counts, Snapshot, from_json
from conoid.cases.outcome import from_json as outcome_from_json
from conoid.cases.output import fragments, history, layout, snapshot

from .launching import command, ended, processes, started, together, wait_for, wait_until_gone
from .scenes import FAST, arguments

STOPPING = Path(__file__).with_name("stopping.py")


def snapshots_of(folder: Path) -> list[Snapshot]:
    """Returns the snapshot messages of the journal; an incomplete line after a kill is ignored."""
    lines = (folder / layout.JOURNAL).read_bytes().splitlines(keepends=True)
    found = [from_json(line) for line in lines if line.endswith(b"\n")]
    return [message for message in found if isinstance(message, Snapshot)]


def whole(folder: Path, message: Snapshot) -> bytes:
    """Returns the bytes of a snapshot, which agree with the journal."""
    data = (folder / message.path).read_bytes()
    assert (len(data), hashlib.sha256(data).hexdigest()) == (message.bytes, message.sha256)
    assert message.path == str(layout.snapshot(folder, message.n).relative_to(folder))
    return data


def arrays(data: bytes) -> dict[str, Any]:
    header = snapshot.header_of(data)
    return {
        name: np.frombuffer(data, array.dtype, int(np.prod(array.shape)), array.offset).reshape(array.shape)
        for name, array in header.arrays.items()
    }


def spread(folder: Path, kind: type[Counts | Snapshot]) -> tuple[int, int, list[int]]:
    """Returns the number of fragments and the sizes of the fragments in the last message of a kind."""
    lines = (folder / layout.JOURNAL).read_bytes().splitlines()
    last = [message for message in map(from_json, lines) if isinstance(message, kind)][-1]
    return last.fragments, last.smallest, last.sizes


def of_cause(folder: Path, cause: str) -> bytes:
    (one,) = [message for message in snapshots_of(folder) if message.cause == cause]
    return whole(folder, one)


@pytest.mark.parametrize("cause", ["start", "end"])
def test_any_number_of_ranks_gives_the_same_surface(
    cause: str, breaking: Callable[[int, str], Path], moving: Path
) -> None:
    one = of_cause(breaking(1, FAST), cause)
    mine, head = arrays(one), snapshot.header_of(one)
    for folder, ranks in ((breaking(2, FAST), 2), (moving, 3)):
        other = of_cause(folder, cause)
        theirs, header = arrays(other), snapshot.header_of(other)
        assert header.ranks == ranks
        assert set(np.unique(theirs["triangle_rank"])) == set(range(ranks))
        assert mine.keys() == theirs.keys()
        for name in mine.keys() - {"triangle_rank"}:
            assert np.array_equal(mine[name], theirs[name]), name
        for name in set(head.__struct_fields__) - {"n", "ranks", "arrays"}:
            assert getattr(head, name) == getattr(header, name), name


@pytest.mark.parametrize("ranks", [1, 2])
def test_the_last_snapshot_equals_the_tables_of_fragments(ranks: int, breaking: Callable[[int, str], Path]) -> None:
    """Momentum that is not in the rows of the snapshot belongs to nodes whose tets have eroded."""
    folder = breaking(ranks, FAST)
    data = of_cause(folder, "end")
    got, header = arrays(data), snapshot.header_of(data)
    rows = {
        int(row["label"]): row for row in fragments.read(sorted((folder / "fragments").glob("fragments_*.csv"))[-1])
    }
    with (folder / layout.HISTORY).open(newline="") as file:
        last = {history.split(name)[0]: text for name, text in list(csv.DictReader(file))[-1].items()}
    outcome = outcome_from_json((folder / layout.OUTCOME).read_bytes())
    assert (header.step, header.t) == (int(last["step"]), float(last["t"]))
    assert header.fragments_total == len(rows) == outcome.fragments == len(got["fragment_id"]) > 10
    assert header.tets == (outcome.elements or 0) - (outcome.eroded or 0)
    assert spread(folder, Counts) == spread(folder, Snapshot)
    for row, label in enumerate(got["fragment_id"].tolist()):
        line = rows[label]
        assert got["fragment_mass"][row] == line["mass"]
        assert got["fragment_tets"][row] == line["tets"]
        assert got["fragment_size"][row] == np.float32(line["extent"])
        for k, axis in enumerate("xyz"):
            assert got["fragment_centre"][row, k] == np.float32(line[f"centre_{axis}"])
            assert got["fragment_velocity"][row, k] == np.float32(line[f"velocity_{axis}"])
    mass, velocity = got["fragment_mass"], got["fragment_velocity"]
    momentum = (mass[:, None] * velocity).sum(axis=0)
    missing = np.array([float(last[f"momentum_{axis}"]) for axis in "xyz"]) - momentum
    whole_mass = arrays(of_cause(folder, "start"))["fragment_mass"].sum()
    kinetic = float(last["kinetic"]) - 0.5 * (mass * (velocity**2).sum(axis=1)).sum()
    assert 0.0 < kinetic < 0.5 * float(last["kinetic"])
    assert 0.0 < whole_mass - mass.sum() < 0.2 * whole_mass, "eroded tets leave their mass with nodes"
    bound = np.sqrt(2.0 * (whole_mass - mass.sum()) * kinetic)
    assert np.linalg.norm(missing) <= bound, "by Cauchy and Schwarz"


def test_births_are_those_of_the_genealogy(breaking: Callable[[int, str], Path]) -> None:
    folder = breaking(1, FAST)
    got = arrays(of_cause(folder, "end"))
    with fragments.genealogy(folder).open(newline="") as file:
        lines = list(csv.DictReader(file))
    tables = {int(path.stem[-4:]): fragments.read(path) for path in (folder / "fragments").glob("fragments_*.csv")}
    born = {int(row["label"]): 0.0 for row in tables[0]}
    for line in lines:
        born.setdefault(int(line["child"]), float(tables[int(line["frame"])][0]["t"]))
    births = dict(zip(got["fragment_id"].tolist(), got["fragment_birth"].tolist(), strict=True))
    assert births == {label: pytest.approx(born[label], rel=1e-6) for label in births}
    assert len(set(births.values())) > 1


def test_a_fragment_keeps_its_number_from_frame_to_frame(breaking: Callable[[int, str], Path]) -> None:
    """Most tets with a fragment number in a frame have the same number in the next frame, and no number is used
    again.
    """
    frames, used, kept = sorted((breaking(2, FAST) / layout.FRAMES).glob("*.vtkhdf")), set[int](), 0
    before: dict[int, int] = {}
    for path in frames:
        with h5py.File(path) as file:
            now = dict(zip(*(file["VTKHDF/CellData"][name][...].tolist() for name in ("tet", "fragment")), strict=True))
        shares: dict[int, Counter[int]] = {}
        for tet, number in now.items():
            if tet in before:
                shares.setdefault(before[tet], Counter())[number] += 1
        for old, pieces in shares.items():
            assert pieces[old] == max(pieces.values())
        kept += len(shares)
        assert not (set(now.values()) - set(before.values())) & used
        used |= set(now.values())
        before = now
    assert kept > 1
    assert used == set(range(len(used)))
    assert len(used) > 10


def test_one_is_made_when_asked_for_and_changes_no_bit(tmp_path: Path, breaking: Callable[[int, str], Path]) -> None:
    place = tmp_path / "asked"
    (place / FAST).mkdir(parents=True)
    (place / FAST / layout.SNAPSHOT_REQUEST).touch()
    together(2, place, [[*arguments(FAST, place, place), "--set", "run.snapshots=0"]])
    assert [message.cause for message in snapshots_of(place / FAST)] == ["asked for"]
    whole(place / FAST, snapshots_of(place / FAST)[0])
    assert not (place / FAST / layout.SNAPSHOT_REQUEST).exists()
    one, two = (outcome_from_json((f / layout.OUTCOME).read_bytes()) for f in (place / FAST, breaking(1, FAST)))
    assert one.digest == two.digest


def test_a_run_that_goes_on_goes_on_counting_and_tidies_up(tmp_path: Path) -> None:
    words, folder = arguments(FAST, tmp_path, tmp_path), tmp_path / FAST
    assert ended(command(2, "20", *words, module=[str(STOPPING)])).returncode == 4
    before = snapshots_of(folder)
    (folder / layout.SNAPSHOTS / "000099.snap").write_bytes(b"never announced")
    layout.share(folder, 7, 1).write_bytes(b"half")
    assert ended(command(1, str(10**9), *words, "--restart", module=[str(STOPPING)])).returncode == 0
    after = snapshots_of(folder)
    assert after[: len(before)] == before
    assert [message.n for message in after] == list(range(len(after)))
    assert len(after) > len(before)
    numbers = [f"{message.n:06d}" for message in after]
    assert sorted(path.name for path in (folder / layout.SNAPSHOTS).iterdir()) == sorted(
        f"{number}.{kind}" for number in numbers for kind in ("snap", "tets")
    )


def test_the_files_that_a_killed_run_announced_are_complete(tmp_path: Path) -> None:
    with started(command(2, "glass_steel_demo", "--out", str(tmp_path))) as launcher:
        wait_for(tmp_path / layout.JOURNAL, '"cause":"run.snapshots"', launcher)
        time.sleep(0.3)
        os.killpg(launcher.pid, signal.SIGKILL)
        launcher.wait(20.0)
    assert not wait_until_gone(processes(tmp_path))
    found = snapshots_of(tmp_path)
    assert len(found) > 1
    for message in found:
        snapshot.header_of(whole(tmp_path, message))
