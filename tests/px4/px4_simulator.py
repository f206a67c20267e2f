# SPDX-License-Identifier: Apache-2.0
"""A real PX4 (SITL) whose only sensor is an IMU that the test simulates. PX4 waits for each reading (lockstep), so the test
determines PX4's time."""
import os
import pathlib
import select
import socket
import subprocess

from pymavlink.dialects.v20 import common

PARAMETERS = {
    "EKF2_EV_CTRL": 15, "EKF2_HGT_REF": 3, "EKF2_GPS_CTRL": 0, "EKF2_BARO_CTRL": 0, "EKF2_MAG_TYPE": 5,
    "EKF2_EV_DELAY": 0, "EKF2_EV_NOISE_MD": 0, "EKF2_EV_QMIN": 1,
    # One IMU, no other sensor, no logs.
    "EKF2_MULTI_IMU": 0, "SENS_IMU_MODE": 1, "SYS_HAS_BARO": 0, "SYS_HAS_MAG": 0, "SYS_HAS_GPS": 0, "SDLOG_MODE": -1,
}
ACCELEROMETER_AND_GYRO = 0b111111
REPLY_S = 0.5  # wall time to wait for PX4's answer to a reading; it does not answer every one


def free_instance():
    """PX4's ports depend only on the number of its instance."""
    for instance in range(9):
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as simulator, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            try:
                simulator.bind(("127.0.0.1", 4560 + instance))
                link.bind(("0.0.0.0", 14580 + instance))
                return instance
            except OSError:
                continue
    raise RuntimeError("all of PX4's ports are in use")


class Px4:
    """`step(t_us, accel, gyro)` with readings in the vehicle's forward-right-down; messages come back over `heard`."""

    def __init__(self, binary, folder, parameters=None):
        binary = pathlib.Path(binary).resolve()
        self.binary, self.instance = binary, free_instance()
        server = socket.create_server(("127.0.0.1", 4560 + self.instance))
        environment = dict(os.environ, PX4_SIM_MODEL="none_iris", HEADLESS="1")
        for name, value in {**PARAMETERS, **(parameters or {})}.items():
            environment[f"PX4_PARAM_{name}"] = str(value)
        self.log = open(pathlib.Path(folder) / "px4.log", "w", encoding="utf-8")
        self.process = subprocess.Popen([binary, "-d", "-i", str(self.instance), "-w", str(folder), binary.parent.parent / "etc"],
                                        env=environment, stdout=self.log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)
        server.settimeout(30)
        self.simulator, _ = server.accept()
        server.close()
        self.simulator.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.link.setblocking(False)
        self.writer = common.MAVLink(None, srcSystem=1, srcComponent=51)
        self.reader = common.MAVLink(None)
        self.reader.robust_parsing = True
        self.answers = False  # PX4 answers only once its modules run

    def step(self, t_us, accel, gyro):
        message = common.MAVLink_hil_sensor_message(t_us, *accel, *gyro, 0, 0, 0, 0, 0, 0, 20, ACCELEROMETER_AND_GYRO)
        self.simulator.sendall(message.pack(self.writer))
        if select.select([self.simulator], [], [], REPLY_S if self.answers else 0.005)[0]:
            self.answers = len(self.simulator.recv(65536)) > 0
            if not self.answers:
                raise RuntimeError("PX4 ended")

    def receive(self):
        """Packets on the onboard link."""
        packets = []
        while select.select([self.link], [], [], 0)[0]:
            packets.append(self.link.recv(65536))
        return packets

    def messages(self, packet):
        return self.reader.parse_buffer(packet) or []

    def send(self, packet):
        self.link.sendto(packet, ("127.0.0.1", 14580 + self.instance))

    def greet_as_ground_station(self):
        """From then on receives what PX4 sends to its ground station, and leaves the onboard link to others."""
        station = common.MAVLink(None, srcSystem=255, srcComponent=190)
        beat = common.MAVLink_heartbeat_message(common.MAV_TYPE_GCS, common.MAV_AUTOPILOT_INVALID, 0, 0, common.MAV_STATE_ACTIVE, 3)
        odometry = common.MAVLink_command_long_message(1, 1, common.MAV_CMD_SET_MESSAGE_INTERVAL, 0, common.MAVLINK_MSG_ID_ODOMETRY,
                                                       33_000, 0, 0, 0, 0, 0)
        for message in (beat, odometry):
            self.link.sendto(message.pack(station), ("127.0.0.1", 18570 + self.instance))

    def ask(self, *command):
        """Starts a command of PX4's own shell; it may need further steps to end."""
        return subprocess.Popen([self.binary.parent / f"px4-{command[0]}", "--instance", str(self.instance), *command[1:]],
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def close(self):
        self.process.terminate()
        try:
            self.process.wait(5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.simulator.close()
        self.link.close()
        self.log.close()
