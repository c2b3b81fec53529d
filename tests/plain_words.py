"""Checker of the language of the repository: banned words, first words of docstrings, line lengths, commit subjects.

    python -m tests.plain_words                  fails where a folder has more findings than NOT_YET allows; lists them
    python -m tests.plain_words worker/contact   every finding below the given files and folders
    python -m tests.plain_words --subjects       fails where the subject of a recent commit breaks the rule

The check of subjects is no part of `make test`: a commit that others have built on cannot be changed any more.

The banned words and first words stand in CONVENTIONS.md, section "Words", in code font. The checker reads docstrings,
comments and messages of Python, comments and strings of JavaScript, Markdown, HTML, TOML, CSS and Makefile.
"""

import ast
import io
import re
import subprocess
import sys
import tokenize
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
FOLDERS = ("cases", "client", "server", "worker", "tests", "docs", "deploy", ".ci")
GENERATED = {"docs/reference/case.md", "docs/reference/http.md", "docs/verification/accuracy.md"}
"""Files that are generated from texts; the texts are checked where they are written."""
WORDS_THEMSELVES = {"CONVENTIONS.md", "tests/plain_words.py", "tests/test_plain_words.py"}
"""Files that name the banned words."""
LONGEST_LINE, LONGEST_SUBJECT = 130, 72
"""Chosen values: columns of a line of docs; characters of a commit subject, which ``git log`` shows in one line."""
SUBJECTS_SINCE = "2026-11-30 14:00"
"""Commits from this date on are checked; earlier subjects stay as they are."""
PEOPLE = "user|reader|engineer|developer|author|person|people|somebody|someone|anybody|anyone|those|client|operator"
ALLOWED = {
    r"due to": "the preposition, not the adjective",
    rf"\b(?:{PEOPLE})s?(?: \w+)? who\b": "the relative pronoun of a person",
    r"\bwho (?:asks|am i)\b": "the user of a request",
    r"\"who\"": "the name of an element of the page",
}
"""Contexts in which a banned word is correct, each with the reason."""
NAMES = ("told", "said", "heard")
"""Banned words that were used as names for messages, answers and warnings; no variable, attribute or function has such
a name."""
NOT_YET: dict[str, int] = {}
"""Folders that are not clean yet, with their numbers of findings. The numbers of findings may fall and not rise."""


class Text(NamedTuple):
    """A piece of prose: the line on which it starts, whether it is a docstring, and its words."""

    line: int
    docstring: bool
    words: str


class Finding(NamedTuple):
    """One violation: file, line, what is wrong, and the words around the violation."""

    path: str
    line: int
    rule: str
    words: str


# Rules: the lists of CONVENTIONS.md


@cache
def section(title: str) -> str:
    text = (ROOT / "CONVENTIONS.md").read_text(encoding="utf-8")
    return text.partition(f"\n## {title}\n")[2].partition("\n## ")[0]


@cache
def banned() -> re.Pattern[str]:
    """Returns the words in code font in the columns "not" of the tables."""
    found: list[str] = []
    column = None
    for line in section("Words").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")] if line.startswith("|") else []
        if "not" in cells:
            column = cells.index("not")
        elif cells and column is not None:
            found += re.findall("`([^`]+)`", cells[column])
    words = "|".join(sorted(found, key=len, reverse=True))
    code_before, code_after = r"(?<![.\w-])", r"(?!\w|\s*[=([]|[.-]\w)"
    return re.compile(rf"{code_before}(?:{words}){code_after}", re.IGNORECASE)


@cache
def first_words() -> re.Pattern[str]:
    """Returns the words in code font in the sentence about the beginning of a docstring."""
    sentence = section("Words").partition("A docstring begins")[2].partition("\n\n")[0]
    return re.compile(rf"(?:{'|'.join(re.findall('`([^`]+)`', sentence))})\b")


# Prose of a file, by its kind


