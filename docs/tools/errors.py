"""Makes docs/errors.md: every message of wrong use and every finding, from the sources themselves.

A message says where, what is wrong and what to do, in this order. What is to be done is a clause of
its own that begins with an order ("…; give another name"), or says what the value has to be ("must
be positive").

python docs/tools/errors.py -o docs
"""

from __future__ import annotations

import ast
import re
import runpy
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: Where the tables go in docs/errors.md.
PLACE = "<!-- made: findings and messages -->"
STOPS = "<!-- made: stops -->"
GAP = "…"
#: Calls in Python whose text is what a user reads, and which argument it is.
_PYTHON = {"InputError": 0, "fail": 0, "BackendError": 0, "misplaced": 1}
#: The same in C++, with all arguments. A path's failure is a status, and no error.
_CPP = re.compile(
    r"(?:throw (?:detail::)?(?:InputError|FieldError)|(?<!return )\bfail(?:_at|_in)?"
    r"|(?<![.\w])(?:require|check))\((?!const |path,|std::size_t)"
)
#: Clauses that tell what to do: they begin with an order, or say what has to be.
_ORDER = re.compile(
    r"(?:then |please |or |and )?(?:add|allow|build|call|check|choose|close|connect|correct|delete"
    r"|divide|end|enter|fill|free|give|install|it takes|keep|leave|let|log|look|lower|make|mount"
    r"|move|name|pass|pip|put|raise|read|rename|repair|repeat|report|run|save|say|see|set|split|start"
    r"|switch|take|try|turn|use|wait|wire|write)\b",
    re.IGNORECASE,
)
_HAS_TO_BE = re.compile(
    rf"\b(?:must|needs?|at least|at most|neither .+ nor|(?:is not|give) one of|numbered 1 to"
    rf"|1 to {GAP}|known are)\b"
)
#: Messages whose end is found when they are made: what it then is.
_COMPUTED = {
    "…: cannot be made: …": "the system's reason follows, and what to do about it",
    "…: cannot be read: …": "the system's reason follows, and what to do about it",
    "…: cannot be written: …": "the system's reason follows, and what to do about it",
    "…simulator options: …": "what the option must be follows",
    "…start-up options: …": "what the option must be follows",
    "interrupted": "nothing was written; repeat it if that was not meant",
    "unknown key…": "write it as the message says: it names the key that was meant, or all known",
    "…: column …: … is not a number; …": "write numbers without separators of thousands, the unit "
    "into the name of the column, and nothing where nothing was read",
    "…column time_s: …; …": "write finer times, give a mapping file with --map, or split the file "
    "where the clock was set: which, the message says",
    "…: column …: unknown; …": "the columns that are known follow; separate them by commas",
}


@dataclass(frozen=True)
class Found:
    """One finding that ``check`` or a reader of logs can make."""

    code: str
    severity: str
    message: str
    remedy: str


@dataclass(frozen=True)
class Message:
    """One message of wrong use, and where the source makes it."""

    text: str
    file: Path  #: relative to the repository
    line: int

    @property
    def area(self) -> str:
        """The package or folder that it comes from."""
        return (
            self.file.relative_to(Path(*self.file.parts[: 2 if len(self.file.parts) > 2 else 1]))
            .parts[0]
            .removesuffix(self.file.suffix)
        )

    @property
    def forwards(self) -> bool:
        """Whether it only hands on the text of another: there is no more in it than values."""
        return len(re.sub(rf"[\s{GAP}:.,;'()\[\]-]", "", self.text)) <= 8

    @property
    def parts(self) -> tuple[str, str]:
        """What is wrong, and what to do; the latter is empty if it does not say."""
        if self.text in _COMPUTED:
            return (self.text, _COMPUTED[self.text])
        clauses = re.split(r"(?<=[;:,(?])\s+|(?<=\s)(?=\()", self.text)
        for i, clause in enumerate(clauses):
            if _ORDER.match(clause.lstrip(f"( {GAP}")) or _HAS_TO_BE.search(clause):
                wrong = " ".join(clauses[:i]).rstrip(" ;,(")
                return (wrong or self.text, " ".join(clauses[i:]))
        return (self.text, "")


def findings() -> list[Found]:
    """All findings in the sources, by code."""
    found: dict[tuple[str, str], Found] = {}
    for path in sorted((ROOT / "python" / "cdprcal").rglob("*.py")):
        for call in _calls(path):
            made = _finding(call)
            if made is not None:
                found.setdefault((made.code, made.message), made)
    return sorted(found.values(), key=lambda f: (f.code, f.message))


def messages() -> list[Message]:
    """Every place in the sources that refuses something, by file and line."""
    found = []
    for path in sorted((ROOT / "python" / "cdprcal").rglob("*.py")):
        for call in _calls(path):
            at = _PYTHON.get(_name(call))
            if at is not None and len(call.args) > at:
                texts = _texts(call.args[at])
                found += [Message(t, path.relative_to(ROOT), call.lineno) for t in texts]
    for folder in ("cpp/cdprcal", "bindings"):
        for path in sorted([*(ROOT / folder).rglob("*.cpp"), *(ROOT / folder).rglob("*.hpp")]):
            for line, text in _thrown(path.read_text(encoding="utf-8")):
                found.append(Message(text, path.relative_to(ROOT), line))
    return found


