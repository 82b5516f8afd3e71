# SPDX-License-Identifier: GPL-2.0-or-later
"""Error messages with a remedy, from the output of pip or from an error of the operating system.

The kinds of errors are tried in order.  The order matters: without a network pip's last message is that there
is no such package.
"""

from __future__ import annotations

import errno
import re

from ..messages.language import N_
from ..messages.language import translate as _
from .setup_errors import SetupError

# Windows' error numbers: access denied, sharing violation, lock violation; path not found because it is too
# long.
_LOCKED = (5, 32, 33)
_TOO_LONG = 206

# Programs of Windows accept paths of up to 259 characters, unless the registry allows longer ones.
LONGEST_WINDOWS_PATH = 259

PROXY = "proxy"
CERTIFICATE = "certificate"
NO_NETWORK = "no network"
NO_NETWORK_IN_FLATPAK = "no network in flatpak"
NO_ROOM = "no room"
NO_PACKAGE = "no package"
READ_ONLY = "read only"
LOCKED = "locked"
PATH_TOO_LONG = "path too long"
OTHER = "other"

_SENTENCES = {
    PROXY: N_(
        "The proxy {proxy} let nothing through ({said}). Correct HTTPS_PROXY, or set up from a folder of"
        " wheels."
    ),
    CERTIFICATE: N_(
        "The connection to {index} is not trusted ({said}). Name your network's certificate in SSL_CERT_FILE,"
        " or set up from a folder of wheels."
    ),
    NO_NETWORK: N_("{index} can't be reached. Connect to the internet, or set up from a folder of wheels."),
    NO_NETWORK_IN_FLATPAK: N_(
        "{index} can't be reached: a Flatpak has no network unless it is given one. Run in a terminal:"
        " flatpak override --user --share=network org.inkscape.Inkscape. Then start Inkscape anew and set up"
        " again."
    ),
    NO_ROOM: N_("There is no room left on the disk for {folder}. Make room for {size} MB and try again."),
    NO_PACKAGE: N_(
        "There is no {package} for {python} in {index}. Install another Python, or correct the folder of"
        " wheels."
    ),
    READ_ONLY: N_("{folder} can't be written to ({said}). Make it writable, or install into another folder."),
    LOCKED: N_(
        "{folder} is in use by another program ({said}). Close other windows of Inkscape, wait for the virus"
        " scanner, and try again."
    ),
    PATH_TOO_LONG: N_(
        "The path {folder} is too long for this system. Install into a folder with a shorter path."
    ),
    OTHER: N_("The packages could not be installed: {said}"),
}

# Megabytes of free space for the environment, including temporary files.
ROOM = 600

_KINDS = (
    (PROXY, r"ProxyError|Cannot connect to proxy|407 Proxy|Tunnel connection failed"),
    (CERTIFICATE, r"CERTIFICATE_VERIFY_FAILED|SSLError|SSLCertVerification"),
    (
        NO_NETWORK,
        r"NewConnectionError|name resolution|getaddrinfo failed|nodename nor servname"
        r"|Name or service not known|Network is unreachable|No route to host|Connection refused"
        r"|Max retries exceeded|ConnectTimeout|ReadTimeout|timed out|Connection reset",
    ),
    (NO_ROOM, r"No space left on device|Errno 28\b|WinError 112\b|Disk quota exceeded"),
    (LOCKED, r"WinError (5|32|33)\b|being used by another process"),
    (PATH_TOO_LONG, r"WinError 206\b|Windows Long Path|Errno 36\b|File name too long"),
    (READ_ONLY, r"Read-only file system|Permission denied"),
    (NO_PACKAGE, r"No matching distribution found for (?P<package>[\w.-]+)"),
)


def of_words(words: str, **about: object) -> SetupError:
    """The error that a program's output describes.

    about : folder, index, python, proxy, flatpak, as far as they are known
    """
    lines = [line.strip() for line in words.splitlines() if line.strip()]
    for kind, pattern in _KINDS:
        found = re.search(pattern, words)
        if found:
            said = next(line for line in lines if re.search(pattern, line))
            return _error(kind, said, {**found.groupdict(), **about})
    return _error(OTHER, last_line(words), about)


def last_line(words: str) -> str:
    """The most informative line: the last error, or else the last line."""
    lines = [line.strip() for line in words.splitlines() if line.strip()]
    errors = [line for line in lines if line.startswith("ERROR")]
    return _short((errors or lines or ["?"])[-1])


def of_system(error: OSError, folder: str) -> SetupError:
    """The SetupError for an error of the operating system in a folder."""
    said = error.strerror or str(error)
    number = getattr(error, "winerror", None)
    if number in _LOCKED or error.errno in (errno.EBUSY, errno.ETXTBSY):
        kind = LOCKED
    elif number == _TOO_LONG or error.errno == errno.ENAMETOOLONG:
        kind = PATH_TOO_LONG
    elif error.errno in (errno.ENOSPC, errno.EDQUOT):
        kind = NO_ROOM
    elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        kind = READ_ONLY
    else:
        kind = OTHER
        said = f"{error.filename or folder}: {said}"
    return _error(kind, said, {"folder": folder})


def path_too_long(folder: str) -> SetupError:
    return _error(PATH_TOO_LONG, "", {"folder": folder})


def _error(kind: str, said: str, about: dict[str, object]) -> SetupError:
    if kind == NO_NETWORK and about.get("flatpak"):
        kind = NO_NETWORK_IN_FLATPAK
    unknown = dict.fromkeys(("folder", "index", "python", "proxy", "package"), "?")
    return SetupError(_(_SENTENCES[kind]).format(**{**unknown, "size": ROOM, **about, "said": _short(said)}))


def _short(said: str, most: int = 160) -> str:
    """The end of a long line, where the cause is."""
    said = re.sub(r"^(ERROR|WARNING): ", "", said)
    return said if len(said) <= most else "\u2026" + said[-most:]
