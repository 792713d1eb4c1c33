"""Makes docs/errors.md: every message of wrong use and every finding, from the sources themselves.

python docs/tools/errors.py -o docs
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: Where the tables go in docs/errors.md.
PLACE = "<!-- made: findings and messages -->"
GAP = "…"
#: Exceptions and functions whose text is what a user reads, with exit code 2.
_RAISED = {"InputError", "fail", "SessionError"}


@dataclass(frozen=True)
class Found:
    """One finding that ``check`` or a reader of logs can make."""

    code: str
    severity: str
    message: str
    remedy: str


def findings() -> list[Found]:
    """All findings in the sources, by code."""
    found: dict[tuple[str, str], Found] = {}
    for path in sorted((ROOT / "python" / "cdprcal").rglob("*.py")):
        for call in _calls(path):
            made = _finding(call)
            if made is not None:
                found.setdefault((made.code, made.message), made)
    return sorted(found.values(), key=lambda f: (f.code, f.message))


def wrong_use() -> dict[str, list[str]]:
    """Messages of wrong use by where they come from."""
    found: dict[str, set[str]] = {}
    package = ROOT / "python" / "cdprcal"
    for path in sorted(package.rglob("*.py")):
        area = path.relative_to(package).parts[0].removesuffix(".py")
        for call in _calls(path):
            if _name(call) in _RAISED and call.args:
                found.setdefault(area, set()).update(_texts(call.args[0]))
    core = ROOT / "cpp" / "cdprcal"
    for path in sorted([*core.rglob("*.cpp"), *core.rglob("*.hpp")]):
        area = path.relative_to(core).parts[0].removesuffix(path.suffix)
        for text in _thrown(path.read_text(encoding="utf-8")):
            found.setdefault(area, set()).add(text)
    told = {area: sorted(t for t in texts if _says(t)) for area, texts in found.items()}
    return {area: texts for area, texts in sorted(told.items()) if texts}


def _says(text: str) -> bool:
    """Whether there is more in it than names and values."""
    return len(re.sub(rf"[\s{GAP}:.,'()-]", "", text)) > 8


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


def _thrown(source: str) -> Iterator[str]:
    """Literals of what is thrown in C++, anything else as a gap."""
    for match in re.finditer(r"(?:throw InputError|\bfail)\((?!const)", source):
        begin, depth, end, quoted = match.end(), 1, match.end(), False
        while depth:
            character = source[end]
            if character == '"' and source[end - 1] != "\\":
                quoted = not quoted
            depth += 0 if quoted else (character == "(") - (character == ")")
            end += 1
        pieces = re.findall(r'"((?:[^"\\]|\\.)*)"|([^"]+)', source[begin : end - 1])
        text = "".join(
            literal if literal else ("" if not code.strip() else GAP) for literal, code in pieces
        )
        text = re.sub(rf"{GAP}+", GAP, text.replace('\\"', '"').replace("\\n", " "))
        yield text.strip()


def _is_value(code: str) -> bool:
    """Whether C++ between two literals puts a value there: not mere glue."""
    return bool(re.sub(r"std::string\(|[\s+()]", "", code))


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
    for area, texts in wrong_use().items():
        lines += [f"### {area}", "", *(f"- {cell(text)}" for text in texts), ""]
    return "\n".join(lines).rstrip() + "\n"


def fill(markdown: str) -> str:
    """The page with the tables in their place."""
    return markdown.replace(PLACE, tables())


if __name__ == "__main__":
    print(fill((ROOT / "docs" / "errors.md").read_text(encoding="utf-8")), end="")