def _calls(path: Path) -> Iterator[ast.Call]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            yield node


def _name(call: ast.Call) -> str:
    return call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")


def _finding(call: ast.Call) -> Found | None:
    keys = {keyword.arg: keyword.value for keyword in call.keywords}
    names = ("severity", "code", "message", "remedy")
    if _name(call) in ("add", "_finding") and len(call.args) >= 4:
        keys |= dict(zip(names, call.args[:4], strict=True))
    elif _name(call) != "Finding":
        return None
    if not all(name in keys for name in names):
        return None
    severity, code, message, remedy = (" / ".join(_texts(keys[name])) for name in names)
    return Found(code, severity, message, remedy) if code != GAP else None


def _texts(node: ast.expr) -> list[str]:
    """What a string may be, values as gaps: one text, or one for each way of an if."""
    if isinstance(node, ast.IfExp):
        return [*_texts(node.body), *_texts(node.orelse)]
    if isinstance(node, ast.Constant):
        return [str(node.value)]
    if isinstance(node, ast.JoinedStr):
        parts = [part.value if isinstance(part, ast.Constant) else GAP for part in node.values]
        return [re.sub(rf"{GAP}+", GAP, "".join(str(part) for part in parts))]
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return [a + b for a in _texts(node.left) for b in _texts(node.right)]
    return [GAP]


#: A comment, a string, a character, a parenthesis: what decides where a C++ call ends.
_TOKEN = re.compile(r"""//[^\n]*|"((?:[^"\\]|\\.)*)"|'(?:[^'\\]|\\.)'|[()]""")


def _thrown(source: str, calls: re.Pattern[str] = _CPP) -> Iterator[tuple[int, str]]:
    """Line and text of what is refused in C++: its literals, anything else as a gap."""
    for match in calls.finditer(source):
        text, depth, end = "", 1, match.end()
        while depth:
            token = _TOKEN.search(source, end)
            assert token is not None
            depth += (token[0] == "(") - (token[0] == ")")
            text += GAP if source[end : token.start()].strip() else ""
            text += token[1] or ""
            end = token.end()
        if match[0].startswith(("require", "check")) and not text.strip(GAP):
            continue  # some other function of that name
        text = re.sub(rf"{GAP}+", GAP, text.replace('\\"', '"').replace("\\n", " "))
        yield source.count("\n", 0, match.start()) + 1, text.strip()


def cell(text: str) -> str:
    """Safe inside a table of Markdown."""
    return text.replace("|", "\\|").replace("\n", " ").replace("<", "&lt;").replace("[", "\\[")


def tables() -> str:
    """What is made: the findings, and the messages by where they come from."""
    lines = ["## Findings in logs and robot files", ""]
    lines += ["| code | severity | message | what to do |", "|---|---|---|---|"]
    lines += [
        f"| `{f.code}` | {f.severity} | {cell(f.message)} | {cell(f.remedy)} |" for f in findings()
    ]
    lines += ["", "## Wrong use", ""]
    by_area: dict[str, set[tuple[str, str]]] = {}
    for message in messages():
        if not message.forwards:
            by_area.setdefault(message.area, set()).add(message.parts)
    for area, rows in sorted(by_area.items()):
        lines += [f"### {area}", "", "| message | what to do |", "|---|---|"]
        lines += [f"| {cell(wrong)} | {cell(what)} |" for wrong, what in sorted(rows)]
        lines.append("")
    return "\n".join(lines).rstrip() + "\n"


def stops() -> list[str]:
    """Reasons for which the start-up procedure stops the robot, values as gaps."""
    folder = ROOT / "cpp" / "cdprcal" / "startup"
    sources = [path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.cpp"))]
    return [
        text
        for source in sources
        for _, text in _thrown(source, re.compile(r"(?<![:\w])(?:raise|hold)\((?!const )"))
        if text.strip(GAP)
    ]


def stop_table() -> str:
    """The reasons to stop and what to do."""
    # From the source: the site is built without the package.
    remedies = runpy.run_path(str(ROOT / "python" / "cdprcal" / "acquisition" / "remedies.py"))
    rows = [(text, remedies["remedy_for"](text)) for text in stops()]
    lines = ["| reason | what to do |", "|---|---|"]
    return "\n".join([*lines, *(f"| {cell(text)} | {remedy} |" for text, remedy in rows)])


def fill(markdown: str) -> str:
    """The page with the tables in their place; to make one, all sources are read."""
    for place, made in ((STOPS, stop_table), (PLACE, tables)):
        if place in markdown:
            markdown = markdown.replace(place, made())
    return markdown


if __name__ == "__main__":
    print(fill((ROOT / "docs" / "errors.md").read_text(encoding="utf-8")), end="")
