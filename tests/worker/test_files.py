"""Files of frames and histories: fields, units and times."""

import csv
import math
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow.parquet
import pytest

from conoid.cases.messages import Energy
from conoid.cases.output import history, layout
from conoid.worker.fracture.columns import FacetConstants, Facets, PairState, Softening
from conoid.worker.model.state import Model, Nodes
from conoid.worker.output import frames, storage
from conoid.worker.output.damage import spent_energy
from conoid.worker.output.frames import principal
from conoid.worker.output.history import History, extremes
from conoid.worker.output.journal import Journal
from conoid.worker.output.losses import Losses
from conoid.worker.output.rewind import lost, rewind
from conoid.worker.parallel.comm import Comm, SerialComm

from ..contact.ranks import on_ranks
from .kernels import Patch
from .meshes import free_tets

ENERGY = Energy(
    kinetic=2.0, elastic=1.0, plastic=0.0, viscous=0.0, contact=0.0, external=0.0, initial=3.0, residual=0.0
)


MOMENTA = [0.0, 0.0, 1.5, 0.0, 0.0, 0.0]


def write_history(folder: Path) -> None:
    table = History(folder, {"push": "N", "load": ""})
    table.write(1, 1e-7, 1e-7, "tet 1", ENERGY, [*MOMENTA, 7.0, 0.1])
    table.write(2, 2e-7, 1e-7, "tet, 2", ENERGY, [*MOMENTA, 8.0, 0.2])
    table.close()


def test_a_history_has_its_units_in_the_header(tmp_path: Path) -> None:
    write_history(tmp_path)
    with (tmp_path / layout.HISTORY).open(encoding="utf-8") as file:
        head, *lines = csv.reader(file)
    assert head[:5] == ["step", "t [s]", "dt [s]", "limiter", "kinetic [J]"]
    assert head[-3:] == ["angular_momentum_z [kg m^2/s]", "push [N]", "load"]
    assert all(len(line) == len(head) for line in lines)
    assert [history.split(text) for text in head[-2:]] == [("push", "N"), ("load", "")]


def test_a_file_of_an_earlier_worker_keeps_its_columns(tmp_path: Path) -> None:
    History(tmp_path, {"push": "N"}).close()
    table = History(tmp_path, {**history.of_parts(["rod", "ball"]), "push": "N"})
    table.write(1, 1e-7, 1e-7, "tet 1", ENERGY, [*MOMENTA, 2.0, 1.0, 0.5, 0.25, 7.0])
    table.close()
    with (tmp_path / layout.HISTORY).open(encoding="utf-8") as file:
        head, line = csv.reader(file)
    assert dict(zip(head, line, strict=True))["push [N]"] == "7.0"
    assert not any(history.part_of(name) for name in head)


def test_extremes_are_those_of_all_lines_that_have_a_number(tmp_path: Path) -> None:
    table = History(tmp_path, {"push": "N", "hole": "m"})
    for push, hole in ((7.0, math.nan), (-2.0, 3.0), (5.0, math.nan)):
        table.write(1, 1e-7, 1e-7, "tet 1", ENERGY, [*MOMENTA, push, hole])
    table.close()
    found = extremes(tmp_path, ["push", "hole", "absent"])
    assert (found["push"], found["hole"]) == ((-2.0, 7.0), (3.0, 3.0))
    assert all(math.isnan(value) for value in (*found["absent"], *extremes(tmp_path / "gone", ["push"])["push"]))


