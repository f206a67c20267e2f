#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A sender for `fbvins live --source socket:PATH` that needs only Python's standard library: a synthetic rig that rests for two seconds
and then sways sideways in front of a patterned wall, in wall time. Messages as in include/fbvins/live/socket_protocol.hpp.

usage: socket_sender.py PATH [SECONDS]
"""
import fcntl
import math
import mmap
import os
import random
import select
import socket
import struct
import sys
import time

HELLO, IMU, FRAME, GOODBYE, RELEASED = 1, 2, 3, 4, 66
HAS_RIG, LEFT, RIGHT = 1, 1, 2
WIDTH, HEIGHT, SLOTS, FOCAL_PX, BASELINE_M, WALL_M = 640, 480, 16, 400.0, 0.1, 2.0
IMAGE_BYTES, SLOT_BYTES, BLOCK_PX, MARGIN_PX = WIDTH * HEIGHT, 2 * WIDTH * HEIGHT, 12, 200
AMPLITUDE_M, OMEGA_RADPS, REST_S = 0.2, 2.5, 2.0
IMU_HZ, READINGS_A_FRAME = 200, 10
LIGHTS = [bytes(min(255, grey + k) for grey in range(256)) for k in range(5)]  # images differ, as identical ones count as a frozen camera


def message(kind, body):
    return struct.pack("=II", kind, 8 + len(body)) + body


def rig():
    """Two cameras without distortion, side by side; the body frame B is the left camera: x right, y down, z forward."""
    def camera(x_m):
        return struct.pack("=II20d", 0, 0, FOCAL_PX, FOCAL_PX, WIDTH / 2, HEIGHT / 2, 0, 0, 0, 0,
                           1, 0, 0, x_m, 0, 1, 0, 0, 0, 0, 1, 0)  # T_BC
    # Noise density and random walk of gyroscope and accelerometer; rates of IMU and images; time offset.
    return camera(0) + camera(BASELINE_M) + struct.pack("=7d", 2e-4, 2e-5, 2e-3, 3e-3, IMU_HZ, IMU_HZ / READINGS_A_FRAME, 0)


def wall():
    """Rows of blocks of random grey and width, long enough for the camera's motion."""
    blocks = range((WIDTH + 2 * MARGIN_PX) // 6)
    return [b"".join(bytes([random.randrange(256)]) * random.randrange(6, 18) for _ in blocks) for _ in range(HEIGHT // BLOCK_PX)]


def view(rows, x_m):
    at = MARGIN_PX + round(FOCAL_PX / WALL_M * x_m)
    return b"".join(row[at:at + WIDTH].translate(random.choice(LIGHTS)) * BLOCK_PX for row in rows)


def motion(t_s):
    """Position and acceleration to the right."""
    phase = OMEGA_RADPS * max(0.0, t_s - REST_S)
    return AMPLITUDE_M * (1 - math.cos(phase)), (t_s > REST_S) * AMPLITUDE_M * OMEGA_RADPS**2 * math.cos(phase)


def reading(stamp_ns, t_s):
    accel = (motion(t_s)[1], -9.81, 0)
    return struct.pack("=q6d", stamp_ns, *(random.gauss(0, 0.003) for _ in range(3)), *(random.gauss(a, 0.03) for a in accel))


def hear(connection, free, timeout_s):
    """Receives messages of the estimator: slots that are free again, or a goodbye."""
    while select.select([connection], [], [], timeout_s)[0]:
        answer, timeout_s = connection.recv(32768), 0
        kind = struct.unpack_from("=I", answer)[0] if answer else GOODBYE
        if kind == RELEASED:
            free |= {slot for slot in range(SLOTS) if struct.unpack_from("=8xQ", answer)[0] >> slot & 1}
        elif kind == GOODBYE:
            sys.exit(f"goodbye: {answer[16:].rstrip(bytes(1)).decode()}")


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[1].startswith("-"):
        asked = sys.argv[1:] in (["-h"], ["--help"])
        print("usage: socket_sender.py PATH [SECONDS]   (fbvins live --source socket:PATH waits there; 30 s)", file=sys.stdout if asked else sys.stderr)
        sys.exit(0 if asked else 2)
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        connection.connect(sys.argv[1])
    except OSError as error:
        sys.exit(f"{sys.argv[1]}: {error.strerror}; start fbvins live --source socket:{sys.argv[1]} first")
    memory = os.memfd_create("images", os.MFD_ALLOW_SEALING)
    os.ftruncate(memory, SLOTS * SLOT_BYTES)
    fcntl.fcntl(memory, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK)
    slots = mmap.mmap(memory, SLOTS * SLOT_BYTES)
    body = struct.pack("=8sHHI32s6I", b"fb-vins", 1, 0, HAS_RIG, b"synthetic rig", WIDTH, HEIGHT, SLOTS, SLOT_BYTES, IMAGE_BYTES, 0)
    socket.send_fds(connection, [message(HELLO, body + rig())], [memory])
    free, rows = set(range(SLOTS)), wall()
    hear(connection, free, None)  # the welcome
    start_ns = time.monotonic_ns()
    for k in range(int(float(sys.argv[2] if len(sys.argv) > 2 else 30) * IMU_HZ)):
        t_s = k / IMU_HZ
        stamp_ns = start_ns + k * 1_000_000_000 // IMU_HZ
        time.sleep(max(0, stamp_ns - time.monotonic_ns()) / 1e9)
        connection.send(message(IMU, struct.pack("=II", 1, 0) + reading(stamp_ns, t_s)))
        hear(connection, free, 0)
        if k % READINGS_A_FRAME == 0 and free:
            slot, x_m = free.pop(), motion(t_s)[0]
            slots[slot * SLOT_BYTES:(slot + 1) * SLOT_BYTES] = view(rows, x_m) + view(rows, x_m + BASELINE_M)
            connection.send(message(FRAME, struct.pack("=qQII", stamp_ns, k // READINGS_A_FRAME, slot, LEFT | RIGHT)))
    connection.send(message(GOODBYE, struct.pack("=II240s", 0, 0, b"end of the synthetic flight")))


if __name__ == "__main__":
    main()
