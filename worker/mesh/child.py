"""Child process that runs gmsh and reads foreign files: ``python -m conoid.worker.mesh.child``.

gmsh is GPL, and gmsh and any parser may crash, hang or request all memory. Therefore meshers and readers run in a
separate process. This process has limits of memory, CPU time and wall time, an environment without secrets, and an
empty working folder. The process reads one JSON request from standard input. The process writes the mesh to an .npz
file, and an error to standard error as one line.
"""

import ctypes
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from pydantic import TypeAdapter

from conoid.cases.model.bodies import Mesh, MeshFile
from conoid.cases.model.solids import Cad, Combination, Measured
from conoid.cases.run import ExitCode

from ..errors import InputError, MeshError, StoppedError
from ..run.signals import REQUESTS
from .sources import Sources

_PASSED_ON = ("HOME", "LANG", "LC_ALL", "LD_LIBRARY_PATH", "PATH", "PYTHONPATH", "TMPDIR", "VIRTUAL_ENV")
"""Environment variables that the child process gets."""

_LOOK = 0.2
"""Interval between two checks of a running child process, s."""

_FULL = 0.97
"""Fraction of the memory limit of a child process. A child process above this fraction of its limit may have too little
memory to report an error."""

_GRACE = 5
"""CPU time between the signal at the CPU limit and the end of a child process, s. Chosen value."""

_DIES_WITH_PARENT = 1
"""Number of the option PR_SET_PDEATHSIG of prctl on Linux, with which the child process ends when its parent ends."""


@dataclass(frozen=True)
class Limits:
    """Limits of a child process: address space in bytes, CPU time and wall time in s."""

    memory: int = 12 * 2**30
    cpu: int = 900
    wall: int = 900

    def allowed(self) -> "Limits":
        """Return these limits. Each limit is reduced to the hard limit of this process (``ulimit -H``) if the hard
        limit is lower.
        """
        memory, cpu = (resource.getrlimit(which)[1] for which in (resource.RLIMIT_AS, resource.RLIMIT_CPU))
        none = resource.RLIM_INFINITY
        return replace(
            self,
            memory=self.memory if memory == none else min(self.memory, memory),
            cpu=self.cpu if cpu == none else min(self.cpu, cpu),
        )


def run_child(mesh: Mesh | Mapping[str, Mesh], sources: Sources, target: Path, key: str, limits: Limits) -> None:
    """Make ``mesh`` (from the files in ``sources``) in a child process. The child process writes the mesh to
    ``target``.

    If ``mesh`` is a table of meshes, they are meshed together and written to ``beside(target, k)``. Raises MeshError
    with the message of the child process, or with the limit that it exceeded. Raises StoppedError if the run was asked
    to stop, because a launcher sends the stop signal to all processes of a rank.
    """
    limits = limits.allowed()
    request = {
        "mesh": {named: each.model_dump(mode="json") for named, each in mesh.items()}
        if isinstance(mesh, Mapping)
        else mesh.model_dump(mode="json"),
        "joint": isinstance(mesh, Mapping),
        "sources": {named: str(path) for named, path in sources.items()},
        "target": str(target),
        "key": key,
        "limits": asdict(limits),
    }
    environment = {name: os.environ[name] for name in _PASSED_ON if name in os.environ} | {"OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-P", "-m", "conoid.worker.mesh.child"]
    with tempfile.TemporaryDirectory(prefix="conoid-mesh-") as folder:
        pipe = subprocess.PIPE
        with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, cwd=folder, env=environment) as child:
            errors = _watched(child, json.dumps(request).encode(), key, limits)
    if -child.returncode in REQUESTS:
        raise StoppedError("stopped on request, before its mesh was made")
    if child.returncode != 0:
        raise MeshError(_reason(key, child.returncode, errors.decode("utf-8", "replace"), limits))


def _watched(child: subprocess.Popen[bytes], request: bytes, key: str, limits: Limits) -> bytes:
    """Wait for the end of the child process and return its standard error. If the child exceeds a limit, end it and
    raise MeshError.

    The parent also checks the memory of the child, because Python can loop for ever if not even an exception fits into
    memory.
    """
    last, message = time.monotonic() + limits.wall, request
    try:
        while True:
            try:
                return child.communicate(message, timeout=_LOOK)[1]
            except subprocess.TimeoutExpired:
                message = b""
            if time.monotonic() > last:
                raise MeshError(f"{key}: not ready after {limits.wall} s and stopped; is the mesh too fine?")
            if _address_space(child.pid) > _FULL * limits.memory:
                raise MeshError(_too_much_memory(key, limits))
    finally:
        child.kill()


