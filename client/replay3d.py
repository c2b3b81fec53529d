"""The 3-D replay inside a report: the page's own modules, three.js and the snapshots of a run, all in one file.

The modules import each other by relative addresses, which a page without an address cannot resolve: here they are
entries of an import map, called ``conoid/NAME``. Two of them ask the server: small ones take their place.
"""

import base64
import hashlib
import json
import re
from html import escape
from importlib import metadata
from pathlib import Path

from conoid.cases import layout

from .errors import ClientError
from .result import Result

MODULES = (
    "arrows.js", "body.js", "colours.js", "eye.js", "figures.js", "framing.js", "keys.js", "outlines.js", "overlay.js",
    "picked.js", "ranges.js", "saving.js", "scales.js", "section.js", "shaders.js", "snapshot.js", "surface.js",
    "tools.js", "view3d.js",
)  # fmt: skip
"""Of the live page, without what asks a server."""
PACKAGE, VERSION = "nicegui", "3.18.0"
THREE = (
    "nicegui/elements/scene/dist/index.js",
    "f55227d12dac0eb037cae13b1992091746fc017a275748e4a1bebd0f6244e7e5",
)
"""three.js as the live page has it: the file in the package, and its sha256 in the wheel of ``VERSION`` on PyPI."""
MOST = 24
"""Snapshots that are embedded, evenly over the run. Chosen: of 1 MB each they make a file of 33 MB."""
_WEB = Path(__file__).parent / "web"
_RELATIVE = re.compile(r"""(from\s*|import\s*\(\s*)(["'])\./""")
_API = """
export async function binary(path) {
  const text = document.getElementById(`snapshot-${path.split("/").pop()}`).textContent;
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
}
export async function call(path) {
  if (path.endsWith("/case.resolved.json")) return JSON.parse(document.getElementById("case").textContent);
  throw new Error("there is no server");
}
"""
_LIBRARIES = 'export const three = () => import("conoid/three");'
_START = """
import { Body } from "conoid/body.js";
const body = new Body("report", () => {});
document.getElementById("replay").append(body.element);
body.update(JSON.parse(document.getElementById("snapshots").textContent));
"""
_STYLE = """
#replay { --soft: #5a6775; --accent: #1f6feb; --line: #d9e0e7; --ink: #1c2530; --paper: #f6f7f9 }
#replay { --card: #ffffff; --track: #e6eaef }
#replay [hidden], #replay h2 { display: none }
#replay button, #replay select, #replay input { font: inherit }
#replay .frame3d { height: min(64vh, 540px); flex: none }
.card-head .note, .field { color: var(--soft); font-size: 13.5px } .field { display: inline-flex; align-items: center }
.key { width: .7rem; height: .7rem }
"""
"""Beside body.css: what the page has from its own style sheet."""


def html(result: Result) -> str:
    """The replay of a run's snapshots; a line where three.js is not installed; nothing where there is no snapshot."""
    names = [name for name in result.folder.names() if re.fullmatch(rf"{layout.SNAPSHOTS}/\d+\.snap", name)]
    if not names or not (_WEB / "body.js").is_file():
        return ""
    try:
        imports = {"conoid/three": three(), "conoid/api.js": _API.encode(), "conoid/libraries.js": _LIBRARIES.encode()}
    except ClientError as error:
        return f"<p class=pale>no replay in 3-D: {escape(str(error))}</p>"
    imports |= {f"conoid/{name}": _bare((_WEB / name).read_text(encoding="utf-8")) for name in MODULES}
    chosen = sorted({names[round(k * (len(names) - 1) / max(MOST - 1, 1))] for k in range(MOST)})
    entries, embedded = [], []
    for name in chosen:
        blob = result.folder.path(name).read_bytes()
        entries.append({"n": int(Path(name).stem), "bytes": len(blob)})
        embedded.append(_script("application/octet-stream", _base64(blob), f"snapshot-{int(Path(name).stem)}"))
    addresses = {name: f"data:text/javascript;base64,{_base64(code)}" for name, code in imports.items()}
    return "".join([
        f"<style>{_STYLE}{(_WEB / 'body.css').read_text(encoding='utf-8')}</style><div id=replay></div>", *embedded,
        _script("application/json", _json(_case(result)), "case"),
        _script("application/json", _json(entries), "snapshots"),
        _script("importmap", _json({"imports": addresses})), _script("module", _START),
    ])  # fmt: skip


def _case(result: Result) -> object:
    """The case with every default; null where it is not there."""
    try:
        return json.loads(result.folder.path(layout.RESOLVED_CASE).read_bytes())
    except (ClientError, OSError, ValueError):
        return None


def three() -> bytes:
    """three.js out of the installed package, which is not imported. Raises ClientError for any but the tested one."""
    cure = f"pip install --no-deps {PACKAGE}=={VERSION}"
    try:
        installed = metadata.distribution(PACKAGE)
        content = Path(str(installed.locate_file(THREE[0]))).read_bytes()
    except (metadata.PackageNotFoundError, OSError):
        raise ClientError(f"{PACKAGE} {VERSION} is not installed: {cure}") from None
    if hashlib.sha256(content).hexdigest() != THREE[1]:
        raise ClientError(f"{PACKAGE} {installed.version} is installed, tested is {VERSION}: {cure}")
    return content


def _bare(code: str) -> bytes:
    """A module with its imports by the names of the import map."""
    return _RELATIVE.sub(r"\1\2conoid/", code).encode()


def _script(kind: str, content: str, name: str = "") -> str:
    return f'<script type="{kind}"{f" id={name}" if name else ""}>{content}</script>'


def _json(data: object) -> str:
    return json.dumps(data).replace("</", "<\\/")


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()
