"""Pictures of frames: their content, and the errors if no picture can be drawn."""

import itertools
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

from conoid.cases.load import parse_case
from conoid.client.drawing import camera, part_colours, renderer
from conoid.client.drawing.fields import FIELDS
from conoid.client.drawing.frame import require_whole
from conoid.client.drawing.picture import Picture
from conoid.client.drawing.planes import Mirror, direction, mirrors
from conoid.client.drawing.renderer import explain, reason
from conoid.client.drawing.view_options import Look
from conoid.client.errors import LookError, UnfinishedError, ViewError
from conoid.client.view import view

from .bodies import write_frame, write_run

SIZE = (320, 240)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_run(tmp_path_factory.mktemp("view") / "bar")


def body_box(path: Path) -> tuple[float, float, float, float]:
    """Returns left, right, top and bottom of the body as fractions of the picture; the body is left of the colour
    bar.
    """
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
    assert right - left > 0.6, "the camera fits, and a long body lies along the picture"
    assert left > 0.05
    assert right < 0.8
    assert 0.02 < top < bottom < 0.98
    assert drawn.unit == "K"
    assert 293 < drawn.low < 300
    assert 500 < drawn.high < 293.15 + 300 * 1.9


@pytest.mark.usefixtures("warm")
def test_mirrors_double_the_model_and_hide_its_sections(folder: Path, tmp_path: Path) -> None:
    two = view(folder, "mises", tmp_path / "b.png", size=SIZE, mirror="x")
    four = view(folder, "mises", tmp_path / "c.png", size=SIZE, mirror="auto")
    across, along = 4, 16
    sides, ends = 2 * across * along, 2 * across * across
    assert two.faces == 2 * (3 * sides + 2 * ends)
    assert four.faces == 4 * (2 * sides + 2 * ends)


@pytest.mark.usefixtures("warm")
@pytest.mark.parametrize("field", ["pressure", "speed", "part"])
def test_every_kind_of_field_can_be_drawn(field: str, folder: Path, tmp_path: Path) -> None:
    drawn = view(folder / "frames" / "000007.vtkhdf", field, tmp_path / "p.png", size=SIZE, raw=field == "speed")
    pixels = imread(drawn.out)
    assert len(np.unique((pixels[:, :, :3] * 15).astype(int).reshape(-1, 3), axis=0)) > 20
    if field == "speed":
        assert (drawn.low, drawn.high) == pytest.approx((0.0, 190.0), abs=6.0)


@pytest.mark.usefixtures("warm")
def test_a_field_that_the_frame_lacks_is_named(tmp_path: Path) -> None:
    write_frame(tmp_path / "f.vtkhdf", leave_out=("mises",))
    with pytest.raises(ViewError, match="no field 'mises'; it has: part, plastic_strain, pressure"):
        view(tmp_path / "f.vtkhdf", "mises", tmp_path / "p.png")


@pytest.mark.usefixtures("warm")
def test_a_file_that_is_not_a_frame_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "f.vtkhdf").write_bytes(b"nothing")
    with pytest.raises(ViewError) as caught:
        view(tmp_path / "f.vtkhdf", "mises", tmp_path / "p.png")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "p.png").exists()


@pytest.mark.parametrize(
    ("source", "field", "message"),
    [("nothing", "mises", "this run, folder or frame does not exist"), ("pyproject.toml", "mises", r"ends in \.vtkhdf"),
     (".", "stress", "allowed: mises, pressure")],
)  # fmt: skip
def test_an_unknown_field_is_refused_before_the_renderer_starts(source: str, field: str, message: str) -> None:
    with pytest.raises(ViewError, match=message):
        view(source, field)


@pytest.mark.parametrize("out", ["bar.png", "bar.gif"])
def test_a_folder_of_runs_is_no_run_to_draw(tmp_path: Path, out: str) -> None:
    for name in ("one", "local/two"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "journal.jsonl").touch()
    with pytest.raises(
        UnfinishedError, match=r"is not the folder of a run; it contains the folders of the runs local/two, one$"
    ):
        view(tmp_path, "mises", out)
    with pytest.raises(UnfinishedError, match=r"^one has not written any frame$"):
        view(tmp_path / "one", "mises", out)


def test_mirror_planes_are_read() -> None:
    planes = (Mirror(0, 0.0), Mirror(1, 0.0))
    assert mirrors("none", planes) == ()
    assert mirrors("auto", planes) == planes
    assert mirrors("x, z=-2e-3", planes) == (Mirror(0, 0.0), Mirror(2, -0.002))
    with pytest.raises(ViewError, match="allowed: auto, none, or planes"):
        mirrors("q", planes)


