"""The committed digests are reproduced, also on other machines and with other versions of the compiler of the
kernels.
"""

import importlib
import platform
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path

import pytest

from conoid.cases.outcome import from_json
from conoid.cases.output import layout

from .launching import together
from .scenes import CASE

KNOWN: dict[str, str] = tomllib.loads(Path(__file__).with_name("digests.toml").read_text(encoding="utf-8"))
SHORT = {
    "shock_copper": "0.3 us", "spinning_cube": "10 us", "crossed_bars": "1 us", "plate_stack": "1 us",
    "taylor_copper": "3 us", "triaxial_glass": "2 us", "free_tets": "5 us",
}  # fmt: skip
"""Shipped cases whose meshes are made without gmsh, and the end times of the cases in this test."""
GIVEN = ("breaking", "eroding", "colliding", "holding")
"""Scenes of this folder that run to their end times."""
EVERYWHERE = [*SHORT, *GIVEN, *(f"shattering_{form}" for form in ("standard", "nodal", "split"))]
PLAIN = "-AVX2,-FMA,-AVX2_Usable,-FMA_Usable"
"""Settings that disable optimised functions of the C library, by the names of the settings in its versions."""
AT_ONCE = ("model=instant", "delay=0")
"""Fracture table of the bodies of ``shattering``."""


def shattering() -> str:
    """Returns the scene with fracture, with the model ``instant`` and one strength for each material."""
    lines = CASE.read_text(encoding="utf-8").splitlines()
    return "\n".join(line for line in lines if not line.startswith(("brittle.scatter", "fracture")))


def arguments(name: str, place: Path, threads: int, changes: Sequence[str]) -> list[str]:
    """Returns the arguments of the worker for a scene, by the name of the scene."""
    case, form = name, name.partition("_")[2]
    words = ["run.frames=0", "run.samples=10", "reference=[]", f"run.threads={threads}", *changes]
    if name in SHORT:
        words.append(f"run.end_time={SHORT[name]}")
    elif name in GIVEN:
        case = str(CASE.with_name(f"{name}.toml"))
    else:
        case = str(place / "shattering.toml")
        words += [f"numerics.pressure={form}", *(f"parts[{k}].fracture.{each}" for k in (0, 1) for each in AT_ONCE)]
    return [case, *(word for change in words for word in ("--set", change)), "--out", str(place / name), "--use", "all"]


def ended(place: Path, ranks: int, threads: int, changes: Sequence[str] = ()) -> dict[str, str]:
    """Returns the digest of every scene, by the name of the scene."""
    (place / "shattering.toml").write_text(shattering(), encoding="utf-8")
    together(ranks, place, [arguments(name, place, threads, changes) for name in EVERYWHERE])
    ends = {name: from_json((place / name / layout.OUTCOME).read_bytes()) for name in EVERYWHERE}
    assert {end.state for end in ends.values()} == {"succeeded"}
    assert all((end.broken or 0) > 100 for name, end in ends.items() if name.startswith(("shattering", "breaking")))
    return {name: str(end.digest)[:16] for name, end in ends.items()}


@pytest.fixture(scope="module")
def digests(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Returns the digests of all scenes on two ranks of two threads."""
    return ended(tmp_path_factory.mktemp("digests"), 2, 2)


@pytest.mark.parametrize("name", EVERYWHERE)
def test_the_digest_is_the_committed_one(name: str, digests: dict[str, str]) -> None:
    assert digests[name] == KNOWN[name]


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("ranks", [1, 2, 3, 7, 16])
def test_it_is_on_any_number_of_ranks_and_threads(ranks: int, threads: int, tmp_path: Path) -> None:
    assert ended(tmp_path, ranks, threads) == KNOWN


@pytest.mark.slow
@pytest.mark.parametrize(("ranks", "threads"), [(3, 2), (7, 1)])
def test_it_is_with_a_cut_every_fifty_steps(ranks: int, threads: int, tmp_path: Path) -> None:
    assert ended(tmp_path, ranks, threads, ["balance.policy=every", "balance.every=50"]) == KNOWN
    ends = {name: from_json((tmp_path / name / layout.OUTCOME).read_bytes()) for name in EVERYWHERE}
    assert all(end.rebalances == ((end.steps or 0) - 1) // 50 for end in ends.values())
    assert sum(end.rebalances or 0 for end in ends.values()) > 10


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() != "x86_64", reason="the plainest processor that is named here is one of x86")
def test_a_processor_without_wide_vectors_and_fused_products_has_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    numpy = importlib.import_module("numpy._core._multiarray_umath")
    features = [name for name in numpy.__cpu_dispatch__ if numpy.__cpu_features__[name]]
    for name, value in {
        "NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": "", "NPY_DISABLE_CPU_FEATURES": " ".join(features),
        "OPENBLAS_CORETYPE": "Nehalem", "GLIBC_TUNABLES": f"glibc.cpu.hwcaps={PLAIN}",
        "CONOID_CACHE_DIR": str(tmp_path / "cache"),
    }.items():  # fmt: skip
        monkeypatch.setenv(name, value)
    subprocess.run(
        [sys.executable, "-m", "conoid.worker.kernels.compile"], check=True, capture_output=True, timeout=1800
    )
    assert ended(tmp_path, 3, 1) == KNOWN
