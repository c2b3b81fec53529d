"""One answer with tied bonds: a tile that fractures on a plate that erodes, for any number of ranks, any
decompositions, and a restart.
"""

from pathlib import Path

import pytest

from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import layout

from .launching import command, ended, together

CASE = str(Path(__file__).with_name("bonded.toml"))
CUTS = ("balance.policy=every", "balance.every=20")


def outcome(folder: Path) -> Outcome:
    return from_json((folder / layout.OUTCOME).read_bytes())


def arguments(folder: Path, *changes: str) -> list[str]:
    return [CASE, "--out", str(folder), *(word for change in changes for word in ("--set", change))]


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    root = tmp_path_factory.mktemp("alone")
    together(1, root, [arguments(root / "run")])
    found = outcome(root / "run")
    assert found.eroded
    assert found.broken
    assert found.energy is not None
    assert found.energy.fracture > 0.0
    return found


@pytest.mark.parametrize(
    ("ranks", "threads"), [(3, 1), (1, 2), *(pytest.param(n, 1, marks=pytest.mark.slow) for n in (2, 7))]
)
def test_bonds_give_one_answer(ranks: int, threads: int, alone: Outcome, tmp_path: Path) -> None:
    changes = CUTS if ranks > 1 else ()
    together(ranks, tmp_path, [arguments(tmp_path / "run", f"run.threads={threads}", *changes)])
    found = outcome(tmp_path / "run")
    assert (found.digest, found.energy) == (alone.digest, alone.energy)


@pytest.mark.slow
def test_bonds_go_on_on_another_number_of_ranks(alone: Outcome, tmp_path: Path) -> None:
    words = arguments(tmp_path / "run", "run.max_steps=60")
    assert ended(command(2, *words)).returncode != 0
    assert ended(command(3, *arguments(tmp_path / "run"), "--restart")).returncode == 0
    assert outcome(tmp_path / "run").digest == alone.digest
