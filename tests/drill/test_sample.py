"""Test of twenty faults of the drill on one server. The command ``python -m tests.drill`` tries all faults."""

import errno
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from conoid.cases.output import layout

from . import damage, strike, strikes, table
from .damage import CASE, Damage
from .judge import TRUE, Row
from .stand import Stand
from .strike import Strike

DISK = Strike(
    "no space, and the server killed", "storage", strikes.and_killed(strikes.fails(errno.ENOSPC)),
    strikes.and_started(strikes.mend), hold=0.5,
)  # fmt: skip
FILES = (
    Damage(layout.SUBMISSION, "garbled", "runs", False), Damage(layout.WORKER, "a folder in its place", "runs", False),
    Damage(layout.LOGS, "deleted", "runs", False), Damage("", "deleted", "runs", False),
    Damage(layout.SUBMISSION, "deleted", "has ended", False), Damage(CASE, "garbled", "has ended", False),
    Damage(layout.JOURNAL, "garbled", "has ended", False),
    Damage(layout.JOURNAL, "a folder in its place", "has ended", False),
    Damage(layout.OUTCOME, "cut to half", "has ended", False),
    Damage(layout.OUTCOME, "a folder in its place", "has ended", False),
    Damage(layout.LOGS, "a file in its place", "has ended", False), Damage("", "deleted", "has ended", False),
)  # fmt: skip
"""Damages that are tried on the server after the strike. Four of the runs use cores, which leaves one slot for the
other runs."""


@pytest.fixture
def stand(tmp_path: Path) -> Iterator[Stand]:
    made = Stand(tmp_path, patience=60.0)
    assert made.start(), made.last_line()
    yield made
    made.close()


@pytest.mark.timeout(900)
def test_twenty_faults_leave_every_state_true(stand: Stand) -> None:
    struck = list(strike.rows(stand, DISK))
    found: list[Row] = [*struck, *damage.rows(stand, FILES)]
    assert len(found) >= 20
    assert [f"{row.fault}: {row.verdict}" for row in found if row.verdict != TRUE] == []


def test_no_request_waits_longer_than_its_limit_for_a_server_that_hangs(tmp_path: Path) -> None:
    """A request to a hung server must give up, otherwise a fault of three seconds would take minutes."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        stand = Stand(tmp_path, http=httpx2.Client(base_url=f"http://127.0.0.1:{silent.getsockname()[1]}"))
        began = time.monotonic()
        with stand.giving_up(0.2):
            assert stand.ask("GET", "/v1/me")[0] == 0
        assert time.monotonic() < began + 5.0


def test_the_table_names_what_was_not_tried(tmp_path: Path) -> None:
    row = Row("a fault", "kill", "succeeded", 1.0, TRUE)
    assert table.write(tmp_path / "faults.md", [row], ["the server paused for 3 s"]) == 0
    assert "groups not tried, 1: the server paused for 3 s" in (tmp_path / "faults.md").read_text()
