"""Replay in 3-D inside of a report: one file with the modules of the page, three.js and the snapshots of a run.

The modules import each other by relative addresses, which a page without an address cannot resolve. Therefore a
report has an import map with an entry ``conoid/NAME`` for each module. Small modules that read the embedded data
replace the modules that send requests to the server. Modules and snapshots are compressed with gzip, which browsers
can decompress.
"""

import base64
import gzip
import hashlib
import json
import re
from collections.abc import Sequence
from html import escape
from importlib import metadata
from pathlib import Path
from typing import Any

from conoid.cases.messages import Snapshot
from conoid.cases.output import layout

from ..errors import ClientError
from ..result import Result

FIRST = "body.js"
"""Module that draws the bodies in 3-D. A report embeds this module and all modules that it imports."""
PACKAGE, VERSION = "nicegui", "3.18.0"
THREE = (
    "nicegui/elements/scene/dist/index.js",
    "f55227d12dac0eb037cae13b1992091746fc017a275748e4a1bebd0f6244e7e5",
)
"""Path of three.js in its package, and its sha256 in the wheel of ``VERSION`` on PyPI. The live page uses the same
file."""
MOST = 24
"""Largest number of snapshots in a report, evenly spaced over the run; fewer if the snapshots are too large (chosen
value)."""
BUDGET = 2_200_000
"""Largest total size of the compressed snapshots in a report, bytes. Base64 makes the snapshots a third larger (chosen
value: the whole report stays below 5 MB)."""
_WEB = Path(__file__).parent.parent / "web"
_IMPORT = re.compile(r"""(?:import|export)\s*(?:\{([^}]*)\}|\*)?[^;'"]*["']\./([\w-]+\.js)["']""")
_RELATIVE = re.compile(r"""(from\s*|import\s*\(\s*|import\s+)(["'])\./""")
_OF_SERVER = {
    "api.js": {
        "binary": """async (path) => {
  const [, n, tets] = /snapshots\\/(\\d+)(\\/tets)?$/.exec(path);
  return conoid[tets ? "bytes" : "unzip"](tets ? `tets-${n}` : `snapshot-${n}`);
}""",
        "call": """async (path) => {
  if (path.endsWith("case.resolved.json")) return JSON.parse(document.getElementById("case").textContent);
  throw new Error("a report does not have it");
}""",
    },
    "libraries.js": {"three": '() => import("conoid/three")'},
}
"""Exports of the small modules that replace the modules with requests to the server."""
_ABSENT = '() => { throw new Error("a report has no server"); }'
_START = """
import { Body } from "conoid/body.js";
const body = new Body("report", () => {});
document.getElementById("replay").replaceWith(body.element);
body.element.id = "replay";
body.update(JSON.parse(document.getElementById("snapshots").textContent));
"""
_BOOT = """
(async () => {
  const bytes = (id) => Uint8Array.from(atob(document.getElementById(id).textContent), (letter) => letter.charCodeAt(0)).buffer;
  const unzip = (id) => new Response(new Blob([bytes(id)]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
  const script = (type, text) => document.body.append(Object.assign(document.createElement("script"), { type, textContent: text }));
  globalThis.conoid = { bytes, unzip };
  try {
    const modules = Object.entries(JSON.parse(new TextDecoder().decode(await unzip("modules"))));
    const imports = Object.fromEntries(modules.map(([name, code]) => [name, `data:text/javascript,${encodeURIComponent(code)}`]));
    script("importmap", JSON.stringify({ imports }));
    script("module", document.getElementById("start").textContent);
  } catch (error) {
    document.getElementById("replay").textContent = `No replay in 3-D: ${error.message}`;
  }
})();
"""  # noqa: E501


def html(result: Result) -> str:
    """Returns the HTML of the replay; a text line with the reason if three.js is not installed; empty for a run
    without snapshots.
    """
    names = [name for name in result.folder.names() if re.fullmatch(rf"{layout.SNAPSHOTS}/\d+\.snap", name)]
    if not names or not (_WEB / FIRST).is_file():
        return ""
    try:
        code = modules(three().decode())
    except ClientError as error:
        return f"<p class=hint>No replay in 3-D: {escape(str(error))}</p>"
    entries, embedded = _snapshots(result, names)
    packed = gzip.compress(json.dumps(code).encode(), mtime=0)
    return "".join([
        '<section id=replay class=card><p class=hint>The replay in 3-D is being unpacked …</p></section>', *embedded,
        _script("application/json", _json(entries), "snapshots"),
        _script("application/json", _json(result.case), "case"),
        _script("application/octet-stream", _base64(packed), "modules"),
        _script("text/plain", _START, "start"), f"<script>{_BOOT}</script>",
    ])  # fmt: skip


