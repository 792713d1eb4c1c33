"""The live page's server: read-only unless it is told that the page may stop the robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cdprcal.local_page import LocalServer, Messages


class LiveServer(LocalServer):
    """Serves the page while its context lasts.

    messages: called once for every page that is opened. stop: what the page's stop button does;
    None: there is no such button, and nothing that the page asks for changes anything. port: 0 is
    any that is free. Raises InputError when the port cannot be had.
    """

    def __init__(
        self, messages: Messages, *, port: int = 0, stop: Callable[[], None] | None = None
    ) -> None:
        def act(_: Any) -> None:
            if stop is not None:
                stop()

        actions = {} if stop is None else {"/stop": act}
        super().__init__("cdprcal.live", port=port, messages=messages, actions=actions)