def test_a_crash_of_the_renderer_names_the_system_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """VTK without EGL and OSMesa ends with a segmentation fault; the test makes the child process end with a
    segmentation fault.
    """
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
    error = "ImportError: libGL.so.1: cannot open shared object file: No such file or directory"
    assert str(explain(1, error)) == "VTK needs the system library libGL; on Debian and Ubuntu: apt install libgl1"


def test_a_renderer_that_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sitecustomize.py").write_text("import time; time.sleep(60)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(renderer, "_SECONDS", 0.5)
    write_frame(tmp_path / "f.vtkhdf")
    with pytest.raises(ViewError, match="did not finish"):
        view(tmp_path / "f.vtkhdf", "mises", tmp_path / "p.png")


def test_fields_can_be_listed_without_vtk() -> None:
    code = "import sys; sys.modules['pyvista'] = None; from conoid.client.drawing.fields import FIELDS; print(*FIELDS)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, env=dict(os.environ), check=True
    )
    assert done.stdout.split() == list(FIELDS)


# What the caller may choose -------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("warm")
def test_frames_have_times_and_are_drawn_side_by_side(folder: Path, tmp_path: Path) -> None:
    drawn = view(folder, "mises", tmp_path / "two.png", size=SIZE, time=[0.0, 75e-6], up="z")
    assert drawn.times == [0.0, 80e-6], "of each time the nearest frame"
    one = view(folder, "mises", tmp_path / "one.png", size=SIZE, frame=0)
    assert drawn.faces == 2 * one.faces
    pixels = imread(tmp_path / "two.png")[:, :, :3]
    coloured = (pixels.max(axis=2) - pixels.min(axis=2) > 0.25)[:, : int(0.8 * SIZE[0])].any(axis=0)
    bodies = np.count_nonzero(np.diff(coloured.astype(int)) == 1)
    assert bodies >= 2


@pytest.mark.usefixtures("warm")
def test_a_gif_has_every_frame(folder: Path, tmp_path: Path) -> None:
    drawn = view(folder, "mises", tmp_path / "all.gif", size=SIZE, rate=4.0)
    assert drawn.times == [0.0, 80e-6]
    with Image.open(tmp_path / "all.gif") as gif:
        assert (gif.size, getattr(gif, "n_frames", 0), gif.info["duration"]) == (SIZE, 2, 250)


@pytest.mark.usefixtures("warm")
def test_a_transparent_ground_is_left_out(folder: Path, tmp_path: Path) -> None:
    view(folder, "mises", tmp_path / "t.png", size=SIZE, transparent=True, scale=False)
    alpha = imread(tmp_path / "t.png")[:, :, 3]
    assert alpha[0, -1] == 0.0
    assert alpha.max() == 1.0
    assert 0.05 < np.mean(alpha > 0.5) < 0.8


@pytest.mark.usefixtures("warm")
def test_a_section_removes_the_tets_in_front_of_it(folder: Path, tmp_path: Path) -> None:
    whole = view(folder, "temperature", tmp_path / "a.png", size=SIZE)
    below = view(folder, "temperature", tmp_path / "b.png", size=SIZE, camera="-z", section="z=0.02")
    above = view(folder, "temperature", tmp_path / "c.png", size=SIZE, camera="z", section="z=0.02")
    assert below.high < 400.0 < whole.high, "the hot foot lies between the plane and the camera"
    assert above.high == pytest.approx(whole.high)
    for beyond, towards in itertools.product((-1, 9), ("z", "-z")):
        with pytest.raises(LookError) as raised:
            view(folder, "temperature", tmp_path / "d.png", size=SIZE, camera=towards, section=f"z={beyond}")
        assert str(raised.value) == f"section = z={beyond}: the body is between z=0 and z=0.02657 (in m)"
        assert raised.value.exit_code == 2


@pytest.mark.usefixtures("warm")
def test_one_extreme_tet_does_not_set_the_colours(tmp_path: Path) -> None:
    write_frame(tmp_path / "f.vtkhdf")
    calm = view(tmp_path / "f.vtkhdf", "mises", tmp_path / "a.png", size=SIZE, raw=True)
    with h5py.File(tmp_path / "f.vtkhdf", "r+") as file:
        file["VTKHDF/CellData/mises"][0] = 1e12
    wild = view(tmp_path / "f.vtkhdf", "mises", tmp_path / "b.png", size=SIZE, raw=True)
    assert wild.high == pytest.approx(1e6)
    assert wild.limits == calm.limits
    every = view(tmp_path / "f.vtkhdf", "mises", tmp_path / "c.png", size=SIZE, raw=True, percentiles=(0, 100))
    assert every.limits is not None
    assert every.limits[1] >= 1e6


