#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A rendered flight with a rangefinder, a sensor of velocity and a barometer: they are counted, kept by every format and by a live
flight's record, of use to one camera, and left out and named where they are wrong.

usage: aiding.py FBVINS
"""
import json
import pathlib
import subprocess
import sys
import tempfile

SENSORS = ["--set", "range.rate_hz=20", "--set", "velocity.rate_hz=50", "--set", "barometer.rate_hz=25"]
OFF = ["--set", "estimator.rangefinder.enabled=false", "--set", "estimator.velocity.enabled=false", "--set", "estimator.barometer.enabled=false"]


def run(program, *arguments):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, (arguments, done.stderr)
    return done.stdout


def fly(program, recording, out, *more):
    run(program, "run", recording, "--out", out, "--frontend", "klt", "--quiet", *more)
    return json.loads((out / "summary.json").read_text(encoding="utf-8"))["result"]


def counts(program, recording):
    aiding = json.loads(run(program, "info", recording, "--json"))["aiding"]
    return {name: sensor["readings"] for name, sensor in aiding.items()}


def counts_by_folder(program, recording, out, *more):
    """Of any format, by the folder that it becomes."""
    run(program, "convert", recording, out, "--quiet", *more)
    return counts(program, out)


def replace_rows(folder, of):
    """The sensor's numbers by others: of(row number, its numbers)."""
    path = folder / "data.csv"
    head, *rows = path.read_text(encoding="utf-8").splitlines()
    out = [head]
    for k, row in enumerate(rows):
        stamp, *numbers = row.split(",")
        out.append(",".join([stamp, *(str(x) for x in of(k, [float(x) for x in numbers]))]))
    path.write_text("\n".join(out) + "\n", encoding="utf-8")


def check_formats(program, flight, folder, error):
    expected = counts(program, flight)
    assert set(expected) == {"rangefinder", "velocity", "barometer"} and all(n > 100 for n in expected.values()), expected
    for name, written, read in (("flight.bag", (), ()), ("flight.mcap", (), ()), ("bag2", ("--rosbag2",), ())):
        copy = folder / name
        run(program, "convert", flight, copy, *written, "--quiet")
        got = counts_by_folder(program, copy, folder / f"{name}_folder", *read)
        # Those behind the last image are not delivered, and so not converted.
        assert all(expected[s] - 20 <= got.get(s, 0) <= expected[s] for s in expected), (name, got, expected)
        result = fly(program, copy, folder / f"out_{name}", *read)
        assert abs(result["accuracy"]["ape_m"]["rmse"] - error) < 0.002, name


def check_record(program, flight, folder):
    record = folder / "live.mcap"
    run(program, "live", "--source", f"replay:{flight}", "--record", record, "--frontend", "klt", "--quiet")
    got, expected = counts(program, record), counts(program, flight)
    assert all(expected[s] - 20 <= got.get(s, 0) <= expected[s] for s in expected), (got, expected)


def check_wrong_ones(program, flight, folder, without):
    """Each alone is anything, from the middle of the flight on: health names it, and the pose is as good as without."""
    spoil = {"range0": (lambda k, v: [0.3 + (k * 7919 % 97) * 0.05] if k > 80 else v, "range_disagrees"),
             "velocity0": (lambda k, v: [2.5 * v[0] + 1, *v[1:]] if k > 200 else v, "velocity_disagrees"),
             "baro0": (lambda k, v: [v[0] + (k * 7919 % 997) - 500] if k > 50 else v, "pressure_disagrees")}
    for sensor, (of, reason) in spoil.items():
        copy = folder / f"wrong_{sensor}"
        subprocess.run(["cp", "-rs", flight, copy], check=True)
        csv = copy / "mav0" / sensor / "data.csv"
        text = csv.read_text(encoding="utf-8")
        csv.unlink()
        csv.write_text(text, encoding="utf-8")
        replace_rows(csv.parent, of)
        off = [o for o in OFF if o != "--set"]
        others = [x for o in off if sensor.rstrip("0")[:4] not in o for x in ("--set", o)]
        result = fly(program, copy, folder / f"out_{sensor}", *others)
        named = result["health"].get(f"degraded/{reason}", 0)
        error = result["accuracy"]["ape_m"]["rmse"]
        print(f"{sensor} wrong: {named} images {reason}, RMSE {1e3 * error:.1f} mm, {1e3 * without:.1f} mm without the sensor")
        assert named > 20, result["health"]
        assert error < 1.5 * without + 0.005 and result["restarts"] == 0


def main(program):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        flight = (folder / "flight").resolve()
        run(program, "simulate", "takeoff", "--seconds", "12", "--seed", "213", "--set", "rig=mono", *SENSORS, "--out", flight, "--quiet")
        aided = fly(program, flight, folder / "out")
        alone = fly(program, flight, folder / "out_alone", *OFF)
        error, without = (r["accuracy"]["ape_m"]["rmse"] for r in (aided, alone))
        print(f"one camera: RMSE {1e3 * error:.1f} mm with the sensors, {1e3 * without:.1f} mm without, {aided['health']}")
        assert error < 0.95 * without
        assert not any("disagrees" in reason for reason in aided["health"]), aided["health"]
        check_formats(program, flight, folder, error)
        check_record(program, flight, folder)
        check_wrong_ones(program, flight, folder, without)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
