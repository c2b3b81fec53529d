"""Hostile bodies of HTTP requests: small bodies with a high cost, numbers that are not finite, incomplete
characters.
"""

import json
import random
import tomllib
from collections.abc import Iterator
from typing import Any

from .running import case_text

TOML, JSON = "application/toml", "application/json"
Body = tuple[str, str, bytes]
"""Name, content type and bytes of a request body."""
_SEED = 20260
VALUES: tuple[Any, ...] = (
    None, True, [], {}, "", "x" * 100_000, -1, 0, 2**63, 2**64, 10**400, 1e308, 1e160, 1e-160, 5e-324, "1e160 m",
    "1e999 m", "1 m^9", "\x1b]0;title\x07", "a\x00b", [[]] * 1000,
)  # fmt: skip


def good() -> dict[str, Any]:
    """Returns a valid case as plain data."""
    return tomllib.loads(case_text())


def corpus() -> list[Body]:
    """Returns all hostile HTTP request bodies; each call returns the same bodies."""
    made = [*_quadratic(), *_deep(), *_numbers(), *_text(), *_large(), *_replaced(), *_mutated()]
    return [(f"{n:03d} {name}", kind, body) for n, (name, kind, body) in enumerate(made)]


def quadratic() -> list[Body]:
    """Returns the HTTP request bodies whose cost grows faster than their size."""
    return [*_quadratic(), *_large()]


def _quadratic() -> Iterator[Body]:
    for n in (33, 1000, 40_000):
        chain = ".".join("a" * n)
        yield f"dotted key {n}", TOML, f"{chain} = 1".encode()
        yield f"dotted table {n}", TOML, f"[{chain}]\nb = 1".encode()
        yield f"quoted dotted key {n}", TOML, '."a"'.join(['"a"', *[""] * n]).encode() + b" = 1"
        yield f"dotted in an inline table {n}", TOML, f"a = {{ {chain} = 1 }}".encode()
    for n in (10, 1000, 20_000):
        pairs = ",".join(f'"k{i}":1' for i in range(n))
        yield f"repeated key {n}", JSON, f'{{{pairs},"k{n - 1}":2}}'.encode()
        yield f"unknown keys {n}", JSON, f"{{{pairs}}}".encode()
        yield (
            f"unknown keys in a part {n}",
            JSON,
            json.dumps({**good(), "parts": [dict.fromkeys(map(str, range(n)))]}).encode(),
        )
        yield f"tables {n}", TOML, "".join(f"[t{i}]\n" for i in range(n)).encode()
        yield f"repeated table {n}", TOML, b"[t]\n" * n
        yield f"super tables {n}", TOML, "".join(f"[a.b.c.d{i}.e]\n" for i in range(n)).encode()
    yield "a long unknown key", JSON, json.dumps({"k" * 500_000: 1}).encode()
    yield "a long word for a quantity", JSON, _with(("run", "end_time"), "1" * 500_000)
    yield "a long unit", JSON, _with(("run", "end_time"), "1 " + "m*" * 200_000)


def _deep() -> Iterator[Body]:
    for n in (10, 100, 1000, 100_000):
        yield f"arrays in arrays {n}", JSON, b"[" * n + b"]" * n
        yield f"arrays in arrays in a case {n}", JSON, b'{"parts":' + b"[" * n + b"]" * n + b"}"
        yield f"objects in objects {n}", JSON, b'{"a":' * n + b"1" + b"}" * n
        yield f"arrays in arrays in TOML {n}", TOML, b"a = " + b"[" * n + b"]" * n
        yield f"tables in tables in TOML {n}", TOML, b"a = " + b"{b=" * n + b"1" + b"}" * n
        yield f"open arrays {n}", JSON, b"[" * n


def _numbers() -> Iterator[Body]:
    for digits in (4299, 4300, 5000, 300_000):
        yield f"{digits} digits in TOML", TOML, b"a = " + b"9" * digits
        yield f"{digits} digits in JSON", JSON, b'{"a": ' + b"9" * digits + b"}"
        yield f"{digits} digits as an end", TOML, case_text().replace('"1 us"', "9" * digits).encode()
    for word in ("NaN", "Infinity", "-Infinity", "1e999", "-1e999"):
        yield f"{word} as an end", JSON, _with(("run", "end_time"), "@").replace(b'"@"', word.encode())
        yield f"{word} ranks", JSON, _with(("run", "ranks"), "@").replace(b'"@"', word.encode())
        yield f"{word} frames", JSON, _with(("run", "frames"), "@").replace(b'"@"', word.encode())
    for word in ("nan", "inf", "-inf", "1e999"):
        yield f"{word} in TOML", TOML, case_text().replace('"1 us"', word).encode()
    for size in ("1e160", "1e-160", "1e-300", "1e300", "5e-324", "1.7e308"):
        yield f"elements of {size} m", TOML, case_text().replace('"0.5 mm"', size).encode()
        body = case_text().replace('"4 mm"', size).replace('"0.5 mm"', size)
        yield f"a body of {size} m", TOML, body.encode()
        yield f"an end of {size} s", TOML, case_text().replace('"1 us"', size).encode()


