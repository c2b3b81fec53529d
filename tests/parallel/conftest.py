"""Runs of the scene with fracture that several modules compare; each run is made once in a session, at its first
use.
"""

from collections.abc import Callable
from pathlib import Path

import pytest

from conoid.cases.output import layout

from .launching import together
from .scenes import FAST, SCENES, arguments


@pytest.fixture(scope="session")
def breaking(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int, str], Path]:
    """Returns the folder of an uninterrupted run, by the number of ranks and the scene; runs with the same number of
    ranks are made together. On more than one rank a file requests a checkpoint before the run begins.
    """
    root = tmp_path_factory.mktemp("breaking")

    def folder(ranks: int, name: str) -> Path:
        place = root / str(ranks)
        if not (place / name).exists():
            alike = [name] if name == FAST else [n for n in SCENES if n != FAST]
            if ranks > 1:
                for each in alike:
                    (place / each).mkdir(parents=True)
                    (place / each / layout.CHECKPOINT_REQUEST).touch()
            together(ranks, place, [arguments(n, root, place) for n in alike])
        return place / name

    return folder


@pytest.fixture(scope="session")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Returns the folder of a run of the scene with fracture on three ranks, with a new decomposition every five
    steps.
    """
    root = tmp_path_factory.mktemp("moving")
    words = [word for change in ("balance.policy=every", "balance.every=5") for word in ("--set", change)]
    together(3, root, [[*arguments(FAST, root, root), *words]])
    return root / FAST
