"""A server belongs to one folder of runs and one database: any other combination is refused without a change."""

import os
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from conoid.server.__main__ import main
from conoid.server.database import identity
from conoid.server.database.identity import IdentityError
from conoid.server.database.store import Store

from .running import MakeProcess


@contextmanager
def opened(url: str) -> Iterator[Store]:
    store = Store(url)
    yield store
    store.close()


def beside(runs: Path) -> str:
    """Returns the URL of the default database, which is in the folder of runs."""
    return f"sqlite:///{runs / 'server.sqlite'}"


@pytest.fixture
def served(tmp_path: Path) -> Path:
    """A folder of runs that belongs to a server."""
    runs = tmp_path / "runs"
    runs.mkdir()
    with opened(beside(runs)) as store:
        identity.require(runs, store)
        identity.require(runs, store)
    return runs


def refusal(runs: Path, url: str) -> str:
    """Returns the error line with which the server refuses the folder. The folder and the database are unchanged after
    the refusal.
    """
    before = {path.name: path.read_bytes() for path in runs.iterdir() if path.suffix != ".sqlite"}
    with opened(url) as store:
        bond = store.bond()
        with pytest.raises(IdentityError) as raised:
            identity.require(runs, store)
        assert store.bond() == bond
    assert {path.name: path.read_bytes() for path in runs.iterdir() if path.suffix != ".sqlite"} == before
    assert "\n" not in str(raised.value)
    assert f"python -m conoid.server --runs {runs} adopt" in str(raised.value)
    return str(raised.value)


def test_a_copy_of_the_folder_is_refused_with_and_without_its_database(served: Path, tmp_path: Path) -> None:
    for name, gone in (("copy", ()), ("bare", ("server.sqlite",))):
        copy = tmp_path / name
        shutil.copytree(served, copy)
        for each in gone:
            (copy / each).unlink()
        assert f"this folder is a copy of {served}, or was moved from there" in refusal(copy, beside(copy))


@pytest.mark.parametrize("known", [True, False])
def test_another_folder_on_the_same_database_is_refused(served: Path, tmp_path: Path, known: bool) -> None:
    other = tmp_path / "other"
    other.mkdir()
    if known:
        with opened(beside(other)) as store:
            identity.require(other, store)
    assert f"its database belongs to the folder {served}" in refusal(other, beside(served))


@pytest.mark.parametrize("content", [b"", b"null", b'{"server": 1}', b"\xff\xfe", b"[" * 100_000])
def test_an_empty_file_is_refused(served: Path, content: bytes) -> None:
    (served / identity.FILE).write_bytes(content)
    assert "server.identity cannot be read" in refusal(served, beside(served))


def test_a_new_database_belongs_to_the_folder(served: Path) -> None:
    (served / "server.sqlite").unlink()
    with opened(beside(served)) as store:
        identity.require(served, store)
        assert store.bond() is not None


def test_a_link_to_the_folder_is_the_folder(served: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(served)
    with opened(beside(served)) as store:
        identity.require(tmp_path / "link", store)


@pytest.mark.parametrize("garbled", [False, True])
def test_a_folder_that_was_moved_is_served_after_adopt(
    served: Path, tmp_path: Path, garbled: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    moved = tmp_path / "moved"
    os.rename(served, moved)
    if garbled:
        (moved / identity.FILE).write_text("{")
    refusal(moved, beside(moved)) if not garbled else None
    assert main(["--runs", str(moved), "adopt"]) == 0
    assert f"belonged to {served} before" in capsys.readouterr().out
    with opened(beside(moved)) as store:
        identity.require(moved, store)


def test_a_second_master_starts_nothing_and_ends_nothing(process: MakeProcess, tmp_path: Path) -> None:
    first = process("--no-zenoh")
    ann = first.user(first.start()["url"])
    run = ann.submit(wait=str(tmp_path / "go"))
    copy = tmp_path / "copy"
    shutil.copytree(first.runs, copy)
    assert main(["--runs", str(copy), "--port", "0", "--no-zenoh"]) == 2
    assert main(["--runs", str(first.runs), "adopt"]) == 1, "a server uses it"
    (tmp_path / "go").touch()
    assert ann.wait_for(run)["state"] == "succeeded"
    with sqlite3.connect(first.runs / "server.sqlite") as database:
        assert database.execute("select count(*) from bond").fetchone() == (1,)
