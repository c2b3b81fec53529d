"""A run gives equal results to the last bit after new decompositions, after stops and restarts on other numbers of
ranks, and after kills.
"""

import contextlib
import itertools
import os
import random
import signal
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from conoid.cases.messages import Balance, Checkpoint, Frame, from_json
from conoid.cases.outcome import Outcome
from conoid.cases.outcome import from_json as outcome_from_json
from conoid.cases.output import fragments, layout

from .launching import command, ended, processes, started, together, wait_until_gone
from .scenes import FAST, SCENES, arguments

STOPPING = Path(__file__).with_name("stopping.py")
STEPS = 54
"""Number of steps of the scene with fracture."""
ERODING = Path(__file__).with_name("eroding.toml")
SEED = int(os.environ.get("CONOID_FUZZ", time.strftime("%Y%m%d")))
"""Seed of the random sample of the day; the seed is part of the names of the tests and can be set again."""
Made = Callable[[str], Path]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, breaking: Callable[[int, str], Path]) -> Made:
    """Returns the folder of an uninterrupted run on one rank, by its scene."""
    root = tmp_path_factory.mktemp("whole")

    def folder(name: str) -> Path:
        if name in SCENES:
            return breaking(1, name)
        if not (root / name).exists():
            together(1, root, [case(name, root, root)])
        return root / name

    return folder


def case(name: str, root: Path, folder: Path) -> list[str]:
    """Returns the arguments of a worker."""
    if name == "eroding":
        return [str(ERODING), "--out", str(folder / name)]
    return arguments(name, root, folder)


def outcome(folder: Path) -> Outcome:
    return outcome_from_json((folder / layout.OUTCOME).read_bytes())


def journal(folder: Path) -> list[object]:
    return [from_json(line) for line in (folder / layout.JOURNAL).read_bytes().splitlines()]


def must_be_one(whole: Path, other: Path) -> None:
    """Checks that the answer is equal, and that no piece of the output is repeated or missing."""
    one, two = outcome(whole), outcome(other)
    assert two.state == "succeeded"
    assert two.digest == one.digest
    assert (two.steps, two.energy, two.eroded, two.nodes) == (one.steps, one.energy, one.eroded, one.nodes)
    assert (two.elements, two.nodes_initial, two.worst_residual) == (
        one.elements,
        one.nodes_initial,
        one.worst_residual,
    )
    assert (other / layout.HISTORY).read_bytes() == (whole / layout.HISTORY).read_bytes()
    indices = [message.index for message in journal(other) if isinstance(message, Frame)]
    assert indices == [message.index for message in journal(whole) if isinstance(message, Frame)]
    for table in [fragments.genealogy(whole), *sorted((whole / "fragments").glob("fragments_*.csv"))]:
        if table.exists():
            assert (other / table.relative_to(whole)).read_bytes() == table.read_bytes()
    numbers = [message.seq for message in journal(other)]  # type: ignore[attr-defined]
    assert numbers == list(range(1, len(numbers) + 1))


Leg = tuple[int, int, int]
"""Numbers of ranks and of threads of each part of a run, and the step before which the part stops."""


def go(words: Sequence[str], legs: Sequence[Leg]) -> None:
    """Runs a case in several parts; the last part must reach the end of the case."""
    for k, (ranks, threads, last) in enumerate(legs):
        more = ["--threads", str(threads), "--use", "all", *(["--restart"] if k else [])]
        launched = ended(command(ranks, str(last), *words, *more, module=[str(STOPPING)]))
        assert launched.returncode == (0 if last > 10**6 else 4), launched.stdout + launched.stderr


def sample(seed: int, legs: int, steps: int) -> list[Leg]:
    """Returns random numbers of ranks, of threads and of steps."""
    draw = random.Random(seed)
    stops = sorted(draw.sample(range(2, steps), legs - 1))
    return [(draw.choice([1, 2, 3, 4, 7]), draw.choice([1, 2, 3]), stop) for stop in [*stops, 10**9]]


@pytest.mark.parametrize(
    ("name", "changes", "ranks"),
    [
        pytest.param(name, [f"balance.every={n}", f"balance.weights={w}"], r, marks=pytest.mark.slow)
        for name in [*SCENES, "eroding"] for n, w, r in ((1, "measured", 7), (3, "outside", 2), (50, "tets", 4))
    ],
)  # fmt: skip
def test_moving_tets_changes_no_bit(name: str, changes: list[str], ranks: int, whole: Made, tmp_path: Path) -> None:
    words = [word for change in ["balance.policy=every", *changes] for word in ("--set", change)]
    together(ranks, tmp_path, [[*case(name, tmp_path, tmp_path), *words]])
    must_have_moved(whole(name), tmp_path / name)


def test_moving_tets_every_five_steps_changes_no_bit(whole: Made, moving: Path) -> None:
    must_have_moved(whole(FAST), moving)


def must_have_moved(whole: Path, other: Path) -> None:
    """Checks that the answer is equal, and that tets were moved between ranks."""
    must_be_one(whole, other)
    moved = [message for message in journal(other) if isinstance(message, Balance)]
    assert len(moved) == (outcome(other).rebalances or 0) > 0
    assert sum(message.tets for message in moved) > 0