def seen(**options: Any) -> Picture:
    return Picture(frames=[], out="", field="mises", look=Look(), **options)


@pytest.mark.usefixtures("warm")
def test_a_scale_bar_has_its_printed_length(folder: Path, tmp_path: Path) -> None:
    """The body is 32.4 mm long at the start and has 0.82 of this length in the last frame; body and scale bar have the
    same scale.
    """
    size = (600, 800)
    drawn = view(folder, "temperature", tmp_path / "s.png", size=size, camera="x", raw=True, captions=False,
                 outlines=False)  # fmt: skip
    assert drawn.times == [80e-6]
    pixels = imread(tmp_path / "s.png")[:, :, :3]
    panel = pixels[: int(0.95 * size[1])]
    body = np.flatnonzero((panel.max(axis=2) - panel.min(axis=2) > 0.25)[:, int(0.25 * size[0]) :].any(axis=1))
    dark = pixels[int(0.95 * size[1]) :].max(axis=2) < 0.4
    bar = int(np.count_nonzero(dark, axis=1).max())
    height = 32.4e-3 * 0.82
    assert (bar / len(body)) * height == pytest.approx(5e-3, rel=0.03)


@pytest.mark.parametrize("cuts", [{}, {0: 0.0}, {1: 0.0}, {0: 0.0, 1: 0.0}, {0: 1.0, 1: 0.0}, {0: 1.0, 1: 1.0}])
@pytest.mark.parametrize("along", [0, 1, 2])
def test_a_long_body_lies_along_the_picture_and_shows_its_planes_of_symmetry(
    along: int, cuts: dict[int, float]
) -> None:
    """The low end of the body is at the left unless a plane of symmetry requires the other side; with ``up`` the body
    stands upright.
    """
    bounds = np.array([[0.0, 1.0]] * 3)
    bounds[along, 1] = 4.0
    planes = tuple(Mirror(axis, at) for axis, at in cuts.items())
    eye = camera.settled(seen(cuts=planes), bounds)
    assert eye.camera is not None
    towards, right, _ = camera.axes(eye.camera, eye.up)
    assert abs(right[along]) > 0.9
    if along == 2 or not cuts:
        assert right[along] > 0.0
    for axis, at in cuts.items():
        assert axis == along or towards[axis] * (1.0 if at else -1.0) > 0.2, "the plane is seen"
    assert camera.settled(seen(cuts=planes, up=(0.0, 0.0, 1.0)), bounds).up == (0.0, 0.0, 1.0)
    bounds[along, 1] = 2.0
    assert camera.settled(seen(), bounds).camera == camera.FROM


def test_a_scale_has_a_round_length() -> None:
    points = [np.array([[0.0, 0.0, 0.0], [0.0, 0.01, 0.3]])]
    eye = camera.place(points, points, seen(camera=(1.0, 0.0, 0.0), up=(0.0, 1.0, 0.0)), 2.0)
    length, text = camera.scale_bar(eye, 2.0)
    assert length == pytest.approx(0.1)
    assert text == "100 mm"
    assert np.abs(eye.right) == pytest.approx([0.0, 0.0, 1.0])
    assert [camera.round_length(x) for x in (0.99, 1.0, 4.9, 7.0)] == pytest.approx([0.5, 1.0, 2.0, 5.0])


def test_panels_are_laid_so_that_bodies_are_large() -> None:
    assert camera.panels(3, (10.0, 1.0), (1600.0, 900.0)) == 1
    assert camera.panels(3, (1.0, 10.0), (1600.0, 900.0)) == 3
    assert camera.panels(4, (1.0, 1.0), (1000.0, 1000.0)) == 2


def test_a_fragment_keeps_its_colour_and_a_part_its_hue() -> None:
    early = part_colours.of_fragments([0, 0, 0, 7, 9], [0, 0, 0, 0, 1], 2)
    late = part_colours.of_fragments([9, 1, 9, 9, 11], [1, 1, 1, 1, 1], 2)
    assert (early[4] == late[0]).all()
    assert len(np.unique(late, axis=0)) == 3
    pieces = part_colours.of_fragments(range(2, 2000), [1] * 1998, 2).astype(int)
    assert len(np.unique(pieces, axis=0)) > 1950
    assert (pieces[:, 0] > pieces[:, 2]).all(), "pieces of the second part are between red and yellow"


