"""The live page: files of Conoid, and two JavaScript libraries from an installed Python package.

The libraries three.js and ECharts are ES modules inside the Python package ``nicegui``. The paths of the files are read
from the metadata of ``nicegui``. The package itself is not imported, so that its dependencies need not be installed.
All files of the page are read once, at the start of the server: no request opens a file.
"""

import gzip
import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path

from fastapi import FastAPI
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from .. import errors
from .download import is_known

PACKAGE, VERSION = "nicegui", "3.18.0"
TESTED = {
    "echarts/index.js": (
        "nicegui/elements/echart/dist/index.js",
        "1d2ba6aca0b953103efb38e40ce29fc0fb71f3b04d94de0f0133c166197b789e",
    ),
    "echarts/index-DlVyZyb_.js": (
        "nicegui/elements/echart/dist/index-DlVyZyb_.js",
        "a67fedec464a22765df705cc09ee7fe16268e32535fbc74dcb5c74c52a02b01d",
    ),
    "three/index.js": (
        "nicegui/elements/scene/dist/index.js",
        "f55227d12dac0eb037cae13b1992091746fc017a275748e4a1bebd0f6244e7e5",
    ),
}
"""The files of the libraries, by the path in their address: path in the package, and SHA-256 hash in the wheel of
``VERSION`` on PyPI."""
_FOREVER = "public, max-age=31536000, immutable"
"""Caching header of a file whose address contains its version. The file is cached for a year, the longest time that RFC
9111 allows."""
_WORTH = 1 << 10
"""Smallest size in bytes of a file that is compressed: the size of one network packet (chosen value)."""
_TYPES = {
    ".js": "text/javascript", ".css": "text/css", ".html": "text/html", ".json": "application/json",
    ".svg": "image/svg+xml", ".png": "image/png",
}  # fmt: skip
_FILE = re.compile(r'((?:href|src)=)"([^"]*)"')
"""Pattern of an address of a file in index.html."""
_LEVEL = 6
"""Compression level of gzip. At this level 1.1 MB of files are compressed to 0.37 MB in 50 ms."""


class LibraryError(Exception):
    """Error: the JavaScript libraries cannot be served. The text of this error is one line."""


@dataclass(frozen=True)
class Library:
    """A file of the page with its HTTP headers."""

    plain: bytes

    @cached_property
    def zipped(self) -> bytes:
        """Returns the file compressed by gzip; it is compressed at the first call."""
        return gzip.compress(self.plain, _LEVEL, mtime=0)

    @cached_property
    def _digest(self) -> str:
        return hashlib.sha256(self.plain).hexdigest()[:32]

    def tag(self, zipped: bool) -> str:
        """Returns the ETag of the file, plain or compressed."""
        return f'"{self._digest}{"-gzip" if zipped else ""}"'


def libraries() -> dict[str, Library]:
    """Returns the files of the JavaScript libraries by address. Raises LibraryError if the package with the libraries
    is missing or has another version.
    """
    cure = f"pip install --no-deps {PACKAGE}=={VERSION}"
    try:
        installed = metadata.distribution(PACKAGE)
    except metadata.PackageNotFoundError:
        raise LibraryError(f"{PACKAGE} {VERSION} is not installed: {cure}") from None
    if installed.version != VERSION:
        raise LibraryError(f"{PACKAGE} {installed.version} is installed, tested is {VERSION}: {cure}")
    return {
        address: _tested(Path(str(installed.locate_file(name))), digest) for address, (name, digest) in TESTED.items()
    }


def _tested(path: Path, digest: str) -> Library:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise LibraryError(f"{path}: {error.strerror}") from None
    if hashlib.sha256(content).hexdigest() != digest:
        raise LibraryError(f"{path}: not the file of {PACKAGE} {VERSION} that was tested (sha256 differs)")
    return Library(content)


def install(app: FastAPI, web: Path, *, auth: bool) -> str:
    """Mounts the page at ``/`` and the JavaScript libraries at ``/lib``. Returns the reason why the libraries cannot
    be served; empty if they can be served. Raises OSError if the page cannot be read.
    """
    found: Mapping[str, Library] = {}
    problem = ""
    try:
        found = libraries()
    except LibraryError as error:
        problem = str(error)
    known = {"auth": auth, "problem": problem}
    names = {name: f"lib/{VERSION}/{name}/index.js" if found else None for name in ("echarts", "three")}
    index = Library(json.dumps({**known, **names}).encode())
    page = {str(path.relative_to(web)): Library(path.read_bytes()) for path in web.rglob("*") if _is_shown(path)}
    app.mount("/lib", _Files({"index.json": index}, {f"{VERSION}/{name}": file for name, file in found.items()}))
    app.mount("/", _Files(*_addressed(page)))
    return problem


def _addressed(page: Mapping[str, Library]) -> tuple[dict[str, Library], dict[str, Library]]:
    """Returns the files of the page by address, and a second time by addresses that contain a hash of all files. The
    file index.html names all scripts with these addresses, because a browser learns what a script imports only after
    the script has arrived.
    """
    if "index.html" not in page:
        return dict(page), {}
    every = hashlib.sha256(b"".join(name.encode() + file.plain for name, file in sorted(page.items())))
    place = f"page/{every.hexdigest()[:16]}/"
    text = _FILE.sub(
        lambda found: f'{found[1]}"{place * (found[2] in page)}{found[2]}"', page["index.html"].plain.decode()
    )
    scripts = [f'  <link rel="modulepreload" href="{place}{name}">\n' for name in sorted(page) if name.endswith(".js")]
    index = Library(text.replace("</head>", f"{''.join(scripts)}</head>").encode())
    return {**page, "index.html": index, "": index}, {place + name: file for name, file in page.items()}


def _is_shown(path: Path) -> bool:
    """Whether a file in the folder of the page belongs to the page; the folder is also a Python package."""
    return path.is_file() and not path.parent.name.startswith("_") and not path.name.startswith(("_", "."))


class _Files:
    """Serves files from memory, by their addresses. A browser must ask at each use whether a file in ``fresh`` has
    changed, because a newer server may have another version.
    """

    def __init__(self, fresh: Mapping[str, Library], lasting: Mapping[str, Library]) -> None:
        self._fresh, self._lasting = fresh, lasting

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Raises HTTPException 405 if the method is not GET or HEAD, and 404 if the address is unknown. Every address
        that has no route reaches this object.
        """
        address = scope["path"].removeprefix(scope["root_path"]).removeprefix("/")
        file, lasts = self._fresh.get(address) or self._lasting.get(address), address in self._lasting
        if file is None or scope["method"] != "GET":
            known = file is not None or errors.allowed(scope["app"], scope["path"])
            raise HTTPException(405 if known else 404)
        await _answer(Request(scope), address, file, lasts)(scope, receive, send)


def _answer(request: Request, address: str, file: Library, lasts: bool) -> Response:
    zipped = "gzip" in request.headers.get("accept-encoding", "") and len(file.plain) > _WORTH
    headers = {"Cache-Control": _FOREVER if lasts else "no-cache", "Vary": "Accept-Encoding", "ETag": file.tag(zipped)}
    if is_known(headers["ETag"], request.headers.get("if-none-match", "")):
        return Response(status_code=304, headers=headers)
    if zipped:
        headers["Content-Encoding"] = "gzip"
    kind = _TYPES.get(Path(address or "index.html").suffix, "application/octet-stream")
    return Response(file.zipped if zipped else file.plain, media_type=kind, headers=headers)
