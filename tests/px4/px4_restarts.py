#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`fbvins live` is killed (SIGKILL) ten times beside a real PX4 that navigates by it, and starts again, in wall time: how long PX4 is
without vision, whether it is told that the frame is new, and how far its own position is off. The world is that of
examples/socket_sender.py, a vehicle that sways sideways before a wall; PX4 gets the same motion as its IMU. To be run by hand, because
the result depends on the load of the machine.

usage: FBVINS_PX4=.../bin/px4 px4_restarts.py FBVINS [ARGUMENT of fbvins live...]
"""
import math
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

os.environ["MAVLINK20"] = "1"
import numpy as np  # noqa: E402
from pymavlink.dialects.v20 import common  # noqa: E402

from px4_simulator import Px4  # noqa: E402

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples"))
import sensor_bridge  # noqa: E402  its connection, which begins anew
import socket_sender as world  # noqa: E402

RESTARTS, BAR_M, VISION_BAR_S = 10, 0.1, 3.0
STANDING_S, CLOCK_S, FLIGHT_S = 12, 50, 8  # before the first pose; until PX4 trusts our clock (500 answers); after each restart
START_US, STEP_S = 1_000_000, 1 / world.IMU_HZ
FLAGS = ["listener", "estimator_status_flags", "-n", "1"]


class Flight:
    def __init__(self, px4, arguments, folder):
        self.px4, self.arguments, self.folder = px4, arguments, pathlib.Path(folder)
        self.link = sensor_bridge.Link(str(self.folder / "s"), world.WIDTH, world.HEIGHT, world.rig())
        self.rows, self.rng = world.wall(), np.random.default_rng(1)
        self.k, self.begin_ns, self.live = 0, time.monotonic_ns(), None
        self.odometry, self.truth, self.slowest_s = [], [], 0
        self.thrust, self.station = None, common.MAVLink(None, srcSystem=255, srcComponent=190)
        px4.link.bind(("127.0.0.1", 0))

    @property
    def t_s(self):
        return self.k * STEP_S

    def x_m(self, t_s):
        return world.motion(t_s - STANDING_S)[0]

    def launch(self):
        companion = f"udp:127.0.0.1:{14580 + self.px4.instance}:{14540 + self.px4.instance}"
        self.live = subprocess.Popen(
            [self.arguments[0], "live", "--source", f"socket:{self.folder / 's'}", "--mavlink", companion, "--quiet", "--set",
             "live.mavlink.mounting.imu_axes=camera_fwd", "--set", "live.mavlink.frame=local_ned", *self.arguments[1:]], cwd=self.folder)

    def check(self):
        if self.live and self.live.poll() is not None:
            sys.exit("fbvins live has ended")

    def step(self):
        """One reading of the IMU, in wall time, and every tenth time an image."""
        due_s = self.begin_ns * 1e-9 + self.t_s
        time.sleep(max(0, due_s - time.monotonic()))
        self.slowest_s = max(self.slowest_s, time.monotonic() - due_s)
        force = world.motion(self.t_s - STANDING_S)[1]
        noise = lambda sigma: self.rng.normal(0, sigma, 3)  # noqa: E731
        gyro, accel = noise(0.003), np.array([force, -9.81, 0]) + noise(0.03)
        frd = [2, 0, 1]  # of B's axes: right, down, forward
        self.px4.step(START_US + round(self.t_s * 1e6), accel[frd], gyro[frd])
        stamp_ns = self.begin_ns + round(self.t_s * 1e9)
        self.link.send("reading", stamp_ns, gyro, accel)
        if self.k % world.READINGS_A_FRAME == 0:
            views = [np.frombuffer(world.view(self.rows, self.x_m(self.t_s) + at), np.uint8).reshape(world.HEIGHT, world.WIDTH)
                     for at in (0, world.BASELINE_M)]
            self.link.send("frame", stamp_ns, *views)
        if self.live and self.k % 20 == 0:
            self.link.keep_open()
        if self.px4.answers and self.k % world.IMU_HZ == 0:
            self.px4.greet_as_ground_station()
        if self.thrust is not None and self.k % 10 == 0:
            self.hold_the_stick(self.thrust, arm=self.thrust == 0 and self.k % world.IMU_HZ == 0)
        for packet in self.px4.receive():
            for m in self.px4.messages(packet):
                if m.get_type() == "ODOMETRY" and m.get_srcComponent() == 1 and math.isfinite(m.x):
                    self.odometry.append((self.t_s, np.array([m.x, m.y, m.z]), m.reset_counter,
                                          np.array([0, self.x_m((m.time_usec - START_US) * 1e-6), 0])))
        self.k += 1

    def hold_the_stick(self, thrust, arm):
        """Thrust by hand, so that PX4 takes itself for flying: on the ground it would hold its position while it has no vision."""
        stick = common.MAVLink_manual_control_message(1, 0, 0, thrust, 0, 0)
        force = common.MAVLink_command_long_message(1, 1, common.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, 21196, 0, 0, 0, 0, 0)
        for message in [stick] + [force] * arm:
            self.px4.link.sendto(message.pack(self.station), ("127.0.0.1", 18570 + self.px4.instance))

    def run(self, seconds):
        for _ in range(round(seconds * world.IMU_HZ)):
            self.step()

    def flag(self, name):
        question = self.px4.ask(*FLAGS)
        while question.poll() is None:
            self.step()
        return dict(re.findall(r"(\w+): (\S+)", question.communicate()[0])).get(name) == "True"

    def vision_after(self, longest_s):
        """Seconds until PX4 fuses vision's position."""
        begin_s = self.t_s
        while self.t_s < begin_s + longest_s:
            self.check()
            if self.flag("cs_ev_pos"):
                return self.t_s - begin_s
            self.run(0.05)
        return math.inf

    def error_m(self, begin_s, end_s):
        """Largest distance of PX4's position from the truth, aligned by the mean."""
        chosen = [p - truth for t_s, p, _, truth in self.odometry if begin_s <= t_s <= end_s]
        return np.linalg.norm(np.array(chosen) - np.mean(chosen, axis=0), axis=1).max() if chosen else math.inf

    def resets(self):
        return self.odometry[-1][2] if self.odometry else -1