def test_cameras_are_read() -> None:
    assert direction("", "camera") is None
    assert direction("-x", "camera") == (-1.0, 0.0, 0.0)
    assert direction("1, -1.5,.6", "camera") == pytest.approx((2 / 3, -1.0, 0.4))
    for wrong in ("q", "0,0,0", "1,2"):
        with pytest.raises(ViewError, match="allowed: an axis such as -x"):
            direction(wrong, "camera")


@pytest.mark.parametrize(
    ("options", "message"),
    [({"percentiles": (50, 50)}, "the smaller number first"),
     ({"limits": (2, 1)}, "= 2, 1: allowed: two numbers, the smaller"),
     ({"zoom": 0}, "above 0"), ({"out": "x.jpg"}, r"must end in \.png, \.gif or \.mp4"),
     ({"colour": "red"}, "colour: unknown option; allowed: mirror, section"),
     ({"size": (10,)}, r"size = \(10,\): expected `array` of length 2"),
     ({"size": (0, 0)}, "size = 0, 0: .* at least 64"), ({"zoom": "a"}, "zoom = 'a': expected `float`"),
     ({"limits": (1,)}, r"limits = \(1,\): expected `array` of length 2"),
     ({"time": "60"}, "time = '60': write the time with its unit"), ({"time": "x us"}, "time = 'x us': ")],
)  # fmt: skip
def test_a_wrong_choice_is_one_line(options: dict[str, Any], message: str, folder: Path) -> None:
    with pytest.raises(ViewError, match=message):
        view(folder, "mises", **options)


def test_a_picture_that_cannot_be_written_is_named(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ViewError) as raised:
        view(folder, "pressure", tmp_path / "file" / "bar.png", size=SIZE)
    assert str(raised.value) == f"{tmp_path}/file: File exists"


@pytest.mark.usefixtures("warm")
@pytest.mark.parametrize("name", ["bar.png", "bar.gif"])
def test_a_picture_for_which_the_disk_is_too_small_leaves_the_old_one(name: str, folder: Path, tmp_path: Path) -> None:
    out = tmp_path / name
    out.write_bytes(b"old")
    out.with_name(f".bar.{os.getpid()}.part{out.suffix}").symlink_to("/dev/full")
    with pytest.raises(ViewError) as raised:
        view(folder, "pressure", out, size=SIZE)
    assert str(raised.value) == f"{out}: No space left on device"
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [(name, b"old")]


def test_a_failure_names_its_file() -> None:
    assert reason(OSError(28, "No space left on device"), "bar.gif") == "bar.gif: No space left on device"


@pytest.mark.usefixtures("warm")
@pytest.mark.parametrize(
    ("mirror", "section"),
    [("x", "y=0.002"), ("x,y", "z=0.01"), ("y", "x=0.001,z=0.01"), ("auto", "z=0.02"), ("z", "x=0.001,y=0.001")],
)
def test_a_body_is_cut_and_mirrored_at_once(mirror: str, section: str, folder: Path, tmp_path: Path) -> None:
    """A section of a tet mesh consists of faces with three to six corners."""
    cut = view(folder, "mises", tmp_path / "a.png", size=(64, 64), section=section)
    both = view(folder, "mises", tmp_path / "b.png", size=(64, 64), section=section, mirror=mirror)
    assert both.faces > cut.faces
    assert both.high == pytest.approx(cut.high)


@pytest.mark.parametrize(
    "options",
    [
        {"mirror": "x,x=0.001"}, {"mirror": "x", "section": "x=0.1"}, {"camera": "0,0,0"}, {"up": "1e999,0,0"},
        {"section": "x=1e99"}, {"camera": "1e-999,0,0"},
    ],
)  # fmt: skip
def test_an_invisible_object_is_refused_in_one_line(options: dict[str, Any], folder: Path, tmp_path: Path) -> None:
    with pytest.raises(LookError) as raised:
        view(folder, "mises", tmp_path / "a.png", size=(64, 64), **options)
    assert "\n" not in str(raised.value)


@pytest.mark.usefixtures("warm")
def test_a_direction_of_any_length_is_one(folder: Path, tmp_path: Path) -> None:
    for seen, up in (("1e-300,0,0", "0,0,1e300"), ("1e300,-1e300,1e300", "z")):
        assert view(folder, "mises", tmp_path / "a.png", size=(64, 64), camera=seen, up=up).faces


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-2000])


