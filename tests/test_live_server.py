# SPDX-License-Identifier: GPL-2.0-or-later
"""Who may talk to the live window's server: one page, once let in, from here, with the key."""

from __future__ import annotations

import http.client
import json
import socket
import threading
import time
from typing import Any, Iterator

import pytest

from alup.live import server as serving
from alup.live.server import Server
from alup.messages.errors import HandleError


def refuse(_question: dict) -> Any:
    raise HandleError("No such handle.")


def number(question: dict) -> Any:
    return {"double": 2 * int(question["number"])}


@pytest.fixture
def server() -> Iterator[Server]:
    made = Server({"number": number, "refuse": refuse, "done": lambda _: {}, "cancel": lambda _: {}})
    yield made
    made.close()


def ask(
    server: Server,
    name: str,
    question: Any = None,
    method: str = "POST",
    body: bytes | None = None,
    **changes: Any,
) -> tuple[int, Any]:
    """Status and JSON; `changes` : headers other than those of the page, None to leave one out"""
    headers = {
        "Host": f"127.0.0.1:{server.port}",
        "Origin": server.origin,
        "Content-Type": "application/json",
        "X-Alup-Key": server.key,
        "Sec-Fetch-Site": "same-origin",
        **{header.replace("_", "-"): value for header, value in changes.items()},
    }
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    connection.putrequest(method, "/" + name, skip_host=True)
    data = body if body is not None else json.dumps(question or {}).encode()
    headers.setdefault("Content-Length", str(len(data)))
    for header, value in headers.items():
        if value is not None:
            connection.putheader(header, value)
    connection.endheaders(data)
    answer = connection.getresponse()
    text = answer.read()
    connection.close()
    is_json = (answer.getheader("Content-Type") or "").startswith("application/json")
    return answer.status, json.loads(text) if is_json else text


def test_the_page_asks_and_is_answered(server: Server) -> None:
    assert ask(server, "number", {"number": 21}) == (200, {"double": 42})
    assert ask(server, "refuse") == (200, {"error": "No such handle."})
    assert ask(server, "number", {"number": "x"})[0] == 400
    assert ask(server, "nothing")[0] == 404


def test_the_token_lets_in_once(server: Server) -> None:
    token = server.address.partition("#")[2]
    assert ask(server, "enter", {"token": "wrong"}, X_Alup_Key=None)[0] == 403
    assert ask(server, "enter", {"token": token}, X_Alup_Key=None) == (200, {"key": server.key})
    assert ask(server, "enter", {"token": token}, X_Alup_Key=None)[0] == 403
    assert ask(server, "enter", {"token": ""}, X_Alup_Key=None)[0] == 403


