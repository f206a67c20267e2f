# SPDX-License-Identifier: Apache-2.0
"""The command `fbvins` of an installed package: the program that lies in it."""
import os
import pathlib
import sys

PROGRAM = pathlib.Path(__file__).resolve().parent / "programs" / "fbvins"


def main():
    """Becomes the program, so that signals and exit codes are its own."""
    os.environ.setdefault("FBVINS_PYTHON", sys.executable)  # by which it reads devices: what pip installs beside this package is found
    try:
        os.execv(PROGRAM, [str(PROGRAM), *sys.argv[1:]])
    except OSError as error:
        sys.exit(f"{PROGRAM}: {error.strerror}; install the package again")