@pytest.mark.parametrize("policy", ["outside", "measured"])
@pytest.mark.slow
def test_triggers_change_no_bit(policy: str, whole: Made, tmp_path: Path) -> None:
    words = ["--set", f"balance.policy={policy}", "--set", "balance.alpha=1.01"]
    together(4, tmp_path, [[*case("instant", tmp_path, tmp_path), *words]])
    must_be_one(whole("instant"), tmp_path / "instant")
    if policy == "outside":
        assert outcome(tmp_path / "instant").rebalances


FIXED = [(2, 2, 11), (3, 1, 24), (1, 3, 10**9)]


@pytest.mark.parametrize(
    ("name", "legs"),
    [
        pytest.param("nodal", FIXED, id="nodal, fixed"),
        *(
            pytest.param(name, sample(SEED + k, 5, STEPS), id=f"{name}, sample {SEED + k}", marks=pytest.mark.slow)
            for k, name in enumerate([*SCENES, "eroding"])
        ),
    ],
)
def test_a_run_goes_on_on_other_ranks(name: str, legs: list[Leg], whole: Made, tmp_path: Path) -> None:
    go(case(name, tmp_path, tmp_path), legs)
    must_be_one(whole(name), tmp_path / name)
    kept = [message for message in journal(tmp_path / name) if isinstance(message, Checkpoint)]
    assert [message.step for message in kept] == [last for *_, last in legs[:-1]]


@pytest.mark.parametrize("kills", [2, pytest.param(50, marks=[pytest.mark.slow, pytest.mark.timeout(1200)])])
def test_a_run_survives_being_killed(kills: int, whole: Made, tmp_path: Path) -> None:
    """The run writes a checkpoint in every step and is killed at random moments, also while it writes a checkpoint;
    on other numbers of ranks and threads after each kill."""
    draw, killed, runs = random.Random(SEED), 0, itertools.count()
    while killed < kills:
        root = tmp_path / str(next(runs))
        root.mkdir()
        words = [*case("nodal", root, root), "--set", "run.checkpoint_every=1 ns"]
        killed += killed_and_ended(draw, words, root / "nodal", kills - killed)
        must_be_one(whole("nodal"), root / "nodal")


def killed_and_ended(draw: random.Random, words: list[str], folder: Path, most: int) -> int:
    """Returns how often a run was killed, at most, before it ended."""
    killed = 0
    while not (folder / layout.OUTCOME).exists() or outcome(folder).state != "succeeded":
        again = ["--restart"] if list((folder / layout.CHECKPOINTS).glob("*[0-9]")) else []
        threads = ["--threads", str(draw.choice([1, 2, 3])), "--use", "all"]
        with started(command(draw.choice([1, 2, 3]), *words, *threads, *again)) as launcher:
            limit = time.monotonic() + (draw.uniform(1.0, 3.5) if killed < most else 120.0)
            while launcher.poll() is None and time.monotonic() < limit:
                time.sleep(0.01)
            if launcher.poll() is None:
                killed += 1
                for process in [launcher.pid, *processes(folder)]:
                    _kill(process)
                wait_until_gone(processes(folder))
    return killed


def _kill(process: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, signal.SIGKILL)


def test_a_checkpoint_is_asked_for_by_a_file(whole: Made, breaking: Callable[[int, str], Path]) -> None:
    asked = breaking(2, FAST)
    must_be_one(whole(FAST), asked)
    kept = [message for message in journal(asked) if isinstance(message, Checkpoint)]
    assert [message.cause for message in kept] == ["asked for"]
    assert not (asked / layout.CHECKPOINT_REQUEST).exists()


def refused(words: Sequence[str]) -> str:
    """Returns the message of a worker that refuses to resume a run."""
    launched = ended(command(1, *words, "--restart"))
    assert launched.returncode == 2
    return launched.stderr.strip()


def test_a_run_that_cannot_be_resumed_has_a_reason(tmp_path: Path) -> None:
    words = case("nodal", tmp_path, tmp_path)
    none = f"--restart: {tmp_path / 'nodal'} has no complete checkpoint: "
    assert refused(words) == f"{none}there is none"
    go(words, [(1, 1, 4)])
    for key, value, si in (("run.end_time", "2 us", 2e-6), ("contact.friction", "0.77", 0.77)):
        message = refused([*words, "--set", f"{key}={value}"])
        assert message.startswith(f"{key} = {si}: the case of the checkpoint has ")
        assert message.endswith(" in this key; --restart resumes this case")
    assert refused([*words, "--set", "run.max_steps=4"]) == (
        "run.max_steps = 4: the checkpoint has 4 steps; set a number above 4"
    )
    file = next((tmp_path / "nodal" / layout.CHECKPOINTS).glob("*/rank-0.h5"))
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    assert refused(words) == f"{none}checkpoint 000000004 is damaged: rank-0.h5 differs from its sha256"


def test_a_run_that_has_succeeded_stays_as_it_is(tmp_path: Path) -> None:
    """Without the refusal, an attempt to resume the run would replace its outcome by a failure."""
    words = ["two_tets", "--out", str(tmp_path / "run"), "--set", "run.end_time=1 us", "--set", "run.frames=0"]
    assert ended(command(1, *words)).returncode == 0
    before = {path: path.read_bytes() for path in (tmp_path / "run").iterdir() if path.is_file()}
    assert refused(words) == f"--restart: {tmp_path / 'run'} has succeeded and has nothing left to do"
    assert all(path.read_bytes() == data for path, data in before.items())
