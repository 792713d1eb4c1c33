"""Requests to local pages, as a browser makes them, and commands that serve one."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import subprocess
import sys
from typing import Any

from cdprcal.local_page import LocalServer


def ask(
    server: LocalServer, method: str, path: str, *, body: Any = None, **headers: str
) -> http.client.HTTPResponse:
    """A request; ``X_Token`` is the header X-Token, and so on."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=30)
    names = {key.replace("_", "-"): value for key, value in headers.items()}
    text = None if body is None else json.dumps(body)
    connection.request(method, path, body=text, headers=names)
    return connection.getresponse()


def started(*arguments: object) -> tuple[subprocess.Popen[str], int]:
    """A command of its own, and the port of its page."""
    command = [sys.executable, "-m", "cdprcal", *map(str, arguments)]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=dict(os.environ))
    assert running.stderr is not None
    for line in running.stderr:
        match = re.search(r"http://127\.0\.0\.1:(\d+)/", line)
        if match:
            return running, int(match[1])
    raise AssertionError(f"no page: {running.wait()}")


def serves_until_ctrl_c(words: str, path: str, *arguments: object) -> None:
    """Holds that a command of its own says these words at a path, and ends well on Ctrl-C."""
    running, port = started(*arguments)
    try:
        assert words in get(port, path)
        running.send_signal(signal.SIGINT)
        assert running.wait(10) == 0
    finally:
        running.kill()


def get(port: int, path: str) -> str:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    connection.request("GET", path)
    return connection.getresponse().read().decode()
