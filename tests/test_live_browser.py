# SPDX-License-Identifier: GPL-2.0-or-later
"""How the live window is opened: which browser, with what, and what others may see of it."""

from __future__ import annotations

import os
import stat
import sys
import time
import webbrowser
from pathlib import Path
from urllib.parse import urlparse

import pytest

from alup.live import browser
from alup.live.browser import Browser

ADDRESS = "http://127.0.0.1:12345/#secret"


@pytest.fixture
def told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A browser that writes down its arguments, a line each, and stays."""
    program, file = tmp_path / "chromium", tmp_path / "told"
    program.write_text(f"#!/bin/sh\nprintf '%s\\n' \"$@\" >{file}.part\nmv {file}.part {file}\nsleep 60\n")
    program.chmod(0o755)
    monkeypatch.delenv(browser.COMMAND_VARIABLE, raising=False)
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr(browser, "found", lambda: iter([str(program)]))
    return file


def lines(file: Path) -> list[str]:
    end = time.monotonic() + 20.0
    while not file.exists() and time.monotonic() < end:
        time.sleep(0.01)
    return file.read_text().split("\n")


def test_a_window_has_a_profile_of_its_own_which_goes_with_it(told: Path) -> None:
    with Browser(ADDRESS) as window:
        arguments = lines(told)
        (profile,) = [one.partition("=")[2] for one in arguments if one.startswith("--user-data-dir=")]
        assert stat.S_IMODE(os.stat(profile).st_mode) == 0o700
        assert f"--app={ADDRESS}" in arguments
        assert "--disable-background-networking" in arguments
        assert not any("sandbox" in one for one in arguments)
        assert window.may_come()
        process = window._process
    assert not os.path.exists(profile)
    assert process is not None and process.poll() is not None


def test_where_others_could_read_it_the_address_is_on_no_command_line(
    told: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(browser, "TELLS_WHOSE", False)
    with Browser(ADDRESS):
        arguments = lines(told)
        assert not any("secret" in one for one in arguments)
        (shown,) = [one.partition("=")[2] for one in arguments if one.startswith("--app=")]
        file = Path(urlparse(shown).path)
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        assert f"url={ADDRESS}" in file.read_text()


def test_the_next_one_is_tried_where_one_ends_without_the_page(
    told: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    programs = ["/does/not/exist", sys.executable, str(tmp_path / "chromium")]
    monkeypatch.setattr(browser, "found", lambda: iter(programs))
    with Browser(ADDRESS) as window:
        end = time.monotonic() + 20.0
        while not told.exists() and time.monotonic() < end:
            assert window.may_come()
            time.sleep(0.02)
        assert f"--app={ADDRESS}" in lines(told)


def test_the_default_browser_is_the_last_and_its_words_go_nowhere(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv(browser.COMMAND_VARIABLE, raising=False)
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr(browser, "found", lambda: iter([]))
    opened: list[str] = []

    def open_(address: str) -> bool:
        os.write(1, b"to Inkscape")
        os.write(2, b"into a window")
        opened.append(address)
        return True

    monkeypatch.setattr(webbrowser, "open", open_)
    with Browser(ADDRESS) as window:
        assert window.may_come()
    assert opened == [ADDRESS]
    assert capfd.readouterr() == ("", "")


def test_without_a_screen_none_is_started(told: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with Browser(ADDRESS) as window:
        assert not window.may_come()
    assert not told.exists()
