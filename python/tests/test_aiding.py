# SPDX-License-Identifier: Apache-2.0
"""Readings of a rangefinder, of wheels and of a barometer: made, read from a recording, flown with."""
import subprocess

import numpy as np
import pytest

import fbvins


@pytest.fixture(scope="module")
def with_sensors(program, tmp_path_factory):
    folder = tmp_path_factory.mktemp("aiding") / "flight"
    subprocess.run([program, "simulate", "normal", "--seconds", "4", "--seed", "3", "--set", "range.rate_hz=20", "--set", "velocity.rate_hz=50",
                    "--set", "barometer.rate_hz=25", "--out", str(folder), "--quiet"], check=True)
    return folder


def test_readings_are_values():
    r = fbvins.RangeSample(7, 1.5, point=np.array([0.1, 0, 0.0]))
    assert (r.t, r.distance, r.sigma) == (7, 1.5, 0.02) and np.array_equal(r.direction, [0, 0, -1]) and r.point[0] == 0.1
    v = fbvins.VelocitySample(8, np.array([1.0, 2, 3]), sigma=np.array([0.1, 0.1, 100]))
    assert np.array_equal(v.velocity, [1, 2, 3]) and v.sigma[2] == 100
    assert fbvins.PressureSample(9, 101325.0).pressure == 101325
    with pytest.raises(ValueError, match="10 to 200 kPa"):
        fbvins.PressureSample(9, 1013.25)
    with pytest.raises(ValueError, match="length 1"):
        fbvins.RangeSample(7, 1.5, direction=np.array([0, 0, -2.0]))
    with pytest.raises(ValueError, match="not finite"):
        fbvins.VelocitySample(8, np.array([np.nan, 0, 0]))


def test_a_recording_brings_them_and_a_system_takes_them(with_sensors):
    counts = {}
    recording = fbvins.open(str(with_sensors))
    with fbvins.System(fbvins.Config(), recording.rig) as system:
        for event in recording:
            counts[type(event)] = counts.get(type(event), 0) + 1
            system.push(event)
    odometry = system.poll()
    assert counts[fbvins.RangeSample] == pytest.approx(80, abs=3)
    assert counts[fbvins.VelocitySample] == pytest.approx(200, abs=5)
    assert counts[fbvins.PressureSample] == pytest.approx(100, abs=3)
    assert sum(o.health == "good" for o in odometry) > 40
