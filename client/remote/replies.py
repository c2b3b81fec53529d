"""Parts of an HTTP answer: problem, redirect, announced size; reasons of a broken connection."""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import httpx2

from conoid.cases.figures import size

from ..errors import ClientError

WORDS = 300
"""Largest number of characters of an error message that are shown. Chosen value."""
LONGEST = 1 << 28
"""Largest size of an answer that is read into memory, or has no length, bytes. Chosen value: ten times the largest
snapshot."""


def problem(status: int, content: bytes) -> Mapping[str, Any]:
    """Returns the problem of a refusal; a replacement if the body is not JSON."""
    try:
        body = json.loads(content)
    except (ValueError, RecursionError):
        body = None
    return body if isinstance(body, dict) else {"title": f"the server answered {status}"}


def place(response: httpx2.Response) -> str:
    """Returns the target of a redirect; the address as it is written may be invalid."""
    return repr(response.headers.get("location", "nowhere")[:WORDS])


def most(response: httpx2.Response, target: Path) -> int:
    """Returns the largest size of a downloaded file: its announced size if the disk has enough space. Raises
    ClientError.
    """
    length = response.headers.get("content-length", "")
    if not length.isdecimal() or "content-encoding" in response.headers:
        return LONGEST
    free = shutil.disk_usage(target.parent).free
    if int(length) > free:
        raise ClientError(f"{target}: cannot be written: it has {size(int(length))}, and {size(free)} are free")
    return int(length)


def reason(error: Exception) -> str:
    """Returns the reason for a missing answer in one line."""
    if isinstance(error, httpx2.ConnectError):
        return "is it running there? (conoid serve; another address: CONOID_URL or --url)"
    return " ".join(str(error).split()) or type(error).__name__


def visible(text: str) -> bool:
    """Returns True if all characters are visible ASCII, as a header requires."""
    return all("!" <= letter <= "~" for letter in text)
