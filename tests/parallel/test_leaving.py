"""End of ranks: each rank deregisters at the launcher, so that no process is killed at the end of a successful run."""

from pathlib import Path

import pytest

from .launching import command, ended


@pytest.mark.parametrize("code", [0, 4])
def test_many_ranks_end_with_their_own_code(code: int) -> None:
    """Without the deregistration (``os._exit``) Hydra kills the other ranks: most runs of the test then have exit code
    9.
    """
    done = ended(command(7, str(code), module=[str(Path(__file__).with_name("leaving.py"))]))
    assert (done.returncode, done.stderr) == (code, ""), done.stdout