def test_a_removed_file_of_a_run_is_distinguished_from_other_files(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    table = History(folder, {})
    (folder / layout.HISTORY).unlink()
    with pytest.raises(FileNotFoundError) as raised:
        table.close()
    assert storage.gone(raised.value, folder)
    assert not storage.gone(raised.value, tmp_path / "other")
    assert not storage.gone(ValueError(str(folder)), folder)


def test_files_removed_during_a_run_are_reported_once(tmp_path: Path) -> None:
    for name in ("frames/000000.vtkhdf", "frames/000001.vtkhdf", "frames/000002.part", "snapshots/000000.snap"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    losses = Losses(tmp_path)
    assert losses.found() == []
    shutil.rmtree(tmp_path / "frames")
    (tmp_path / "snapshots/000000.snap").rename(tmp_path / "snapshots/000001.snap")
    assert losses.found() == [
        "frames: 2 files from 000000.vtkhdf to 000001.vtkhdf removed during the run; later files are written",
        "snapshots: 000000.snap removed during the run; later files are written",
    ]
    assert losses.found() == []


def test_a_journal_and_a_history_that_are_removed_take_no_more_lines(tmp_path: Path) -> None:
    """Lines that are written to an open file after its removal would be lost, and the run would end as if these lines
    existed.
    """
    journal, table = Journal(tmp_path, "r"), History(tmp_path, {})
    journal.starting("at first")
    (tmp_path / layout.JOURNAL).unlink()
    (tmp_path / layout.HISTORY).unlink()
    with pytest.raises(FileNotFoundError, match=layout.JOURNAL) as raised:
        journal.starting("at last")
    assert storage.gone(raised.value, tmp_path)
    with pytest.raises(FileNotFoundError, match=layout.HISTORY):
        table.write(1, 1e-7, 1e-7, "tet 1", ENERGY, MOMENTA)
    with pytest.raises(FileNotFoundError, match=layout.HISTORY):
        table.close()
    journal.close()


@pytest.mark.parametrize(
    ("damage", "kept"),
    [
        (lambda data: data, 2), (lambda data: b"", 0), (lambda data: data[:-9], 1), (lambda data: b"\xff\x00" * 99, 0),
        (lambda data: data.replace(b"1e-07", b"1e-Q7", 1), 1), (lambda data: data[-40:], 0),
    ],
)  # fmt: skip
def test_a_resumed_run_reports_lines_of_a_history_that_are_lost(
    damage: Callable[[bytes], bytes], kept: int, tmp_path: Path
) -> None:
    """Extremes of probes are read from the history: without the lost lines the extremes would be wrong without a
    message.
    """
    write_history(tmp_path)
    path = tmp_path / layout.HISTORY
    path.write_bytes(damage(path.read_bytes()))
    assert rewind(tmp_path, 3, 0) == kept
    assert [text.split(":")[0] for text in lost(kept, 2)] == (
        [] if kept == 2 else [f"history.csv has {kept} of the 2 lines that were written up to the checkpoint"]
    )
    write_history(tmp_path)
    assert len(path.read_text().splitlines()) == 1 + kept + 2


def test_a_history_that_is_no_file_blocks_nothing(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / layout.HISTORY)
    with pytest.raises(IsADirectoryError, match="is not a regular file"):
        rewind(tmp_path, 2, 0)


def test_one_part_alone_has_no_columns() -> None:
    assert history.of_parts(["rod"]) == {}
    assert [history.part_of(name) for name in history.of_parts(["rod", "ball"])][1:3] == [
        ("internal", "rod"), ("kinetic", "ball")
    ]  # fmt: skip
    assert history.part_of("kinetic") is None


def test_parquet_has_the_same_numbers_and_the_units(tmp_path: Path) -> None:
    write_history(tmp_path)
    table = pyarrow.parquet.read_table(tmp_path / layout.HISTORY_PARQUET)
    assert table.column("t").to_pylist() == [1e-7, 2e-7]
    assert table.column("limiter").to_pylist() == ["tet 1", "tet, 2"]
    assert table.schema.field("push").metadata == {b"unit": b"N"}
    assert rewind(tmp_path, 2, 0) == 1
    assert not (tmp_path / layout.HISTORY_PARQUET).exists(), "a run that goes on has no end yet"


def without_tets(nodes: int) -> Model:
    """Returns the model of a rank without tets, because other ranks have all tets or all tets have eroded; ``nodes``
    are the nodes of all ranks."""
    none, points, force, no = np.zeros(0, np.int32), np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros(0)
    mine = Nodes(np.zeros(0, np.int64), none, none, np.zeros(0, bool), points, points, points, no, force, no)
    return Model(mine, nodes_global=nodes)


def test_a_frame_may_come_from_ranks_without_tets(tmp_path: Path) -> None:
    """Rank 0 writes the names of the columns. In an earlier version a run failed if rank 0 had no tets, or if all
    tets had eroded."""
    model = Patch(free_tets(3, 1)).sim.model
    labels, damage = [np.arange(3)], [np.ones(3)]

    def write(models: list[Model], comm: Comm) -> None:
        mine, here = models[comm.rank], len(models[comm.rank].blocks)
        frames.write(tmp_path, len(models), 0.0, mine, comm, labels[:here], damage[:here])

    on_ranks(2, lambda comm: write([without_tets(model.nodes_global), model], comm))
    write([without_tets(0)], SerialComm())
    for index, tets in ((2, 3), (1, 0)):
        with h5py.File(layout.frame(tmp_path, index)) as file:
            cells = {name: len(values) for name, values in file["VTKHDF/CellData"].items()}
            assert {"tet", "mises", "stress", "fragment", "damage"} <= cells.keys()
            assert set(cells.values()) == {tets}
            assert len(file["VTKHDF/Types"]) == tets


def test_principal_stresses() -> None:
    """The stresses of the tets are pure shear in yz, compression along x with tension along z, and a pressure."""
    stresses = np.array([[0, 0, 0, 0, 5.0, 0], [-3.0, 0, 2.0, 0, 0, 0], [-1.0, -1.0, -1.0, 0, 0, 0]])
    assert principal(stresses) == pytest.approx([5.0, 2.0, -1.0])


def test_a_facet_is_damaged_by_the_energy_that_it_has_spent() -> None:
    """The facet has three states: whole; opened to half of the critical opening (a quarter of the area under the law is
    left); and failed."""
    m, strength, critical, knee = 3, 2.0, 6.0, 1.0
    three, nine = np.zeros((m, 3)), np.zeros((m, 3, 3))
    tops = np.repeat([[knee], [knee + 0.5 * critical], [knee + critical]], 3, axis=1)
    facets = Facets(
        np.zeros((m, 2), np.int64), np.zeros((m, 6), np.int32),
        FacetConstants(np.full(m, 0.5 * strength * critical), np.ones(m), np.ones(m)),
        Softening(three + strength, three + critical, three + knee, lent=three, offset=nine),
        PairState(tops, size=three, opening=nine, pull=nine, work=three, foreseen=nine),
    )  # fmt: skip
    assert spent_energy(facets) == pytest.approx([0.0, 0.75, 1.0])