@pytest.mark.parametrize(
    "changes",
    [
        {"X_Alup_Key": None},
        {"X_Alup_Key": "guessed"},
        {"X_Alup_Key": ""},
        {"Origin": None},
        {"Origin": "null"},
        {"Origin": "http://evil.example"},
        {"Origin": "http://127.0.0.1:1"},
        {"Host": None},
        {"Host": "evil.example"},
        {"Host": "localhost"},
        {"Sec_Fetch_Site": "same-site"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Content_Type": "text/plain"},
        {"Content_Type": None},
    ],
    ids=str,
)
def test_others_are_refused(server: Server, changes: dict[str, Any]) -> None:
    asked: list[Any] = []
    server.answers["number"] = asked.append
    assert ask(server, "number", {"number": 1}, **changes)[0] in (400, 403)
    assert ask(server, "alive", **changes)[0] in (400, 403)
    assert not asked
    assert not server.is_over


def test_host_decides_about_files_as_well(server: Server) -> None:
    assert ask(server, "", method="GET", Origin=None)[0] == 200
    assert ask(server, "main.js", method="GET", Origin=None)[0] == 200
    assert ask(server, "", method="GET", Host="rebound.example:80")[0] == 403
    for path in ("../server.py", "..%2fserver.py", "/etc/passwd", "page/", "engine.py", "__init__.py"):
        assert ask(server, path, method="GET")[0] == 404
    assert ask(server, "number", {"number": 1}, method="GET")[0] == 404
    for method in ("PUT", "OPTIONS", "DELETE"):
        assert ask(server, "number", {"number": 1}, method=method)[0] == 501


def test_no_answer_may_be_framed_or_read_elsewhere(server: Server) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    connection.request("GET", "/")
    answer = connection.getresponse()
    answer.read()
    connection.close()
    policy = answer.getheader("Content-Security-Policy") or ""
    assert "default-src 'none'" in policy and "script-src 'self';" in policy
    assert "frame-ancestors 'none'" in policy and "unsafe-eval" not in policy and "http" not in policy
    assert answer.getheader("Access-Control-Allow-Origin") is None
    assert answer.getheader("Set-Cookie") is None
    assert answer.getheader("X-Content-Type-Options") == "nosniff"
    assert answer.getheader("Cache-Control") == "no-store"


def test_it_listens_on_this_machine_only(server: Server) -> None:
    assert server._http.socket.getsockname()[0] == "127.0.0.1"


def test_what_is_no_question_is_refused(server: Server) -> None:
    assert ask(server, "number", body=b"{")[0] == 400
    assert ask(server, "number", body=b"[1]")[0] == 400
    assert ask(server, "number", body=b"\xff\xfe")[0] == 400
    too_long = str(serving.LARGEST_QUESTION + 1)
    assert ask(server, "number", body=b"", Content_Length=too_long)[0] == 413
    assert ask(server, "number", body=b"", Content_Length="-1")[0] == 413
    assert ask(server, "number", {"number": 1}) == (200, {"double": 2})


def test_another_user_is_refused(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    import os

    mine = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: mine + 1)
    with pytest.raises((ConnectionError, http.client.HTTPException)):
        ask(server, "number", {"number": 1})
    monkeypatch.setattr(os, "getuid", lambda: mine)
    assert ask(server, "number", {"number": 1})[0] == 200


# --- the end ------------------------------------------------------------------------------------


def staying(server: Server) -> socket.socket:
    """A page that is there as long as the connection."""
    connection = socket.create_connection(("127.0.0.1", server.port), timeout=10)
    connection.sendall(
        f"POST /alive HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nOrigin: {server.origin}\r\n"
        f"Content-Type: application/json\r\nX-Alup-Key: {server.key}\r\n"
        "Content-Length: 2\r\n\r\n{}".encode()
    )
    assert b"200 OK" in connection.recv(4096)
    return connection


def ended(server: Server) -> tuple[threading.Thread, list[str]]:
    found: list[str] = []
    thread = threading.Thread(target=lambda: found.append(server.wait(lambda: True)))
    thread.start()
    return thread, found


@pytest.mark.parametrize(("name", "how"), [("done", serving.DONE), ("cancel", serving.CANCELLED)])
def test_the_page_ends_the_window(server: Server, name: str, how: str) -> None:
    page = staying(server)
    thread, found = ended(server)
    assert ask(server, name)[0] == 200
    thread.join(5)
    assert found == [how]
    assert ask(server, "number", {"number": 1})[0] == 410
    page.close()


def test_a_lost_page_ends_it_too(server: Server) -> None:
    thread, found = ended(server)
    page = staying(server)
    page.close()
    time.sleep(0.5)
    page = staying(server)  # loaded anew
    thread.join(serving.GRACE_SECONDS + 1.0)
    assert not found
    page.close()
    thread.join(5)
    assert found == [serving.LOST]


def test_an_error_of_ours_is_heard(server: Server) -> None:
    def broken(_question: dict) -> Any:
        raise ZeroDivisionError("broken")

    server.answers["number"] = broken
    with pytest.raises((ConnectionError, http.client.HTTPException)):
        ask(server, "number")
    with pytest.raises(ZeroDivisionError, match="broken"):
        server.wait(lambda: True)


def test_a_page_that_never_comes(server: Server) -> None:
    assert server.wait(lambda: False) == serving.NEVER
