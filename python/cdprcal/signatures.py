"""Functions of the core as Python sees its own: with a signature, for editors and ``inspect``.

Those of extension modules have none that ``inspect.signature`` can read; the type stubs know it.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable
from functools import cache
from importlib import resources
from typing import Any

from cdprcal import _core


class CoreFunction:
    """A function of the core, called as it is; its signature is read from the stubs when asked."""

    def __init__(self, name: str, function: Callable[..., Any]) -> None:
        self._function = function
        self.__name__ = self.__qualname__ = name
        self.__module__ = "cdprcal"
        self.__doc__ = function.__doc__
        self.__wrapped__ = function

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return self._function(*arguments, **options)

    @property
    def __signature__(self) -> inspect.Signature:
        return signature_of(self.__name__)

    def __reduce__(self) -> str:
        return self.__name__

    def __repr__(self) -> str:
        return f"<function cdprcal.{self.__name__}>"


def signed(name: str) -> Any:
    """A name of the core: functions with their signature, all others as they are."""
    member = getattr(_core, name)
    return CoreFunction(name, member) if inspect.isbuiltin(member) else member


def signature_of(name: str) -> inspect.Signature:
    """The signature of a function of the core. Raises KeyError for a name that is none."""
    node = _stubs()[name]
    given = node.args
    parameters = []
    positional = [*given.posonlyargs, *given.args]
    missing: list[ast.expr | None] = [None] * (len(positional) - len(given.defaults))
    for argument, default in zip(positional, [*missing, *given.defaults], strict=True):
        parameters.append(_parameter(argument, default, inspect.Parameter.POSITIONAL_OR_KEYWORD))
    for argument, default in zip(given.kwonlyargs, given.kw_defaults, strict=True):
        parameters.append(_parameter(argument, default, inspect.Parameter.KEYWORD_ONLY))
    if given.kwarg is not None:
        parameters.append(_parameter(given.kwarg, None, inspect.Parameter.VAR_KEYWORD))
    returns = inspect.Signature.empty if node.returns is None else ast.unparse(node.returns)
    return inspect.Signature(parameters, return_annotation=returns)


def _parameter(argument: ast.arg, default: ast.expr | None, kind: Any) -> inspect.Parameter:
    value: Any = inspect.Parameter.empty
    if default is not None:
        try:
            value = ast.literal_eval(default)
        except ValueError:
            value = ...
    annotation: Any = inspect.Parameter.empty
    if argument.annotation is not None:
        annotation = ast.unparse(argument.annotation)
    return inspect.Parameter(argument.arg, kind, default=value, annotation=annotation)


@cache
def arguments_of(name: str) -> tuple[str, ...]:
    """What makes an object of a class of the core, by name: of options and values, attributes."""
    given = _stubs()[f"{name}.__init__"].args
    return tuple(argument.arg for argument in (*given.args[1:], *given.kwonlyargs))


@cache
def _stubs() -> dict[str, ast.FunctionDef]:
    """The functions and constructors of the stubs by name; of overloads the first."""
    text = (resources.files("cdprcal") / "_core.pyi").read_text("utf-8")
    found: dict[str, ast.FunctionDef] = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef):
            found.setdefault(node.name, node)
        elif isinstance(node, ast.ClassDef):
            for member in node.body:
                if isinstance(member, ast.FunctionDef) and member.name == "__init__":
                    found.setdefault(f"{node.name}.__init__", member)
    return found
