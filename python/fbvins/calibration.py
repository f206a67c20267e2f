# SPDX-License-Identifier: Apache-2.0
"""Rigs from calibration files."""
from __future__ import annotations

import os
from typing import Optional

from . import _fbvins


def kalibr(camchain, imu: Optional[str] = None) -> _fbvins.Rig:
    """Kalibr's camchain-imucam.yaml and, for the noise figures, imu.yaml. cam0 is left, cam1 right."""
    return _fbvins.load_kalibr(os.fspath(camchain), os.fspath(imu) if imu is not None else "")
