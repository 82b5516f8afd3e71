# SPDX-License-Identifier: GPL-2.0-or-later
"""The base class of all effects: reading the file, writing the result, and messages of failures.

A drawing is read by `loading`.  The result replaces the file in one step, so the file always holds either the
former or the new drawing.  It keeps the former one if anything fails.
"""

from __future__ import annotations

import copy
import errno
import io
import os
import sys
from typing import Any

import inkex

from ..messages.errors import AlupError
from ..messages.language import N_
from ..messages.language import translate as _
from .tree import loading

_NO_MEMORY = N_(
    "There is not enough memory for this drawing; nothing was changed. Close other programs, "
    "select fewer paths, or set the samples further apart."
)
_TOO_DEEP = N_("The drawing is nested too deep; nothing was changed. Ungroup some of it.")
_INTERRUPTED = N_("Interrupted: nothing was changed.")


class Effect(inkex.EffectExtension):
    """An effect of Inkscape that leaves the designer's file unchanged whenever it fails."""

    @classmethod
    def main(cls) -> None:
        """Run the effect as a program, and end the process at once.

        The interpreter's clean-up of all imported modules would take a tenth of a run's time.
        """
        cls().run()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(0)

    def run(self, args: Any = None, **others: Any) -> None:
        try:
            super().run(args, **others)
        except AlupError as error:
            self._leave(str(error))
        except MemoryError:
            self._leave(_(_NO_MEMORY))
        except RecursionError:
            self._leave(_(_TOO_DEEP))
        except KeyboardInterrupt:
            self._leave(_(_INTERRUPTED))

    def effect(self) -> None:
        """Run `change`; errors of the package become Inkscape's message."""
        try:
            self.change()
        except AlupError as error:
            raise inkex.AbortExtension(str(error)) from error

    def change(self) -> None:
        """Change `self.svg`, or raise AlupError and leave it as it was."""
        raise NotImplementedError

    def load_raw(self) -> None:
        try:
            super().load_raw()
        except OSError as error:
            file = self.options.input_file
            message = _("{file} can't be read: {reason}. Check it, and choose another one if need be.")
            name = file if isinstance(file, str) else _("The standard input")
            raise AlupError(message.format(file=name, reason=error.strerror or error)) from error

    def load(self, stream: Any) -> Any:
        if stream is None:
            raise AlupError(_("There is no drawing: name a file, or give it as the standard input."))
        # The standard input is a text stream.  Its bytes are read, because XML names its own encoding.
        document = loading.parse(getattr(stream, "buffer", stream).read())
        self.original_document = copy.deepcopy(document)
        self.svg = document.getroot()
        self.svg.selection.set(*self.options.ids)
        return document

    def save_raw(self, ret: Any) -> None:
        if not self.has_changed(ret):
            return
        whole = io.BytesIO()
        self.save(whole)
        output = self.options.output
        try:
            if isinstance(output, str):
                write_whole(output, whole.getvalue())
            elif output is None:
                raise AlupError(
                    _("There is nowhere to write to: the standard output is closed. Use --output.")
                )
            else:
                _write_all(output, whole.getvalue())
        except OSError as error:
            name = output if isinstance(output, str) else _("the standard output")
            if not isinstance(output, str):
                _forget_stdout()
            message = _(
                "The drawing can't be written to {file}: {reason}. Choose another place with --output."
            )
            raise AlupError(message.format(file=name, reason=error.strerror or error)) from error

    def _leave(self, message: str) -> None:
        inkex.errormsg(message)
        sys.exit(1)


def write_whole(name: str, data: bytes) -> None:
    """Replace a file's content in one step: at any moment it holds either the former or all of the new data.

    Raises OSError; then the file is unchanged.
    """
    name = os.path.realpath(name)
    if os.path.exists(name) and not os.path.isfile(name):  # a device, or a pipe
        with open(name, "wb") as file:
            file.write(data)
        return
    mode = os.stat(name).st_mode & 0o777 if os.path.exists(name) else 0o666
    part = os.path.join(os.path.dirname(name), f".alup-{os.getpid()}.part")
    # O_EXCL: a link of this name, made by somebody else, is not followed.
    descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), mode)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, name)
    except BaseException:
        os.unlink(part)
        raise


def _write_all(output: Any, data: bytes) -> None:
    """Write all data to a stream whose `write` may accept less, such as an unbuffered standard output."""
    rest = memoryview(data)
    while rest:
        written = output.write(rest)
        if not written:  # it never waits
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        rest = rest[written:]
    output.flush()


def _forget_stdout() -> None:
    """Discard the buffer of the standard output.  Otherwise Python reports an error when it exits."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
