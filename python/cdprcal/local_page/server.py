"""The server of a local page: this computer only, and nothing changes but by the page itself.

It listens on 127.0.0.1 and answers only requests that name it so: a page of another site cannot
reach it through a name of its own that leads here. What changes anything takes a token that only
the page knows, so that no other page can do it behind the user's back.
"""

from __future__ import annotations

import errno
import hmac
import json
import secrets
import threading
from collections.abc import Callable, Iterator, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from typing import Any, Self

from cdprcal._core import InputError
from cdprcal.extras import need
from cdprcal.io.files import reason

#: Gives the messages of one page, as JSON texts; '' keeps the connection alive.
Messages = Callable[[], Iterator[str]]
#: Does what a page asks for, told as plain data; the answer as plain data, None: there is none.
Action = Callable[[Any], Any]

_TYPES = {"html": "text/html", "js": "text/javascript", "css": "text/css"}
_POLICY = (
    "default-src 'none'; script-src 'self'; connect-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
#: The package with what all pages share.
_SHARED = "cdprcal.local_page"
#: No page asks for more.
_MOST_BYTES = 1 << 20


class LocalServer:
    """Serves a page while its context lasts.

    package: whose folder ``static`` holds what is on the page, its script and its style, all named
    alike ('live': live.html, live.js, live.css); page.html goes around it. messages: called once
    for every page that is opened, whose ``/events`` they are. actions: path → what it does; without
    any, nothing that a page asks for changes anything. port: 0 is any that is free. Raises
    InputError when it cannot be had, and where Plotly is not installed.
    """

    def __init__(
        self,
        package: str,
        *,
        port: int = 0,
        messages: Messages | None = None,
        actions: Mapping[str, Action] | None = None,
    ) -> None:
        need("plotly")
        self.token = secrets.token_urlsafe(16)
        try:
            self._server = _Server(("127.0.0.1", port), _Handler)
        except OSError as error:
            taken = error.errno == errno.EADDRINUSE
            why = "is taken; choose another" if taken else f"cannot be had: {reason(error)}"
            raise InputError(f"port {port} {why}") from None
        name = package.rpartition(".")[2]
        self._server.page = (package, name)
        self._server.files = {
            **{f"/{name}.{kind}": (package, f"{name}.{kind}") for kind in ("js", "css")},
            **{f"/{file}": (_SHARED, file) for file in ("page.js", "page.css")},
        }
        self._server.messages = messages
        self._server.actions = dict(actions or {})
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

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    page: tuple[str, str]
    files: dict[str, tuple[str, str]]
    messages: Messages | None
    actions: dict[str, Action]
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
        if self.path == "/":
            self._send(self._page(), "html")
        elif self.path == "/events" and self.server.messages is not None:
            self._events(self.server.messages)
        elif self.path == "/plotly.js":
            script = resources.files("plotly") / "package_data" / "plotly.min.js"
            self._send(script.read_bytes(), "js")
        elif self.path in self.server.files:
            package, name = self.server.files[self.path]
            self._send(_static(package, name), name.rpartition(".")[2])
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _page(self) -> bytes:
        package, name = self.server.page
        token = self.server.token if self.server.actions else ""
        page = _static(_SHARED, "page.html").replace(b"{{name}}", name.encode())
        body = _static(package, f"{name}.html")
        return page.replace(b"{{token}}", token.encode()).replace(b"{{body}}", body)

    def do_POST(self) -> None:
        if not self._is_for_us():
            return
        action = self.server.actions.get(self.path)
        length = self.headers.get("Content-Length") or "0"
        if action is None:
            self.send_error(HTTPStatus.FORBIDDEN, "read-only")
        elif not hmac.compare_digest(self.headers.get("X-Token", ""), self.server.token):
            self.send_error(HTTPStatus.FORBIDDEN, "wrong token")
        elif not length.isdecimal() or int(length) > _MOST_BYTES:
            self.send_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        else:
            self._act(action, self.rfile.read(int(length)))

    def _act(self, action: Action, body: bytes) -> None:
        status = HTTPStatus.OK
        try:
            answer = action(json.loads(body) if body else None)
        except (InputError, ValueError) as error:  # the same message as on a terminal
            status, answer = HTTPStatus.BAD_REQUEST, {"error": str(error)}
        except OSError as error:
            said = f"{error.filename or 'output'}: {reason(error)}"
            status, answer = HTTPStatus.BAD_REQUEST, {"error": said}
        if answer is None:
            self.send_response(HTTPStatus.NO_CONTENT)
            self.end_headers()
            return
        data = json.dumps(answer, allow_nan=False).encode()
        self.send_response(status)
        self._headers("application/json; charset=utf-8", len(data))
        self.wfile.write(data)

    def _is_for_us(self) -> bool:
        port = self.server.server_address[1]
        if self.headers.get("Host") in (f"127.0.0.1:{port}", f"localhost:{port}"):
            return True
        self.send_error(HTTPStatus.FORBIDDEN, "this page is for 127.0.0.1")
        return False

    def _events(self, messages: Messages) -> None:
        self.send_response(HTTPStatus.OK)
        self._headers("text/event-stream")
        for text in messages():
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


def _static(package: str, name: str) -> bytes:
    return (resources.files(package) / "static" / name).read_bytes()
