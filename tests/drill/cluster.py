"""Faults of a batch system: its controller, its node, the jobs, and commands that answer anything but the truth.

The Slurm is real (``tests.server.real_slurm``). The server and its jobs reach it through commands of the stand, which
do what an order says as long as there is one.
"""

import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ..server import real_slurm
from ..server.real_slurm import Cluster
from . import situations
from .stand import Stand
from .strike import Deed, Strike
from .strikes import and_killed, and_started

COMMANDS = ("squeue", "sbatch", "scancel", "scontrol", "sacct")
PROFILE = "drill"
_SITE = """
launcher = "slurm"
[slurm]
poll = 0.5
bin = "{bin}"
[slurm.profiles.drill]
partition = "low"
lines = ["export HYDRA_IFACE=lo"]
"""
_COMMAND = """#!/bin/sh
case "$(cat {order} 2>/dev/null)" in
    garbage) printf '\\377{{|||\\n7|\\n<html>502 Bad Gateway</html>\\n\\0\\n' ;;
    nothing) ;;
    half) told=$({real} "$@"); printf '%s' "$told" | head -c $(( ${{#told}} / 2 )) ;;
    fails) echo "slurm_load_jobs error: Unable to contact slurm controller (connect failure)" >&2; exit 1 ;;
    hangs) exec sleep 60 ;;
    mute) {real} "$@" >/dev/null ;;
    unheard) {real} "$@" >/dev/null; echo "error: Socket timed out on send/recv operation" >&2; exit 1 ;;
    *) exec {real} "$@" ;;
esac
"""
ANSWERS = {
    "garbage": "answers garbage", "nothing": "answers nothing", "half": "breaks off in the middle",
    "fails": "does not reach the controller", "hangs": "hangs", "mute": "does its work and says nothing",
    "unheard": "does its work and fails",
}  # fmt: skip
ALL_BUT_KILLED = tuple(life for life in situations.ALL if life is not situations.is_killed_meanwhile)
"""Where Slurm puts jobs back or knows of none any more, one whose rank is killed goes on like any other."""
ROUND = 3.0
"""s between two looks of the operator."""
AGAIN = 6
"""Starts of a run whose job is put back: by the fault, by its end, and when it gets its place again."""


@dataclass
class ClusterStand(Stand):
    """A server that hands its runs to a Slurm of this machine; ``root`` has the commands and their orders besides."""

    slots: int = 1000
    large: int = real_slurm.CORES - 3
    patience: float = 90.0
    profile: str = PROFILE
    cluster: Cluster | None = None
    mended: bool = False
    """Whether the fault is over and an operator looks round."""
    rounds: float = 0.0
    """When he looks round again."""

    def jobs(self, *states: str) -> list[str]:
        """The numbers of the jobs in one of these states."""
        assert self.cluster is not None
        return [number for number, state in self.cluster.jobs("conoid-") if state in states]

    def told(self, *words: str) -> None:
        """A command of the operator; what Slurm will not do is left undone."""
        assert self.cluster is not None
        with suppress(AssertionError):
            self.cluster.command(*words)

    def state(self, run: str) -> str:
        """Also what an operator does about jobs that wait for him."""
        if self.mended and time.monotonic() > self.rounds:
            self.rounds = time.monotonic() + ROUND
            self.operate()
        return super().state(run)

    def operate(self) -> None:
        """Slurm drains a node that it takes for faulty, holds what it cannot start, and lets a job that it has put back
        wait for two minutes. The last of these is not waited for here.
        """
        assert self.cluster is not None
        with suppress(AssertionError):
            self.cluster.resume()
        for job in self.jobs("PENDING", "REQUEUED", "REQUEUE_HOLD", "SPECIAL_EXIT"):
            self.told("scontrol", "release", job)
            self.told("scontrol", "update", f"jobid={job}", "StartTime=now", "TimeLimit=UNLIMITED")

    def close(self) -> None:
        """The jobs as well."""
        super().close()
        self.told("scancel", "--full", "--signal=KILL", "--user=root")
        self.told("scancel", "--user=root")


def stand(root: Path, cluster: Cluster) -> ClusterStand:
    """With commands of its own, which work until an order comes."""
    (root / "bin").mkdir()
    (root / "orders").mkdir()
    for name in COMMANDS:
        real = shutil.which(name) or "false"
        (root / "bin" / name).write_text(_COMMAND.format(order=root / "orders" / name, real=real))
        (root / "bin" / name).chmod(0o755)
    (root / "site.toml").write_text(_SITE.format(bin=root / "bin"))
    return ClusterStand(root, options=("--site", str(root / "site.toml")), cluster=cluster)


def mended(deed: Callable[[ClusterStand, Cluster], None]) -> Deed:
    """The end of a fault, after which an operator looks round."""

    def done(stand: Stand) -> None:
        on(deed)(stand)
        assert isinstance(stand, ClusterStand)
        stand.mended = True

    return done


def on(deed: Callable[[ClusterStand, Cluster], None]) -> Deed:
    """A deed of a stand that has a cluster."""

    def done(stand: Stand) -> None:
        assert isinstance(stand, ClusterStand)
        assert stand.cluster is not None
        stand.mended = False
        deed(stand, stand.cluster)

    return done


# The controller -------------------------------------------------------------------------------------------------------


def killed(_: ClusterStand, cluster: Cluster) -> None:
    cluster.kill()


def back(_: ClusterStand, cluster: Cluster) -> None:
    cluster.start()