def _address_space(process: int) -> int:
    """Return the address space of a process, bytes; 0 if the process has just ended or if the system has no /proc."""
    try:
        return int(Path(f"/proc/{process}/statm").read_text().split()[0]) * resource.getpagesize()
    except (OSError, IndexError, ValueError):
        return 0


def _too_much_memory(key: str, limits: Limits) -> str:
    return f"{key}: needs more memory than its limit of {limits.memory / 2**30:.3g} GiB"


def _reason(key: str, code: int, errors: str, limits: Limits) -> str:
    lines = errors.strip().splitlines()
    if code == ExitCode.BAD_INPUT and lines:
        return lines[-1]
    if -code in (signal.SIGXCPU, signal.SIGKILL):
        return f"{key}: took more than {limits.cpu} s of CPU time, or was killed; is the mesh too fine?"
    how = f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
    if -code == signal.SIGALRM:
        return f"{key}: OpenCASCADE has not read the file after two minutes; is the file damaged?"
    memory = limits.memory / 2**30
    return f"{key}: the mesh process {how} (memory limit {memory:.3g} GiB): {lines[-1] if lines else 'no message'}"


def main() -> int:
    """Process the request on standard input; return the exit code."""
    request = json.load(sys.stdin)
    limits = Limits(**request["limits"])
    limit(limits)
    key, target = str(request["key"]), Path(request["target"])
    try:
        sources = {named: Path(path) for named, path in request["sources"].items()}
        if request["joint"]:
            perform_together(TypeAdapter(dict[str, Mesh]).validate_python(request["mesh"]), sources, target)
        else:
            mesh: Mesh = TypeAdapter[Mesh](Mesh).validate_python(request["mesh"])
            perform(mesh, key, sources, target)
    except InputError as error:
        text, keys = str(error), tuple(request["mesh"]) if request["joint"] else (key,)
        return _failed(text if text.startswith(keys) else f"{key}: {text}", ExitCode.BAD_INPUT)
    except MemoryError:
        return _failed(_too_much_memory(key, limits), ExitCode.BAD_INPUT)
    except (Exception, SystemExit) as error:
        return _failed(f"{type(error).__name__}: {error}", ExitCode.CRASHED)
    return ExitCode.SUCCEEDED


def perform(mesh: Mesh, key: str, sources: Sources, target: Path) -> None:
    """Make or read a mesh, check it, order its tets and store it.

    gmsh and numpy are imported here, after the limits of the process are set.
    """
    from .model import check
    from .order import morton_ordered
    from .store import save

    if isinstance(mesh, MeshFile):
        from .read import read

        made = read(mesh, sources[key], key)
    elif isinstance(mesh, Measured):
        from .occ.solids import measured

        made = check(measured(mesh, sources, key))
    else:
        from .unstructured import unstructured

        made = check(unstructured(mesh, key))
    save(morton_ordered(made), target)


def beside(target: Path, k: int) -> Path:
    """Return the path of mesh number ``k`` if several meshes are made together."""
    return target.with_name(f"{target.stem}-{k}{target.suffix}")


def perform_together(meshes: dict[str, Mesh], sources: Sources, target: Path) -> None:
    """Make several meshes with common nodes at their interfaces, and store each mesh. The keys of ``meshes`` are the
    keys of the meshes in the case.
    """
    from .model import check
    from .order import morton_ordered
    from .store import save
    from .together import together

    drawn = {
        key: mesh
        for key, mesh in meshes.items()
        if isinstance(mesh, Cad | Combination) or not isinstance(mesh, Measured)
    }
    made = together(drawn, sources, target.stem)
    for k, mesh in enumerate(made):
        save(morton_ordered(check(mesh)), beside(target, k))


def limit(limits: Limits) -> None:
    """Set the limits of this process. On Linux the process ends when its parent ends."""
    resource.setrlimit(resource.RLIMIT_AS, (limits.memory, limits.memory))
    hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
    last = limits.cpu + _GRACE if hard == resource.RLIM_INFINITY else min(limits.cpu + _GRACE, hard)
    resource.setrlimit(resource.RLIMIT_CPU, (limits.cpu, last))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DIES_WITH_PARENT, signal.SIGKILL)


def _failed(text: str, code: int) -> int:
    print(" ".join(text.split()), file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
