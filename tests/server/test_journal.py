"""Lines of the journal are never lost, doubled or broken."""

import resource
import threading
from pathlib import Path

import pytest

from conoid.cases.messages import Status, from_json, to_json
from conoid.server.runs import journal
from conoid.server.runs.journal import Tail, append, lines, statuses


def status(text: str = "") -> Status:
    return Status(run="a", state="queued", message=text)


def test_append_goes_on_from_the_last_number(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    path.write_bytes(to_json(Status(run="a", seq=41, state="running")) + b"\n")
    assert append(path, status("x")).seq == 42
    assert append(path, status("y")).seq == 43
    assert [line.seq for line in lines(path)] == [41, 42, 43]
    assert [line.seq for line in lines(path, after=42)] == [43]


def test_the_first_line_is_number_one(tmp_path: Path) -> None:
    assert append(tmp_path / "journal.jsonl", status()).seq == 1


def test_half_a_line_is_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    append(path, status())
    with path.open("ab") as file:
        file.write(b'{"type":"status","run":"a","se')
    assert append(path, status()).seq == 2
    assert [from_json(raw).seq for raw in path.read_bytes().splitlines()] == [1, 2]


def test_a_whole_line_without_its_line_feed_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    append(path, status())
    with path.open("ab") as file:
        file.write(to_json(Status(run="a", seq=2, state="running")))
    assert append(path, status()).seq == 3
    assert [from_json(raw).seq for raw in path.read_bytes().splitlines()] == [1, 2, 3]


def test_lines_of_any_length(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    for size in (10, 1_000_000, 10, 300_000):
        append(path, status("x" * size))
    assert [len(found.message) for found in statuses(path)] == [10, 1_000_000, 10, 300_000]
    with path.open("ab") as file:
        file.write(b"y" * 600_000)
    assert append(path, status()).seq == 5


def test_a_reader_beside_a_writer_sees_every_line_once(tmp_path: Path) -> None:
    path, count = tmp_path / "journal.jsonl", 2000

    def write() -> None:
        with path.open("ab", buffering=0) as file:
            for seq in range(1, count + 1):
                line = to_json(Status(run="a", seq=seq, state="running")) + b"\n"
                file.write(line[:20])
                file.write(line[20:])

    writer = threading.Thread(target=write)
    writer.start()
    tail = Tail(path)
    seen: list[int] = []
    while len(seen) < count and (writer.is_alive() or len(seen) < count):
        seen += [line.seq for line in tail.read()]
    writer.join()
    assert seen == list(range(1, count + 1))
    assert tail.read() == []


def test_no_journal_yet(tmp_path: Path) -> None:
    assert Tail(tmp_path / "journal.jsonl").read() == []


def test_reading_from_any_number_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("conoid.server.runs.journal._CHUNK", 400)
    path, last = tmp_path / "journal.jsonl", 300
    for seq in range(1, last + 1):
        length = 3000 if seq in {100, 101} else seq % 37
        with path.open("ab") as file:
            file.write(to_json(Status(run="a", seq=seq, state="running", message="x" * length)) + b"\n")
    for after in range(last + 2):
        assert [line.seq for line in lines(path, after)] == list(range(after + 1, last + 1))


@pytest.mark.parametrize("length", [3 * journal._CHUNK, 2 * journal._LONGEST + 5, 5 * journal._LONGEST])
@pytest.mark.parametrize("ends", [True, False])
def test_a_line_without_end_is_never_read_as_a_whole(tmp_path: Path, length: int, ends: bool) -> None:
    path = tmp_path / "journal.jsonl"
    first, late = append(path, status("first")), to_json(Status(run="a", seq=9, state="running"))
    with path.open("ab") as file:
        file.truncate(path.stat().st_size + length)
        file.seek(0, 2)
        file.write(b"\n" * ends + (late + b"\n") * ends)
    tail, most = Tail(path), _most_memory()
    found = [line.seq for _ in range(8) for line in tail.read()]
    assert found == [first.seq, *([9] if ends else [])]
    assert journal.last(path) == (late if ends else to_json(first))
    with path.open("ab") as file:
        file.write(b"\n")
    assert append(path, status("last")).seq == (10 if ends else 2)
    assert [line.seq for _ in range(8) for line in tail.read()] == [10 if ends else 2]
    assert _most_memory() - most < 6 * journal._LONGEST


def _most_memory() -> int:
    """Returns the largest memory of this process so far, bytes."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
