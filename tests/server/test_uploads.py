"""Files that users send: received in whole or in pieces, verified, counted, separated by user, removed."""

import errno
import hashlib
import os
import random
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from conoid.cases.site.batch import Site
from conoid.cases.site.policy import Files
from conoid.server.intake import receiving, uploads
from conoid.server.intake.uploads import Part, Uploads
from conoid.server.settings import Settings

from .faulty import Plan, faults
from .running import Running, User

RULES = Files(size=3000, bytes=5000, number=4)


@pytest.fixture
def settings(settings: Settings) -> Settings:
    return replace(settings, site=Site(files=RULES))


def made(size: int, seed: int = 1) -> tuple[bytes, str]:
    """Returns a file and its hash."""
    data = random.Random(seed).randbytes(size)
    return data, hashlib.sha256(data).hexdigest()


def put(user: User, sha256: str, data: Any, piece: str | None = None, **headers: str) -> Any:
    """Sends one PUT request with the whole file, or with the range of bytes ``piece`` of the file."""
    part = {"Content-Range": f"bytes {piece}"} if piece else {}
    return user.http.put(f"/v1/files/{sha256}", content=data, headers={**part, **headers})


def refused(answer: Any, status: int, code: str) -> str:
    """Returns the one line of a refusal."""
    assert (answer.status_code, answer.json()["code"]) == (status, code), answer.text
    line = str(answer.json()["detail"])
    assert "\n" not in line
    return line


def files_of(user: User) -> list[str]:
    """Returns the files in the folder of a user."""
    folder = user.runs / uploads.FOLDER / user.name
    return sorted(path.name for path in folder.iterdir()) if folder.exists() else []


def test_a_file_comes_in_pieces_and_is_there_when_it_is_whole(server: Running) -> None:
    data, sha256 = made(1000)
    assert server.ann.http.get(f"/v1/files/{sha256}").status_code == 404
    early = put(server.ann, sha256, data[400:], "400-999/1000")
    assert refused(early, 409, "wrong_offset") == "the server has 0 bytes of the file, and the body begins at 400"
    assert files_of(server.ann) == [], "and nothing counts"
    first = put(server.ann, sha256, data[:400], "0-399/1000")
    assert (first.status_code, first.json()["offset"], first.json()["whole"]) == (200, 400, False)
    assert files_of(server.ann) == [f"{sha256}.1000.part"]
    answer = server.ann.http.head(f"/v1/files/{sha256}")
    assert [answer.headers[f"Upload-{name}"] for name in ("Offset", "Length", "Complete")] == ["400", "1000", "?0"]
    wrong = put(server.ann, sha256, data[:400], "0-399/1000")
    assert refused(wrong, 409, "wrong_offset") == "the server has 400 bytes of the file, and the body begins at 0"
    assert wrong.headers["Upload-Offset"] == "400"
    last = put(server.ann, sha256, data[400:], "400-999/1000")
    assert (last.status_code, last.json()["offset"], last.json()["whole"]) == (201, 1000, True)
    (name,) = files_of(server.ann)
    path = server.ann.runs / uploads.FOLDER / "ann" / name
    assert (name, path.read_bytes(), path.stat().st_mode & 0o777) == (sha256, data, 0o400)
    assert put(server.ann, sha256, data).status_code == 200, "it is there: nothing is taken in again"
    (listed,) = server.ann.http.get("/v1/files").json()["files"]
    assert (listed["sha256"], listed["size"], listed["whole"]) == (sha256, 1000, True)
    assert server.ann.http.delete(f"/v1/files/{sha256}").status_code == 204
    assert files_of(server.ann) == []


@pytest.mark.parametrize("size", [0, 1, 2999, 3000])
def test_a_complete_file_replaces_its_pieces(server: Running, size: int) -> None:
    data, sha256 = made(size)
    if size > 1:
        put(server.ann, sha256, b"?" * (size - 1), f"0-{size - 2}/{size}")
    assert put(server.ann, sha256, data).status_code == 201
    assert files_of(server.ann) == [sha256]


