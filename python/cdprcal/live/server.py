"""The live page's server: this computer only, read-only unless it is told otherwise.

It listens on 127.0.0.1 and answers only requests that name it so: a page of another site cannot
reach it through a name of its own that leads here. Stopping the robot takes a token that only the
page knows, so that no other page can do it behind the operator's back.
"""

from __future__ import annotations

import errno
import hmac
import secrets
import threading
from collections.abc import Callable, Iterator
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from types import TracebackType
from typing import Any, Self

from cdprcal._core import InputError
from cdprcal.io.files import reason

#: Gives the messages of one page, as JSON texts; '' keeps the connection alive.
Messages = Callable[[], Iterator[str]]

_TYPES = {"html": "text/html", "js": "text/javascript", "css": "text/css"}
_FILES = {"/": "live.html", "/live.js": "live.js", "/live.css": "live.css"}
_POLICY = (
    "default-src 'none'; script-src 'self'; connect-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


class LiveServer:
    """Serves the page while its context lasts.

    messages: called once for every page that is opened. stop: what the page's stop button does;
    None: there is no such button, and nothing that the page asks for changes anything. port: 0 is
    any that is free. Raises InputError when the port cannot be had.
    """

    def __init__(
        self, messages: Messages, *, port: int = 0, stop: Callable[[], None] | None = None
    ) -> None:
        self.token = secrets.token_urlsafe(16)
        try:
            self._server = _Server(("127.0.0.1", port), _Handler)
        except OSError as error:
            taken = error.errno == errno.EADDRINUSE
            why = "is taken; choose another" if taken else f"cannot be had: {reason(error)}"
            raise InputError(f"port {port} {why}") from None
        self._server.messages = messages
        self._server.stop_robot = stop
        self._server.token = self.token
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)

    @property
    def port(self) -> int:
        """The port that it listens on."""
        return int(self._server.server_address[1])

    @property
    def address(self) -> str:
        """What to open in a browser."""
        return f"http://127.0.0.1:{self.port}/"

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._server.shutdown()
        self._server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    messages: Messages
    stop_robot: Callable[[], None] | None
    token: str

    def handle_error(self, request: Any, client_address: Any) -> None:
        pass  # a page that was closed while it was written to


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    server_version = "cdprcal"
    sys_version = ""
    timeout = 30

    def do_GET(self) -> None:
        if not self._is_for_us():
            return
        if self.path == "/events":
            self._events()
        elif self.path == "/plotly.js":
            script = resources.files("plotly") / "package_data" / "plotly.min.js"
            self._send(script.read_bytes(), "js")
        elif self.path in _FILES:
            name = _FILES[self.path]
            data = (resources.files("cdprcal.live") / "static" / name).read_bytes()
            if name == "live.html":
                data = data.replace(b"{{token}}", self._token().encode())
            self._send(data, name.rpartition(".")[2])
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        if not self._is_for_us():
            return
        stop = self.server.stop_robot
        if self.path != "/stop" or stop is None:
            self.send_error(HTTPStatus.FORBIDDEN, "read-only")
        elif not hmac.compare_digest(self.headers.get("X-Token", ""), self.server.token):
            self.send_error(HTTPStatus.FORBIDDEN, "wrong token")
        else:
            stop()
            self.send_response(HTTPStatus.NO_CONTENT)
            self.end_headers()

    def _token(self) -> str:
        return "" if self.server.stop_robot is None else self.server.token

    def _is_for_us(self) -> bool:
        port = self.server.server_address[1]
        if self.headers.get("Host") in (f"127.0.0.1:{port}", f"localhost:{port}"):
            return True
        self.send_error(HTTPStatus.FORBIDDEN, "this page is for 127.0.0.1")
        return False

    def _events(self) -> None:
        self.send_response(HTTPStatus.OK)
        self._headers("text/event-stream")
        for text in self.server.messages():
            self.wfile.write(f"data: {text}\n\n".encode() if text else b": still here\n\n")
            self.wfile.flush()

    def _send(self, data: bytes, kind: str) -> None:
        self.send_response(HTTPStatus.OK)
        self._headers(f"{_TYPES[kind]}; charset=utf-8", len(data))
        self.wfile.write(data)

    def _headers(self, content_type: str, length: int | None = None) -> None:
        self.send_header("Content-Type", content_type)
        if length is not None:
            self.send_header("Content-Length", str(length))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", _POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()

    def log_message(self, format: str, *args: Any) -> None:
        pass
