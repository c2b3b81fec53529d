"""Failed writes of HDF5 files: an error names the file, and the process continues."""

import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from conoid.worker.output import hdf5

FULL = """
import resource, signal, sys
from pathlib import Path
import numpy as np
from conoid.worker.output import hdf5, storage

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
values = np.random.default_rng(1).random((2000, 3))
try:
    with hdf5.created(Path(sys.argv[1])) as file:
        for name in "abcdefgh":
            file.create_dataset(f"group/{name}", data=values, compression="gzip").attrs["unit"] = "m"
            file[f"plain/{name}"] = values[:100]
except OSError as error:
    print(storage.failed(error), error.filename)
"""
"""The file has eight tables with 45 kB each after compression."""


@pytest.mark.parametrize("room", [0, 100, 3000, 60_000, 300_000, 370_000])
def test_a_disk_that_is_too_small_is_reported_once_and_stops_nothing_else(room: int, tmp_path: Path) -> None:
    path = tmp_path / "frame.part"
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(path), str(room)], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, f"True {path}\n", "")


def test_a_file_is_there_as_it_was_written(tmp_path: Path) -> None:
    values = np.arange(3e5).reshape(-1, 3)
    with hdf5.created(tmp_path / "a.h5") as file:
        file.create_dataset("packed", data=values, compression="gzip", shuffle=True)
        file["plain"], file.attrs["t"] = values, 1.5
        assert (file["plain"][5] == values[5]).all()
    with h5py.File(tmp_path / "a.h5") as file:
        assert (file["packed"][:] == values).all()
        assert (file["plain"][:] == values).all()
        assert file.attrs["t"] == 1.5


def test_the_error_of_the_worker_is_the_reported_one(tmp_path: Path) -> None:
    with pytest.raises(KeyError, match="none"), hdf5.created(tmp_path / "a.h5") as file:
        raise KeyError("none", file)
