"""Content of a report, an HTML file that needs no other file."""

import base64
import gzip
import json
import os
import random
import re
import threading
from html.parser import HTMLParser
from pathlib import Path

import pytest
from typer.testing import CliRunner

from conoid.client.cli import app
from conoid.client.commands import options, progress
from conoid.client.errors import ClientError, UnfinishedError
from conoid.client.local.atomic import save_text
from conoid.client.reports import pictures, replay3d, report
from conoid.client.result import Result
from conoid.server.answers import page

from .bodies import write_fragments, write_history, write_run


class Reader(HTMLParser):
    """Parser that collects the addresses and the text of a page, and checks that every element is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.text = ""
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in {"img", "meta"}:
            self.open.append(tag)
        self.addresses += [value or "" for name, value in attrs if name in {"src", "href", "action", "data", "poster"}]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def read(path: Path) -> Reader:
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    reader.close()
    assert not reader.open
    return reader


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = write_run(tmp_path / "bar")
    write_history(made, t=[0.0, 4e-5, 8e-5], dt=[1e-8] * 3, kinetic=[5.0, 4.0, 3.0], push=[0.0, 1.0, 2.0])
    write_fragments(made, 7, [1.0, 2.0, 1e-4])
    (made / "journal.jsonl").write_text("")
    return made


def test_a_report_for_which_the_disk_is_too_small_leaves_the_old_one(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "bar.html"
    out.write_text("old")
    (tmp_path / f".bar.{os.getpid()}.part.html").symlink_to("/dev/full")
    with pytest.raises(ClientError, match=r"bar.html: cannot be written: No space left on device$"):
        report.write(Result.open(folder), out, ())
    assert out.read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bar", "bar.html"]


def test_what_is_no_file_is_written_to_as_it_is(tmp_path: Path) -> None:
    """The command keeps a link to a file as a link, and does not replace a device."""
    (tmp_path / "link").symlink_to(tmp_path / "file")
    for out in (tmp_path / "link", Path("/dev/null")):
        save_text(out, "text")
    assert (tmp_path / "file").read_text() == "text"
    assert (tmp_path / "link").is_symlink()
    assert Path("/dev/null").is_char_device()


@pytest.mark.usefixtures("warm")
def test_a_report_is_one_file_without_requests(folder: Path, tmp_path: Path) -> None:
    out = report.write(Result.open(folder), tmp_path / "bar.html", ["temperature"])
    page = read(out)
    assert page.addresses
    assert all(address.startswith("data:image/") for address in page.addresses)
    assert not re.search(r"url\((?!#)|@import|<link|fetch\(", out.read_text())
    pictures = [address for address in page.addresses if address.startswith("data:image/webp")]
    assert base64.b64decode(pictures[0].partition(",")[2]).startswith(b"RIFF")
    assert out.stat().st_size < 5_000_000


def test_the_report_gives_the_end_of_the_run_and_its_references(folder: Path, tmp_path: Path) -> None:
    outcome = json.loads((folder / "outcome.json").read_text())
    outcome["reference"] += [{**outcome["reference"][0], "name": "width of rod", "pass": False}]
    (folder / "outcome.json").write_text(json.dumps(outcome))
    text = read(report.write(Result.open(folder), tmp_path / "bar.html", [])).text
    for words in ("A steel bar", "succeeded", "d" * 64, "extent of rod", "Fragments", "of ten tets or more"):
        assert words in text
    html = (tmp_path / "bar.html").read_text()
    assert html.count("<span class=good>pass</span>") == html.count("<span class=bad>FAIL</span>") == 1


def test_no_text_of_a_case_becomes_markup(folder: Path, tmp_path: Path) -> None:
    case = json.loads((folder / "case.resolved.json").read_text())
    case |= {"title": "<script>alert(1)</script>", "description": "<b>&"}
    (folder / "case.resolved.json").write_text(json.dumps(case))
    html = report.write(Result.open(folder), tmp_path / "bar.html", []).read_text()
    assert "<script>alert" not in html
    assert "&lt;script&gt;alert(1)" in html
    assert "<b>&" not in html


def test_a_run_that_has_not_ended_has_a_report_of_what_is_there(folder: Path, tmp_path: Path) -> None:
    for name in ("outcome.json", "history.csv"):
        (folder / name).unlink()
    text = read(report.write(Result.open(folder), tmp_path / "bar.html", [])).text
    assert "not ended" in text
    assert "References" not in text
    assert "Energy" not in text
    (folder / "case.resolved.json").unlink()
    with pytest.raises(UnfinishedError):
        report.write(Result.open(folder), tmp_path / "bar.html", [])


@pytest.mark.usefixtures("warm")
def test_the_parts_have_their_energies_where_there_are_several(folder: Path, tmp_path: Path) -> None:
    assert "part, at the end" not in read(report.write(Result.open(folder), tmp_path / "one.html", fields=[])).text
    parts = {
        "kinetic.rod": [5.0, 3.0],
        "internal.rod": [0.0, 1.25],
        "kinetic.ball": [1.0, 0.5],
        "internal.ball": [0.0] * 2,
    }
    write_history(folder, t=[0.0, 8e-5], dt=[1e-8] * 2, **parts)
    text = read(report.write(Result.open(folder), tmp_path / "two.html", fields=[])).text
    assert "part, at the endkineticinternal" in text
    assert "rod3.00 J1.25 J" in text
    assert "ball0.500 J0 J" in text


def test_a_field_that_cannot_be_drawn_is_a_line(folder: Path, tmp_path: Path) -> None:
    text = read(report.write(Result.open(folder), tmp_path / "bar.html", ["fragment"])).text
    assert "fragment: the frame has no field 'fragment'" in text


def test_the_command_names_the_file_after_the_run(folder: Path, quiet_home: Path) -> None:
    done = CliRunner().invoke(app, ["report", str(folder), "--no-pictures"])
    assert done.exit_code == 0, done.output
    assert done.stdout == "bar.html\n"
    assert "Pictures" not in read(quiet_home / "bar.html").text
    wrong = CliRunner().invoke(app, ["report", str(folder), "--field", "x"])
    assert "field = 'x': allowed: mises" in wrong.stderr


def test_a_long_report_prints_its_progress(folder: Path, quiet_home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "LONGEST", 0.05)
    received = threading.Event()

    def renderer(*lines: str) -> None:
        if lines[0].startswith("writing bar.html: energy, "):
            received.set()

    def energy(*_: object) -> list[str]:
        assert received.wait(30.0)
        return []

    monkeypatch.setattr(options, "complain", renderer)
    monkeypatch.setattr(pictures, "curve", energy)
    done = CliRunner().invoke(app, ["report", str(folder), "--no-pictures"])
    assert done.exit_code == 0, done.output
    assert done.stdout == "bar.html\n", "scripts read no more than the file"


# The replay -----------------------------------------------------------------------------------------------------------


def with_snapshots(folder: Path, n: int) -> Result:
    (folder / "snapshots").mkdir()
    for index in range(n):
        (folder / "snapshots" / f"{index:06d}.snap").write_bytes(b"CONOSNAP" + bytes([index]))
    return Result.open(folder)


def embedded(html: str, name: str) -> bytes:
    """Returns the unpacked content of an element of the report, by the id of the element."""
    found = re.search(rf'<script type="application/octet-stream" id={name}>(.*?)</script>', html)
    assert found is not None
    return gzip.decompress(base64.b64decode(found[1]))


def modules(html: str) -> dict[str, str]:
    """Returns the embedded modules of the report by the names by which they are imported."""
    found: dict[str, str] = json.loads(embedded(html, "modules"))
    return found


def test_a_replay_has_every_module_that_it_imports(folder: Path, tmp_path: Path) -> None:
    html = report.write(with_snapshots(folder, 3), tmp_path / "bar.html", []).read_text()
    there = modules(html)
    assert "conoid/view3d.js" in there
    for name in ("colours.js", "shaders.js"):
        own = (Path(replay3d.__file__).parent.parent / "web" / name).read_text(encoding="utf-8")
        assert own.replace('"./', '"conoid/') == there[f"conoid/{name}"], "the report has the colours of the page"
    for name, code in there.items():
        if name != "conoid/three":
            for used in re.findall(r"""(?:from|import)\s*\(?\s*["']([^"']+)["']""", code):
                assert used in there, f"{name} imports {used}"
            for names, used in re.findall(r"""import\s*\{([^}]*)\}\s*from\s*["']([^"']+)["']""", code):
                for one in names.split(","):
                    assert re.search(rf"export [^;]*\b{one.split(' as ')[0].strip()}\b", there[used]), (name, one)
    assert [int(n) for n in re.findall(r"id=snapshot-(\d+)", html)] == [0, 1, 2]
    assert embedded(html, "snapshot-2") == b"CONOSNAP\x02"


def test_of_many_snapshots_some_are_embedded_evenly(folder: Path) -> None:
    html = replay3d.html(with_snapshots(folder, 100))
    shown = [int(n) for n in re.findall(r"id=snapshot-(\d+)", html)]
    assert len(shown) == replay3d.MOST
    assert (shown[0], shown[-1]) == (0, 99)


def test_of_large_snapshots_there_are_fewer(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = with_snapshots(folder, 30)
    for path in (folder / "snapshots").iterdir():
        path.write_bytes(b"CONOSNAP" + random.Random(path.name).randbytes(10_000))
    monkeypatch.setattr(replay3d, "BUDGET", 65_000)
    html = replay3d.html(result)
    shown = [int(n) for n in re.findall(r"id=snapshot-(\d+)", html)]
    assert 2 < len(shown) <= 6
    assert (shown[0], shown[-1]) == (0, 29)


def test_without_snapshots_there_is_no_replay_and_without_three_a_line(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert replay3d.html(Result.open(folder)) == ""
    monkeypatch.setattr(replay3d, "PACKAGE", "not-there")
    assert replay3d.html(with_snapshots(folder, 1)) == (
        "<p class=hint>No replay in 3-D: not-there 3.18.0 is not installed: pip install --no-deps not-there==3.18.0</p>"
    )


def test_the_replay_draws_with_what_the_page_draws_with() -> None:
    assert (replay3d.PACKAGE, replay3d.VERSION) == (page.PACKAGE, page.VERSION)
    assert page.TESTED["three/index.js"] == replay3d.THREE
