#!/usr/bin/env bash
# Checks the types of the Python module, and runs its tests with a build of the program.
#   packaging/python/test.sh [SPECULA]
set -euo pipefail
cd "$(dirname "$0")/../.."
export SPECULA_PROGRAM
SPECULA_PROGRAM=$(realpath "${1:-target/debug/specula}")
venv=$PWD/target/python
if ! { [ -d "$venv" ] || python3 -m venv "$venv"; } ||
    ! "$venv/bin/pip" install --quiet numpy safetensors scipy scipy-stubs OpenEXR mypy pytest; then
    echo "SKIPPED the Python module: its tests need Python with venv, and PyPI"
    exit 0
fi
cd packaging/python
# What they keep between runs does not belong into the checkout.
export PYTHONDONTWRITEBYTECODE=1
"$venv/bin/mypy" --cache-dir "$venv/mypy"
"$venv/bin/python" -m pytest --quiet -o cache_dir="$venv/pytest"
