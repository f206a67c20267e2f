#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A real PX4 navigates by `fbvins live --mavlink` in wall time: a recording is played as live sensors, and PX4's EKF2 gets the
same IMU at the same moments. To be run by hand, because the result depends on the load of the machine; the test is px4_flight.py.

usage: FBVINS_PX4=.../bin/px4 px4_live.py FBVINS RECORDING [ARGUMENT of fbvins live, but --quiet...]
"""
import json
import os
import subprocess
import sys
import tempfile
import threading
import time

os.environ["MAVLINK20"] = "1"
import numpy as np  # noqa: E402

from flight_data import MOUNTING, Recording  # noqa: E402
from px4_flight import START_US, STEP_US, Flight  # noqa: E402
from px4_simulator import Px4  # noqa: E402

STANDING_S = 20  # in which EKF2 learns the gyro bias


class Listener(Flight):
    """Computes the errors of a Flight only; here `fbvins live` itself sends the poses."""

    def __init__(self, px4, recording, flight_us):
        self.px4, self.recording, self.flight_us = px4, recording, flight_us
        self.odometry, self.sent, self.said, self.answers = [], [], [], {}

    def step(self, t_us, accel, gyro):
        self.px4.step(t_us, accel, gyro)
        for packet in self.px4.receive():
            for message in self.px4.messages(packet):
                self.hear(message)


class Live:
    """`fbvins live`, and the difference of CLOCK_MONOTONIC and the recording's stamps while it plays."""

    def __init__(self, arguments, instance):
        mounting = [word for one in MOUNTING for word in ("--set", one)]
        address = f"udp:127.0.0.1:{14580 + instance}:{14540 + instance}"
        self.process = subprocess.Popen([arguments[0], "live", "--source", f"replay:{arguments[1]}", "--mavlink", address, *mounting,
                                         *arguments[2:]], stdout=subprocess.PIPE, text=True)
        self.since_ns, self.newest = None, {}
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            self.newest = json.loads(line)
            if self.newest.get("t_ns", 0) > 0:
                since_ns = self.newest["host_ns"] - self.newest["t_ns"]
                self.since_ns = min(self.since_ns or since_ns, since_ns)


def main():
    recording = Recording(sys.argv[2])
    with tempfile.TemporaryDirectory() as folder:
        # VISION_POSITION_ESTIMATE has no field for quality.
        px4, live = Px4(os.environ["FBVINS_PX4"], folder, {"EKF2_EV_QMIN": 0} if "live.mavlink.dialect=vision_estimate" in sys.argv else {}), None
        begin_ns, listener = time.monotonic_ns(), Listener(px4, recording, START_US)
        # PX4 sends its messages to the port that the sink listens on; this script reads them on the ground station's port.
        px4.link.bind(("127.0.0.1", 0))
        rest, t_us = recording.at_rest(), START_US
        try:
            while live is None or live.since_ns is None:
                if live and live.process.poll() is not None:
                    sys.exit("fbvins live ended before it told its state")
                if live is None and t_us > START_US + STANDING_S * 1e6:
                    live = Live(sys.argv[1:], px4.instance)
                if px4.answers and t_us % 1_000_000 < STEP_US:
                    px4.greet_as_ground_station()
                listener.step(t_us, *rest)
                t_us += STEP_US
                time.sleep(max(0, begin_ns * 1e-9 + (t_us - START_US) * 1e-6 - time.monotonic()))
            since_ns = live.since_ns
            listener.flight_us = START_US + (since_ns + int(recording.imu_ns[0]) - begin_ns) // 1000
            for t_ns, accel, gyro in zip(recording.imu_ns, recording.accel, recording.gyro):
                if listener.to_us(t_ns) <= t_us:
                    continue
                time.sleep(max(0, (since_ns + int(t_ns)) * 1e-9 - time.monotonic()))
                listener.step(listener.to_us(t_ns), accel, gyro)
        finally:
            px4.close()
            if live:
                live.process.wait()
    # The flight begins where the standing ends, in motion and up to a second late; EKF2 needs a few seconds to find its tilt.
    errors = listener.errors(4, 16.8)
    print(f"PX4 by fbvins live, to truth: {100 * np.sqrt(np.mean(errors ** 2)):.1f} cm RMS, {100 * errors.max():.1f} cm at most, "
          f"of {len(errors)} poses")
    print(json.dumps(live.newest))


if __name__ == "__main__":
    sys.exit(main())
