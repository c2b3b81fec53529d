"""No rank waits for another rank that loads kernels at its first crack or contact."""

from pathlib import Path

from conoid.worker.contact.narrow_phase import detection, stages
from conoid.worker.contact.scene import split_pairs, split_update
from conoid.worker.contact.solver import slot_numbers
from conoid.worker.kernels import preload

from .launching import command, ended

PROGRAM = str(Path(__file__).with_name("loading.py"))
SCENE = str(Path(__file__).with_name("breaking.toml"))


def test_contact_and_fracture_load_no_kernel_once_steps_have_begun(tmp_path: Path) -> None:
    finished = ended(command(2, SCENE, "--out", str(tmp_path / "run"), module=[PROGRAM]))
    assert finished.returncode == 0, finished.stderr
    late = [line.removeprefix("late: conoid.worker.") for line in finished.stdout.splitlines() if "late: " in line]
    assert late, "those that all ranks call in their first step are loaded there"
    assert not [
        name
        for name in late
        if name.startswith(("contact.", "fracture.", "boundaries.", "drivers.", "walls.", "inheriting."))
    ]


def test_kernels_that_functions_name_are_found_as_their_own_and_as_those_of_other_modules() -> None:
    found = {*preload.called(split_update)}
    assert {split_update._lacking, split_pairs.tear_faces, split_pairs.inherited} <= found
    assert split_pairs._become not in found, "which kernels alone call"
    assert slot_numbers.number not in found
    assert stages.take in {*preload.called(detection)}, "named in a method, within a class"
