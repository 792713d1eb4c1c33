"""The page of an exploration: fits again what is asked for, and saves the corrected robot."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from cdprcal import _core
from cdprcal._core import Diagnosis, InputError
from cdprcal.explore.exploration import Choice, Exploration
from cdprcal.explore.shown import shown
from cdprcal.io.files import write_texts
from cdprcal.io.replacing import signed
from cdprcal.local_page import LocalServer

#: Fits that are kept, so that a tick that is taken back, and saving, take no time.
_MOST_KNOWN = 32


class ExploreServer(LocalServer):
    """Serves the page while its context lasts.

    names: what the page calls the logs. output: where its button saves the corrected robot file,
    None: what it saves is a download of the browser. Raises InputError when the port cannot be had.
    """

    def __init__(
        self,
        exploration: Exploration,
        names: Sequence[str],
        *,
        output: Path | None = None,
        port: int = 0,
    ) -> None:
        self._exploration = exploration
        self._names = list(names)
        self._output = output
        # One choice at a time is fitted: it uses all cores itself. A search, which takes seconds,
        # keeps no choice waiting, and ends when the page asks for anything else.
        self._fitting = threading.Lock()
        self._asked = 0
        self._step = ""
        self._known: dict[Choice, Diagnosis] = {}
        actions = {"/fit": self._fit, "/step": self._tell_step, "/save": self._save}
        super().__init__("cdprcal.explore", port=port, actions=actions)

    def _fit(self, asked: Any) -> dict[str, Any]:
        self._asked += 1
        choice, diagnosis = self._fitted(asked)
        robot, logs = self._exploration.robot, self._exploration.logs
        page = shown(diagnosis, robot, self._names, choice.effects is None, logs)
        return {**page, "robot": robot.name, "output": str(self._output or "")}

    def _save(self, asked: Any) -> dict[str, Any]:
        choice, diagnosis = self._fitted(asked)
        text = f"{_history(choice, self._names)}{_core.to_yaml(diagnosis.corrected)}"
        if self._output is None:
            return {"name": f"{self._exploration.robot.name}-corrected.yaml", "text": text}
        write_texts({self._output: signed(text)})
        return {"saved": str(self._output)}

    def _fitted(self, asked: Any) -> tuple[Choice, Diagnosis]:
        try:
            choice = Choice.model_validate(asked)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(str(part) for part in first["loc"]) or "the choice"
            raise InputError(f"{where}: {first['msg']}") from None
        found = self._known.get(choice)
        if found is None:
            found = self._search(choice) if choice.effects is None else self._fit_chosen(choice)
            self._known[choice] = found
            if len(self._known) > _MOST_KNOWN:
                self._known.pop(next(iter(self._known)), None)
        return choice, found

    def _search(self, choice: Choice) -> Diagnosis:
        mine = self._asked

        def goes_on(step: str) -> bool:
            self._step = step
            return self._asked == mine

        found = self._exploration.fit(choice, goes_on)
        if self._asked != mine:
            raise InputError(
                "the search for effects ended, since a page asked for something else; choose Find "
                "effects to begin it again"
            )
        return found

    def _fit_chosen(self, choice: Choice) -> Diagnosis:
        with self._fitting:
            return self._exploration.fit(choice)

    def _tell_step(self, _: Any) -> dict[str, str]:
        return {"step": self._step}


def _history(choice: Choice, names: Sequence[str]) -> str:
    """How the robot file came about, as comments at its top."""
    how = "found by the diagnosis" if choice.effects is None else "chosen by hand"
    lines = [f"Made by cdprcal explore from {', '.join(names)}; effects {how}."]
    lines += [
        f"Left out: the pose at {pose.run_time_s:g} s of {names[pose.run]}."
        for pose in choice.left_out
    ]
    return "".join(f"# {' '.join(line.split())}\n" for line in lines)
