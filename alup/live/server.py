# SPDX-License-Identifier: GPL-2.0-or-later
"""The way between a page and the engine: HTTP on this machine, for one page that knows a secret.

Each question is a POST with a JSON body.  A page has one `drag` under way at a time and sends the newest
place of the pointer when the answer comes, so nothing queues up anywhere.  A round trip on the loopback
interface takes a millisecond; the standard library's server is enough for that, where WebSockets would need a
package or a protocol of our own.

Who may ask, and why nobody else can:

* The server listens on 127.0.0.1 alone, at a port that the system chooses.
* The page itself is no secret.  Its address ends with a token behind a #, which no browser sends anywhere;
  the page takes it out of the address, and exchanges it, once, for a key.  Every question carries the key in
  a header, which another site's page can't add without permission.  A cookie would go to every port of this
  machine, whoever listens there.
* `Host` must be this address, so that no name of somebody else's that points here (DNS rebinding) is
  served; `Origin` and `Sec-Fetch-Site` must be this page's own.
* A command line can be read by other users, and the address stands on the browser's.  Linux says whose
  a connection is; it must be ours.  On macOS a private file leads to the address (see `browser`).
* The page may load nothing from elsewhere and runs no script but its own (`Content-Security-Policy`).

The page keeps one answer open, `alive`.  When that connection ends, the page is gone, whether it was closed
or lost; timers of a page in the background would be no such sign, as browsers hold them back.
"""

from __future__ import annotations

import hmac
import json
import os
import secrets
import select
import socket
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Callable

from ..messages.errors import AlupError
from ..messages.language import translate as _

HOST = "127.0.0.1"
FOLDER = Path(__file__).with_name("page")

# Files of the page, and what they are.
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}

# A drag of many frames is a kilobyte; nothing that the page sends comes near.
LARGEST_QUESTION = 1_000_000

# A page that was lost may come back within this time: it was loaded anew.
GRACE_SECONDS = 2.0
# A browser that starts for the first time, on a busy machine.
START_SECONDS = 40.0
_TICK_SECONDS = 0.25
# So often a byte goes to the page, which notices by that if nobody is there any more.
_BEAT_SECONDS = 1.0