def _snapshots(result: Result, names: Sequence[str]) -> tuple[list[dict[str, Any]], list[str]]:
    """Returns the entries of the list of snapshots, and scripts with the bytes of the snapshots. Snapshots of all
    tets are added while the total size stays below the limit.
    """
    announced = {message.n: message for message in _messages(result) if isinstance(message, Snapshot)}
    packed = _packed(result, names)
    room = BUDGET - sum(map(len, packed.values()))
    entries, embedded = [], []
    for name, data in packed.items():
        n, tets, entry = int(Path(name).stem), name.replace(".snap", ".tets"), {"bytes": len(data), "tets": 0}
        if tets in result.folder.names():
            volume = result.folder.path(tets).read_bytes()
            if len(volume) < room:
                room -= len(volume)
                entry["tets"] = len(volume)
                embedded.append(_script("application/octet-stream", _base64(volume), f"tets-{n}"))
        entries.append(
            {"n": n, **entry, **({"t": announced[n].t, "fields": announced[n].fields} if n in announced else {})}
        )
        embedded.append(_script("application/octet-stream", _base64(data), f"snapshot-{n}"))
    return entries, embedded


def _packed(result: Result, names: Sequence[str]) -> dict[str, bytes]:
    """Returns as many compressed snapshots as the size limit allows, at least the first and the last snapshot."""
    packed = {name: gzip.compress(result.folder.path(name).read_bytes(), mtime=0) for name in spread(names, MOST)}
    while len(packed) > 2 and sum(map(len, packed.values())) > BUDGET:
        kept = spread(list(packed), max(2, len(packed) * 4 // 5))
        packed = {name: packed[name] for name in kept}
    return packed


def _messages(result: Result) -> list[Any]:
    try:
        return list(result.messages)
    except ClientError:
        return []


def spread(names: Sequence[str], most: int) -> list[str]:
    """Returns at most ``most`` names, evenly spaced in the list, with the first and the last name."""
    return sorted({names[round(k * (len(names) - 1) / max(most - 1, 1))] for k in range(most)})


def modules(library: str) -> dict[str, str]:
    """Returns the code of all modules of the replay by their names in the import map; ``library``: code of three.js."""
    found, asked, waiting = {"conoid/three": library}, {name: set(known) for name, known in _OF_SERVER.items()}, [FIRST]
    while waiting:
        name = waiting.pop()
        code = (_WEB / name).read_text(encoding="utf-8")
        found[f"conoid/{name}"] = _RELATIVE.sub(r"\1\2conoid/", code)
        for names, other in _IMPORT.findall(code):
            if other in asked:
                asked[other] |= {each.split(" as ")[0].strip() for each in names.split(",") if each.strip()}
            elif f"conoid/{other}" not in found:
                waiting.append(other)
    return found | {f"conoid/{name}": _stand_in(name, wanted) for name, wanted in asked.items()}


def _stand_in(module: str, wanted: set[str]) -> str:
    known = _OF_SERVER[module]
    return "\n".join(f"export const {name} = {known.get(name, _ABSENT)};" for name in sorted(wanted))


def three() -> bytes:
    """Reads three.js from the installed package without importing the package. Raises ClientError for another
    version than the tested version.
    """
    cure = f"pip install --no-deps {PACKAGE}=={VERSION}"
    try:
        installed = metadata.distribution(PACKAGE)
        content = Path(str(installed.locate_file(THREE[0]))).read_bytes()
    except (metadata.PackageNotFoundError, OSError):
        raise ClientError(f"{PACKAGE} {VERSION} is not installed: {cure}") from None
    if hashlib.sha256(content).hexdigest() != THREE[1]:
        raise ClientError(f"{PACKAGE} {installed.version} is installed, but the tested version is {VERSION}: {cure}")
    return content


def _script(kind: str, content: str, name: str) -> str:
    return f'<script type="{kind}" id={name}>{content}</script>'


def _json(data: object) -> str:
    return json.dumps(data).replace("</", "<\\/")


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()
