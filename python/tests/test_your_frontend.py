# SPDX-License-Identifier: Apache-2.0
"""Frontends in Python. The last file: what is registered stays, and configurations written by this process name it."""
import importlib.util
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import fbvins


class Silent:
    """Sees nothing, and keeps what it was given."""

    def __init__(self, rig):
        self.packets = []
        Silent.rig = rig

    def process(self, packet, prior):
        Silent.last = (packet, prior)


def named(make, name, **options):
    """Registered once in this process."""
    fbvins.register_frontend(name, make, **options)
    return name


def test_a_frontend_gets_images_readings_and_the_state_before(flight):
    recording = fbvins.open(flight, max_frames=20)
    run = fbvins.run(recording, named(Silent, "silent"))
    assert not run.has_pose.any()
    packet, prior = Silent.last
    assert Silent.rig.left.width == recording.rig.left.width
    assert packet.frame.left.shape == (Silent.rig.left.height, Silent.rig.left.width) and packet.frame.t == run.t[-1]
    assert packet.gyro.shape == packet.accel.shape == (len(packet.imu_t), 3) and np.all(np.diff(packet.imu_t) > 0)
    assert packet.imu_t[0] <= run.t[-2] and packet.imu_t[-1] >= run.t[-1], "the readings reach from image to image"
    assert not prior.valid and prior.T_GB.shape == (4, 4)


def returning(result):
    class Frontend:
        def __init__(self, rig):
            pass

        def process(self, packet, prior):
            if isinstance(result, Exception):
                raise result
            return result
    return Frontend


@pytest.mark.parametrize("result, message", [
    (KeyError("no such corner"), "no such corner"),
    (np.zeros((3, 2)), r"returns \(ids, left, right\)"),
    ((np.arange(3), np.zeros((2, 2)), None), "left"),
    ((np.arange(3), np.zeros((3, 2)), np.zeros((3, 3))), "right"),
    ((np.arange(3) + 0.5, np.zeros((3, 2)), None), "ids"),
])
@pytest.mark.parametrize("threaded", [False, True])
def test_what_goes_wrong_in_a_frontend_is_raised(flight, result, message, threaded):
    name = named(returning(result), f"wrong-{abs(hash((message, threaded)))}")
    with pytest.raises(RuntimeError, match=message):
        fbvins.run(fbvins.open(flight, max_frames=20), name, threaded=threaded)


def test_names_are_unique_and_makers_are_asked(flight):
    name = named(Silent, "only-once")
    with pytest.raises(ValueError, match="already"):
        fbvins.register_frontend(name, Silent)
    with pytest.raises(ValueError, match="no name"):
        fbvins.register_frontend("not a name", Silent)
    with pytest.raises(TypeError, match="callable"):
        fbvins.register_frontend("nothing", 3)
    with pytest.raises(ValueError, match="rigs of mine only"):
        def picky(rig):
            raise RuntimeError("rigs of mine only")
        fbvins.System({"frontend.kind": named(picky, "picky")}, fbvins.open(flight).rig)


def test_positions_outside_or_missing_are_no_observations(flight):
    """A frontend that sees nothing but places beyond the image is blind: no pose, no crash."""
    nowhere = np.array([[-5.0, 10], [np.nan, np.nan], [1e6, 1e6]])
    run = fbvins.run(fbvins.open(flight, max_frames=20), named(returning((np.arange(3), nowhere, nowhere)), "nowhere"))
    assert not run.has_pose.any() and not run.frontend_statistics["stereo"].any()


def example():
    pytest.importorskip("cv2", reason="OpenCV (opencv-python-headless) is not installed")
    path = pathlib.Path(__file__).resolve().parents[2] / "examples/own_frontend.py"
    if not path.exists():
        pytest.skip("the examples are not here")
    return path


def test_the_example_flies(flight):
    """RMSE as of the built-in optical flow, within a factor of two, the same threaded."""
    spec = importlib.util.spec_from_file_location("own_frontend", example())
    spec.loader.exec_module(importlib.util.module_from_spec(spec))
    klt, own, threaded = (fbvins.run(flight, name, threaded=t) for name, t in (("klt", False), ("corners", False), ("corners", True)))
    rmse = [fbvins.evaluate(run.ground_truth, run).absolute_m.rmse for run in (klt, own)]
    assert rmse[1] < 2 * rmse[0] + 0.005, rmse
    assert own.has_pose.mean() > klt.has_pose.mean() - 0.1
    assert np.array_equal(own.p, threaded.p, equal_nan=True)


def test_the_interpreter_ends_with_registered_frontends(flight):
    """Quietly: no leak, no crash."""
    script = ("import sys, fbvins\n"
              "class F:\n"
              "    def __init__(self, rig): self.rig = rig\n"
              "    def process(self, packet, prior): return None\n"
              "fbvins.register_frontend('f', F)\n"
              "kept = fbvins.System({'frontend.kind': 'f'}, fbvins.open(sys.argv[1]).rig, threaded=True)\n")
    done = subprocess.run([sys.executable, "-c", script, str(flight)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
