"""The real worker on a mesh file: a run on the server has the same digest as a run of the worker alone."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

from typer.testing import CliRunner

from conoid.cases.output import layout
from conoid.client.cli import app

CASE = """
name = "bar"
run = { end_time = "2 us", frames = 1, snapshots = 0 }
boundaries = [{ kind = "wall", point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }]
[[parts]]
name = "bar"
material = "steel"
velocity = ["0 m/s", "0 m/s", "-50 m/s"]
mesh = { shape = "file", path = "../meshes/bar.inp", unit = "1 mm", group = "All" }
"""
BAR = """*NODE
1, 0, 0, 0
2, 10, 0, 0
3, 0, 10, 0
4, 0, 0, 10
5, 10, 10, 10
*ELEMENT, TYPE=C3D4, ELSET=All
1, 1, 2, 3, 4
2, 2, 3, 4, 5
"""


def test_a_run_of_a_mesh_file_has_the_digest_of_the_worker_alone(quiet_home: Path) -> None:
    """The command ``conoid run`` reads the copy of the mesh file in the run's folder. The original mesh file may
    change, and the folder of the run may be moved.
    """
    for name, text in (("case/bar.toml", CASE), ("meshes/bar.inp", BAR)):
        (quiet_home / name).parent.mkdir()
        (quiet_home / name).write_text(text)
    ended = CliRunner().invoke(app, ["run", "case/bar.toml", "--json"])
    assert ended.exit_code == 0, ended.output
    answer = json.loads(ended.stdout)
    (copy,) = (Path(answer["folder"]) / layout.FILES).iterdir()
    assert copy.name == f"{hashlib.sha256(BAR.encode()).hexdigest()}.inp"
    assert copy.read_text() == BAR
    (quiet_home / "meshes" / "bar.inp").write_text(BAR.replace("10, 10, 10", "10, 10, 11"))
    for case, same in ((Path(answer["folder"]) / "case.json", True), (quiet_home / "case" / "bar.toml", False)):
        command = [sys.executable, "-m", "conoid.worker", str(case), "--out", str(quiet_home / str(same))]
        subprocess.run(command, check=True, capture_output=True)
        outcome = json.loads((quiet_home / str(same) / layout.OUTCOME).read_bytes())
        assert (outcome["digest"] == answer["outcome"]["digest"]) is same
