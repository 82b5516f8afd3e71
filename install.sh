#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# Install ALUP Reshape for the Inkscape of this user: `./install.sh --help`.
#
# All is done by alup/setup, in Python; this file finds one for it. Any that is not older than 3.8 will do.
here=$(cd "$(dirname "$0")" && pwd) || exit 1
bundle=/Applications/Inkscape.app/Contents
for python in python3 /opt/homebrew/bin/python3 /usr/local/bin/python3 /usr/bin/python3 "$bundle/Resources/bin/python3" \
    "$bundle/Frameworks/Python.framework/Versions/Current/bin/python3" python; do
    python=$(command -v "$python") || continue
    # macOS has a file of this name that only opens a window as long as there are no developer tools.
    if [ "$python" = /usr/bin/python3 ] && [ "$(uname -s)" = Darwin ] && ! xcode-select -p >/dev/null 2>&1; then
        continue
    fi
    if "$python" -c 'import sys; sys.exit(sys.version_info < (3, 8))' 2>/dev/null; then
        exec "$python" -E -s -B "$here/alup/setup" "$@"
    fi
done
echo "install.sh: no Python 3.8 or later was found; install one (on Debian: sudo apt-get install python3)" >&2
exit 1
