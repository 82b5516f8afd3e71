# SPDX-License-Identifier: GPL-2.0-or-later
"""Fetch a wheel from a package index without pip: pip itself where a Python comes without it, and uv.

An index is the simple one of PEP 503: a page of links for each project, with the files' digests.
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

_PATIENCE_SECONDS = 30
_CHUNK = 1 << 16


@dataclass(frozen=True)
class Wheel:
    """A file of an index."""

    name: str
    url: str
    sha256: str

    @property
    def release(self) -> tuple[int, ...]:
        """Its version, () where it is none of numbers only."""
        version = self.name.split("-")[1]
        return tuple(map(int, version.split("."))) if re.fullmatch(r"\d+(\.\d+)*", version) else ()


class _Links(HTMLParser):
    """Wheels among the links of a page, with the Python that they require."""

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
    """The newest release's wheel that suits.

    python : version that it has to run under; suits : of a file's name.
    Raises SetupError where the index can't be read or has none.
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
    """Path of the downloaded file; SetupError where it is not what the index promised."""
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
    """An error of the network, unless it is one of the disk."""
    if path and not isinstance(error, urllib.error.URLError) and error.filename == path:
        return faults.of_system(error, os.path.dirname(path))
    return faults.of_words(str(error), index=index, proxy=proxy())


def proxy() -> str:
    """The proxy that is used for the index, empty where there is none."""
    return urllib.request.getproxies().get("https", "")


def _allows(needs: str, python: tuple[int, ...]) -> bool:
    """Whether a requirement as ">=3.9" is met; pip and uv name the lowest version only."""
    lowest = re.search(r">=\s*(\d+(?:\.\d+)*)", needs)
    return lowest is None or python >= tuple(map(int, lowest[1].split(".")))


def _called(python: tuple[int, ...]) -> str:
    return "Python " + ".".join(map(str, python))
