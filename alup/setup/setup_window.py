# SPDX-License-Identifier: GPL-2.0-or-later
"""The window of *Set up*: the plan, a button to begin, the progress, a button to cancel.

It uses GTK 3 by PyGObject, as Inkscape's own extension manager does.  If that is missing, importing this
module fails.  The work is done in a thread, so that the window responds meanwhile.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import gi  # type: ignore[import-not-found,unused-ignore]

gi.require_version("Gtk", "3.0")
gi.require_version("Gdk", "3.0")
from gi.repository import Gdk, GLib, Gtk  # type: ignore[import-not-found,unused-ignore]  # noqa: E402

from ..messages.language import translate as _  # noqa: E402
from .progress import Progress  # noqa: E402
from .setup_errors import Cancelled, SetupError  # noqa: E402

if TYPE_CHECKING:
    from .job import Job

TITLE = "ALUP Reshape"

# Width of borders in pixels, and of lines in letters.
_BORDER, _LETTERS = 18, 76


def can_open() -> bool:
    """Whether a window can be opened on a screen."""
    answer = Gtk.init_check([])
    return bool(answer[0] if isinstance(answer, tuple) else answer)


def open_window(job: Job, agreed: bool) -> int:
    """Open the window and wait; returns the exit code, 0 if the environment exists in the end.

    agreed : whether to begin at once, and to close the window after success
    """
    window = _Window(job, agreed)
    Gtk.main()
    return window.code


class _Shown(Progress):
    """Progress of the working thread, passed on to the thread of the window."""

    def __init__(self, window: _Window) -> None:
        self._window, self._stop = window, threading.Event()

    def step(self, text: str, done: float) -> None:
        GLib.idle_add(self._window.show_step, text, done)

    def detail(self, line: str) -> None:
        GLib.idle_add(self._window.show_detail, line)

    def cancelled(self) -> bool:
        return self._stop.is_set()

    def cancel(self) -> None:
        self._stop.set()


class _Window:
    def __init__(self, job: Job, agreed: bool) -> None:
        self.code = 1
        self._agreed = agreed
        self._job, self._progress = job, _Shown(self)
        self._thread: threading.Thread | None = None
        self._window = Gtk.Window(title=TITLE)
        self._window.set_resizable(False)
        self._window.set_position(Gtk.WindowPosition.CENTER)
        self._window.set_border_width(_BORDER)
        self._window.connect("delete-event", self._closed)
        self._window.connect("key-press-event", self._pressed)
        box = Gtk.Box(orientation=Gtk.Orientation.VERTICAL, spacing=_BORDER // 2)
        self._text = self._label(selectable=True)
        self._step = self._label()
        self._bar = Gtk.ProgressBar()
        self._detail = self._label()
        self._detail.set_ellipsize(3)  # Pango.EllipsizeMode.END
        self._detail.set_sensitive(False)
        self._buttons = Gtk.Box(spacing=_BORDER // 2, halign=Gtk.Align.END)
        self._spinner = Gtk.Spinner()
        for part in (self._text, self._step, self._bar, self._detail, self._buttons):
            box.pack_start(part, expand=False, fill=True, padding=0)
        self._buttons.pack_start(self._spinner, expand=False, fill=True, padding=0)
        self._window.add(box)
        self._cancel = self._button(_("_Cancel"), self._stop)
        self._begin = self._button(_("_Set up"), self._work)
        self._begin.get_style_context().add_class("suggested-action")
        for part in (box, self._text, self._buttons, self._cancel):
            part.show()
        self._plan: Any = None
        self._propose()
        self._window.present()

    @staticmethod
    def _label(selectable: bool = False) -> Any:
        label = Gtk.Label(
            xalign=0.0, wrap=True, selectable=selectable, width_chars=_LETTERS, max_width_chars=_LETTERS
        )
        label.set_line_wrap_mode(2)  # Pango.WrapMode.WORD_CHAR: paths have no spaces
        return label

    def _button(self, text: str, action: Any) -> Any:
        button = Gtk.Button(label=text, use_underline=True)
        button.connect("clicked", lambda _button: action())
        self._buttons.pack_start(button, expand=False, fill=True, padding=0)
        return button

    def _propose(self) -> None:
        """Show the plan and ask for agreement."""
        try:
            self._plan = self._job.plan()
        except SetupError as error:
            self._end(str(error))
            return
        self._text.set_text(f"{self._job.state()}\n\n{self._plan.text()}")
        self._begin.show()
        self._begin.grab_focus()
        if self._agreed:
            self._work()

    def _work(self) -> None:
        self._begin.hide()
        for part in (self._step, self._bar, self._detail, self._spinner):
            part.show()
        self._spinner.start()
        self._thread = threading.Thread(target=self._do, daemon=True)
        self._thread.start()

    def _do(self) -> None:
        """Do the work, in its thread; any error is shown in the window."""
        code = 1
        try:
            said = self._job.do(self._plan, self._progress)
            code = 0
        except SetupError as error:
            said = str(error)
        except Cancelled:
            said = _("Cancelled; nothing was changed.")
        except Exception as error:
            GLib.idle_add(self._end, f"{type(error).__name__}: {error}", code)
            raise
        GLib.idle_add(self._end, said, code)

    def show_step(self, text: str, done: float) -> None:
        self._bar.set_fraction(done)
        self._step.set_text(text)

    def show_detail(self, line: str) -> None:
        self._detail.set_text(line)

    def _end(self, said: str, code: int = 1) -> None:
        self.code = code
        self._thread = None
        if self._agreed and code == 0:
            Gtk.main_quit()
        self._text.set_text(said)
        for part in (self._step, self._bar, self._detail, self._begin, self._spinner):
            part.hide()
        self._cancel.set_label(_("_Close"))
        self._cancel.set_sensitive(True)
        self._cancel.grab_focus()

    def _stop(self) -> None:
        """Cancel the work, or close the window if there is none."""
        if self._thread is None:
            Gtk.main_quit()
            return
        self._progress.cancel()
        self._cancel.set_sensitive(False)
        self._step.set_text(_("Cancelling ..."))

    def _pressed(self, _window: Any, event: Any) -> bool:
        """Escape has the effect of Cancel."""
        escape: bool = event.keyval == Gdk.KEY_Escape
        if escape:
            self._stop()
        return escape

    def _closed(self, _window: Any, _event: Any) -> bool:
        """Closing the window has the effect of Cancel; the window stays until the work is undone."""
        self._stop()
        return True