def torn(path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(data[:1000] + bytes(3000) + data[4000:])


def astray(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["VTKHDF/Connectivity"][7] = 10**6


def short(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["VTKHDF/NumberOfPoints"][0] += 5


def lacks(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        del file["VTKHDF/Types"]


def other(path: Path) -> None:
    path.write_text("no frame at all")


def empty(path: Path) -> None:
    path.write_bytes(b"")


@pytest.mark.parametrize("damage", [cut, torn, astray, short, lacks, other, empty])
def test_a_damaged_frame_is_named(damage: Any, tmp_path: Path) -> None:
    """VTK prints messages for some damaged frames, and reads beyond the ends of arrays for other damaged frames."""
    path = tmp_path / "000001.vtkhdf"
    write_frame(path)
    require_whole(str(path))
    damage(path)
    with pytest.raises(ViewError, match=f"^{path}: this file is not a frame, or is damaged: ") as raised:
        require_whole(str(path))
    assert "\n" not in str(raised.value)


def test_a_picture_of_a_damaged_frame_is_one_line(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "bar")
    astray(folder / "frames" / "000007.vtkhdf")
    with pytest.raises(
        ViewError, match=r"7\.vtkhdf: this file is not a frame, or is damaged: cells of piece 0 refer to"
    ):
        view(folder, "mises", tmp_path / "t.png", size=SIZE)


@pytest.mark.usefixtures("warm")
def test_tets_of_a_set_are_drawn_alone(tmp_path: Path) -> None:
    frame = tmp_path / "f.vtkhdf"
    write_frame(frame)
    with h5py.File(frame, "a") as file:
        root = file["VTKHDF"]
        low = root["Points"][:, 2] < 1e-9
        root["PointData/set_FOOT"], root["PointData/set_a\u2215b"] = low.astype(np.uint8), 0 * low.astype(np.uint8)
    across = 4
    drawn = view(frame, "mises", tmp_path / "s.png", size=SIZE, on="FOOT")
    assert 2 * across * across < drawn.faces < 2 * across * across + 4 * 2 * across + 4 * across * across
    with pytest.raises(LookError, match=r"^on = 'FEET': did you mean 'FOOT'|^on = 'FEET': allowed: FOOT, a"):
        view(frame, "mises", tmp_path / "s.png", size=SIZE, on="FEET")
    with pytest.raises(LookError, match="no tet of the frame has a node in the set"):
        view(frame, "mises", tmp_path / "s.png", size=SIZE, on="a/b")


@pytest.mark.usefixtures("warm")
def test_round_and_moving_walls_are_drawn_where_they_are(tmp_path: Path) -> None:
    """The test writes the case in the same way as a worker; the frames have the positions of the walls."""
    run = write_run(tmp_path / "bar")
    ball = {"kind": "wall", "name": "ball", "shape": "sphere", "radius": "2 mm", "mass": "1 g"}
    walls = [
        {**ball, "point": ["3 mm", "3 mm", "-9 m"]},
        {"kind": "wall", "name": "tube", "shape": "cylinder", "radius": "9 mm", "axis": [0, 0, 1], "side": "inside",
         "point": [0, 0, 0]},
    ]  # fmt: skip
    mesh = {"shape": "box", "low": [0, 0, 0], "high": ["1 mm", "1 mm", "1 mm"], "element_size": "1 mm"}
    case = {"name": "bar", "parts": [{"name": "rod", "material": "steel", "mesh": mesh}], "boundaries": walls[:1]}
    pictures = {}
    for name, place, boundaries in (("far", None, walls[:1]), ("near", 13.0, walls[:1]), ("both", 13.0, walls)):
        resolved = parse_case({**case, "run": {"end_time": "1 us"}, "boundaries": boundaries}).model_dump_json()
        (run / "case.resolved.json").write_text(resolved)
        for frame in (run / "frames").glob("*.vtkhdf"):
            with h5py.File(frame, "a") as file:
                field = file["VTKHDF/FieldData"]
                field.pop("wall_position", None)
                if place is not None:
                    field["wall_position"] = np.array([[0.0, 0.0, 1e-3 * place], [0.0, 0.0, 0.0]])[: len(boundaries)]
        drawn = view(run, "mises", tmp_path / f"{name}.png", size=SIZE)
        pictures[name] = imread(drawn.out)[:, : int(0.8 * SIZE[0]), :3]
    changed = [(np.abs(a - b).max(axis=2) > 0.02).sum() for a, b in itertools.pairwise(pictures.values())]
    assert changed[0] > 300, "a ball of 2 mm that moved to the middle of the bar"
    assert changed[1] > 10_000, "a tube around the bar"
