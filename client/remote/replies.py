"""Data of an HTTP answer: problem, redirect, announced size. The module also has the reasons of a broken connection."""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import httpx2

from conoid.cases.figures import size

from ..errors import ClientError

WORDS = 300
"""Largest number of characters of an error message that are shown (chosen value)."""
LONGEST = 1 << 28
"""Largest size, bytes, of an answer that is read into memory or has no announced length (chosen value: ten times the
largest snapshot)."""


def problem(status: int, content: bytes) -> Mapping[str, Any]:
    """Returns the problem of a refusal; a general problem if the content of the answer is not JSON."""
    try:
        body = json.loads(content)
    except (ValueError, RecursionError):
        body = None
    return body if isinstance(body, dict) else {"title": f"the server answered {status}"}


def place(response: httpx2.Response) -> str:
    """Returns the target of a redirect. If the address is invalid, it is returned as the server has written it."""
    return repr(response.headers.get("location", "nowhere")[:WORDS])


def most(response: httpx2.Response, target: Path) -> int:
    """Returns the largest allowed size of a downloaded file: the announced size if the disk has enough space. Raises
    ClientError.
    """
    length = response.headers.get("content-length", "")
    if not length.isdecimal() or "content-encoding" in response.headers:
        return LONGEST
    free = shutil.disk_usage(target.parent).free
    if int(length) > free:
        raise ClientError(
            f"{target}: cannot be written: the file has {size(int(length))}, and {size(free)} of the disk are free"
        )
    return int(length)


def reason(error: Exception) -> str:
    """Returns, in one line, why no answer has arrived."""
    if isinstance(error, httpx2.ConnectError):
        return "is a server running there? (conoid serve; another address: CONOID_URL or --url)"
    return " ".join(str(error).split()) or type(error).__name__


def visible(text: str) -> bool:
    """Returns True if all characters are visible ASCII, as HTTP requires of a header."""
    return all("!" <= letter <= "~" for letter in text)
