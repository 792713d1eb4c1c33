"""Writes the type stubs of cdprcal._core: ``python bindings/stubs.py python/cdprcal/_core.pyi``.

Run it, and ``ruff format``, after a change of the bindings; a test compares the checked-in stubs
with the module. pybind11-stubgen does the work; what it does not know about is put right here.
"""

from __future__ import annotations

import ast
import enum
import subprocess
import sys
import tempfile
from pathlib import Path

_MODULE = "cdprcal._core"
_PRIVATE = {"__getstate__", "__reduce__", "__setstate__", "__new__"}


def make_stubs() -> str:
    """The stubs of the module that is installed, not yet formatted."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, "-m", "pybind11_stubgen", _MODULE, "-o", folder],
            check=True,
            capture_output=True,
            text=True,
        )
        path = Path(folder, *_MODULE.split(".")).with_suffix(".pyi")
        tree = ast.parse(path.read_text(encoding="utf-8"))
    return ast.unparse(_PutRight().visit(tree)) + "\n"


#: What Python code sets on objects of the core (cdprcal.calibrate), class → attributes.
_SET_IN_PYTHON = {"Calibration": "caveats: tuple[typing.Any, ...]"}

_GENERIC = {
    "collections.abc.Callable": "[..., typing.Any]",
    "list": "[typing.Any]",
    "os.PathLike": "[str]",
}


class _PutRight(ast.NodeTransformer):
    """Enum members as members, no pickling plumbing, a type for **kwargs and bare generics."""

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        if node.args.kwarg is not None and node.args.kwarg.annotation is None:
            node.args.kwarg.annotation = ast.parse("typing.Any", mode="eval").body
        for argument in [*node.args.args, *node.args.kwonlyargs]:
            if argument.annotation is not None:
                argument.annotation = self._whole(argument.annotation)
        if node.returns is not None:
            node.returns = self._whole(node.returns)
        return node

    def _whole(self, annotation: ast.expr) -> ast.expr:
        if isinstance(annotation, ast.BinOp):  # X | None
            annotation.left = self._whole(annotation.left)
            annotation.right = self._whole(annotation.right)
            return annotation
        text = ast.unparse(annotation)
        if text == "object":  # made in Python, of libraries that need not be there
            return ast.parse("typing.Any", mode="eval").body
        if text in _GENERIC:
            return ast.parse(text + _GENERIC[text], mode="eval").body
        return annotation

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.ClassDef:
        import cdprcal._core

        node.body = [
            item
            for item in node.body
            if not (isinstance(item, ast.FunctionDef) and item.name in _PRIVATE)
        ]
        actual = getattr(cdprcal._core, node.name)
        if issubclass(actual, enum.Enum):
            members = [ast.parse(f"{member.name} = {member.value!r}").body[0] for member in actual]
            docstring = [item for item in node.body if isinstance(item, ast.Expr)]
            node.body = [*docstring, *members]
        if node.name in _SET_IN_PYTHON:
            node.body += ast.parse(_SET_IN_PYTHON[node.name]).body
        self.generic_visit(node)
        return node


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(make_stubs(), encoding="utf-8")
