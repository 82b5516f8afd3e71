#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# The tests of the core under other Pythons: `sh tests/pythons.sh [PYTHON ...]`, by default each version from
# 3.8 on that is found on the PATH and among pyenv's and uv's.
#
# Each gets a throw-away environment with the newest packages that exist for it, the ones that the installer
# would fetch, and runs the tests that need neither Inkscape nor a screen. TESTS='tests/test_solve.py ...'
# runs these only; the output of pip and pytest is kept in LOGS (a folder) if that is given.
set -eu

cd "$(dirname "$0")/.."
unset PYTHONPATH PYTHONHOME PIP_TARGET PIP_PREFIX PIP_USER PIP_REQUIRE_VIRTUALENV INKSCAPE_PROFILE_DIR
# Tests compare messages.
export LANGUAGE=en PYTHONDONTWRITEBYTECODE=1

# What belongs to Inkscape, to a screen, to the tools of run.sh, or to a C++ compiler; single tests that need
# an Inkscape are known by their fixtures (`leave_out`).
elsewhere='inkscape window pictures install archive paper_cpp architecture inx language gallery sweep'
test_tools='pytest pytest-timeout hypothesis'

say() { printf '%s\n' "$*"; }

# wanted PYTHON: the packages that the installer would fetch for it; optional: those it would go without
wanted() {
    "$1" -c 'from alup.setup import machine, packages, pythons
print(*packages.required_packages(pythons.look(machine.Machine(), __import__("sys").executable)))'
}
optional() { "$1" -c 'from alup.setup import packages; print(*packages.OPTIONAL_PACKAGES)'; }

recent_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 8))' 2>/dev/null; }

# One of each version, the first found: two builds of one version differ in nothing we use.
find_pythons() {
    seen=' '
    for version in 8 9 10 11 12 13 14 15 16; do
        for python in "$(command -v "python3.$version" || true)" \
            "${PYENV_ROOT:-$HOME/.pyenv}/versions/3.$version".*/bin/python3 \
            "${UV_PYTHON_INSTALL_DIR:-$HOME/.local/share/uv/python}/cpython-3.$version".*/bin/python3; do
            case $seen in *" $version "*) continue ;; esac
            # A version manager has a file of every name on the PATH, which may start nothing.
            if [ -n "$python" ] && recent_enough "$python"; then
                seen="$seen$version "
                printf '%s\n' "$python"
            fi
        done
    done
}

chosen_tests() {
    for file in tests/test_*.py; do
        name=${file#tests/test_}
        case " $elsewhere " in *" ${name%.py} "*) ;; *) printf '%s ' "$file" ;; esac
    done
}

# A plugin of pytest's.
leave_out() {
    cat <<'END'
def pytest_collection_modifyitems(config, items):
    unwanted = [item for item in items if {"installed", "display"} & set(getattr(item, "fixturenames", ()))]
    config.hook.pytest_deselected(items=unwanted)
    items[:] = [item for item in items if item not in unwanted]
END
}

# set_up PYTHON FOLDER: an environment in FOLDER; false if a package that is needed does not exist
set_up() {
    "$1" -m venv "$2" >>"$log" 2>&1 || return 1
    set -- "$2/bin/python" -m pip install --quiet --disable-pip-version-check --only-binary :all:
    # shellcheck disable=SC2046,SC2086 # lists of words
    "$@" $(wanted "$python") $test_tools >>"$log" 2>&1 || return 1
    for package in $(optional "$python"); do
        "$@" "$package" >>"$log" 2>&1 || say "no wheel of $package" >>"$log"
    done
    # The version that run.sh tests with, else the newest that this Python may have.
    inkex=$(sed -n "s/^inkex='\(.*\)'\$/\1/p" tests/run.sh)
    "$@" --no-deps "$inkex" >>"$log" 2>&1 || "$@" --no-deps "${inkex%%=*}" >>"$log" 2>&1
}

# versions PYTHON: of Python and of the packages that matter, one after the other
versions() {
    "$1" - <<'END'
import platform
from importlib.metadata import PackageNotFoundError, version

found = [platform.python_version()]
for name in ("numpy", "scipy", "lxml", "inkex", "qdldl", "libigl"):
    try:
        found.append(version(name))
    except PackageNotFoundError:
        found.append("no-wheel")
print(*found)
END
}

# One row of the table; false if a test failed.
row() {
    log=$folder/log
    : >"$log"
    if ! set_up "$1" "$folder/venv"; then
        tail -n 3 "$log" >&2
        result="$("$1" -c 'import platform; print(platform.python_version())') - - - - - - - no-environment"
        code=1
    else
        code=0
        # shellcheck disable=SC2086 # lists of words
        PYTHONPATH=$folder nice -n 10 "$folder/venv/bin/python" -m pytest -q -p no:cacheprovider -p leave_out \
            --basetemp="$folder/tests" $tests >>"$log" 2>&1 || code=$?
        result="$(versions "$folder/venv/bin/python") $(summary)"
    fi
    # shellcheck disable=SC2086 # words
    show $result
    if [ "$code" -ne 0 ]; then sed -n 's/^\(FAILED\|ERROR\) /    &/p' "$log" | cut -c 1-200; fi
    if [ -n "${LOGS:-}" ]; then cp "$log" "$LOGS/${result%% *}.log"; fi
    rm -rf "$folder/venv" "$folder/tests"
    return "$code"
}

# pytest's last line without its seconds: 512-passed,2-skipped
summary() {
    tail -n 1 "$log" | sed 's/^=* *//; s/ in [0-9.]*s.*//; s/, /,/g; s/ /-/g'
}

show() {
    # shellcheck disable=SC2059 # a format
    printf "$format" "$@"
}

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
leave_out >"$folder/leave_out.py"
trap 'exit 130' INT TERM HUP
tests=${TESTS:-$(chosen_tests)}
if [ $# -eq 0 ]; then
    # shellcheck disable=SC2046 # one a line, without spaces
    set -- $(find_pythons)
fi
[ $# -gt 0 ] || {
    say "tests/pythons.sh: no Python from 3.8 on was found; name some" >&2
    exit 1
}
[ -z "${LOGS:-}" ] || mkdir -p "$LOGS"

format='%-8s %-8s %-8s %-7s %-7s %-14s %-10s %-9s %s\n'
show Python numpy scipy lxml inkex qdldl libigl tests
failed=0
for python in "$@"; do
    row "$python" || failed=1
done
exit $failed
