#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Records live flights and runs the records: the results have the same bytes, also where sensors failed. The record of a program
that was killed can be run up to its end.

usage: flight_record.py FBVINS
"""
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

FILES = ["trajectory_tum.txt", "trajectory.csv"]
FAULTS = {"whole": [], "one camera and no IMU": ["--fault", "left_off:1.5:0.5", "--fault", "imu_off:2.5:0.3"],
          "another frontend": ["--frontend", "orb", "--set", "estimator.max_iterations=5"],
          "images lost": ["--fault", "lose_images:1:2:0.4", "--fault", "camera_off:3.2:0.3"]}


class Failure(Exception):
    pass


def require(fact, sentence):
    if not fact:
        raise Failure(sentence)


def fly(program, flight, record, *arguments):
    return [program, "live", "--source", f"replay:{flight}", "--record", str(record), "--quiet", *map(str, arguments)]


def run_again(program, record, out):
    command = [program, "run", str(record), "--config", str(record), "--out", str(out), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    return done.returncode, done.stderr


def check_same_bytes(program, flight, root):
    """The record has exactly what the estimator received, so images that were dropped do not change the result."""
    for number, (name, faults) in enumerate(FAULTS.items()):
        record, live, again = (root / f"{number}{end}" for end in (".mcap", "live", "again"))
        subprocess.run(fly(program, flight, record, "--out", live, *faults), check=True)
        require(run_again(program, record, again)[0] == 0, f"{name}: the record cannot be run")
        for file in FILES:
            require((live / file).read_bytes() == (again / file).read_bytes(), f"{name}: {file} differs")
        require(b"\n" in (again / FILES[0]).read_bytes(), f"{name}: there is no pose")


def check_kill(program, flight, root):
    record = root / "killed.mcap"
    with subprocess.Popen(fly(program, flight, record)) as process:
        # Kill it only once there are images; only what has been written until then must be in the record.
        while process.poll() is None and (not record.exists() or record.stat().st_size < 3_000_000):
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
    require(process.returncode == -signal.SIGKILL, "the flight ended before it was killed")
    code, said = run_again(program, record, root / "after_kill")
    require(code == 0 or "no pose in any of" in said, f"after a kill: {said}")
    require("was cut off while it was written" in said, f"after a kill there is no warning: {said}")


def check_refusals(program, flight, root):
    record = root / "0.mcap"
    before = record.read_bytes()
    done = subprocess.run(fly(program, flight, record), capture_output=True, text=True)
    require(done.returncode == 0 and "exists already" in done.stderr, f"the flight has no record of its own: {done}")
    require(record.read_bytes() == before, "the record that was there has changed")
    require((root / "0-2.mcap").exists(), "the next record has not the next number")
    blind = root / "blind.mcap"
    subprocess.run(fly(program, flight, blind, "--record-no-images", "--max-images", 20), capture_output=True)
    code, said = run_again(program, blind, root / "blind")
    require(code == 2 and f"{blind}: holds no images" in said, f"without images: {said}")


def main():
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        flight = root / "flight"
        subprocess.run([program, "simulate", "normal", "--seconds", "4", "--set", "image_rate_hz=10", "--out", flight, "--quiet"],
                       check=True)
        try:
            for check in (check_same_bytes, check_kill, check_refusals):
                check(program, flight, root)
        except Failure as failure:
            print(failure)
            return 1
    print("records of live flights give the same bytes: whole, with faults, and of a killed program")
    return 0


if __name__ == "__main__":
    sys.exit(main())