def python(source: str) -> Iterator[Text]:
    """Yields docstrings, also those below constants; strings of at least three words; comments."""
    nodes = list(ast.walk(ast.parse(source)))
    docstrings = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    for node in nodes:
        if not isinstance(node, ast.Constant) or not isinstance(node.value, str):
            continue
        if id(node) in docstrings or len(node.value.split()) >= 3:
            yield Text(node.lineno, id(node) in docstrings, node.value)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield Text(token.start[0], False, token.string)


def script(source: str) -> Iterator[Text]:
    """Yields comments of JavaScript and CSS, and strings of at least three words."""
    pieces = re.compile(r"/\*.*?\*/|(?<![:\"'`])//[^\n]*|\"[^\"\n]*\"|'[^'\n]*'|`[^`]*`", re.DOTALL)
    for found in pieces.finditer(source):
        if len(found[0].split()) >= 3:
            words = found[0][1:-1] if found[0][0] in "\"'`" else found[0]
            yield Text(source.count("\n", 0, found.start()) + 1, False, words)


def page(source: str) -> Iterator[Text]:
    """Yields the lines of a page of Markdown without its blocks of code."""
    code = False
    for number, line in enumerate(source.splitlines(), 1):
        code ^= line.lstrip().startswith("```")
        if not code:
            yield Text(number, False, line)


def hypertext(source: str) -> Iterator[Text]:
    """Yields the texts between tags, and the titles and labels in tags."""
    for found in re.finditer(r">([^<]+)<|(?:title|aria-label|placeholder)=\"([^\"]+)\"", source):
        yield Text(source.count("\n", 0, found.start()) + 1, False, found[1] or found[2])


def lines(source: str) -> Iterator[Text]:
    """Yields every line of TOML files, Makefiles and files of a shell."""
    for number, line in enumerate(source.splitlines(), 1):
        yield Text(number, False, line)


READERS: dict[str, Callable[[str], Iterator[Text]]] = {
    ".py": python, ".js": script, ".mjs": script, ".css": script, ".md": page, ".html": hypertext, ".toml": lines,
    "": lines, ".conf": lines, ".service": lines,
}  # fmt: skip


# Checks


def of_names(path: Path, source: str) -> Iterator[tuple[int, str, str]]:
    """Yields names of variables and attributes that are banned words: a message, an answer or a warning has its own
    name.
    """
    if path.suffix == ".py":
        tokens = tokenize.generate_tokens(io.StringIO(source).readline)
        names = [(token.start[0], token.string, token.line) for token in tokens if token.type == tokenize.NAME]
    else:
        plain = (
            re.sub(r"//[^\n]*|\"[^\"\n]*\"|'[^'\n]*'", "", source).splitlines()
            if path.suffix in (".js", ".mjs")
            else []
        )
        names = [(n, name, line) for n, line in enumerate(plain, 1) for name in re.findall(r"\w+", line)]
    for number, name, line in names:
        if name.strip("_").lower() in NAMES:
            yield number, f"name {name}", line.strip()[:90]


def of_words(text: Text) -> Iterator[tuple[int, str, str]]:
    """Yields banned words of a text outside code font: line, rule and words."""
    plain = re.sub(r"``[^`]*``|`[^`]*`|https?://\S+", lambda found: "\n" * found[0].count("\n"), text.words)
    allowed = [found.span() for context in ALLOWED for found in re.finditer(context, plain, re.IGNORECASE)]
    for found in banned().finditer(plain):
        if not any(start <= found.start() < end for start, end in allowed):
            around = plain[max(0, found.start() - 50) : found.end() + 40]
            yield text.line + plain.count("\n", 0, found.start()), found[0].lower(), " ".join(around.split())
    if text.docstring and (start := first_words().match(text.words.lstrip())):
        yield text.line, f"docstring begins with {start[0]}", " ".join(text.words.split())[:90]


def of_lengths(source: str) -> Iterator[tuple[int, str, str]]:
    """Yields lines of a page over the limit, except code, formulas, tables, pictures, addresses and long commands."""
    code = False
    for number, line in enumerate(source.splitlines(), 1):
        code ^= line.startswith("```")
        plain = re.sub(r"`[^`]{60,}`", "", line)
        if len(plain) > LONGEST_LINE and not code and not line.startswith(("|", "![", "    ")) and "://" not in line:
            yield number, f"{len(line)} columns", line[:90]


