"""One answer with bonds, for any number of ranks, any decompositions, and a restart: a tile that fractures is tied to a
plate that erodes; a tile that fractures and erodes forms one body with a plate that erodes.
"""

from pathlib import Path

import pytest

from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import layout

from .launching import command, ended, together

CASES = {name: str(Path(__file__).with_name(f"{name}.toml")) for name in ("bonded", "eroding_bond")}
CUTS = ("balance.policy=every", "balance.every=20")


def outcome(folder: Path) -> Outcome:
    return from_json((folder / layout.OUTCOME).read_bytes())


def arguments(case: str, folder: Path, *changes: str) -> list[str]:
    return [CASES[case], "--out", str(folder), *(word for change in changes for word in ("--set", change))]


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Outcome]:
    root = tmp_path_factory.mktemp("alone")
    together(1, root, [arguments(name, root / name) for name in CASES])
    every = {name: outcome(root / name) for name in CASES}
    for found in every.values():
        assert found.eroded
        assert found.broken
        assert found.energy is not None
        assert found.energy.fracture > 0.0
    return every


@pytest.mark.parametrize(
    ("ranks", "threads"), [(3, 1), (1, 2), *(pytest.param(n, 1, marks=pytest.mark.slow) for n in (2, 7))]
)
def test_bonds_give_one_answer(ranks: int, threads: int, alone: dict[str, Outcome], tmp_path: Path) -> None:
    changes = f"run.threads={threads}", *(CUTS if ranks > 1 else ())
    together(ranks, tmp_path, [arguments(name, tmp_path / name, *changes) for name in CASES])
    for name in CASES:
        found = outcome(tmp_path / name)
        assert (found.digest, found.energy) == (alone[name].digest, alone[name].energy)


@pytest.mark.parametrize("case", [pytest.param("bonded", marks=pytest.mark.slow), "eroding_bond"])
def test_bonds_go_on_on_another_number_of_ranks(case: str, alone: dict[str, Outcome], tmp_path: Path) -> None:
    words = arguments(case, tmp_path / "run", "run.max_steps=60")
    assert ended(command(2, *words)).returncode != 0
    assert ended(command(3, *arguments(case, tmp_path / "run"), "--restart")).returncode == 0
    assert outcome(tmp_path / "run").digest == alone[case].digest
