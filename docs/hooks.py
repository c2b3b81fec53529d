"""Hooks of the documentation site: pages of notebooks and of the repository's root, links, mermaid, checks of the built
site."""

import json
import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

_OUTSIDE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+(?:deploy|cases|tests|client|server|worker)[^)]*\)")
_LOADED = re.compile(
    r'<(?:script|img|iframe)\b[^>]*\bsrc="?(?:https?:)?//[^>]*>'
    r'|<link\b[^>]*\brel="?stylesheet[^>]*href="?(?:https?:)?//[^>]*>'
)
"""An HTML element that loads from another site; a link that the reader may follow is not included."""
_KEYS_PAGE = "reference/case.html"
_ROOT = Path(__file__).parents[1]
_ROOT_PAGES = ("ARCHITECTURE.md", "CONVENTIONS.md", "CONTRIBUTING.md", "CHANGELOG.md")
_SCHEMA = _ROOT / "cases" / "case.schema.json"


def on_files(files: Files, *, config: Any) -> Files:
    """Adds pages of notebooks and of the repository's root, and the files of mermaid, from the package nicegui."""
    for file in [file for file in files if file.src_uri.endswith(".ipynb")]:
        files.append(File.generated(config, file.src_uri.removesuffix(".ipynb") + ".md", content=_notebook(file)))
    for page in _ROOT_PAGES:
        text = (_ROOT / page).read_text(encoding="utf-8")
        files.append(File.generated(config, f"project/{page.lower()}", content=_from_root(text)))
    (nicegui,) = find_spec("nicegui").submodule_search_locations  # type: ignore[union-attr, misc]
    for script in Path(nicegui).glob("elements/mermaid/dist/*.js"):
        files.append(File.generated(config, f"assets/mermaid/{script.name}", abs_src_path=str(script)))
    return files


def _notebook(file: File) -> str:
    """Returns the page of a notebook, with a link to the notebook itself."""
    cells = json.loads(Path(file.abs_src_path or "").read_text(encoding="utf-8"))["cells"]
    return "\n\n".join([*map(_cell, cells), f"[Download this notebook]({Path(file.src_uri).name}).\n"])


def _from_root(text: str) -> str:
    """Returns the text of a page of the repository's root, with the links that the page has below project/."""
    pages = "|".join(page.removesuffix(".md") for page in _ROOT_PAGES)
    text = re.sub(rf"\]\(({pages})\.md", lambda found: f"]({found[1].lower()}.md", text)
    return re.sub(r"\]\((?!https?:|\w+\.md)(?:docs/)?", lambda found: "](../", text)


def _cell(cell: dict[str, Any]) -> str:
    """Returns a cell of a notebook as Markdown."""
    text = "".join(cell["source"])
    return text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```"


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Returns the text of a page; links to files outside docs/ become plain text, since the site has no page for such
    files.
    """
    return _OUTSIDE.sub(r"`\1`", markdown)


def on_post_build(*, config: Any) -> None:
    """Fails the build if the search does not find a key of a case on the page of keys, or if a page loads from another
    site.
    """
    site = Path(config["site_dir"])
    index = json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))
    pages = [page for page in index["docs"] if page["location"].startswith(_KEYS_PAGE)]
    text = re.sub(r"<[^>]*>", " ", " ".join(f"{page['title']} {page['text']}" for page in pages))
    if missing := sorted(_keys(json.loads(_SCHEMA.read_text(encoding="utf-8"))) - set(re.findall(r"\w+", text))):
        raise PluginError(f"the search of the site does not find these keys of a case: {', '.join(missing)}")
    for page in sorted(site.rglob("*.html")):
        if found := _LOADED.search(page.read_text(encoding="utf-8")):
            raise PluginError(f"{page.relative_to(site)} loads from another site: {found[0]}")


def _keys(schema: object) -> set[str]:
    """Returns the names of all properties of a JSON schema."""
    if isinstance(schema, list):
        return set().union(*map(_keys, schema))
    if not isinstance(schema, dict):
        return set()
    named = schema.get("properties")
    own = set(named) if isinstance(named, dict) else set()
    return own.union(*map(_keys, schema.values()))