KEY_HEADER = "X-Alup-Key"

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = (
    ("Content-Security-Policy", _POLICY),
    ("X-Content-Type-Options", "nosniff"),
    ("X-Frame-Options", "DENY"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Cross-Origin-Embedder-Policy", "require-corp"),
    ("Cache-Control", "no-store"),
)

# Ends of a live window.
DONE, CANCELLED, LOST, NEVER, FAILED = "done", "cancelled", "lost", "never", "failed"

Answer = Callable[[dict], Any]


class Server:
    """answers : what the page may ask, by name; each gets the question and returns what becomes JSON

    An AlupError is answered with its sentence.  `done` and `cancel` end the window, besides what they answer.
    """

    def __init__(self, answers: dict[str, Answer]):
        self.answers = answers
        self.token, self.key = secrets.token_urlsafe(32), secrets.token_urlsafe(32)
        self._lock = threading.Lock()
        self._pages = 0
        self._left_at: float | None = None
        self._end: str | None = None
        self._error: Exception | None = None
        self._changed = threading.Condition(self._lock)
        self._http = _Http((HOST, 0), _Handler)
        self._http.owner = self
        self.port = int(self._http.server_address[1])
        self.origin = f"http://{HOST}:{self.port}"
        self._thread = threading.Thread(target=self._http.serve_forever, args=(0.05,), daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        return f"{self.origin}/#{self.token}"

    def wait(self, still_possible: Callable[[], bool]) -> str:
        """How the window ends.  still_possible : asked now and then until the page comes, whether it may"""
        begun = time.monotonic()
        with self._changed:
            while self._end is None:
                self._changed.wait(_TICK_SECONDS)
                now = time.monotonic()
                if self._pages:
                    continue
                if self._left_at is not None:
                    if now - self._left_at > GRACE_SECONDS:
                        self._end = LOST
                elif now - begun > START_SECONDS or not still_possible():
                    self._end = NEVER
        if self._error is not None:
            raise self._error
        return self._end

    def end(self, how: str) -> None:
        with self._changed:
            if self._end is None:
                self._end = how
            self._changed.notify_all()

    def fail(self, error: Exception) -> None:
        """End the window by an error of ours, which `wait` raises where it is heard."""
        self._error = error
        self.end(FAILED)

    @property
    def is_over(self) -> bool:
        return self._end is not None

    def close(self) -> None:
        self._http.shutdown()
        self._http.server_close()

    def enter(self, token: str) -> str | None:
        """The key for the token, once."""
        with self._lock:
            right = bool(self.token) and hmac.compare_digest(token.encode(), self.token.encode())
            if not right:
                return None
            self.token = ""
            return self.key

    def page_came(self) -> None:
        with self._changed:
            self._pages += 1

    def page_left(self) -> None:
        with self._changed:
            self._pages -= 1
            self._left_at = time.monotonic()
            self._changed.notify_all()


class _Http(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    owner: Server

    def verify_request(self, _request: Any, client_address: Any) -> bool:
        return is_ours(client_address[1], self.server_address[1])

    def handle_error(self, _request: Any, _client_address: Any) -> None:
        """Say nothing: what is written there opens a window in Inkscape.  Connections end as they like."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "ALUP", ""
    disable_nagle_algorithm = True
    wbufsize = 1 << 16
    timeout = 600
    server: _Http

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - the name of the library
        """Say nothing: what is written there opens a window in Inkscape."""

    def do_GET(self) -> None:
        if not self._is_addressed_here():
            return
        name = self.path.split("?")[0].split("#")[0]
        file = FILES.get("/index.html" if name == "/" else name)
        if file is None:
            self._send(404, b"", "text/plain")
            return
        self._send(200, file.read_bytes(), _TYPES[file.suffix])

    def do_POST(self) -> None:
        owner = self.server.owner
        length = self.headers.get("Content-Length") or ""
        if not length.isdigit() or int(length) > LARGEST_QUESTION:
            self.close_connection = True
            self._send(413, b"", "text/plain")
            return
        body = self.rfile.read(int(length))
        if not self._is_addressed_here() or not self._is_asked_here():
            return
        try:
            question = json.loads(body or b"{}")
        except ValueError:
            question = None
        if not isinstance(question, dict):
            self._send(400, b"", "text/plain")
            return
        if self.path == "/enter":
            key = owner.enter(str(question.get("token", "")))
            self._json(200 if key else 403, {"key": key} if key else {})
            return
        given = self.headers.get(KEY_HEADER) or ""
        if not hmac.compare_digest(given.encode("utf-8", "replace"), owner.key.encode()):
            self._send(403, b"", "text/plain")
            return
        if self.path == "/alive":
            self._stay()
            return
        self._answer(self.path[1:], question)

    def _answer(self, name: str, question: dict) -> None:
        owner = self.server.owner
        answer = owner.answers.get(name)
        if answer is None:
            self._send(404, b"", "text/plain")
            return
        if owner.is_over:
            self._json(410, {})
            return
        try:
            found = answer(question)
        except AlupError as error:
            self._json(200, {"error": str(error)})
            return
        except (KeyError, TypeError, ValueError):
            self._json(400, {})
            return
        except MemoryError:
            self._json(200, {"error": _("There is not enough memory for this.")})
            return
        except Exception as error:
            owner.fail(error)
            raise
        self._json(200, found)
        if name in ("done", "cancel"):
            owner.end(DONE if name == "done" else CANCELLED)

    def _stay(self) -> None:
        """Answer as long as the page is there."""
        owner = self.server.owner
        self.close_connection = True
        self.send_response(200)
        self._own_headers("application/octet-stream")
        self.send_header("Transfer-Encoding", "chunked")
        self.end_headers()
        owner.page_came()
        try:
            beat = 0.0
            while not owner.is_over:
                if time.monotonic() - beat > _BEAT_SECONDS:
                    self.wfile.write(b"1\r\n.\r\n")
                    self.wfile.flush()
                    beat = time.monotonic()
                readable, _w, _x = select.select([self.connection], [], [], _TICK_SECONDS)
                if readable and not self.connection.recv(1024):
                    break
            else:
                self.wfile.write(b"0\r\n\r\n")
                self.wfile.flush()
        except OSError:
            pass  # the page is gone
        finally:
            owner.page_left()

    def _is_addressed_here(self) -> bool:
        hosts = self.headers.get_all("Host") or []
        if hosts == [f"{HOST}:{self.server.owner.port}"]:
            return True
        self._send(403, b"", "text/plain")
        return False

    def _is_asked_here(self) -> bool:
        """Whether our page asks: no other site's, and no form."""
        site = self.headers.get("Sec-Fetch-Site")
        kind = (self.headers.get("Content-Type") or "").split(";")[0].strip()
        origin = self.headers.get("Origin")
        if (
            origin == self.server.owner.origin
            and site in (None, "same-origin")
            and kind == "application/json"
        ):
            return True
        self._send(403, b"", "text/plain")
        return False

    def _json(self, status: int, data: Any) -> None:
        text = json.dumps(data, separators=(",", ":"), allow_nan=False)
        self._send(status, text.encode(), "application/json")

    def _send(self, status: int, body: bytes, kind: str) -> None:
        try:
            self.send_response(status)
            self._own_headers(kind + ("; charset=utf-8" if kind.startswith("text/") else ""))
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)
            self.wfile.flush()
        except OSError:
            self.close_connection = True  # nobody waits for it any more

    def _own_headers(self, kind: str) -> None:
        self.send_header("Content-Type", kind)
        for name, value in _HEADERS:
            self.send_header(name, value)


FILES = {"/" + path.name: path for path in sorted(FOLDER.glob("*")) if path.suffix in _TYPES}


def is_ours(port: int, to: int) -> bool:
    """Whether the connection from a port of this machine to one of ours is our user's, as far as is told."""
    if not hasattr(os, "getuid"):
        return True
    try:
        with open("/proc/net/tcp", encoding="ascii") as file:
            lines = file.read().split("\n")[1:]
    except OSError:  # not Linux
        return True
    wanted = (f"{_hexadecimal(HOST)}:{port:04X}", f"{_hexadecimal(HOST)}:{to:04X}")
    for line in lines:
        parts = line.split()
        if len(parts) > 7 and (parts[1], parts[2]) == wanted:
            return int(parts[7]) == os.getuid()
    return False


def _hexadecimal(host: str) -> str:
    """An address as the system's table has it: a number in the machine's own order of bytes."""
    return f"{int.from_bytes(socket.inet_aton(host), sys.byteorder):08X}"
