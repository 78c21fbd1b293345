"""Compares whole processes of `specula` with other programs, in turn in one run.

    cargo build --release
    pip install OpenImageIO
    python research/peers/programs.py PHOTOGRAPH [--rounds 5] [--program PATH]

- A photograph to spherical harmonics, with suns and lamps taken out, beside `oiiotool`, which decodes the same file
  and reads each pixel once for its statistics.
- A cube of 256^2 with six levels for three.js, beside Filament's `cmgen`.

Each run starts from nothing: the cache is deleted before it. A program that is not in PATH is reported as SKIPPED.
"""

import argparse
import os
import shutil
import statistics
import subprocess
import tempfile
from pathlib import Path

TO_SH = """\
schema = 1
out = "out"

[stage.environment]
kind = "import-environment"
source = "{photograph}"

[stage.lighting]
kind = "project-sh"
input = "environment"
"""

PREFILTER = """\
schema = 1
out = "out"

[stage.environment]
kind = "import-environment"
source = "{photograph}"

[stage.levels]
kind = "prefilter"
input = "environment"
preset = "three"
resolution = 256
"""


def run(command, folder):
    """Seconds that passed, seconds of all threads, and the largest memory in MB."""
    shutil.rmtree(folder / ".specula", ignore_errors=True)
    start = os.times()
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    message = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise SystemExit(f"{command[0]} failed: {message.decode(errors='replace')}")
    seconds = os.times().elapsed - start.elapsed
    return seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main():
    parser = argparse.ArgumentParser(description="Compares whole processes of specula with other programs.")
    parser.add_argument("photograph", type=Path)
    parser.add_argument("--rounds", type=int, default=5, help="runs of each program")
    root = Path(__file__).parents[2]
    parser.add_argument("--program", type=Path, default=root / "target/release/specula", help="our program")
    options = parser.parse_args()
    program, photograph = options.program.resolve(), options.photograph.resolve()

    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        local = folder / photograph.name
        local.symlink_to(photograph)
        cases = []
        for title, name, text, peer in (
            ("to SH", "to-sh.toml", TO_SH, ["oiiotool", "-i:now=1", local.name, "--stats"]),
            (
                "prefilter",
                "prefilter.toml",
                PREFILTER,
                ["cmgen", "-q", "--format=ktx", "--size=256", "--deploy=cmgen", local.name],
            ),
        ):
            (folder / name).write_text(text.format(photograph=local.name))
            ours = [str(program), "build", "--manifest", name]
            found = shutil.which(peer[0])
            if found is None:
                print(f"SKIPPED {peer[0]}: it is not in PATH")
            cases.append((title, ours, [found, *peer[1:]] if found else None, peer[0]))

        print(f"{'':12}{'program':>12}{'seconds':>10}{'of all threads':>16}{'MB':>8}{'share of the peer':>20}")
        for title, ours, peer, peer_name in cases:
            commands = {"specula": ours} | ({peer_name: peer} if peer else {})
            runs = {name: [] for name in commands}
            for _ in range(options.rounds):
                for name, command in commands.items():
                    runs[name].append(run(command, folder))
            medians = {name: [statistics.median(values) for values in zip(*times)] for name, times in runs.items()}
            for name, (seconds, of_threads, memory) in medians.items():
                share = f"{seconds / medians[peer_name][0]:.2f}" if name == "specula" and peer else ""
                print(f"{title:12}{name:>12}{seconds:10.2f}{of_threads:16.2f}{memory:8.0f}{share:>20}")


if __name__ == "__main__":
    main()