def test_a_file_that_a_killed_server_did_not_verify_is_verified_on_request(server: Running) -> None:
    data, sha256 = made(500)
    folder = server.ann.runs / uploads.FOLDER / "ann"
    folder.mkdir(parents=True)
    (folder / f"{sha256}.500.part").write_bytes(data)
    assert put(server.ann, sha256, b"", "*/500").status_code == 201
    assert files_of(server.ann) == [sha256]


@pytest.mark.parametrize("seed", range(3))
def test_pieces_in_any_order_make_the_right_file(server: Running, seed: int) -> None:
    """Random pieces of two files are sent, at right and wrong offsets, with right and wrong bytes, and compared with
    a model.
    """
    dice = random.Random(seed)
    files = [made(size, seed * 10 + size) for size in (400, 700)]
    book: dict[str, bytes | None] = {}
    """Bytes of each file that have arrived; None for a complete file."""
    for _ in range(150):
        data, sha256 = dice.choice(files)
        there = book.get(sha256, b"")
        first = dice.choice([0, len(there or b""), len(there or b""), dice.randrange(len(data))])
        piece = data[first : first + dice.choice([0, 1, 100, 300, 700])]
        if dice.random() < 0.1:
            piece = bytes(len(piece))
        if dice.random() < 0.03:
            server.ann.http.delete(f"/v1/files/{sha256}")
            book.pop(sha256, None)
            continue
        span = f"{first}-{first + len(piece) - 1}" if piece else "*"
        answer = put(server.ann, sha256, piece, f"{span}/{len(data)}")
        begins = first if piece else len(data)
        if there is None:
            expected = 200
        elif begins != len(there):
            expected = 409
        else:
            arrived = there + piece
            expected = 200 if len(arrived) < len(data) else 201 if arrived == data else 422
            book[sha256] = arrived if expected == 200 else None
            if expected == 422:
                del book[sha256]
        assert answer.status_code == expected, answer.text
        found = server.ann.http.get(f"/v1/files/{sha256}")
        assert found.status_code == (200 if sha256 in book else 404)
        if sha256 in book:
            had = book[sha256]
            assert (found.json()["whole"], found.json()["offset"]) == (had is None, len(data if had is None else had))
    for data, sha256 in files:
        if sha256 in book and book[sha256] is None:
            assert (server.ann.runs / uploads.FOLDER / "ann" / sha256).read_bytes() == data


def test_bytes_that_have_another_hash_are_not_kept(server: Running) -> None:
    data, sha256 = made(500)
    put(server.ann, sha256, data[:100], "0-99/500")
    line = refused(put(server.ann, sha256, b"x" * 400, "100-499/500"), 422, "wrong_hash")
    assert line.startswith("the bytes that have arrived have the sha256 ")
    assert files_of(server.ann) == []


@pytest.mark.parametrize(
    ("headers", "status", "code", "line"),
    [
        ({"Content-Encoding": "gzip"}, 415, "unsupported_encoding", "a request body must not be encoded"),
        ({"Content-Range": "bytes 0-9/9"}, 400, "bad_range", "does not fit"),
        ({"Content-Range": "bytes 5-4/9"}, 400, "bad_range", "does not fit"),
        ({"Content-Range": "bytes 0-5/1000"}, 400, "bad_range", "does not fit Content-Length 10"),
        ({"Content-Range": "bytes 0-9/*"}, 400, "bad_range", "write bytes FIRST-LAST/SIZE"),
        ({"Content-Range": "bytes 0-9/" + "9" * 30}, 400, "bad_range", "write bytes FIRST-LAST/SIZE"),
        ({"Content-Range": "lines 0-9/10"}, 400, "bad_range", "write bytes FIRST-LAST/SIZE"),
        ({"Content-Range": "bytes 0-9/3001"}, 413, "too_large", "the file has 3.00 kB; this server allows 3.00 kB"),
        ({"Content-Range": "bytes 0-9/" + "9" * 18}, 413, "too_large", "this server allows 3.00 kB"),
    ],
)
def test_a_body_that_cannot_be_is_refused_before_it_is_read(
    server: Running, headers: dict[str, str], status: int, code: str, line: str
) -> None:
    assert line in refused(put(server.ann, made(10)[1], b"0123456789", **headers), status, code)
    assert files_of(server.ann) == []


