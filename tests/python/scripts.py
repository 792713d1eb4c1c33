"""Programs of their own, and scripts without an ending as modules."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import subprocess
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any


def executed(command: Sequence[str | Path], **options: Any) -> subprocess.CompletedProcess[str]:
    """What a program said, and how it ended; options as those of subprocess.run."""
    return subprocess.run(command, capture_output=True, text=True, **({"check": False} | options))


def load_script(path: Path) -> ModuleType:
    """What a script defines; it does not run."""
    loader = importlib.machinery.SourceFileLoader(f"{path.name}_tool", str(path))
    spec = importlib.util.spec_from_loader(loader.name, loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module
