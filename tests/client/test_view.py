"""Pictures of frames: what is drawn, and what is said when nothing can be."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from conoid.client import pictures
from conoid.client.errors import ViewError
from conoid.client.pictures import FIELDS, Mirror, Scene, explain, mirrors
from conoid.client.view import view

from .bodies import write_frame, write_run

SIZE = (320, 240)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_run(tmp_path_factory.mktemp("view") / "bar")


def body_box(path: Path) -> tuple[float, float, float, float]:
    """Left, right, top, bottom of what is coloured left of the colour bar, as shares of the picture."""
    pixels = imread(path)[:, :, :3]
    assert pixels.shape == (SIZE[1], SIZE[0], 3)
    coloured = pixels.max(axis=2) - pixels.min(axis=2) > 0.25
    coloured[:, int(0.8 * SIZE[0]) :] = coloured[int(0.82 * SIZE[1]) :, : int(0.16 * SIZE[0])] = False
    rows, columns = np.flatnonzero(coloured.any(axis=1)), np.flatnonzero(coloured.any(axis=0))
    return columns[0] / SIZE[0], columns[-1] / SIZE[0], rows[0] / SIZE[1], rows[-1] / SIZE[1]


def test_a_picture_shows_the_body_whole_and_large(folder: Path, tmp_path: Path) -> None:
    drawn = view(folder, "temperature", tmp_path / "t.png", size=SIZE)
    assert drawn.faces == 4 * 2 * 4 * 16 + 2 * 2 * 4 * 4, "four sides and two ends of 4 x 4 x 16 cells"
    left, right, top, bottom = body_box(tmp_path / "t.png")
    assert bottom - top > 0.6, "the camera fits"
    assert left > 0.05
    assert right < 0.8
    assert 0.02 < top < bottom < 0.98
    assert drawn.unit == "K"
    assert 293 < drawn.low < 300
    assert 500 < drawn.high < 293.15 + 300 * 1.9


def test_mirrors_double_the_model_and_hide_its_sections(folder: Path, tmp_path: Path) -> None:
    two = view(folder, "mises", tmp_path / "b.png", size=SIZE, mirror="x")
    four = view(folder, "mises", tmp_path / "c.png", size=SIZE, mirror="auto")
    across, along = 4, 16
    sides, ends = 2 * across * along, 2 * across * across
    assert two.faces == 2 * (3 * sides + 2 * ends)
    assert four.faces == 4 * (2 * sides + 2 * ends)


@pytest.mark.parametrize("field", ["pressure", "speed", "part"])
def test_every_kind_of_field_can_be_drawn(field: str, folder: Path, tmp_path: Path) -> None:
    drawn = view(folder / "frames" / "000007.vtkhdf", field, tmp_path / "p.png", size=SIZE, raw=field == "speed")
    pixels = imread(drawn.out)
    assert len(np.unique((pixels[:, :, :3] * 15).astype(int).reshape(-1, 3), axis=0)) > 20
    if field == "speed":
        assert (drawn.low, drawn.high) == pytest.approx((0.0, 190.0), abs=6.0)


def test_a_field_that_the_frame_lacks_is_named(tmp_path: Path) -> None:
    write_frame(tmp_path / "f.vtkhdf", leave_out=("mises",))
    with pytest.raises(ViewError, match="no field 'mises'; it has: part, plastic_strain, pressure"):
        view(tmp_path / "f.vtkhdf", "mises", tmp_path / "p.png")


def test_a_file_that_is_no_frame_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "f.vtkhdf").write_bytes(b"nothing")
    with pytest.raises(ViewError) as caught:
        view(tmp_path / "f.vtkhdf", "mises", tmp_path / "p.png")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "p.png").exists()


@pytest.mark.parametrize(
    ("source", "field", "said"),
    [("nothing", "mises", "no such run, folder or frame"), ("pyproject.toml", "mises", r"ends in \.vtkhdf"),
     (".", "stress", "allowed: mises, pressure")],
)  # fmt: skip
def test_what_cannot_be_drawn_is_said_before_anything_starts(source: str, field: str, said: str) -> None:
    with pytest.raises(ViewError, match=said):
        view(source, field)


def test_mirror_planes_are_read() -> None:
    scene = Scene(mirrors=(Mirror(0, 0.0), Mirror(1, 0.0)))
    assert mirrors("none", scene) == ()
    assert mirrors("auto", scene) == scene.mirrors
    assert mirrors("x, z=-2e-3", scene) == (Mirror(0, 0.0), Mirror(2, -0.002))
    with pytest.raises(ViewError, match="write auto, none, or planes"):
        mirrors("q", scene)


def test_a_crash_of_the_renderer_names_the_system_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """VTK without EGL and OSMesa dies of a segmentation fault; here the child is made to die of one."""
    (tmp_path / "sitecustomize.py").write_text("import ctypes; ctypes.string_at(0)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    write_frame(tmp_path / "f.vtkhdf")
    with pytest.raises(ViewError, match=r"crashed \(signal 11\).*libegl1.*libosmesa6"):
        view(tmp_path / "f.vtkhdf", "mises", tmp_path / "p.png")


def test_a_missing_pyvista_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sitecustomize.py").write_text("import sys; sys.modules['pyvista'] = None")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    write_frame(tmp_path / "f.vtkhdf")
    with pytest.raises(ViewError, match=r"pip install 'conoid\[view\]'"):
        view(tmp_path / "f.vtkhdf", "mises", tmp_path / "p.png")


def test_a_missing_library_names_its_package() -> None:
    told = "ImportError: libGL.so.1: cannot open shared object file: No such file or directory"
    assert str(explain(1, told)) == "VTK needs the system library libGL; on Debian and Ubuntu: apt install libgl1"


def test_a_renderer_that_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sitecustomize.py").write_text("import time; time.sleep(60)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(pictures, "_SECONDS", 0.5)
    write_frame(tmp_path / "f.vtkhdf")
    with pytest.raises(ViewError, match="did not finish"):
        view(tmp_path / "f.vtkhdf", "mises", tmp_path / "p.png")


def test_fields_can_be_listed_without_vtk() -> None:
    code = "import sys; sys.modules['pyvista'] = None; from conoid.client.pictures import FIELDS; print(*FIELDS)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, env=dict(os.environ), check=True
    )
    assert done.stdout.split() == list(FIELDS)
