# SPDX-License-Identifier: Apache-2.0
"""Third-party recordings and calibrations."""
import subprocess

import numpy as np
import pytest

import fbvins


def test_a_bag_gives_the_same_poses_as_the_folder(program, flight, tmp_path):
    bag = tmp_path / "flight.bag"
    subprocess.run([program, "convert", flight, bag, "--quiet"], check=True)
    recording = fbvins.open(bag, calibration=flight, max_frames=60, topics=("/cam0/image_raw", "/cam1/image_raw", "/imu0"))
    assert recording.format.startswith("ROS 1 bag") and recording.warnings == []
    assert np.array_equal(fbvins.run(recording).p, fbvins.run(flight, max_images=60).p, equal_nan=True)
    own = fbvins.open(bag).rig
    assert np.allclose(own.T_BC1, fbvins.open(flight, max_frames=1).rig.T_BC1, atol=1e-12)
    with pytest.raises(FileNotFoundError, match="/left"):
        fbvins.open(bag, topics=("/left", "/right"))


def test_calibrations_of_other_programs(flight, tmp_path):
    rig = fbvins.calibration.euroc(flight)
    assert np.array_equal(rig.T_BC0, fbvins.open(flight, max_frames=1).rig.T_BC0)
    lines = ["%YAML:1.0"]
    for name, camera, T in (("cam0", rig.left, rig.T_BC0), ("cam1", rig.right, rig.T_BC1)):
        lines += [f"{name}:", "  T_imu_cam:", *(f"    - {row.tolist()}" for row in T), "  camera_model: pinhole", "  distortion_model: radtan",
                  f"  distortion_coeffs: {camera.distortion}", f"  intrinsics: {camera.intrinsics}", f"  resolution: [{camera.width}, {camera.height}]"]
    (tmp_path / "kalibr_imucam_chain.yaml").write_text("\n".join(lines))
    again = fbvins.calibration.openvins(tmp_path / "kalibr_imucam_chain.yaml")
    assert np.allclose(again.T_BC1, rig.T_BC1, atol=1e-12) and again.right.intrinsics == rig.right.intrinsics
    with pytest.raises(FileNotFoundError):
        fbvins.calibration.load(tmp_path / "nothing.yaml")
