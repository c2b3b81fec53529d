"""Cost of snapshots of the fragments per step: the command is
``python -m tests.bench.snapshots --ranks 4 --readers 20 --frozen``.

Steps with and without snapshots are compared within one run, as in ``switch``, because two processes differ by more
than the cost of snapshots. Blocks of steps come in pairs: one block with snapshots as often as allowed, one block
without snapshots, in random order. The measured value is the CPU time of the solver threads of all ranks, without
waiting. The readers subscribe to all keys over Zenoh.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from conoid.cases.outcome import from_json
from conoid.cases.output import layout

from . import router, switch
from .switch import Block, Pairs

_PREFIX = "conoid/v1/bench/run"
_MARKS = "marks"
_ROOT = Path(__file__).parents[2]


def measure(options: argparse.Namespace, folder: Path) -> tuple[Pairs, float]:
    """Pairs of blocks of a run, and the fraction of the CPU time that the solver spends in calls for snapshots."""
    with ExitStack() as stack:
        _, endpoint = stack.enter_context(router.started())
        for frozen in [False] * bool(options.readers) + [True] * options.frozen:
            stack.enter_context(_readers(endpoint, 1 if frozen else options.readers, frozen))
        mpiexec = str(Path(sys.executable).with_name("mpiexec"))
        mine = [sys.executable, "-m", "mpi4py", "-m", "tests.bench.snapshots", "--worker", str(options.steps)]
        words = [options.case, "--out", str(folder), "--telemetry", endpoint, "--prefix", _PREFIX]
        words += ["--set", f"run.max_steps={(2 * options.pairs + 1) * options.steps + 1}", "--set", "run.frames=0"]
        words += [
            "--set",
            "run.checkpoint_every=none",
            "--set",
            "run.snapshots=100000",
            "--set",
            "balance.policy=never",
        ]
        command = [mpiexec, "-n", str(options.ranks), *mine, *words, "--set", "reference=[]"]
        subprocess.run(command, cwd=_ROOT, check=False)
    marks = [json.loads((folder / f"{_MARKS}.{rank}").read_text()) for rank in range(options.ranks)]
    blocks = _blocks(marks, options.pairs, options.steps)
    switched_on = [k for k, block in enumerate(blocks) if block.live]
    within = sum(rank[k + 1][3] - rank[k][3] for rank in marks for k in switched_on)
    return Pairs("snapshots", blocks), within / (options.steps * sum(blocks[k].cpu for k in switched_on))


def _blocks(marks: list[list[list[float]]], pairs: int, steps: int) -> list[Block]:
    """Returns the CPU times of solver and other threads, the wall time, and the time within the calls, from the marks
    of each rank at the ends of the blocks."""
    blocks = []
    for k, live in zip(range(min(map(len, marks)) - 1), switch.turns(pairs), strict=False):
        spent = [[(b - a) / steps for a, b in zip(rank[k], rank[k + 1], strict=True)] for rank in marks]
        blocks.append(Block(live, sum(s[0] for s in spent), sum(s[1] for s in spent), spent[0][2]))
    return blocks[: len(blocks) // 2 * 2]


@contextmanager
def _readers(endpoint: str, number: int, frozen: bool) -> Iterator[None]:
    words = [sys.executable, "-m", "tests.bench.snapshots", "--reader", endpoint, str(number)]
    with subprocess.Popen(words, cwd=_ROOT, stdout=subprocess.PIPE) as reader:
        try:
            assert reader.stdout is not None
            reader.stdout.readline()
            if frozen:
                reader.send_signal(signal.SIGSTOP)
            yield
        finally:
            reader.kill()


def _read(endpoint: str, number: int) -> None:
    """Runs some readers in this process, until the process is killed."""
    import zenoh

    config = zenoh.Config()
    for key, value in {
        "mode": "client", "connect/endpoints": [endpoint], "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
    }.items():  # fmt: skip
        config.insert_json5(key, json.dumps(value))
    sessions = [zenoh.open(config) for _ in range(number)]
    received = [session.declare_subscriber("conoid/**", lambda sample: None) for session in sessions]
    print("ready", len(received), flush=True)
    signal.pause()


def _work(steps: int, arguments: list[str]) -> int:
    """Runs the worker and switches snapshots on and off every ``steps`` steps. The worker writes a mark at the end of
    each block."""
    from conoid.worker.accounts.timers import worked
    from conoid.worker.run import main

    begin = main.ready_kernels

    def ready(comm: Any, journal: Any) -> None:
        begin(comm, journal)
        from conoid.worker.snapshots.stage import Snapshots

        marks: list[list[float]] = []
        turns, within = switch.turns(1000), [0.0]

        def timed(work: Callable[..., Any]) -> Callable[..., Any]:
            def call(*words: Any, **named: Any) -> Any:
                start = time.thread_time()
                try:
                    return work(*words, **named)
                finally:
                    within[0] += time.thread_time() - start

            return call

        look, due = timed(Snapshots.look), timed(Snapshots.due)

        def marked(self: Any, sim: Any, *, due: bool, ending: bool) -> None:
            if sim.clock.step and sim.clock.step % steps == 0:
                mine = worked(sim.comm)
                marks.append([mine, time.process_time() - time.thread_time(), time.perf_counter(), within[0]])
                place = Path(arguments[arguments.index("--out") + 1])
                (place / f"{_MARKS}.{sim.comm.rank}").write_text(json.dumps(marks))
            look(self, sim, due=due, ending=ending)

        def switched(self: Any, clock: Any, now: float, *, look: bool) -> bool:
            k = clock.step // steps - 1
            return bool(k >= 0 and turns[min(k, len(turns) - 1)] and due(self, clock, now, look=look))

        Snapshots.look, Snapshots.due = marked, switched  # type: ignore[method-assign]
        Snapshots.tell = timed(Snapshots.tell)  # type: ignore[method-assign]

    main.ready_kernels = ready
    return main.main(arguments)


def main() -> None:
    """Prints the medians of the CPU times, their ratio with its interval, and the number of snapshots."""
    if "--worker" in sys.argv:
        sys.exit(_work(int(sys.argv[2]), sys.argv[3:]))
    if "--reader" in sys.argv:
        _read(sys.argv[2], int(sys.argv[3]))
    parser = argparse.ArgumentParser()
    parser.add_argument("--case", default="glass_steel_bar")
    for name, value in {"ranks": 1, "readers": 0, "pairs": 15, "steps": 25}.items():
        parser.add_argument(f"--{name}", type=int, default=value)
    parser.add_argument("--frozen", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="conoid-bench-") as out:
        (pairs, share), folder = measure(options, Path(out)), Path(out)
        made = len(list((folder / layout.SNAPSHOTS).glob("*.snap")))
        ended = from_json((folder / layout.OUTCOME).read_bytes())
    for what in ("cpu", "wall"):
        middle, low, high = pairs.ratio(what)
        with_, without = (1e3 * pairs.median(live, what) for live in (True, False))
        print(
            f"{what}: {with_:.3f} ms a step with, {without:.3f} without, ratio {middle:.4f} ({low:.4f} to {high:.4f})"
        )
    print(f"in the calls for snapshots: {100 * share:.3f} % of the CPU time of the blocks with them")
    print(
        f"{made} snapshots in {ended.elapsed:.0f} s on {os.cpu_count()} cores, {ended.steps} steps, {ended.digest[:16]}"
    )


if __name__ == "__main__":
    main()
