#!/usr/bin/env bash
# Prints the path of bgd, the program of BuildGrid, a server of the Remote Execution API, and installs it first if
# it is missing, from PyPI into a virtual environment. If it cannot be had, says why and exits with 1.
set -u
home=${SPECULA_BUILDGRID_HOME:-${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/specula-tests/buildgrid}
version=0.4.4
bgd=$home/bin/bgd
fail() { echo "install-buildgrid: $*" >&2; exit 1; }
if [ ! -e "$home/installed-$version" ]; then
    python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' || fail "BuildGrid needs Python 3.11 or newer"
    python3 -m venv "$home" >&2 || fail "python3 cannot make $home (Debian has this in python3-venv)"
    "$home/bin/python" -m pip install -q --disable-pip-version-check "buildgrid==$version" >&2 ||
        fail "pip cannot install buildgrid $version"
    "$bgd" --help >/dev/null 2>&1 || fail "bgd does not run here"
    touch "$home/installed-$version"
fi
echo "$bgd"
