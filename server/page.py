"""The live page: its own files, and the two JavaScript libraries that it draws with, out of an installed wheel.

three.js and ECharts come as ES modules inside the package ``nicegui``. Its metadata says where the files are; they are
served, and the package is never imported: what it needs itself is not needed here.
"""

import gzip
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path

from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route
from starlette.types import Scope

from . import errors

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
"""Address below the version: the file in the package, and its sha256 in the wheel of ``VERSION`` on PyPI."""
_FOREVER = "public, max-age=31536000, immutable"
"""The version is part of the address. One year is the longest that RFC 9111's readers take."""
_LEVEL = 6
"""Of gzip: 1.1 MB become 0.37 MB in 50 ms, once."""


class LibraryError(Exception):
    """The libraries cannot be served; the text is one line."""


@dataclass(frozen=True)
class Library:
    """One file as it is sent."""

    plain: bytes

    @cached_property
    def zipped(self) -> bytes:
        """Compressed at the first request."""
        return gzip.compress(self.plain, _LEVEL, mtime=0)


def libraries() -> dict[str, Library]:
    """The tested files, by address. Raises LibraryError if the package is absent or is another one."""
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
    """Mounts the page at ``/`` and the libraries at ``/lib``; what is wrong with the libraries, or an empty text."""
    files: Mapping[str, Library] = {}
    problem = ""
    try:
        files = libraries()
    except LibraryError as error:
        problem = str(error)
    app.mount("/lib", _served(files, problem, auth), name="libraries")
    app.mount("/", _Page(directory=web, html=True), name="page")
    return problem


class _Page(StaticFiles):
    """The page's own files. A browser asks each time whether they are still the same: a server may be a newer one."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Raises HTTPException 405 for what the server answers to other methods, and 404 whatever is asked of what is
        not there: the mount sees every address that no route takes.
        """
        if self.lookup_path(path)[1] is None:
            known = errors.allowed(scope["app"], scope["path"])
            if known or scope["method"] not in {"GET", "HEAD"}:
                raise HTTPException(405 if known else 404)
        answer = await super().get_response(path, scope)
        answer.headers["Cache-Control"] = "no-cache"
        return answer


def _served(files: Mapping[str, Library], problem: str, auth: bool) -> Starlette:
    names = {name: f"lib/{VERSION}/{name}/index.js" if files else None for name in ("echarts", "three")}
    known = {"auth": auth, "problem": problem, **names}

    def index(_: Request) -> Response:
        return JSONResponse(known, headers={"Cache-Control": "no-cache"})

    def content(request: Request) -> Response:
        found = files.get(request.path_params["address"])
        if found is None:
            raise HTTPException(404)
        headers = {"Cache-Control": _FOREVER, "Vary": "Accept-Encoding"}
        if "gzip" not in request.headers.get("accept-encoding", ""):
            return Response(found.plain, media_type="text/javascript", headers=headers)
        headers["Content-Encoding"] = "gzip"
        return Response(found.zipped, media_type="text/javascript", headers=headers)

    return Starlette(routes=[Route("/index.json", index), Route(f"/{VERSION}/{{address:path}}", content)])