def _text() -> Iterator[Body]:
    for name, word in (("low", "\\ud800"), ("high", "\\udc00"), ("turned round", "\\udc00\\ud800")):
        for key in ("title", "name", "description"):
            text = json.dumps({**good(), key: "@"}).replace("@", word)
            yield f"half a character in the {key}, {name}", JSON, text.encode()
        yield f"half a character as a key, {name}", JSON, f'{{"{word}": 1}}'.encode()
        yield (
            f"half a character as a material, {name}",
            JSON,
            _with(("parts", 0, "material"), "@").replace(b"@", word.encode()),
        )
    for n, raw in enumerate(
        (b"\xff\xfe", b"\xed\xa0\x80", b"\xc0\x80", b"\xf8\x88\x80\x80\x80", b"\x00", b"\xef\xbb\xbf")
    ):
        yield f"bytes {n} in TOML", TOML, raw + case_text().encode()
        yield f"bytes {n} in JSON", JSON, raw + json.dumps(good()).encode()
        yield f"bytes {n} in a title", TOML, case_text().encode().replace(b"A bar", b"A " + raw)
    for word in ("\x1b[2J", "\x1b]52;c;cm0=\x07", "\x9b31m", "\x7f", "\u202e", "\r\n"):
        yield f"a title with {word!r}", JSON, _with(("title",), word)
    for body in (
        b"",
        b" ",
        b"\n" * 1000,
        b"null",
        b"1",
        b'"a"',
        b"{}",
        b"[]",
        b"{",
        b'{"a"',
        b"true",
        b"a",
        b"=",
        b"[[",
        b"'''",
    ):
        yield f"{body[:9]!r} as JSON", JSON, body
        yield f"{body[:9]!r} as TOML", TOML, body


def _large() -> Iterator[Body]:
    part, wall = good()["parts"][0], {"kind": "wall", "point": [0, 0, 0], "normal": [0, 0, 1]}
    ball = {"shape": "sphere", "radius": 0.002, "element_size": 0.0005}
    grading = {"near": 0.0005, "far": 0.002, "far_size": 0.001}
    for n in (64, 256):
        balls = [
            {**part, "name": f"b{i}", "mesh": {**ball, "centre": at, "grading": {**grading, "origin": at}}}
            for i in range(n)
            for at in [[0.01 * (i % 16), 0.01 * (i // 16), 0.0]]
        ]
        yield f"graded balls {n}", JSON, json.dumps({**good(), "parts": balls}).encode()
    for n in (300, 3000):
        yield (
            f"parts {n}",
            JSON,
            json.dumps({**good(), "parts": [{**part, "name": f"p{i}"} for i in range(n)]}).encode(),
        )
        yield f"walls {n}", JSON, json.dumps({**good(), "boundaries": [wall] * n}).encode()
        named = {f"m{i}": good()["materials"]["steel"] for i in range(n)}
        yield f"materials {n}", JSON, json.dumps({**good(), "materials": {**good()["materials"], **named}}).encode()
        yield f"wrong parts {n}", JSON, json.dumps({**good(), "parts": [{}] * n}).encode()


def _replaced() -> Iterator[Body]:
    """Yields copies of a valid case with one wrong value: every third combination of a key and a value."""
    places = list(_places(good()))
    wrong = [(place, value) for place in places for value in VALUES]
    for place, value in wrong[::3]:
        yield f"{'.'.join(map(str, place))} = {str(value)[:20]!r}", JSON, _with(place, value)


def _mutated() -> Iterator[Body]:
    chance = random.Random(_SEED)
    for n in range(60):
        for kind, text in ((TOML, case_text().encode()), (JSON, json.dumps(good()).encode())):
            body = bytearray(text)
            for _ in range(chance.randint(1, 5)):
                body[chance.randrange(len(body))] = chance.randrange(256)
            yield f"mutation {n}", kind, bytes(body[: chance.randint(1, len(body))] if n % 3 == 0 else body)


def _places(data: Any, place: tuple[int | str, ...] = ()) -> Iterator[tuple[int | str, ...]]:
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield (*place, key)
        yield from _places(value, (*place, key))


def _with(place: tuple[int | str, ...], value: Any) -> bytes:
    """Returns a valid case with the given value at the given key."""
    case = good()
    inner: Any = case
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    return json.dumps(case).encode()
