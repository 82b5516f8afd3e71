#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# The one test command: `sh tests/run.sh` sets up all it needs, lints, and runs every test.
# With arguments it runs pytest alone, with them: sh tests/run.sh tests/test_startup.py -k record
# With --set-up it stops before the tests.
#
# A Debian with python3 is enough. The tools of the tests go into .venv/ of the checkout; the tests
# themselves install the extension by install.sh, into a temporary profile.
set -eu

cd "$(dirname "$0")/.."
# Nothing of the caller's may decide what is tested.
unset PYTHONPATH PYTHONHOME INKSCAPE_PROFILE_DIR
# Tests compare messages; test_language.py asks for other languages itself.
export LANGUAGE=en
PYTHON=${PYTHON:-python3}

# Exact versions: a test must not fail because a tool was released meanwhile.
tools='pytest==9.2.0 pytest-xdist==3.8.0 pytest-timeout==2.4.0 hypothesis==6.170.15
    ruff==0.17.6 mypy==2.4.1 types-lxml==2026.2.16 import-linter==2.17 numpy==2.4.6 scipy==1.17.1 lxml==5.4.0 cssselect==1.6.0 tinycss2==1.5.1
    polib==1.2.0 tqdm==4.70.1 matplotlib==3.11.2 playwright==1.65.2'
# Its other requirements are for what we do not use; one of them would have to be compiled.
inkex='inkex==1.4.1'
optional_tools='qdldl==0.1.9.post1 libigl==2.6.3'

say() { printf '%s\n' "$*"; }

install_programs() {
    missing=
    command -v inkscape >/dev/null || missing="$missing inkscape"
    command -v Xvfb >/dev/null || missing="$missing xvfb"
    command -v xauth >/dev/null || missing="$missing xauth"
    command -v openbox >/dev/null || missing="$missing openbox"
    command -v xdotool >/dev/null || missing="$missing xdotool"
    command -v rsvg-convert >/dev/null || missing="$missing librsvg2-bin"
    # The window of Set up is one of GTK, by the system's Python, which Inkscape starts.
    if ! /usr/bin/python3 -c 'import gi; gi.require_version("Gtk", "3.0")' 2>/dev/null; then
        missing="$missing python3-gi gir1.2-gtk-3.0"
    fi
    command -v shellcheck >/dev/null || missing="$missing shellcheck"
    command -v chromium >/dev/null || missing="$missing chromium"
    # The tests' Python and Inkscape's each get an environment; Debian's needs a package for that.
    for python in "$PYTHON" /usr/bin/python3; do
        if ! "$python" -c 'import ensurepip' 2>/dev/null; then missing="$missing python3-venv"; fi
    done
    [ -n "$missing" ] || return 0
    if [ "$(id -u)" -eq 0 ]; then
        as_root='env'
    elif sudo -n true 2>/dev/null; then
        as_root='sudo -n env'
    else
        as_root=
    fi
    if [ -z "$as_root" ] || ! command -v apt-get >/dev/null; then
        say "tests/run.sh: these are missing; install them, then try again:$missing" >&2
        exit 1
    fi
    say "Installing by apt-get:$missing"
    $as_root DEBIAN_FRONTEND=noninteractive apt-get -qq update
    # shellcheck disable=SC2086 # a list of words
    $as_root DEBIAN_FRONTEND=noninteractive apt-get -qq install --yes --no-install-recommends $missing \
        </dev/null >/dev/null
}

install_tools() {
    wanted="$("$PYTHON" --version) $tools $inkex $optional_tools"
    if [ -f .venv/wanted ] && [ "$(cat .venv/wanted)" = "$wanted" ]; then return; fi
    say "Setting up .venv ..."
    rm -rf .venv
    "$PYTHON" -m venv .venv
    set -- .venv/bin/python -m pip install --quiet --disable-pip-version-check
    # shellcheck disable=SC2086 # a list of words
    "$@" $tools
    "$@" --no-deps "$inkex"
    for tool in $optional_tools; do
        "$@" --only-binary :all: "$tool" || say "Note: without $tool; its stand-in is tested"
    done
    printf '%s\n' "$wanted" >.venv/wanted
}

install_programs
install_tools
[ "${1:-}" != --set-up ] || exit 0
if [ $# -gt 0 ]; then
    exec .venv/bin/python -m pytest "$@"
fi
.venv/bin/ruff check .
.venv/bin/mypy
.venv/bin/lint-imports --no-cache
shellcheck install.sh tests/*.sh docs/gallery.sh .ci/run
exec .venv/bin/python -m pytest -n 2 --dist loadgroup
