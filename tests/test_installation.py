"""The wheel and the source distribution work without the repository."""

import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
SHIPPED = ("cases", "client", "server", "worker", "pyproject.toml", "README.md", "LICENSE")
THIS = Path(sysconfig.get_path("data"))
MPI = {"CONOID_MPIEXEC": str(THIS / "bin" / "mpiexec"), "MPI4PY_LIBMPI": str(THIS / "lib" / "libmpi.so.12")}
"""Launcher and library of the package mpich of this environment."""
BUILD = "from setuptools import build_meta; import sys; print(getattr(build_meta, sys.argv[1])(sys.argv[2]))"


def called(*command: str | Path, folder: Path) -> str:
    ended = subprocess.run(
        [*map(str, command)], cwd=folder, env={**os.environ, **MPI}, capture_output=True, text=True, timeout=600,
        check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


def built(kind: str, source: Path, out: Path) -> Path:
    """Returns the file that setuptools makes of the folder ``source``: a ``wheel`` or an ``sdist``."""
    return out / called(sys.executable, "-c", BUILD, f"build_{kind}", out, folder=source).splitlines()[-1]


def checkout(folder: Path) -> Path:
    """Returns a copy of the sources, so that the build leaves no file in the repository."""
    folder.mkdir()
    for name in SHIPPED:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(ROOT / name, folder / name)
    return folder


def installed(wheel: Path, folder: Path) -> Path:
    """Returns the programs of a new environment with the wheel; all other packages are those of this environment."""
    venv.create(folder, symlinks=True)
    python = folder / "bin" / "python"
    called(sys.executable, "-m", "pip", "--python", python, "install", "--no-index", "--no-deps", wheel, folder=folder)
    (packages,) = folder.glob("lib/python*/site-packages")
    (packages / "others.pth").write_text(sysconfig.get_path("purelib"))
    return folder / "bin"


@pytest.mark.slow
@pytest.mark.timeout(1200)  # the environment has no compiled kernels
def test_a_wheel_of_the_source_distribution_runs_in_an_empty_folder(tmp_path: Path) -> None:
    source = built("sdist", checkout(tmp_path / "checkout"), tmp_path)
    shutil.unpack_archive(source, tmp_path, filter="data")
    wheel = built("wheel", tmp_path / source.name.removesuffix(".tar.gz"), tmp_path)
    programs = installed(wheel, tmp_path / "environment")
    empty = tmp_path / "empty"
    empty.mkdir()
    for name in ("conoid", "queue.py", "numpy.py"):  # of the user: no process of Conoid may import these modules
        (empty / name).mkdir() if name == "conoid" else (empty / name).write_text("raise SystemExit(9)\n")
    place = called(programs / "python", "-P", "-c", "import conoid.cases as c; print(c.__file__)", folder=empty)
    assert Path(place.strip()).is_relative_to(tmp_path)
    assert "succeeded" in called(programs / "conoid", "demo", "--out", "steel.png", folder=empty)
    assert (empty / "steel.png").stat().st_size > 10_000
    called(programs / "conoid", "cases", "copy", "imported_taylor", folder=empty)
    assert "valid" in called(programs / "conoid", "validate", "imported_taylor.toml", folder=empty)


def test_the_extra_all_has_every_program_and_this_environment_satisfies_it() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    (whole,) = map(Requirement, extras["all"])
    assert {"client", "mesh", "mpich", "server", "view", "worker"} <= whole.extras
    for requirement in (Requirement(each) for extra in whole.extras for each in extras[extra]):
        assert metadata.version(requirement.name) in requirement.specifier
