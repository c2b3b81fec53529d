"""Twenty faults of the drill on one server: the tests of every day. All of them: ``python -m tests.drill``."""

import errno
from collections.abc import Iterator
from pathlib import Path

import pytest

from conoid.cases import layout

from . import damage, strike, strikes
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
"""On the server that the strike has left; four of them run, which leaves one slot for the others."""


@pytest.fixture
def stand(tmp_path: Path) -> Iterator[Stand]:
    made = Stand(tmp_path, patience=60.0)
    assert made.start(), made.said()
    yield made
    made.close()


@pytest.mark.timeout(900)
def test_twenty_faults_leave_every_state_true(stand: Stand) -> None:
    struck = list(strike.rows(stand, DISK))
    found: list[Row] = [*struck, *damage.rows(stand, FILES)]
    assert len(found) >= 20
    assert [f"{row.fault}: {row.verdict}" for row in found if row.verdict != TRUE] == []
