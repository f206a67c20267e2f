#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`fbvins px4 check` reads the parameters of a real PX4: with those of `fbvins px4 params` all is right, and what is spoilt is
named. FBVINS_PX4 names the program (bin/px4 of a px4_sitl build).

usage: px4_check.py FBVINS [PYTHON]    PYTHON: one that has pymavlink, when this one has not
"""
import json
import os
import subprocess
import sys
import tempfile

from other_python import needs

needs(["pymavlink"], at=2)
from px4_simulator import Px4  # noqa: E402

STEP_US = 5000
STANDING_S = 5  # of PX4's time, until its modules run
SPOILT = {"EKF2_EV_CTRL": 0, "EKF2_HGT_REF": 1, "SYS_HAS_MAG": 1, "EKF2_EV_QMIN": 0}


def advised(program):
    """The parameters of `fbvins px4 params`, by name."""
    done = subprocess.run([program, "px4", "params"], capture_output=True, text=True, check=True)
    return {fields[2]: fields[3] for fields in (line.split("\t") for line in done.stdout.splitlines()) if len(fields) == 5}


def checked(program, binary, parameters):
    """The exit code of a check of a PX4 with these parameters, and what it says."""
    with tempfile.TemporaryDirectory() as folder:
        px4 = Px4(binary, folder, parameters)
        try:
            t_us, check = 1_000_000, None
            while check is None or check.poll() is None:
                px4.step(t_us, (0, 0, -9.81), (0, 0, 0))
                t_us += STEP_US
                if check is None and t_us > STANDING_S * 1_000_000:
                    check = subprocess.Popen([program, "px4", "check", f"udp:127.0.0.1:{14580 + px4.instance}", "--json"], stdout=subprocess.PIPE,
                                             stderr=subprocess.PIPE, text=True)
            out, err = check.communicate()
        finally:
            px4.close()
    assert out, err
    return check.returncode, json.loads(out)


def main(program):
    binary = os.environ.get("FBVINS_PX4", "")
    if not binary:
        print("SKIPPED: FBVINS_PX4 names no PX4 (bin/px4 of a px4_sitl build)")
        return 77
    right = advised(program)
    code, said = checked(program, binary, right)
    print(f"as advised: {said['read']} parameters read; {said['findings']}")
    assert code == 0 and said["read"] >= len(right), said
    assert not any(finding["wrong"] for finding in said["findings"]), said
    code, said = checked(program, binary, {**right, **SPOILT})
    wrong = {finding["name"] for finding in said["findings"] if finding["wrong"]}
    for finding in said["findings"]:
        print("spoilt:", finding["sentence"])
    assert code == 1 and wrong == set(SPOILT), (code, wrong)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
