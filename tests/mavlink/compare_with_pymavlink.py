#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares FBVINS's MAVLink frames with pymavlink's, byte by byte, on random values, also signed; decodes pymavlink's frames with
FBVINS, and FBVINS's signed ones with pymavlink, which refuses what is not signed with its key.

usage: compare_with_pymavlink.py MAVLINK_TEXT [PYTHON]    PYTHON: one that has pymavlink, when this one has not
"""
import itertools
import math
import os
import random
import struct
import subprocess
import sys

os.environ["MAVLINK20"] = "1"
try:
    from pymavlink.dialects.v20 import common
except ImportError:
    if len(sys.argv) > 2 and os.path.exists(sys.argv[2]) and sys.argv[2] != sys.executable:
        os.execv(sys.argv[2], [sys.argv[2], *sys.argv[:2]])
    print("SKIPPED: pymavlink is not installed; `./dev test` puts it into build/venv")
    sys.exit(77)

MESSAGES = [common.MAVLink_heartbeat_message, common.MAVLink_timesync_message, common.MAVLink_odometry_message,
            common.MAVLink_vision_position_estimate_message, common.MAVLink_vision_speed_estimate_message,
            common.MAVLink_statustext_message, common.MAVLink_set_position_target_local_ned_message, common.MAVLink_command_long_message,
            common.MAVLink_command_ack_message, common.MAVLink_extended_sys_state_message, common.MAVLink_hil_sensor_message,
            common.MAVLink_hil_actuator_controls_message, common.MAVLink_highres_imu_message, common.MAVLink_scaled_imu_message,
            common.MAVLink_local_position_ned_message, common.MAVLink_attitude_quaternion_message,
            common.MAVLink_set_gps_global_origin_message, common.MAVLink_gps_global_origin_message,
            common.MAVLink_param_request_read_message, common.MAVLink_param_value_message]
RANGES = {"int8_t": (-2**7, 2**7 - 1), "int16_t": (-2**15, 2**15 - 1), "uint8_t": (0, 2**8 - 1), "uint16_t": (0, 2**16 - 1), "uint32_t": (0, 2**32 - 1),
          "int32_t": (-2**31, 2**31 - 1), "int64_t": (-2**63, 2**63 - 1), "uint64_t": (0, 2**64 - 1)}


def random_number(rng, kind):
    if rng.random() < 0.3:  # zeros at the end are left out of a frame
        return 0
    if kind != "float":
        return rng.randint(*RANGES[kind])
    number = rng.choice([rng.gauss(0, 1), rng.gauss(0, 1e6), rng.gauss(0, 1e-12), math.nan, math.inf])
    return struct.unpack("<f", struct.pack("<f", number))[0]


def random_value(rng, kind, count):
    if kind == "char":
        return bytes(rng.randint(32, 126) for _ in range(rng.randint(0, count)))
    return random_number(rng, kind) if count == 0 else [random_number(rng, kind) for _ in range(count)]


def random_message(rng, kind):
    types = dict(zip(kind.fieldnames, kind.fieldtypes))
    counts = dict(zip(kind.ordered_fieldnames, kind.array_lengths))
    return kind(*(random_value(rng, types[name], counts[name]) for name in kind.fieldnames))


def flat(message):
    """The values in the order of the wire, as text."""
    for name, count in zip(message.ordered_fieldnames, message.array_lengths):
        is_text = name in ("text", "param_id")
        value = getattr(message, f"_{name}_raw" if is_text else name)
        if is_text:
            value = list(value.ljust(count, b"\0"))
        for number in value if isinstance(value, list) else [value]:
            yield f"{number:.9g}" if isinstance(number, float) else str(number)


def pymavlink_takes(frame, key):
    """Whether pymavlink takes a frame where it wants frames that are signed with the key."""
    reader = common.MAVLink(None)
    reader.signing.secret_key, reader.robust_parsing = key, True
    reader.signing.sign_outgoing = True
    return [message for message in reader.parse_buffer(frame) or [] if message.get_type() != "BAD_DATA"] != []


def signed(program):
    """Signed frames of both sides."""
    rng, key, time = random.Random(20), bytes(range(7, 39)), 40_000_000_000_000
    lines, frames = [f"key {key.hex()} {time}"], []
    for k, kind in enumerate(MESSAGES * 20):
        message, link = random_message(rng, kind), common.MAVLink(None, srcSystem=1, srcComponent=197)
        link.seq, link.signing.secret_key, link.signing.sign_outgoing, link.signing.timestamp = k % 256, key, True, time + k
        frames.append(bytes(message.pack(link)))
        lines += [f"encode {kind.id} 1 197 {k % 256} {' '.join(flat(message))}", f"decode {frames[-1].hex()}", f"decode {frames[-1].hex()}"]
    done = subprocess.run([program], input="\n".join(lines) + "\n", stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode == 77:
        print(f"no signed frames: {done.stdout.strip()}")
        return 0
    answer, failures = iter(done.stdout.split("\n")[1:]), 0
    for frame in frames:
        ours = bytes.fromhex(next(answer))
        once, again = (list(itertools.takewhile(lambda line: line != ".", answer)) for _ in range(2))
        wrong_key = bytes(reversed(key))
        good = ours == frame and len(once) == 1 and not again and pymavlink_takes(ours, key) and not pymavlink_takes(ours, wrong_key)
        failures += not good
    print(f"{len(frames)} signed frames: {failures} differ from pymavlink's or are not taken as they should")
    return failures


def main():
    rng, messages, lines = random.Random(19), [], []
    for kind, _ in itertools.product(MESSAGES, range(300)):
        message = random_message(rng, kind)
        link = common.MAVLink(None, srcSystem=rng.randint(0, 255), srcComponent=rng.randint(0, 255))
        link.seq = rng.randint(0, 255)
        head = f"{kind.id} {link.srcSystem} {link.srcComponent} {link.seq}"
        messages.append((kind.msgname, f"{head} {' '.join(flat(message))}", message.pack(link).hex()))
        lines += [f"encode {messages[-1][1]}", f"decode {messages[-1][2]}"]
    answers = subprocess.run([sys.argv[1]], input="\n".join(lines) + "\n", check=True, stdout=subprocess.PIPE, text=True).stdout.split("\n")
    failures, answer = 0, iter(answers)
    for name, text, frame in messages:
        ours = next(answer)
        read = list(itertools.takewhile(lambda line: line != ".", answer))
        if ours != frame or read != [text]:
            failures += 1
            print(f"DIFFERENT {name} {text}\n  pymavlink {frame}\n  fbvins    {ours}\n  read      {read}")
    print(f"{len(messages)} frames of {len(MESSAGES)} messages: {failures} differ from pymavlink's")
    failures += signed(sys.argv[1])
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
