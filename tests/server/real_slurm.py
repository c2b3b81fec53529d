"""A Slurm of one node on this machine, which tests start as root, without systemd, cgroups or a database."""

import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

NEEDED = ("slurmctld", "slurmd", "munged", "sbatch")
PACKAGES = "slurm-wlm munge"
CORES = 8
"""Number of cores in the configuration of the node, independent of the machine. This number of runs with one core can
run at the same time."""
_PATIENCE = 60.0

_CONF = """
ClusterName=conoid
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={place}/munge.socket
SlurmctldPort={controller}
SlurmdPort={daemon}
StateSaveLocation={place}/state
SlurmdSpoolDir={place}/spool
SlurmctldPidFile={place}/slurmctld.pid
SlurmdPidFile={place}/slurmd.pid
SlurmctldLogFile={place}/slurmctld.log
SlurmdLogFile={place}/slurmd.log
SlurmdParameters=config_overrides
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=bf_interval=2,sched_min_interval=100000,sched_interval=5
MpiDefault=none
ReturnToService=2
KillWait=30
MinJobAge=3600
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} State=UNKNOWN
PartitionName=low Nodes={host} Default=YES MaxTime=INFINITE State=UP PriorityTier=1 PreemptMode=REQUEUE GraceTime=0
PartitionName=grace Nodes={host} MaxTime=INFINITE State=UP PriorityTier=1 PreemptMode=REQUEUE GraceTime=60
PartitionName=gone Nodes={host} MaxTime=INFINITE State=UP PriorityTier=1 PreemptMode=CANCEL
PartitionName=high Nodes={host} MaxTime=INFINITE State=UP PriorityTier=10 PreemptMode=OFF
"""


def missing() -> str:
    """Returns the reason why no Slurm can be started on this machine; empty if Slurm can be started."""
    absent = [name for name in NEEDED if shutil.which(name) is None]
    if absent:
        return f"{', '.join(absent)}: not installed (apt-get install {PACKAGES}; make drill does it)"
    return "" if os.geteuid() == 0 else "only root can start slurmd and munged"


@dataclass
class Cluster:
    """A running Slurm with actions for tests."""

    place: Path
    conf: Path
    host: str

    def command(self, *words: str) -> str:
        """Runs a command of Slurm and returns its output."""
        done = subprocess.run(
            words, env={**os.environ, "SLURM_CONF": str(self.conf)}, capture_output=True, text=True, timeout=60,
            check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def jobs(self, name: str) -> list[tuple[str, str]]:
        """Returns the number and the state of all Slurm jobs whose names begin with ``name``."""
        rows = [row.split("|") for row in self.command("squeue", "-h", "-t", "all", "-o", "%i|%T|%j").splitlines()]
        return [(row[0], row[1]) for row in rows if len(row) > 2 and row[2].startswith(name)]

    def start(self) -> None:
        """Starts the controller of Slurm."""
        subprocess.run(["slurmctld", "-f", str(self.conf)], check=True, timeout=60, env=self._env())

    def kill(self) -> None:
        """Kills the controller of Slurm, which simulates a crash."""
        with suppress(OSError, ValueError):
            os.kill(int((self.place / "slurmctld.pid").read_text()), signal.SIGKILL)

    def pause(self, number: signal.Signals) -> None:
        """Sends a signal to the controller of Slurm."""
        os.kill(int((self.place / "slurmctld.pid").read_text()), number)

    def await_node(self) -> None:
        """Waits until the node accepts Slurm jobs."""
        deadline, state = time.monotonic() + _PATIENCE, "unknown"
        while time.monotonic() < deadline:
            with suppress(AssertionError):
                state = self.resume()
                if state in {"idle", "mixed", "allocated"}:
                    return
            time.sleep(0.2)
        raise AssertionError(f"the node is {state}, not ready: {(self.place / 'slurmctld.log').read_text()[-2000:]}")

    def resume(self) -> str:
        """Returns the state of the node. A node that is out of service is put into service again."""
        state = self.command("sinfo", "-h", "-o", "%T").splitlines()[0]
        if "drain" in state or "down" in state:
            self.command("scontrol", "update", f"nodename={self.host}", "state=resume")
        return state

    def _env(self) -> dict[str, str]:
        return {**os.environ, "SLURM_CONF": str(self.conf)}


@contextmanager
def running(place: Path) -> Iterator[Cluster]:
    """Starts a cluster with its state below ``place`` and sets SLURM_CONF; afterwards ends the cluster with all its
    jobs.
    """
    for name in ("state", "spool"):
        (place / name).mkdir(parents=True)
    for parent in (place, *place.parents):
        if parent.stat().st_uid == os.geteuid() and parent != Path("/") and not parent.stat().st_mode & 0o001:
            parent.chmod(parent.stat().st_mode | 0o011)
    host = socket.gethostname().partition(".")[0]
    conf = place / "slurm.conf"
    controller, daemon = _free_ports(2)
    conf.write_text(_CONF.format(place=place, host=host, controller=controller, daemon=daemon, cores=CORES))
    cluster, before = Cluster(place, conf, host), os.environ.get("SLURM_CONF")
    os.environ["SLURM_CONF"] = str(conf)
    munged = _munged(place)
    try:
        cluster.start()
        subprocess.run(["slurmd", "-f", str(conf), "-N", host], check=True, timeout=60)
        cluster.await_node()
        yield cluster
    finally:
        _end(cluster)
        munged.terminate()
        munged.wait(20)
        os.environ.pop("SLURM_CONF")
        if before is not None:
            os.environ["SLURM_CONF"] = before


def _munged(place: Path) -> "subprocess.Popen[bytes]":
    """Starts a munge daemon with its own key."""
    key = place / "munge.key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o600)
    words = [f"--{name}-file={place}/munge.{name}" for name in ("key", "pid", "log", "seed")]
    munged = subprocess.Popen(
        ["munged", "--foreground", "--force", f"--socket={place}/munge.socket", *words], stderr=subprocess.DEVNULL
    )
    deadline = time.monotonic() + _PATIENCE
    while not (place / "munge.socket").exists():
        assert munged.poll() is None, "munged ended at its start"
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return munged


def _end(cluster: Cluster) -> None:
    with suppress(AssertionError, subprocess.TimeoutExpired):
        cluster.command("scancel", "--full", "--signal=KILL", "--user=root")
        cluster.command("scancel", "--user=root")
    for name in ("slurmctld", "slurmd"):
        with suppress(OSError, ValueError):
            os.kill(int((cluster.place / f"{name}.pid").read_text()), signal.SIGKILL)
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            mine = entry.name.isdigit() and str(cluster.place).encode() in (entry / "environ").read_bytes()
            if mine and b"slurmstepd" in (entry / "cmdline").read_bytes():
                os.kill(int(entry.name), signal.SIGKILL)


def _free_ports(number: int) -> list[int]:
    probes = [socket.socket() for _ in range(number)]
    for probe in probes:
        probe.bind(("127.0.0.1", 0))
    ports = [int(probe.getsockname()[1]) for probe in probes]
    for probe in probes:
        probe.close()
    return ports
