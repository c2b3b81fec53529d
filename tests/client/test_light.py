"""The client works without MPI, numba and VTK, and starts fast enough for interactive use."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

WEB = Path(__file__).parents[2] / "client" / "web"
BLOCK = """
import sys
for absent in ("numba", "mpi4py", "vtk", "vtkmodules", "pyvista", "h5py", "gmsh", "meshio", "scipy", "numpy", "fastapi", "sqlalchemy", "uvicorn"):
    sys.modules[absent] = None
"""  # noqa: E501


def python(code: str, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", BLOCK + code, *words], capture_output=True, text=True, timeout=60, check=False
    )


def test_the_command_line_and_the_stream_need_no_heavy_package() -> None:
    ended = python(
        "import conoid.client, conoid.client.remote.stream\nfrom conoid.client.cli import main\nmain()",
        "validate",
        "demo",
    )
    assert ended.returncode == 0, ended.stderr
    assert "demo: valid" in ended.stdout


def test_results_are_read_without_numpy(tmp_path: Path) -> None:
    (tmp_path / "history.csv").write_text("step,t\n1,0.5\n")
    ended = python(f"from conoid.client import Result\nprint(Result.open({str(tmp_path)!r}).history['t'][0])")
    assert ended.stdout == "0.5\n", ended.stderr


@pytest.mark.parametrize("absent", ["zenoh", "pyvista"])
def test_importing_the_client_does_not_import(absent: str) -> None:
    ended = python(
        f"import conoid.client, conoid.client.cli\nprint({absent!r} in sys.modules and bool(sys.modules[{absent!r}]))"
    )
    assert ended.stdout == "False\n", ended.stderr


# The page -------------------------------------------------------------------------------------------------------------


def test_the_page_is_whole_and_has_nothing_from_elsewhere() -> None:
    names = {path.name for path in WEB.iterdir() if path.suffix in {".html", ".js", ".css"}}
    for path in WEB.iterdir():
        if path.name not in names:
            continue
        text = path.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "the name of SVG")
        assert not re.findall(r"(?:https?:)?//[a-z0-9-]+\.[a-z]", text), f"{path.name} loads from elsewhere"
        for used in re.findall(r"""(?:from|src=|href=)\s*["'](?:\./)?([\w.]+\.(?:js|css))["']""", text):
            assert used in names, f"{path.name} uses {used}, which is not there"


def test_the_page_never_makes_markup_of_data() -> None:
    for path in WEB.glob("*.js"):
        assert not re.search(
            r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|eval\(", path.read_text(encoding="utf-8")
        )