def restart(flight, number):
    before, kill_s = flight.resets(), flight.t_s
    flight.live.send_signal(signal.SIGKILL)
    flight.live.wait()
    stopped = 0.0
    while stopped < 1:  # until PX4 has noticed: 0.4 s without vision
        flight.run(0.1)
        stopped += 0.1
    begin_s = flight.t_s
    flight.launch()
    vision_s = flight.vision_after(20)
    back_s = flight.t_s
    flight.run(FLIGHT_S)
    told = (flight.resets() - before) % 256
    blind_m, after_m = flight.error_m(kill_s, begin_s), flight.error_m(back_s + 1, flight.t_s)
    good = vision_s <= VISION_BAR_S and after_m <= BAR_M and told > 0
    print(f"{'ok   ' if good else 'FAILS'} restart {number}: vision after {vision_s:.2f} s; {told} resets told; off by {100 * blind_m:.1f} cm while "
          f"there was none, {100 * after_m:.1f} cm from a second after it on", flush=True)
    return good


def main():
    with tempfile.TemporaryDirectory() as folder:
        px4 = Px4(os.environ["FBVINS_PX4"], folder, {"COM_RC_IN_MODE": 1, "CBRK_SUPPLY_CHK": 894281, "COM_DISARM_PRFLT": -1})
        flight = Flight(px4, sys.argv[1:], folder)
        try:
            flight.run(STANDING_S - 2)
            flight.launch()
            print(f"first start: vision after {flight.vision_after(30):.2f} s", flush=True)
            flight.run(CLOCK_S)
            for flight.thrust in (0, 1000):
                flight.run(3)
            print(f"PX4 takes itself for flying: {flight.flag('cs_in_air')}", flush=True)
            results = [restart(flight, number + 1) for number in range(RESTARTS)]
        finally:
            if flight.live:
                flight.live.kill()
            px4.close()
            flight.link.close()
    print(f"{sum(results)} of {RESTARTS} restarts; the simulation was late by {flight.slowest_s:.2f} s at most")
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