def test_a_body_without_a_length_is_refused(server: Running) -> None:
    def endless() -> Iterator[bytes]:
        yield b"x" * 10

    refused(put(server.ann, made(10)[1], endless()), 411, "length_required")


@pytest.mark.parametrize("name", ["x", "0" * 63, "A" * 64, "0" * 65, "..", "%2e%2e%2fserver.sqlite", "0" * 64 + "%0a"])
def test_an_invalid_hash_names_no_file(server: Running, name: str) -> None:
    for answer in (put(server.ann, name, b"x"), server.ann.http.get(f"/v1/files/{name}")):
        assert answer.status_code in {400, 404, 405}
        assert "\n" not in answer.json()["detail"]
    assert files_of(server.ann) == []


def test_bytes_and_number_of_files_are_a_users_quota(server: Running) -> None:
    """A file that is being sent counts with its full size."""
    (first, one), (second, two) = made(3000, 1), made(2500, 2)
    assert put(server.ann, one, first[:10], "0-9/3000").status_code == 200
    line = refused(put(server.ann, two, second), 429, "file_quota")
    assert line == "the file has 2.50 kB, and your files 3.00 kB; this server allows 5.00 kB"
    assert put(server.bob, two, second).status_code == 201, "everybody has his own"
    for n in range(3):
        small, sha256 = made(10, n + 5)
        assert put(server.ann, sha256, small).status_code == 201
    tiny, sha256 = made(1, 9)
    line = refused(put(server.ann, sha256, tiny), 429, "file_quota")
    assert line == "you have uploaded 4 files; this server allows 4"
    assert put(server.ann, one, first[10:], "10-2999/3000").status_code == 201, "what has begun may end"


