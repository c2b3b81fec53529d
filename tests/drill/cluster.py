"""Faults of a batch system: faults of its controller, node, jobs and commands.

The Slurm of the drill is real (``tests.server.real_slurm``). The server and its jobs call wrapper scripts of the stand
in place of the Slurm commands. A wrapper script fails as its order file describes; without an order file the script
calls the command.
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
    half) answer=$({real} "$@"); printf '%s' "$answer" | head -c $(( ${{#answer}} / 2 )) ;;
    fails) echo "slurm_load_jobs error: Unable to contact slurm controller (connect failure)" >&2; exit 1 ;;
    hangs) exec sleep 60 ;;
    mute) {real} "$@" >/dev/null ;;
    unheard) {real} "$@" >/dev/null; echo "error: Socket timed out on send/recv operation" >&2; exit 1 ;;
    *) exec {real} "$@" ;;
esac
"""
ANSWERS = {
    "garbage": "answers garbage", "nothing": "answers nothing", "half": "breaks off in the middle",
    "fails": "does not reach the controller", "hangs": "hangs", "mute": "does its work and prints nothing",
    "unheard": "does its work and fails",
}  # fmt: skip
ALL_BUT_KILLED = tuple(life for life in situations.ALL if life is not situations.is_killed_meanwhile)
"""Situations after faults in which Slurm requeues or loses jobs. The situation of a killed rank is left out, because
its run continues in the same way as all other runs."""
ROUND = 3.0
"""Time in s between two actions of the operator."""
AGAIN = 6
"""Largest number of starts of a run whose Slurm job is requeued: after the fault, after the end of the fault, and when
the job is scheduled again."""


@dataclass
class ClusterStand(Stand):
    """A server that submits its runs to a Slurm on this machine; ``root`` also contains the wrapper scripts and their
    order files."""

    slots: int = 1000
    large: int = real_slurm.CORES - 3
    patience: float = 90.0
    profile: str = PROFILE
    cluster: Cluster | None = None
    mended: bool = False
    """True if the fault has ended and the operator acts."""
    rounds: float = 0.0
    """Time of the next action of the operator."""

    def jobs(self, *states: str) -> list[str]:
        """Returns the numbers of the Slurm jobs in one of the given states."""
        assert self.cluster is not None
        return [number for number, state in self.cluster.jobs("conoid-") if state in states]

    def run_command(self, *words: str) -> None:
        """Runs a command of the operator; a refusal by Slurm is ignored."""
        assert self.cluster is not None
        with suppress(AssertionError):
            self.cluster.command(*words)

    def state(self, run: str) -> str:
        """Returns the state of a run; before that, the operator treats the Slurm jobs that need an action."""
        if self.mended and time.monotonic() > self.rounds:
            self.rounds = time.monotonic() + ROUND
            self.operate()
        return super().state(run)

    def operate(self) -> None:
        """Acts as an operator of Slurm: resumes a drained node, releases held jobs, and starts requeued jobs at once.
        Slurm itself would delay a requeued job by two minutes.
        """
        assert self.cluster is not None
        with suppress(AssertionError):
            self.cluster.resume()
        for job in self.jobs("PENDING", "REQUEUED", "REQUEUE_HOLD", "SPECIAL_EXIT"):
            self.run_command("scontrol", "release", job)
            self.run_command("scontrol", "update", f"jobid={job}", "StartTime=now", "TimeLimit=UNLIMITED")

    def close(self) -> None:
        """Ends the server and all Slurm jobs."""
        super().close()
        self.run_command("scancel", "--full", "--signal=KILL", "--user=root")
        self.run_command("scancel", "--user=root")


def stand(root: Path, cluster: Cluster) -> ClusterStand:
    """Returns a stand whose wrapper scripts call the Slurm commands until the scripts get an order."""
    (root / "bin").mkdir()
    (root / "orders").mkdir()
    for name in COMMANDS:
        real = shutil.which(name) or "false"
        (root / "bin" / name).write_text(_COMMAND.format(order=root / "orders" / name, real=real))
        (root / "bin" / name).chmod(0o755)
    (root / "site.toml").write_text(_SITE.format(bin=root / "bin"))
    return ClusterStand(root, options=("--site", str(root / "site.toml")), cluster=cluster)


def mended(deed: Callable[[ClusterStand, Cluster], None]) -> Deed:
    """Returns a function that ends a fault; after its call the operator acts."""

    def done(stand: Stand) -> None:
        on(deed)(stand)
        assert isinstance(stand, ClusterStand)
        stand.mended = True

    return done


def on(deed: Callable[[ClusterStand, Cluster], None]) -> Deed:
    """Converts a function that needs the stand and its cluster into a function of the stand."""

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
    """Restarts the controller twice, each time for about the time of one query of the queue, and leaves the controller
    killed.
    """
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
    """Yields the faults of the controller: killed, killed several times, hung; in some faults the server is also
    killed.
    """
    away, here = on(killed), mended(back)
    still, moves = on(hung), mended(goes_on)
    yield _again("the controller killed", away, here, hold=4.0)
    yield _again("the controller killed three times", on(killed_often), here)
    yield _strike("the controller hung for 15 s", still, moves, hold=15.0)
    yield _again("the controller and the server killed", and_killed(away), and_started(here))
    yield _strike("the controller hung and the server killed", and_killed(still), and_started(moves))


# The node and the jobs ------------------------------------------------------------------------------------------------


def node(state: str) -> Callable[[ClusterStand, Cluster], None]:
    """Returns a function that sets the state of the node."""
    return lambda stand, cluster: stand.run_command(
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
    """Does nothing: the operator ends the fault."""


def preempted(stand: ClusterStand, _: Cluster) -> None:
    """Submits a Slurm job of higher priority that needs every core."""
    wants = ("-p", "high", "-n", str(real_slurm.CORES), "-o", "/dev/null", "--wrap", "sleep 4")
    stand.run_command("sbatch", *wants)
    time.sleep(3.0)


def each(state: str, *words: str) -> Callable[[ClusterStand, Cluster], None]:
    """Returns a function that runs a command of the operator for each Slurm job in a state."""

    def done(stand: ClusterStand, _: Cluster) -> None:
        for job in stand.jobs(state):
            stand.run_command(*words, job)

    return done


def limited(stand: ClusterStand, _: Cluster) -> None:
    """Sets the time limit of all running Slurm jobs to one minute."""
    for job in stand.jobs("RUNNING"):
        stand.run_command("scontrol", "update", f"jobid={job}", "TimeLimit=1")


def nodes() -> Iterator[Strike]:
    """Yields the faults of node and jobs: node drained, down, without its daemon; jobs preempted, requeued, held, at
    their time limit."""
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
    """Returns a function that gives an order to the named wrapper scripts."""

    def deed(stand: Stand) -> None:
        for name in names:
            (stand.root / "orders" / name).write_text(what)

    return deed


def obeyed(stand: Stand) -> None:
    """Removes all orders, so that the wrapper scripts call the Slurm commands again."""
    for path in (stand.root / "orders").iterdir():
        path.unlink()


def commands() -> Iterator[Strike]:
    """Yields the faults of commands: wrong lists of jobs, and commands that work but do not answer."""
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
    """Returns all faults of the batch system, in the order in which the drill tries the faults."""
    return [*controllers(), *nodes(), *commands()]