def of_paragraphs(source: str) -> Iterator[tuple[int, str, str]]:
    """Yields paragraphs and list items of a page that begin with a pronoun instead of a noun."""
    before, code = "", False
    for number, line in enumerate(source.splitlines(), 1):
        code ^= line.lstrip().startswith("```")
        item = re.match(r"\s*(?:[-*]|\d+\.) ", line)
        start = line[item.end() :] if item else line if not before.strip() else ""
        if not code and (found := re.match(r"(?:It|They|Those|Both)\b", start)):
            yield number, f"paragraph begins with {found[0]}", line[:90]
        before = line


def findings(path: Path) -> list[Finding]:
    """Yields all findings of a file."""
    name = path.relative_to(ROOT).as_posix()
    source = path.read_text(encoding="utf-8")
    found = [*of_lengths(source), *of_paragraphs(source)] if path.suffix == ".md" else []
    if name not in WORDS_THEMSELVES:
        found += [each for text in READERS[path.suffix](source) for each in of_words(text)]
        found += of_names(path, source)
    return [Finding(name, *each) for each in sorted(found)]


def files() -> list[Path]:
    """Returns the files of the repository that are checked."""
    below = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*")]
    every = [*ROOT.glob("*.md"), ROOT / "Makefile", ROOT / "pyproject.toml", *below]
    ours = [path for path in every if path.is_file() and path.suffix in READERS and "__pycache__" not in path.parts]
    return sorted(path for path in ours if path.relative_to(ROOT).as_posix() not in GENERATED)


def subjects() -> list[str]:
    """Returns the subjects of recent commits that are not ``area: what changed``; none outside a git checkout."""
    log = ["git", "-C", str(ROOT), "log", "--no-merges", f"--since={SUBJECTS_SINCE}", "--format=%s"]
    try:
        shown = subprocess.run(log, capture_output=True, text=True, timeout=60, check=False).stdout
    except OSError:
        return []
    return [subject for subject in shown.splitlines() if not is_subject(subject)]


def is_subject(subject: str) -> bool:
    """Returns True for ``area: what changed`` within the limit."""
    return len(subject) <= LONGEST_SUBJECT and re.match(r"[a-z][\w/., -]*: \S", subject) is not None


def folder(name: str) -> str:
    """Returns the folder by which a file is counted, at most two levels deep."""
    return "/".join(name.split("/")[:-1][:2]) or "."


def excess(counts: Counter[str]) -> list[str]:
    """Returns lines about the folders that have more findings than NOT_YET allows."""
    every = sorted(counts.items())
    return [f"{at}: {many} findings, allowed: {NOT_YET.get(at, 0)}" for at, many in every if many > NOT_YET.get(at, 0)]


def chosen(places: list[str]) -> list[Finding]:
    """Returns the findings below the given files and folders."""
    roots = [Path(place).resolve() for place in places]
    return [found for path in files() if any(path.is_relative_to(root) for root in roots) for found in findings(path)]


def main(places: list[str]) -> int:
    """Prints findings below ``places``, or the findings of the folders that have too many; returns the exit status."""
    if places:
        show(chosen(places))
        return 0
    every = [found for path in files() for found in findings(path)]
    counts = Counter(folder(found.path) for found in every)
    wrong = excess(counts)
    show(found for found in every if any(line.startswith(f"{folder(found.path)}:") for line in wrong))
    for line in wrong:
        print(line)
    print(f"words: {len(every)} findings in {len(counts)} folders")
    return 1 if wrong else 0


def show(every: Iterable[Finding]) -> None:
    """Prints each finding in one line."""
    for found in every:
        print(f"{found.path}:{found.line}: {found.rule}: {found.words}")


def check_subjects() -> int:
    """Prints the subjects that break the rule; returns the exit status."""
    wrong = subjects()
    for subject in wrong:
        print(f"commit subject: {subject}: not `area: what changed` in {LONGEST_SUBJECT} characters")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(check_subjects() if sys.argv[1:] == ["--subjects"] else main(sys.argv[1:]))
