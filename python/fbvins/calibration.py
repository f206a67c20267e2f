# SPDX-License-Identifier: Apache-2.0
"""Rigs from the calibration files of other programs."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, Optional, Union

from . import _fbvins

if TYPE_CHECKING:
    import numpy

    PathLike = Union[str, "os.PathLike[str]"]


def load(path: PathLike, imu: Optional[PathLike] = None) -> _fbvins.Rig:
    """The format is recognised by content: Kalibr's camchain-imucam.yaml (cam0 is left, cam1 right), OpenVINS's estimator_config.yaml or
    kalibr_imucam_chain.yaml, Basalt's calibration.json (pinhole, pinhole-radtan8, kb4, ds, eucm), VINS-Fusion's configuration with its two camera
    files (PINHOLE, KANNALA_BRANDT, MEI), VINS-Mono's and ORB-SLAM3's configurations, an OAK's JSON, Kimera-VIO's LeftCameraParams.yaml, a EuRoC
    folder. imu: Kalibr's imu.yaml (imu.yaml:imu1 of several IMUs) or imu_utils, instead of the file's own noise figures."""
    return _fbvins.load_calibration(os.fspath(path), os.fspath(imu) if imu is not None else "")


#: The same function under the names of the formats.
kalibr = openvins = basalt = vins_fusion = euroc = load


def ros_camera_info(left: PathLike, right: PathLike, T_BC0: numpy.ndarray, imu_noise: Optional[_fbvins.ImuNoise] = None) -> _fbvins.Rig:
    """From two files of ROS's camera calibration. They contain the stereo extrinsics but not those of the IMU: T_BC0, float64 (4, 4), takes
    coordinates in the left camera to the IMU, m."""
    rig = _fbvins.load_camera_info(os.fspath(left), os.fspath(right), T_BC0)
    if imu_noise is None:
        return rig
    return _fbvins.Rig(rig.left, rig.right, rig.T_BC0, rig.T_BC1, imu_noise, rig.image_rate_hz, rig.time_offset_s)
