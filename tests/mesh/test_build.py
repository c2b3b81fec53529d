"""Making and reading of meshes: the cache, equal bytes every time, the limits of the child process, clear refusals."""

import hashlib
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from conoid.cases.model.bodies import Box, Cylinder, MeshFile
from conoid.worker.errors import MeshError, StoppedError
from conoid.worker.mesh import build as building
from conoid.worker.mesh.build import build, cache_folder
from conoid.worker.mesh.child import Limits, run_child
from conoid.worker.mesh.model import TetMesh
from conoid.worker.mesh.order import morton_ordered
from conoid.worker.mesh.store import load, save

BAR = Cylinder(shape="cylinder", radius=3.2e-3, length=32.4e-3, element_size=1.6e-3, sector="quarter")
BLOCK = Box(shape="box", low=(0, 0, 0), high=(1, 1, 1), element_size=0.3, generator="structured")
HERE = Path(__file__).parent


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CONOID_CACHE_DIR", str(tmp_path / "kept"))
    return cache_folder()


def same(a: TetMesh, b: TetMesh) -> bool:
    return np.array_equal(a.points, b.points) and np.array_equal(a.tets, b.tets)


def only(folder: Path) -> Path:
    (file,) = folder.iterdir()
    return file


@pytest.mark.parametrize("body", [BAR, BLOCK])
def test_two_builds_are_equal_to_the_bit(body: Box | Cylinder, cache: Path) -> None:
    first = build(body, HERE)
    only(cache).unlink()
    assert same(first, build(body, HERE))
    assert same(first, morton_ordered(first))


