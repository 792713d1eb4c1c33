"""Effects as text that come with the package: ``--effects more`` takes more.yaml from here."""

from __future__ import annotations

from importlib.resources import files

_ENDING = ".yaml"


def names() -> list[str]:
    """What ``--effects`` takes beside the paths of files."""
    entries = (entry.name for entry in files(__package__).iterdir())
    return sorted(name.removesuffix(_ENDING) for name in entries if name.endswith(_ENDING))


def text(name: str) -> str:
    """The file of that name, which ``names`` lists."""
    return (files(__package__) / f"{name}{_ENDING}").read_text(encoding="utf-8")
