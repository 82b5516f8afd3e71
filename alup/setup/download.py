# SPDX-License-Identifier: GPL-2.0-or-later
"""Download a wheel from a package index without pip: pip itself, if the Python has none, and uv.

The index has the simple interface of PEP 503: a page of links for each project, with the files' digests.
"""

from __future__ import annotations

import hashlib
import os
import re
import ssl
import urllib.error
import urllib.parse
import urllib.request
from dataclasses import dataclass
from html.parser import HTMLParser
from typing import Callable

from ..messages.language import translate as _
from . import faults
from .progress import Progress
from .setup_errors import SetupError

# Time limit of a connection that does not answer.  Chosen by looking at the cases.
_PATIENCE_SECONDS = 30
# Bytes that are read between two checks for cancelling.
_CHUNK = 1 << 16


@dataclass(frozen=True)
class Wheel:
    """A wheel in an index."""

    name: str
    url: str
    sha256: str

    @property
    def release(self) -> tuple[int, ...]:
        """The version as numbers; () if it has other parts."""
        version = self.name.split("-")[1]
        return tuple(map(int, version.split("."))) if re.fullmatch(r"\d+(\.\d+)*", version) else ()


class _Links(HTMLParser):
    """Parser of a page: its wheels, with the versions of Python that they require."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.page = page
        self.found: list[tuple[Wheel, str]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        link = {name: value or "" for name, value in attrs}
        if tag != "a" or "data-yanked" in link:
            return
        url, _hash, digest = urllib.parse.urljoin(self.page, link.get("href", "")).partition("#sha256=")
        name = urllib.parse.unquote(url.rsplit("/", 1)[-1])
        if name.endswith(".whl"):
            self.found.append((Wheel(name, url, digest), link.get("data-requires-python", "")))


def newest(index: str, project: str, python: tuple[int, ...], suits: Callable[[str], bool]) -> Wheel:
    """The suitable wheel of the newest release.

    python : the version that has to run it; suits : tells by the file's name whether a wheel is suitable
    Raises SetupError if the index can't be read, or has no such wheel.
    """
    page = f"{index.rstrip('/')}/{project}/"
    links = _Links(page)
    links.feed(_read(page, index).decode("utf-8", "replace"))
    fitting = [
        wheel
        for wheel, needs in links.found
        if wheel.release and suits(wheel.name) and _allows(needs, python)
    ]
    if not fitting:
        raise faults.of_words(
            f"No matching distribution found for {project}", index=index, python=_called(python)
        )
    return max(fitting, key=lambda wheel: wheel.release)


def fetch(wheel: Wheel, folder: str, index: str, progress: Progress) -> str:
    """Download a wheel; returns its path.  Raises SetupError if its digest is wrong."""
    path = os.path.join(folder, wheel.name)
    digest = hashlib.sha256()
    try:
        with _open(wheel.url) as answer, open(path, "wb") as file:
            while True:
                progress.check()
                part = answer.read(_CHUNK)
                if not part:
                    break
                digest.update(part)
                file.write(part)
    except (OSError, ssl.SSLError) as error:
        raise _unreached(error, index, path) from error
    if wheel.sha256 and digest.hexdigest() != wheel.sha256:
        text = _("{name} arrived damaged from {index}. Try again.")
        raise SetupError(text.format(name=wheel.name, index=index))
    return path


def _read(url: str, index: str) -> bytes:
    try:
        with _open(url) as answer:
            return bytes(answer.read())
    except (OSError, ssl.SSLError) as error:
        raise _unreached(error, index, "") from error


def _open(url: str):  # type: ignore[no-untyped-def]
    if urllib.parse.urlsplit(url).scheme not in ("http", "https", "file"):
        text = _("{url} is no address of a package index; it begins with https.")
        raise SetupError(text.format(url=url))
    context = ssl.create_default_context(cafile=os.environ.get("PIP_CERT") or None)
    request = urllib.request.Request(url, headers={"Accept": "text/html"})  # noqa: S310 - checked above
    return urllib.request.urlopen(request, timeout=_PATIENCE_SECONDS, context=context)  # noqa: S310


def _unreached(error: OSError, index: str, path: str) -> SetupError:
    """The SetupError for a failed download: of the network, or of the disk."""
    if path and not isinstance(error, urllib.error.URLError) and error.filename == path:
        return faults.of_system(error, os.path.dirname(path))
    return faults.of_words(str(error), index=index, proxy=proxy())


def proxy() -> str:
    """The proxy used for the index; empty if there is none."""
    return urllib.request.getproxies().get("https", "")


def _allows(needs: str, python: tuple[int, ...]) -> bool:
    """Whether a requirement such as ">=3.9" is met; pip and uv only state a lowest version."""
    lowest = re.search(r">=\s*(\d+(?:\.\d+)*)", needs)
    return lowest is None or python >= tuple(map(int, lowest[1].split(".")))


def _called(python: tuple[int, ...]) -> str:
    return "Python " + ".".join(map(str, python))