def test_the_second_build_comes_from_the_cache(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = build(BAR, HERE)
    monkeypatch.setattr(building, "run_child", None)
    start = time.perf_counter()
    assert same(first, build(BAR, HERE))
    assert time.perf_counter() - start < 0.2


def test_everything_that_decides_the_mesh_is_in_its_key(cache: Path) -> None:
    build(BLOCK, HERE)
    build(BLOCK.model_copy(update={"split": 5}), HERE)
    build(BLOCK.model_copy(update={"element_size": 0.5}), HERE)
    build(BLOCK, HERE)
    assert len(list(cache.iterdir())) == 3


@pytest.mark.parametrize("place", [0.0, 0.02, 0.3, 0.6, 0.99])
def test_a_damaged_cache_entry_is_made_again(place: float, cache: Path) -> None:
    first = build(BLOCK, HERE)
    file = only(cache)
    content = bytearray(file.read_bytes())
    at = int(place * len(content))
    content[at : at + 8] = bytes(255 - byte for byte in content[at : at + 8])
    file.write_bytes(content)
    assert same(first, build(BLOCK, HERE))


def test_half_a_cache_entry_is_made_again(cache: Path) -> None:
    first = build(BAR, HERE)
    file = only(cache)
    os.truncate(file, file.stat().st_size // 2)
    assert same(first, build(BAR, HERE))
    assert same(first, load(file) or first)


def test_a_cache_that_cannot_be_written_costs_only_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("CONOID_CACHE_DIR", str(tmp_path / "file"))
    assert len(build(BLOCK, HERE).tets) == 6 * 27


def test_the_cache_drops_the_least_recently_used_entry(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build(BLOCK, HERE)
    old = only(cache)
    os.utime(old, (0, 0))
    monkeypatch.setattr(building, "_CACHE_BYTES", old.stat().st_size + 1)
    build(BLOCK.model_copy(update={"split": 5}), HERE)
    assert not old.exists()
    assert len(list(cache.iterdir())) == 1


def test_a_failed_write_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file"):
        save(build(BLOCK, HERE), tmp_path / "nowhere" / "mesh.npz")
    (tmp_path / "mesh.npz").mkdir()
    with pytest.raises(OSError, match="directory"):
        save(build(BLOCK, HERE), tmp_path / "mesh.npz")
    assert [file.name for file in tmp_path.iterdir()] == ["mesh.npz"]


@pytest.mark.parametrize("path", ["rod.msh", "deep/rod.inp"])
def test_a_missing_file_is_named_with_its_key(path: str) -> None:
    file = MeshFile(shape="file", path=path, unit=1e-3)
    with pytest.raises(MeshError, match=rf"^parts\[2\]\.mesh\.path = '{path}': no such file \(/") as raised:
        build(file, HERE, "parts[2].mesh")
    assert raised.value.exit_code == 2


def test_an_address_is_not_a_file() -> None:
    with pytest.raises(MeshError, match="expected a file, not an address"):
        build(MeshFile(shape="file", path="https://example.org/rod.msh", unit=1.0), HERE)


def test_a_file_must_have_the_checksum_that_is_asked_for(tmp_path: Path) -> None:
    (tmp_path / "rod.inp").write_bytes(b"*NODE\n")
    wrong = "0" * 64
    right = hashlib.sha256(b"*NODE\n").hexdigest()
    with pytest.raises(MeshError, match=f"mesh.sha256 = '{wrong}': 'rod.inp' has {right}"):
        build(MeshFile(shape="file", path="rod.inp", unit=1.0, sha256=wrong), tmp_path)


def test_a_child_that_takes_too_long_is_stopped(tmp_path: Path) -> None:
    start = time.perf_counter()
    with pytest.raises(MeshError, match=r"mesh: not ready after 1 s and stopped"):
        run_child(BAR.model_copy(update={"element_size": 6e-5}), {}, tmp_path / "m.npz", "mesh", Limits(wall=1))
    assert time.perf_counter() - start < 5
    assert list(tmp_path.iterdir()) == []


def test_a_child_that_computes_too_long_is_stopped(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="took more than 1 s of CPU time"):
        run_child(BAR.model_copy(update={"element_size": 5e-5}), {}, tmp_path / "m.npz", "mesh", Limits(cpu=1))


def test_a_child_that_wants_too_much_memory_is_stopped(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"^mesh: .*memory") as raised:
        run_child(BAR, {}, tmp_path / "m.npz", "mesh", Limits(memory=150 * 2**20))
    assert "\n" not in str(raised.value)


def test_a_child_that_is_told_to_stop_has_not_failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A launcher sends a cancel to every process of a rank."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    (tmp_path / "sitecustomize.py").write_text("import os; os.kill(os.getpid(), 15)")
    with pytest.raises(StoppedError, match="stopped on request") as raised:
        run_child(BAR, {}, tmp_path / "m.npz", "mesh", Limits())
    assert (raised.value.state, raised.value.exit_code) == ("cancelled", 4)


def test_the_child_gets_no_secrets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment variables of the child process are selected by name; the child process prints no other variable
    of this process.
    """
    monkeypatch.setenv("CONOID_ZENOH_PASSWORD", "hunter2")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    (tmp_path / "sitecustomize.py").write_text(
        f"import os; open({str(tmp_path / 'seen')!r}, 'w').write(' '.join(os.environ.values()))"
    )
    run_child(BAR, {}, tmp_path / "m.npz", "mesh", Limits())
    assert "hunter2" not in (tmp_path / "seen").read_text()


def test_without_gmsh_the_cure_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(MeshError, match=r"mesh: gmsh is not installed here; .*generator = 'structured'"):
        build(BAR, HERE)


UNDER_LIMITS = """
import resource, sys
from pathlib import Path
from conoid.cases.model.bodies import Box
from conoid.worker.errors import MeshError
from conoid.worker.mesh.build import build
memory, cpu = (int(word) for word in sys.argv[1:])
resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
resource.setrlimit(resource.RLIMIT_CPU, (cpu, cpu))
body = Box(shape="box", low=(0, 0, 0), high=(1, 1, 1), element_size=0.5)
try:
    print(len(build(body, Path()).tets) > 0)
except MeshError as error:
    print(error)
"""


@pytest.mark.parametrize(("memory", "says"), [(3 * 2**30, "True"), (200 * 2**20, "0.195 GiB")])
def test_a_child_allocates_no_more_than_is_allowed(memory: int, says: str, cache: Path) -> None:
    """The test sets hard limits, as ``ulimit -v`` and ``ulimit -t`` or a batch system do; no user can raise such
    limits.
    """
    command = [sys.executable, "-c", UNDER_LIMITS, str(memory), "200"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert says in ended.stdout
    assert ended.stdout.count("\n") == 1
