"""Content of pictures: cuts with the field, parts, arrows, debris, captions, films."""

import os
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

from conoid.client.drawing import captions, films, part_colours, picture_layout, scales
from conoid.client.drawing.camera import Camera
from conoid.client.drawing.fields import FIELDS
from conoid.client.drawing.picture import Drawn
from conoid.client.drawing.scene import Scene, draw
from conoid.client.drawing.view_options import Look
from conoid.client.errors import LookError, ViewError

from .bodies import quarter_bar, write_frame

SIZE = (400, 300)
TWO = Scene(parts=("foot", "head"), title="Two parts")


@pytest.fixture(scope="module")
def frame(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bar of two parts, the lower and the upper half; the bar is hot only at its axis and has three fragments."""
    path = tmp_path_factory.mktemp("frames") / "000000.vtkhdf"
    write_frame(path)
    points, tets = quarter_bar()
    centre = points[tets].mean(axis=1)
    core = (np.abs(centre - [1.6e-3, 1.6e-3, 16e-3]) < [8e-4, 8e-4, 8e-3]).all(axis=1)
    change(
        path, part=(centre[:, 2] > 16e-3).astype(np.int32), fragment=np.floor(centre[:, 2] / 11e-3).astype(np.int64),
        temperature=293.0 + 700.0 * core,
    )  # fmt: skip
    return path


def change(path: Path, **cells: Any) -> None:
    with h5py.File(path, "r+") as file:
        data = file["VTKHDF/CellData"]
        for name, values in cells.items():
            if name in data:
                del data[name]
            data[name] = values


def drawn(frame: Path, field: str, out: Path, **options: Any) -> Drawn:
    return draw([frame], TWO, "bar", field, out, **{"size": SIZE, **options})


def coloured(path: Path) -> Any:
    """Returns an array (height, width) that is True for the pixels of the body; the captions at the right are left
    out.
    """
    pixels = imread(path)[:, : int(0.7 * SIZE[0]), :3]
    found = pixels.max(axis=2) - pixels.min(axis=2) > 0.08
    found[int(0.75 * SIZE[1]) :, : int(0.25 * SIZE[0])] = False
    return found


@pytest.mark.usefixtures("warm")
@pytest.mark.parametrize(
    ("section", "mirror", "camera"),
    [("x=0.0016", "none", "x"), ("z=middle", "none", "z"), ("x=0", "x", "x"),
     ("x=-0.0016", "x", "x"), ("x=0.0016", "x", "-x"),
     ("x=-0.0016,y=0.0016", "x,y", "1,1,0.2")],
)  # fmt: skip
def test_a_cut_has_the_field_that_is_inside(
    section: str, mirror: str, camera: str, frame: Path, tmp_path: Path
) -> None:
    """The cut of a mirrored body also shows the field. A section in the plane of a mirror cuts no tets and shows the
    inside of the body.
    """
    outside = drawn(frame, "temperature", tmp_path / "a.png", raw=True, mirror=mirror)
    cut = drawn(frame, "temperature", tmp_path / "b.png", raw=True, mirror=mirror, section=section, camera=camera)
    assert outside.high == 293.0
    assert cut.high == (293.0 if section == "x=0" else 993.0)
    assert coloured(tmp_path / "b.png").sum() > 1000


@pytest.mark.usefixtures("warm")
def test_a_cut_in_the_plane_of_a_mirror_is_closed(frame: Path, tmp_path: Path) -> None:
    half = drawn(frame, "part", tmp_path / "a.png", camera="x")
    cut = drawn(frame, "part", tmp_path / "b.png", camera="x", mirror="x", section="x=0")
    assert cut.faces == half.faces


@pytest.mark.usefixtures("warm")
def test_the_image_of_a_component_points_the_other_way(frame: Path, tmp_path: Path) -> None:
    plain = drawn(frame, "velocity_z", tmp_path / "a.png", raw=True)
    across = drawn(frame, "velocity_z", tmp_path / "b.png", raw=True, mirror="z")
    aside = drawn(frame, "velocity_z", tmp_path / "c.png", raw=True, mirror="x")
    assert plain.high < 0.0 < -plain.low == across.high
    assert (aside.low, aside.high) == (plain.low, plain.high)


@pytest.mark.usefixtures("warm")
def test_parts_can_be_hidden_transparent_uncut_and_in_focus(frame: Path, tmp_path: Path) -> None:
    every = drawn(frame, "part", tmp_path / "a.png")
    head = drawn(frame, "part", tmp_path / "b.png", hide=["foot"])
    assert head.faces < every.faces
    assert head.low == head.high == 1.0
    whole = drawn(frame, "part", tmp_path / "c.png", section="x=0.0013", camera="x")
    some = drawn(frame, "part", tmp_path / "d.png", section="x=0.0013", camera="x", whole=["foot"])
    assert some.faces != whole.faces
    drawn(frame, "part", tmp_path / "e.png", focus=["foot"])
    assert coloured(tmp_path / "e.png").sum() > 1.5 * coloured(tmp_path / "a.png").sum()
    drawn(frame, "part", tmp_path / "f.png", opacity={"foot": 0.3})
    pale, solid = (imread(tmp_path / name)[:, :, :3] for name in ("f.png", "a.png"))
    assert pale.mean() > solid.mean()
    for option in ({"hide": ["toe"]}, {"focus": ["toe"]}, {"opacity": {"toe": 0.5}}):
        with pytest.raises(LookError, match=r"= 'toe': allowed: foot, head"):
            drawn(frame, "part", tmp_path / "g.png", **option)
    with pytest.raises(LookError, match="all parts are hidden"):
        drawn(frame, "part", tmp_path / "g.png", hide=["foot", "head"])


@pytest.mark.usefixtures("warm")
def test_what_has_one_value_is_one_colour_and_a_line(frame: Path, tmp_path: Path) -> None:
    same = tmp_path / "same.vtkhdf"
    same.write_bytes(frame.read_bytes())
    change(same, mises=np.full(len(quarter_bar()[1]), 2.0e6) * (1 + 1e-12 * np.arange(len(quarter_bar()[1]))))
    found = drawn(same, "mises", tmp_path / "a.png", outlines=False)
    assert found.limits is None
    pixels = imread(tmp_path / "a.png")[:, : int(0.7 * SIZE[0]), :3]
    green = pixels[..., 1] > pixels[..., 2] + 0.05
    assert green[: int(0.7 * SIZE[1])].sum() == 0, "no colour of the scale"
    given = drawn(same, "mises", tmp_path / "b.png", limits=(0, 4))
    assert given.limits == (0.0, 4.0), "a given range is used unchanged"


@pytest.mark.usefixtures("warm")
def test_debris_far_away_does_not_shrink_the_body_and_is_counted(frame: Path, tmp_path: Path) -> None:
    drawn(frame, "part", tmp_path / "a.png", camera="x", up="z")
    far = tmp_path / "far.vtkhdf"
    far.write_bytes(frame.read_bytes())
    fragment = np.zeros(len(quarter_bar()[1]), np.int64)
    fragment[-1] = 7
    change(far, fragment=fragment)
    with h5py.File(far, "r+") as file:
        root = file["VTKHDF"]
        corners = np.asarray(root["Connectivity"]).reshape(-1, 4)
        points = np.asarray(root["Points"])
        own = np.arange(len(points), len(points) + 4)
        extra = points[corners[-1]] + [0.0, 0.5, 0.0]
        corners[-1] = own
        for name, values in (("Points", np.concatenate([points, extra])), ("Connectivity", corners.reshape(-1))):
            del root[name]
            root[name] = values
        root["NumberOfPoints"][0] += 4
        for name in ("velocity", "displacement"):
            values = np.asarray(root["PointData"][name])
            del root["PointData"][name]
            root["PointData"][name] = np.concatenate([values, values[:4]])
    found = drawn(far, "part", tmp_path / "b.png", camera="x", up="z")
    assert found.beyond == 1
    assert coloured(tmp_path / "b.png").sum() > 0.9 * coloured(tmp_path / "a.png").sum()


@pytest.mark.usefixtures("warm")
def test_nodes_that_have_left_are_no_part_of_the_body(frame: Path, tmp_path: Path) -> None:
    """A long body lies horizontally in the picture, and the section of the test must lie within its tets."""
    lost = tmp_path / "lost.vtkhdf"
    lost.write_bytes(frame.read_bytes())
    with h5py.File(lost, "r+") as file:
        root = file["VTKHDF"]
        points = np.concatenate([np.asarray(root["Points"]), [[0.5, 0.4, 0.0]]])
        del root["Points"]
        root["Points"], root["NumberOfPoints"][0] = points, len(points)
        for name in ("velocity", "displacement"):
            values = np.asarray(root["PointData"][name])
            del root["PointData"][name]
            root["PointData"][name] = np.concatenate([values, values[:1]])
    drawn(frame, "part", tmp_path / "a.png")
    drawn(lost, "part", tmp_path / "b.png")
    assert (coloured(tmp_path / "a.png") == coloured(tmp_path / "b.png")).mean() > 0.999
    with pytest.raises(LookError, match=r"section = x=0\.4: the body is between x=0 and"):
        drawn(lost, "part", tmp_path / "c.png", section="x=0.4")


@pytest.mark.usefixtures("warm")
def test_arrows_bands_and_a_dark_ground(frame: Path, tmp_path: Path) -> None:
    drawn(frame, "speed", tmp_path / "a.png")
    drawn(frame, "speed", tmp_path / "b.png", vectors="velocity", bands=4, dark=True)
    light, dark = (imread(tmp_path / name)[:, :, :3] for name in ("a.png", "b.png"))
    assert light[2, 2].min() == 1.0
    assert dark[2, 2].max() < 0.15
    with pytest.raises(LookError, match="bands = 1: allowed: 2 to 64"):
        drawn(frame, "speed", tmp_path / "c.png", bands=1)
    with pytest.raises(LookError, match="vectors = 'force': allowed: velocity, displacement"):
        drawn(frame, "speed", tmp_path / "c.png", vectors="force")


@pytest.mark.usefixtures("warm")
def test_a_fixed_range_is_that_of_the_run(frame: Path, tmp_path: Path) -> None:
    hot = tmp_path / "hot.vtkhdf"
    hot.write_bytes(frame.read_bytes())
    change(hot, mises=np.linspace(0.0, 5e9, len(quarter_bar()[1])))
    run = Scene(parts=TWO.parts, frames=(frame, hot))
    now = draw([frame], run, "bar", "mises", tmp_path / "a.png", size=SIZE)
    ever = draw([frame], run, "bar", "mises", tmp_path / "b.png", size=SIZE, fixed=True)
    assert now.limits is not None
    assert ever.limits is not None
    assert now.limits[1] < ever.limits[1] == 5000.0


# Texts ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(200, 200), (320, 240), (700, 500), (1280, 720), (1920, 1080), (500, 1400)])
def test_no_text_is_cut_off_at_any_size(size: tuple[int, int]) -> None:
    """No text is drawn on the outermost pixels of a picture, for any field and any length of a name."""
    font = picture_layout.font(Look(size=size))
    right, above, towards = np.linalg.qr(np.random.default_rng(sum(size)).normal(size=(3, 3)))[0]
    eye = Camera(np.zeros(3), towards, right, above, half=0.05, deep=0.1)
    parts = ["a part with a much longer name than usual in a case", *map(str, range(60))]
    for name, field in FIELDS.items():
        scale = (
            None
            if field.kind in ("classes", "fragments")
            else scales.of([np.array([-123456.5, 98765.4])], field, Look())
        )
        entries = captions.entries(name, range(len(parts)), parts)
        side = captions.beside_bar(field, scale, font) if scale else captions.beside_legend(entries, "1 fragment", font)
        side, head = min(side, round(0.34 * size[0])), 3 * font
        panel = (0, head, size[0] - side, size[1] - head)
        laid = picture_layout.Sheet([panel], (0, 0, size[0], head), (panel[2], head, side, panel[3]), 1, font, eye)
        image = Image.new("RGB", size, "#ffffff")
        painter = captions.Painter(image, laid, captions.LIGHT)
        painter.title("A title of a case that goes on and on, " * 5, "t = 123.4 µs")
        painter.triad(panel)
        painter.length(panel)
        painter.notes(panel, ["arrows: velocity, the longest 357 m/s", "12 pieces outside the picture"])
        painter.bar(field, scale, (-1e9, 1e9)) if scale else painter.legend(entries, "12 690 fragments")
        pixels = np.asarray(image)
        for edge in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]):
            assert (edge == 255).all(), (name, size)


def test_the_ends_and_round_numbers_are_written_beside_a_bar() -> None:
    assert scales.ticks(0.0, 1500.0) == [0.0, 250.0, 500.0, 750.0, 1000.0, 1250.0, 1500.0]
    assert scales.ticks(0.0, 1234.0) == [0.0, 250.0, 500.0, 750.0, 1000.0, 1234.0]


# Films ----------------------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("warm")
def test_a_film_has_the_colours_and_the_camera_of_a_picture(frame: Path, tmp_path: Path) -> None:
    """A film of one frame has the same view as the picture: position and colour of the body do not depend on the kind
    of file.
    """
    for field in ("fragment", "temperature"):
        drawn(frame, field, tmp_path / "a.png", camera="x")
        draw([frame, frame], TWO, "bar", field, tmp_path / "a.gif", size=SIZE, camera="x")
        still = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
        with Image.open(tmp_path / "a.gif") as gif:
            apart = np.abs(np.asarray(gif.convert("RGB")).astype(int) - still).max(axis=2)
            assert np.percentile(apart, 97) < 24, "shade of hollows is that of stills alone"


def test_a_film_goes_to_ffmpeg_and_its_absence_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\nfor last; do :; done\nprintf "%s\\n" "$@" > "$last.words"\ncat > "$last"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    images = [Image.new("RGB", (65, 64), colour) for colour in ("red", "blue")]
    films.save(iter(images), 2, 12.5, tmp_path / "a.mp4")
    assert len((tmp_path / "a.mp4").read_bytes()) == 2 * 64 * 64 * 3, "H.264 takes even sides alone"
    words = (tmp_path / "a.mp4.words").read_text().split()
    assert words[words.index("-s") + 1] == "64x64"
    assert words[words.index("-r") + 1] == "12.5"
    program.write_text("#!/bin/sh\necho no codec >&2\nexit 3\n")
    with pytest.raises(ViewError, match="ffmpeg could not write the film: no codec"):
        films.save(iter(images), 2, 12.5, tmp_path / "b.mp4")
    monkeypatch.setenv("PATH", str(tmp_path / "nowhere"))
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(ViewError, match="needs ffmpeg: install it with pip install imageio-ffmpeg"):
        films.save(iter(images), 2, 12.5, tmp_path / "b.mp4")


@pytest.mark.usefixtures("warm")
def test_a_picture_has_the_colours_of_the_fragments(frame: Path, tmp_path: Path) -> None:
    """Light makes the colours of a picture brighter or darker; the ratios of red, green and blue are those of the
    page.
    """
    drawn(frame, "fragment", tmp_path / "a.png", camera="x", outlines=False)
    pixels = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(float)
    for number, part in ((0, 0), (1, 1), (2, 1)):
        colour = part_colours.of_fragments([number], [part], 2)[0].astype(float)
        shares = pixels / np.maximum(pixels.sum(axis=2, keepdims=True), 1.0)
        near = np.abs(shares - colour / colour.sum()).max(axis=2) < 0.012
        assert (near & (pixels.max(axis=2) < 255)).sum() > 300, (number, part)
