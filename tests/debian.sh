#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# The installer, and the archive alone, with the Inkscape of another Debian: `sh tests/debian.sh SUITE FOLDER`.
#
# As root, with debootstrap. FOLDER gets the system of that suite (1.5 GB, 5 minutes; kept for the next time); in it run
#   1. install.sh --demo and --check, from a copy of this checkout,
#   2. what the archive of release/archive.py has, in a fresh profile: each effect names Set up, Set up makes the
#      environment without a window, Reshape reshapes the example, through Inkscape's command line.
# The pictures of the demonstration are left in FOLDER. MIRROR names another server than deb.debian.org.
set -eu

suite=${1:?SUITE, as trixie} folder=${2:?FOLDER}
here=$(cd "$(dirname "$0")/.." && pwd)
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
root=$folder/$suite

inside() {
    env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 LANGUAGE=en DEBIAN_FRONTEND=noninteractive \
        chroot "$root" "$@"
}

if [ ! -f "$root/complete" ]; then
    rm -rf "$root"
    debootstrap --variant=minbase "$suite" "$root" "${MIRROR:-http://deb.debian.org/debian}" >"$folder/log"
    # No service is to start in it.
    printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"
    chmod +x "$root/usr/sbin/policy-rc.d"
    inside apt-get -qq update
    inside apt-get -qq install --yes --no-install-recommends ca-certificates python3 python3-venv inkscape \
        python3-lxml python3-numpy python3-cssselect python3-tinycss2 xvfb xauth >>"$folder/log" 2>&1
    touch "$root/complete"
fi
# A network with a certificate of its own.
cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/ca-certificates.crt"
cp /etc/resolv.conf /etc/hosts "$root/etc/"
mount --bind /dev "$root/dev"
mount -t proc proc "$root/proc"
trap 'umount -l "$root/dev" "$root/proc"' EXIT

rm -rf "$root/checkout" "$root/root/.config"
mkdir -p "$root/checkout" "$root/root/.config/inkscape/extensions"
for name in alup examples locale release; do cp -R "$here/$name" "$root/checkout/"; done
cp "$here"/alup_* "$here"/install.* "$here/LICENSE" "$root/checkout/"

inside inkscape --version
inside sh -c 'cd /root && sh /checkout/install.sh --demo && sh /checkout/install.sh --check'
cp "$root/root/alup-demo.png" "$root/root/alup-demo.svg" "$folder/"
inside sh /checkout/install.sh --uninstall

inside python3 /checkout/release/archive.py /root
# shellcheck disable=SC2016 # it is the inner shell that expands them
inside sh -euc '
    extensions=/root/.config/inkscape/extensions
    mkdir -p $extensions
    python3 -m zipfile -e /root/alup-reshape-*.zip $extensions
    cd $extensions/alup-reshape
    export PYTHONPATH=$extensions:/usr/share/inkscape/extensions
    for effect in alup_*.py; do
        if [ $effect = alup_set_up.py ]; then continue; fi
        # -S: the packages of the system do not count
        if python3 -S $effect /checkout/examples/truck.svg 2>/root/said; then exit 1; fi
        grep -q "choose Extensions > ALUP Reshape > Set up..." /root/said
    done
    # What it did or why not is said on the standard error, which Inkscape shows.
    python3 alup_set_up.py --agree=true
    unset PYTHONPATH
    timeout 120 xvfb-run -a inkscape --app-id-tag=alup --batch-process \
        --actions="org.alup.alup-reshape.noprefs;export-filename:/root/out.svg;export-do" \
        /checkout/examples/truck.svg </dev/null >/root/log 2>&1
    if cmp -s /checkout/examples/truck.svg /root/out.svg; then exit 1; fi
    grep -q "alup:original" /root/out.svg
'
echo "All is well with the Inkscape of $suite."
