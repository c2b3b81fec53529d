"""Hooks of the documentation site: links out of docs/, pages of notebooks, and a check that search finds every key."""

import json
import re
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

_OUTSIDE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+(?:deploy|cases|tests|client|server|worker)[^)]*\)")
_SCHEMA = Path(__file__).parents[1] / "cases" / "case.schema.json"


def on_files(files: Files, *, config: Any) -> Files:
    """Adds a page ``NAME.md`` for each notebook ``NAME.ipynb``, which stays beside it for download."""
    for file in [file for file in files if file.src_uri.endswith(".ipynb")]:
        notebook = json.loads(Path(file.abs_src_path).read_text(encoding="utf-8"))
        link = f"\n\n[Download this notebook]({Path(file.src_uri).name}).\n"
        text = "\n\n".join(map(_cell, notebook["cells"])) + link
        files.append(File.generated(config, file.src_uri.removesuffix(".ipynb") + ".md", content=text))
    return files


def _cell(cell: dict[str, Any]) -> str:
    """A cell of a notebook as Markdown."""
    text = "".join(cell["source"])
    return text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```"


def on_page_markdown(markdown: str, **_: Any) -> str:
    """The text of a page; links to files outside docs/ become plain text, since the site has no such page."""
    return _OUTSIDE.sub(r"`\1`", markdown)


def on_post_build(*, config: Any) -> None:
    """Fails the build when the search index lacks a key of a case."""
    index = json.loads((Path(config["site_dir"]) / "search" / "search_index.json").read_text(encoding="utf-8"))
    text = " ".join(f"{page['title']} {page['text']}" for page in index["docs"])
    words = set(re.findall(r"\w+", re.sub(r"<[^>]*>", " ", text)))
    if missing := sorted(_keys(json.loads(_SCHEMA.read_text(encoding="utf-8"))) - words):
        raise PluginError(f"the search of the site does not find these keys of a case: {', '.join(missing)}")


def _keys(schema: object) -> set[str]:
    """The names of all properties of a JSON schema."""
    if isinstance(schema, list):
        return set().union(*map(_keys, schema))
    if not isinstance(schema, dict):
        return set()
    named = schema.get("properties")
    own = set(named) if isinstance(named, dict) else set()
    return own.union(*map(_keys, schema.values()))
