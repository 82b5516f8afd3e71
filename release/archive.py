#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Build alup-reshape-VERSION.zip: `python3 release/archive.py [FOLDER]`, by default into the working folder.

The archive holds the extension's files in one folder, to be unpacked into Inkscape's folder of user
extensions.  It is the same on every machine, byte for byte: files are in the order of their names, have one
date, and are not compressed, because compressors differ.  Its size and SHA-256 are printed.
"""

from __future__ import annotations

import hashlib
import os
import sys
import zipfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, ROOT)

import alup  # noqa: E402
from alup.setup import files  # noqa: E402
from alup.setup.inkscapes import NAME  # noqa: E402

# The earliest date that a zip file can have.
_DATE = (1980, 1, 1, 0, 0, 0)

# Permissions of files and programs, for the upper half of the attributes, and the number of the system Unix.
_PLAIN, _PROGRAM, _UNIX = 0o100644, 0o100755, 3


def build(folder: str) -> str:
    """Path of the archive, written into a folder."""
    path = os.path.join(folder, f"{NAME}-{alup.__version__}.zip")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        names = files.of_extension(ROOT)
        for name in [files.LIST, *names]:
            entry = zipfile.ZipInfo(f"{NAME}/{name}", _DATE)
            entry.create_system = _UNIX
            entry.external_attr = (_PROGRAM if name.endswith(".sh") else _PLAIN) << 16
            archive.writestr(entry, "\n".join(names) if name == files.LIST else _content(name))
    return path


def _content(name: str) -> bytes:
    with open(os.path.join(ROOT, *name.split("/")), "rb") as file:
        return file.read()


def main() -> int:
    lacking = files.missing(ROOT)
    if lacking:
        sys.stderr.write(f"release/archive.py: {lacking[0]} is missing; get a complete checkout\n")
        return 1
    path = build(sys.argv[1] if len(sys.argv) > 1 else os.curdir)
    with open(path, "rb") as file:
        content = file.read()
    sys.stdout.write(f"{path}\n{len(content)} bytes\nsha256 {hashlib.sha256(content).hexdigest()}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
