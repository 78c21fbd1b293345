"""Compares the transforms and rotations of `sh` with SHTns and ducc0, in turn in one run.

    cargo build --release --manifest-path research/Cargo.toml --bin transform-times
    pip install shtns ducc0 numpy
    python research/peers/transforms.py [--threads 2] [--rounds 5] [--program PATH]

Theirs run on one thread, since two are slower for them at these sizes, three channels in turn. Each library has its
fastest grid of 512 x 1024: for SHTns, in double precision, the best of a Gauss grid and of an equally spaced one
(`sht_reg_fast`); for ducc0, in single precision, the rings of a lat-long image (`F1`). Inputs are in the
precision of the library. A library that is not installed is reported as SKIPPED.
"""

import argparse
import json
import os
import statistics
import subprocess
import time
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"

HEIGHT, WIDTH, CHANNELS = 512, 1024, 3
SECONDS = 0.3


def median(run):
    run()
    wall, cpu, begun = [], [], time.perf_counter()
    while len(wall) < 5 or time.perf_counter() - begun < SECONDS:
        start, cpu_start = time.perf_counter(), time.process_time()
        run()
        wall.append(time.perf_counter() - start)
        cpu.append(time.process_time() - cpu_start)
    return {"wall": 1e3 * statistics.median(wall), "cpu": 1e3 * statistics.median(cpu)}


def best(times):
    return min(times, key=lambda time: time["cpu"])


def shtns_cases():
    import numpy
    import shtns

    random = numpy.random.default_rng(1)
    cases = {}
    for degree in (30, 255):
        plans = []
        for grid in (shtns.sht_gauss, shtns.sht_reg_fast):
            plan = shtns.sht(degree, degree, 1, shtns.sht_orthonormal)
            plan.set_grid(HEIGHT, WIDTH, grid | shtns.SHT_PHI_CONTIGUOUS)
            plans.append(plan)
        image = random.random((CHANNELS, HEIGHT, WIDTH))
        series = [[plan.analys(channel.copy()) for channel in image] for plan in plans]

        def analyse(plans=plans, image=image, series=series):
            # SHTns may overwrite the pixels: from zeros they stay finite.
            image[:] = 0.0
            outputs = [numpy.empty_like(output) for output in series[0]]

            def run(plan):
                for channel, output in zip(image, outputs):
                    plan.spat_to_SH(channel, output)

            return best([median(lambda: run(plan)) for plan in plans])

        def synthesise(plans=plans, image=image, series=series):
            def run(plan, inputs):
                for channel, values in zip(image, inputs):
                    plan.SH_to_spat(values, channel)

            return best([median(lambda: run(plan, inputs)) for plan, inputs in zip(plans, series)])

        cases[f"analysis/{degree}"] = analyse
        cases[f"synthesis/{degree}"] = synthesise
    for degree in (64, 256):
        plan = shtns.sht(degree, degree, 1, shtns.sht_orthonormal)
        coefficients = [random.random(plan.nlm) + 1j * random.random(plan.nlm) for _ in range(CHANNELS)]
        rotation = shtns.rotation(degree, degree)
        rotation.set_angles_ZYZ(0.4, 0.7, 1.9)

        def rotate(rotation=rotation, coefficients=coefficients):
            return median(lambda: [rotation.apply_real(channel) for channel in coefficients])

        cases[f"rotation/{degree}"] = rotate
    return cases


def ducc0_cases():
    import ducc0
    import numpy

    random = numpy.random.default_rng(1)
    image = random.random((CHANNELS, 1, HEIGHT, WIDTH), dtype=numpy.float32)
    cases = {}
    for degree in (30, 255, 511):
        options = {"spin": 0, "lmax": degree, "geometry": "F1", "nthreads": 1}
        series = [ducc0.sht.analysis_2d(map=channel, **options) for channel in image]

        def analyse(options=options, series=series):
            def run():
                for channel, output in zip(image, series):
                    ducc0.sht.analysis_2d(map=channel, alm=output, **options)

            return median(run)

        def synthesise(options=options, series=series):
            pixels = numpy.empty_like(image)

            def run():
                for values, channel in zip(series, pixels):
                    ducc0.sht.synthesis_2d(alm=values, map=channel, **options)

            return median(run)

        cases[f"analysis/{degree}"] = analyse
        cases[f"synthesis/{degree}"] = synthesise
    return cases


def main():
    parser = argparse.ArgumentParser(description="Compares transforms and rotations with SHTns and ducc0.")
    parser.add_argument("--threads", default="2", help="the threads of our program")
    parser.add_argument("--rounds", type=int, default=5, help="runs of each side")
    root = Path(__file__).parent.parent
    parser.add_argument("--program", default=root / "target/release/transform-times", help="our program")
    options = parser.parse_args()

    peers = {}
    for name, cases in (("SHTns f64", shtns_cases), ("ducc0 f32", ducc0_cases)):
        try:
            peers[name] = cases()
        except ImportError as error:
            print(f"SKIPPED {name}: {error}")
    rounds = {}
    for _ in range(options.rounds):
        ours = json.loads(subprocess.check_output([options.program, options.threads]))
        for case, times in ours.items():
            rounds.setdefault((case, "ours"), []).append(times)
        for name, cases in peers.items():
            for case, run in cases.items():
                rounds.setdefault((case, name), []).append(run())

    def value(case, name, clock):
        times = rounds.get((case, name))
        return statistics.median(time[clock] for time in times) if times else None

    names = ["ours", *peers]
    for clock, text in (("wall", f"passed, ours on {options.threads} threads"), ("cpu", "of all threads")):
        print(f"\nmilliseconds {text}")
        print("".join([f"{'':16}", *(f"{name:>12}" for name in names), f"{'share of the best peer':>24}"]))
        for case in ours:
            times = [value(case, name, clock) for name in names]
            theirs = [time for time in times[1:] if time is not None]
            cells = ["-" if time is None else f"{time:.2f}" for time in times]
            share = f"{times[0] / min(theirs):.2f}" if theirs else "-"
            print("".join([f"{case:16}", *(f"{cell:>12}" for cell in cells), f"{share:>24}"]))


if __name__ == "__main__":
    main()
