"""The server of one page: loopback only, behind a path that nobody can guess, and no file at all.

A page of another site cannot read it. The Host header must name the loopback interface, so that a foreign
name that resolves to it is refused, and the path holds a secret. Other users of the machine do not know that
path either.
"""

from __future__ import annotations

import json
import secrets
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Condition, Thread
from typing import Any
from urllib.parse import parse_qs, urlsplit

from inputdesign_cli.errors import OutputError
from inputdesign_cli.report.render import script, script_source

HOST = "127.0.0.1"
# Seconds after which a page asks for news again, and seconds that a client may take for its request.
_PATIENCE, _SLOWEST = 20.0, 30.0
_POLICY = (
    f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'self' {script_source()}; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


class Board:
    """Holds one page, and a number that grows whenever it changes."""

    def __init__(self) -> None:
        self._changed = Condition()
        self._page, self._version = "", 0

    def show(self, page: str) -> None:
        """Show another page, a whole HTML document."""
        with self._changed:
            if page != self._page:
                self._page, self._version = page, self._version + 1
                self._changed.notify_all()

    @property
    def page(self) -> tuple[str, int]:
        """Return the page, and its number."""
        with self._changed:
            return self._page, self._version

    def newer_than(self, version: int, patience: float) -> int:
        """Return the number of the page once it differs from `version`, or after `patience` seconds."""
        with self._changed:
            self._changed.wait_for(lambda: self._version != version, patience)
            return self._version


@contextmanager
def serving(board: Board, port: int = 0) -> Iterator[str]:
    """Serve the page of a board while the block runs, and yield its address.

    Args:
        port: 0 takes a free one.

    Raises:
        OutputError: `port-taken`.
    """
    secret = secrets.token_urlsafe(16)

    class Handler(_Handler):
        shown, path_prefix = board, f"/{secret}/"
        hosts = frozenset[str]()

    try:
        server = _Server((HOST, port), Handler)
    except OSError as error:
        message = f"nothing can be served at {HOST}:{port}: {error.strerror or error}"
        raise OutputError.because(
            "port-taken", message, "choose another --port, or 0 for a free one"
        ) from error
    taken = server.server_address[1]
    Handler.hosts = frozenset({f"{HOST}:{taken}", f"localhost:{taken}"})
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
    thread.start()
    try:
        yield f"http://{HOST}:{taken}/{secret}/"
    finally:
        server.shutdown()
        server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Print nothing where a browser goes away while it waits for a new page."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers GET and HEAD for the page, its script, and the number of the page that is newest."""

    shown: Board
    path_prefix: str
    hosts: frozenset[str]
    server_version, sys_version = "idesign", ""
    timeout = _SLOWEST

    def do_GET(self) -> None:
        """Send the page, its script or the newest number; refuse any other request."""
        try:
            asked = urlsplit(self.path)
        except ValueError:  # such as http://[::1
            self._answer("text/plain", "this is no address\n", HTTPStatus.BAD_REQUEST)
            return
        # The browser must ask for this machine by its own name, and not from another site's page.
        named = self.headers.get_all("Host") or []
        ours = len(named) == 1 and named[0] in self.hosts
        if not ours or self.headers.get("Sec-Fetch-Site") == "cross-site":
            self._answer("text/plain", "this page is for the machine that it runs on\n", HTTPStatus.FORBIDDEN)
        elif asked.path == self.path_prefix:
            page, version = self.shown.page
            self._answer("text/html", page.replace("<html ", f'<html data-version="{version}" ', 1))
        elif asked.path == f"{self.path_prefix}follow.js":
            self._answer("text/javascript", script("follow.js"))
        elif asked.path == f"{self.path_prefix}news":
            given = parse_qs(asked.query).get("version", ["0"])[0]
            version = int(given) if given.isdecimal() and len(given) < 10 else 0
            found = {"version": self.shown.newer_than(version, _PATIENCE)}
            self._answer("application/json", json.dumps(found))
        else:
            self._answer("text/plain", "there is nothing here\n", HTTPStatus.NOT_FOUND)

    do_HEAD = do_GET

    def _answer(self, kind: str, text: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        body = text.encode("utf-8", "backslashreplace")
        self.send_response(status)
        for name, value in (
            ("Content-Type", f"{kind}; charset=utf-8"),
            ("Content-Length", str(len(body))),
            ("Cache-Control", "no-store"),
            ("Content-Security-Policy", _POLICY),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
        ):
            self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Print nothing about requests: the terminal is the user's."""