def test_a_user_gets_no_information_about_files_of_others(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    """The answers for a hash of another user's file and for an unknown hash are equal and take the same CPU time."""
    (there, none) = made(500, 1), made(500, 2)
    assert put(server.ann, there[1], there[0]).status_code == 201
    assert put(server.bob, made(1)[1], made(1)[0]).status_code == 201
    asked: list[str] = []
    for name in ("stat", "open", "scandir", "utime", "unlink"):
        real = getattr(os, name)

        def noted(path: Any, *more: Any, real: Any = real, name: str = name, **words: Any) -> Any:
            if uploads.FOLDER in str(path):
                asked.append(f"{name} {path}")
            return real(path, *more, **words)

        monkeypatch.setattr(os, name, noted)
    seen: list[tuple[list[Any], list[str]]] = []
    for _, sha256 in (there, none):
        asked.clear()
        http = server.bob.http
        answers = [
            http.get(f"/v1/files/{sha256}"),
            http.head(f"/v1/files/{sha256}"),
            http.delete(f"/v1/files/{sha256}"),
        ]
        answers += [http.get("/v1/files"), put(server.bob, sha256, b"x", "7-7/500")]
        seen.append(
            (
                [(a.status_code, a.text.replace(sha256, "HASH"), dict(a.headers)) for a in answers],
                [one.replace(sha256, "HASH") for one in asked],
            )
        )
        assert not any("/ann" in one for one in asked)
        server.bob.http.delete(f"/v1/files/{sha256}")
    assert seen[0] == seen[1]
    assert len(seen[0][1]) > 5
    assert server.nobody.http.get(f"/v1/files/{there[1]}").status_code == 401


def test_a_full_disk_refuses_in_one_line_and_keeps_what_has_come(
    server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, sha256 = made(1000)
    put(server.ann, sha256, data[:300], "0-299/1000")
    real = os.pwrite

    def full(fd: int, view: Any, offset: int) -> int:
        if offset >= 500:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(fd, view[: 500 - offset], offset)

    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", full)
        line = refused(put(server.ann, sha256, data[300:], "300-999/1000"), 507, "storage")
    assert line == "the file cannot be stored: No space left on device"
    assert server.ann.http.head(f"/v1/files/{sha256}").headers["Upload-Offset"] == "500"
    assert put(server.ann, sha256, data[500:], "500-999/1000").status_code == 201
    server.service.uploads._free_disk = 1 << 60
    other, name = made(1000, 2)
    assert "the server's disk has no space for 1.00 kB" in refused(put(server.ann, name, other), 507, "disk_full")
    assert files_of(server.ann) == [sha256]


def test_wherever_a_disk_fails_the_same_again_makes_the_file_whole(tmp_path: Path) -> None:
    """A fault occurs at each call that writes, at one call after the other. A file with its final name is always
    complete.
    """
    data, sha256 = made(1000)
    store, fired = Uploads(tmp_path, Files(), 0), 0

    def bring() -> None:
        found = store.find("ann", sha256)
        part = store.begin("ann", sha256, 1000, found.offset if found else 0)
        part.write(data[part.offset :])
        store.finish("ann", part)

    for n in range(20):
        plan = Plan(tmp_path, n, OSError(errno.EIO, "Input/output error"))
        with faults(plan), suppress(OSError):
            bring()
        fired += plan.fired
        if not (found := store.find("ann", sha256)) or not found.whole:
            bring()
        assert (tmp_path / uploads.FOLDER / "ann" / sha256).read_bytes() == data
        store.remove("ann", sha256)
    assert fired == 3, "opening, renaming, the name on disk"


def test_another_connection_waits_and_continues_a_stalled_one(server: Running) -> None:
    """The receiver has one transfer that received bytes recently, and another transfer without recent bytes."""
    data, sha256 = made(100)
    transfer = receiving._Transfer()
    book = server.service.receiver._open
    book["ann", sha256] = transfer
    assert refused(put(server.ann, sha256, data), 409, "in_progress") == "another connection brings this file"
    assert put(server.bob, sha256, data).status_code == 201, "of another user"
    transfer.received -= 2 * receiving._STALLED
    real = transfer.give_up

    def leave() -> None:
        real()
        del book["ann", sha256]
        transfer.over.set()

    transfer.give_up = leave  # type: ignore[method-assign]
    assert put(server.ann, sha256, data).status_code == 201
    assert transfer.given_up


def test_old_files_go_unless_a_run_or_a_sweep_needs_them(tmp_path: Path) -> None:
    store = Uploads(tmp_path, Files(age="1 h"), 0)
    now, hashes = time.time(), [made(10, n)[1] for n in range(5)]
    for n, sha256 in enumerate(hashes):
        part = store.begin("ann", sha256, 10, 0)
        part.write(made(10, n)[0][: 10 if n else 5])
        if n:
            store.finish("ann", part)
    folder = tmp_path / uploads.FOLDER / "ann"
    os.link(folder / hashes[1], tmp_path / "of a run")
    for path in folder.iterdir():
        os.utime(path, (now - 7200, now - 7200))
    assert store.find("ann", hashes[2]) is not None, "asked for: it is wanted"
    gone = store.purge(now, {hashes[3]})
    assert sorted(gone) == sorted(f"file {hashes[n]} of ann" for n in (0, 4))
    assert [each.sha256 for each in store.of("ann")] == sorted(hashes[1:4])
    assert store.purge(now + 3 * 3600)
    assert [each.sha256 for each in store.of("ann")] == [hashes[1]]
    (tmp_path / "of a run").unlink()
    store.purge(now + 3 * 3600)
    assert store.owners() == [], "an empty folder is gone"


def test_a_piece_held_by_a_hung_thread_does_not_affect_later_pieces(tmp_path: Path) -> None:
    store = Uploads(tmp_path, Files(), 0)
    data, sha256 = made(100)
    old = store.begin("ann", sha256, 100, 0)
    old.write(data[:50])
    new = store.begin("ann", sha256, 100, 50)
    assert new.offset == 50
    new.write(data[50:])
    old.write(data[50:70])
    store.finish("ann", new)
    assert (tmp_path / uploads.FOLDER / "ann" / sha256).read_bytes() == data


def test_a_link_beside_is_not_written_through(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").write_bytes(b"kept")
    os.symlink(tmp_path / "elsewhere", tmp_path / "x.part")
    with pytest.raises(OSError, match="symbolic links"):
        Part(tmp_path / "x.part", 10, anew=True)
    assert (tmp_path / "elsewhere").read_bytes() == b"kept"