def killed_often(stand: ClusterStand, cluster: Cluster) -> None:
    """It comes back twice, for as long as a look at the queue takes, and not at all in the end."""
    for pause in (0.3, 1.5):
        cluster.kill()
        time.sleep(0.2)
        cluster.start()
        time.sleep(pause)
    cluster.kill()


def hung(_: ClusterStand, cluster: Cluster) -> None:
    cluster.pause(signal.SIGSTOP)


def goes_on(_: ClusterStand, cluster: Cluster) -> None:
    cluster.pause(signal.SIGCONT)


def controllers() -> Iterator[Strike]:
    """Killed, killed several times, hung; with the server killed meanwhile."""
    away, here = on(killed), mended(back)
    still, moves = on(hung), mended(goes_on)
    yield _again("the controller killed", away, here, hold=4.0)
    yield _again("the controller killed three times", on(killed_often), here)
    yield _strike("the controller hung for 15 s", still, moves, hold=15.0)
    yield _again("the controller and the server killed", and_killed(away), and_started(here))
    yield _strike("the controller hung and the server killed", and_killed(still), and_started(moves))


# The node and the jobs ------------------------------------------------------------------------------------------------


def node(state: str) -> Callable[[ClusterStand, Cluster], None]:
    """What happens to the node."""
    return lambda stand, cluster: stand.told(
        "scontrol", "update", f"nodename={cluster.host}", f"state={state}", "reason=drill"
    )


def resumed(_: ClusterStand, cluster: Cluster) -> None:
    cluster.resume()


def daemon_killed(_: ClusterStand, cluster: Cluster) -> None:
    subprocess.run(["kill", "-9", (cluster.place / "slurmd.pid").read_text().strip()], check=True)


def daemon_back(stand: ClusterStand, cluster: Cluster) -> None:
    subprocess.run(["slurmd", "-f", str(cluster.conf), "-N", cluster.host], check=True, timeout=60)
    resumed(stand, cluster)


def looked_after(_: ClusterStand, __: Cluster) -> None:
    """The operator does the rest."""


def preempted(stand: ClusterStand, _: Cluster) -> None:
    """Somebody with more rights wants every core."""
    wants = ("-p", "high", "-n", str(real_slurm.CORES), "-o", "/dev/null", "--wrap", "sleep 4")
    stand.told("sbatch", *wants)
    time.sleep(3.0)


def each(state: str, *words: str) -> Callable[[ClusterStand, Cluster], None]:
    """A command of the operator for each job in a state."""

    def done(stand: ClusterStand, _: Cluster) -> None:
        for job in stand.jobs(state):
            stand.told(*words, job)

    return done


def limited(stand: ClusterStand, _: Cluster) -> None:
    """The time of all that run is nearly over."""
    for job in stand.jobs("RUNNING"):
        stand.told("scontrol", "update", f"jobid={job}", "TimeLimit=1")


def nodes() -> Iterator[Strike]:
    """The node drained, down, without its daemon; jobs preempted, put back, held, at their time limit."""
    yield _strike("the node drained", on(node("drain")), mended(resumed), hold=4.0)
    yield _strike("the node's daemon killed", on(daemon_killed), mended(daemon_back), hold=4.0)
    again = mended(looked_after)
    yield _again("the node down", on(node("down")), mended(resumed), hold=4.0)
    yield _again("the jobs preempted", on(preempted), again, hold=4.0)
    yield _again("the jobs put back by an operator", on(each("RUNNING", "scontrol", "requeue")), again)
    yield _again("the jobs put back and held", on(each("RUNNING", "scontrol", "requeuehold")), again)
    yield _strike("the jobs that wait held", on(each("PENDING", "scontrol", "hold")), again)
    yield _again("the jobs at their time limit", on(limited), again, hold=75.0)


# Commands that do not tell the truth ----------------------------------------------------------------------------------


def ordered(what: str, *names: str) -> Deed:
    """These commands do so from now on."""

    def deed(stand: Stand) -> None:
        for name in names:
            (stand.root / "orders" / name).write_text(what)

    return deed


def obeyed(stand: Stand) -> None:
    """They tell the truth again."""
    for path in (stand.root / "orders").iterdir():
        path.unlink()


def commands() -> Iterator[Strike]:
    """Lists that are none, jobs that are made without an answer, ends that nobody is told of."""
    answers: dict[str, tuple[str, ...]] = {
        "squeue": ("garbage", "half", "fails", "hangs"), "sbatch": ("garbage", "nothing", "mute", "unheard", "fails"),
        "scancel": ("fails", "nothing", "unheard"), "scontrol": ("garbage", "nothing", "fails"),
    }  # fmt: skip
    for name, kinds in answers.items():
        for what in kinds:
            yield _strike(f"{name} {ANSWERS[what]}", ordered(what, name), obeyed, hold=4.0)
    yield _again("squeue answers nothing", ordered("nothing", "squeue"), obeyed, hold=4.0)
    yield _strike("every command answers garbage", ordered("garbage", *COMMANDS), obeyed, hold=4.0)
    yield _strike("every command fails", ordered("fails", *COMMANDS), obeyed, hold=4.0)


def _strike(name: str, deed: Deed, lift: Deed, hold: float = 2.5) -> Strike:
    return Strike(name, "controller", deed, lift, "slurm", hold=hold)


def _again(name: str, deed: Deed, lift: Deed, hold: float = 2.5) -> Strike:
    return Strike(name, "controller", deed, lift, "slurm", hold=hold, lives=ALL_BUT_KILLED, launches=AGAIN)


def everything() -> list[Strike]:
    """All of them, in the order in which they are tried."""
    return [*controllers(), *nodes(), *commands()]
