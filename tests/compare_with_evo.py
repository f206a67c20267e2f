#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares `fbvins eval` with evo (github.com/MichaelGrupp/evo) on the same files: every figure must agree to 1e-6.

usage: compare_with_evo.py FBVINS [PYTHON]      PYTHON: an interpreter that may have evo (./dev test makes one)
exit 77 (skipped) where evo is not installed
"""
import json
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile

try:
    import numpy as np
    from evo.core import metrics, sync
    from evo.tools import file_interface
except ImportError as missing:
    if len(sys.argv) > 2 and pathlib.Path(sys.argv[2]).exists():
        os.execv(sys.argv[2], [sys.argv[2], __file__, sys.argv[1]])
    print(f"skipped: evo is not installed ({missing}); ./dev test installs it where PyPI can be reached")
    sys.exit(77)

TOLERANCE = 1e-6
START_S = 1403636580


def quaternion_xyzw(rotation_vector):
    angle = math.sqrt(sum(c * c for c in rotation_vector))
    k = math.sin(angle / 2) / angle if angle > 1e-9 else 0.5
    return [k * c for c in rotation_vector] + [math.cos(angle / 2)]


def multiply(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


def flight(s):
    """Position (m) and orientation (xyzw) at s seconds."""
    p = [2.0 * math.sin(0.5 * s), 1.5 * math.cos(0.31 * s) + 0.1 * s, 1 + 0.4 * math.sin(0.9 * s)]
    return p, quaternion_xyzw([0.3 * math.sin(s), 0.2 * math.cos(0.7 * s), 0.4 * math.sin(0.2 * s)])


def write_truth(path, seconds):
    with open(path, "w", encoding="utf-8") as out:
        for i in range(int(seconds * 200)):
            p, q = flight(i / 200)
            print(f"{START_S + i // 200}.{i % 200 * 5_000_000:09d}", *(f"{v:.9f}" for v in p + q), file=out)


def write_estimate(path, seconds, seed, jitter_ns, drop):
    """The flight in another world frame (rotated, shifted, scaled), with noise, drift, jitter of the stamps and missing poses."""
    rng = random.Random(seed)
    turn = quaternion_xyzw([0.1, -0.2, 1.9])
    with open(path, "w", encoding="utf-8") as out:
        for i in range(int(seconds * 20)):
            if rng.random() < drop:
                continue
            s = i / 20
            p, q = flight(s)
            p = [1.03 * c + 0.004 * s + rng.gauss(0, 0.01) for c in p]
            rotated = multiply(multiply(turn, p + [0.0]), [-turn[0], -turn[1], -turn[2], turn[3]])
            q = multiply(multiply(turn, q), quaternion_xyzw([rng.gauss(0, 0.01) for _ in range(3)]))
            ns = i * 50_000_000 + 20_000_000 + rng.randint(-jitter_ns, jitter_ns)
            stamp = f"{START_S + ns // 1_000_000_000}.{ns % 1_000_000_000:09d}"
            print(stamp, rotated[0] + 5, rotated[1] - 3, rotated[2], *q, file=out)


def fbvins(program, truth, estimate, *arguments):
    command = [program, "eval", str(truth), str(estimate), "--json", *arguments]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def evo_pairs(truth, estimate, alignment):
    reference = file_interface.read_tum_trajectory_file(str(truth))
    candidate = file_interface.read_tum_trajectory_file(str(estimate))
    reference, candidate = sync.associate_trajectories(reference, candidate, max_diff=0.01)
    if alignment != "none":
        candidate.align(reference, correct_scale=alignment == "sim3")
    return reference, candidate


def evo_errors(metric, pairs):
    metric.process_data(pairs)
    return np.array(metric.error)


def check(what, ours, errors, failures):
    theirs = {"count": len(errors), "max": np.max(errors), "mean": np.mean(errors), "median": np.median(errors),
              "rmse": math.sqrt(np.mean(np.square(errors))), "std": np.std(errors)}
    worst = max(abs(ours[name] - value) for name, value in theirs.items())
    good = worst <= TOLERANCE and len(errors) > 10
    print(f"{'same' if good else 'DIFFERENT'} {what}: rmse {ours['rmse']:.9f}, {len(errors)} values, largest difference {worst:.1e}")
    if not good:
        print("  fbvins", ours, "\n  evo   ", theirs)
        failures.append(what)


def compare_absolute(program, truth, estimate, failures):
    for alignment in ("se3", "sim3", "none"):
        ours = fbvins(program, truth, estimate, "--align", alignment)
        pairs = evo_pairs(truth, estimate, alignment)
        for key, relation in (("ape_m", metrics.PoseRelation.translation_part),
                              ("ape_deg", metrics.PoseRelation.rotation_angle_deg)):
            check(f"{key} {alignment}", ours[key], evo_errors(metrics.APE(relation), pairs), failures)


def compare_per_metre(program, truth, estimate, failures):
    for all_pairs in (True, False):
        for of_truth in (True, False):
            choice = ["--pairs", "all" if all_pairs else "consecutive", "--path", "truth" if of_truth else "estimate"]
            ours = fbvins(program, truth, estimate, "--align", "sim3", *choice)
            pairs = evo_pairs(truth, estimate, "sim3")
            for key, relation in (("rpe_per_metre_m", metrics.PoseRelation.translation_part),
                                  ("rpe_per_metre_deg", metrics.PoseRelation.rotation_angle_deg)):
                metric = metrics.RPE(relation, 1.0, metrics.Unit.meters, all_pairs=all_pairs, pairs_from_reference=of_truth)
                check(f"{key} {' '.join(choice)}", ours[key], evo_errors(metric, pairs), failures)


def compare_per_second(program, truth, estimate, failures):
    """evo counts frames, not seconds: both are the same where the estimate has exactly 20 poses per second."""
    pairs = evo_pairs(truth, estimate, "se3")
    relation = metrics.PoseRelation.translation_part

    def frames(count, all_pairs):
        return evo_errors(metrics.RPE(relation, count, metrics.Unit.frames, all_pairs=all_pairs), pairs)

    ours = fbvins(program, truth, estimate, "--pairs", "consecutive")
    check("rpe_per_second_m consecutive", ours["rpe_per_second_m"], frames(20, False), failures)
    # At the end of the flight fbvins also uses the two segments of 0.95 s and 0.90 s, within 10 % of a second, as evo does for metres.
    whole = np.concatenate([frames(20, True), frames(19, True)[-1:], frames(18, True)[-1:]])
    check("rpe_per_second_m all", fbvins(program, truth, estimate)["rpe_per_second_m"], whole, failures)


def main():
    program, failures = sys.argv[1], []
    with tempfile.TemporaryDirectory() as folder:
        truth, ragged, even = (pathlib.Path(folder) / name for name in ("truth.txt", "ragged.txt", "even.txt"))
        write_truth(truth, 40)
        write_estimate(ragged, 43, seed=1, jitter_ns=2_000_000, drop=0.1)  # some stamps lie outside the truth's time span
        write_estimate(even, 39, seed=2, jitter_ns=0, drop=0)
        compare_absolute(program, truth, ragged, failures)
        compare_per_metre(program, truth, ragged, failures)
        compare_per_second(program, truth, even, failures)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
