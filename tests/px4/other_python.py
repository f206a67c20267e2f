# SPDX-License-Identifier: Apache-2.0
"""A Python that has the modules a script needs: this one, or the one that a caller names."""
import importlib
import os
import sys


def needs(modules, at):
    """Imports them. Where one is missing, the script starts again with the Python of argument `at`, or is skipped."""
    os.environ["MAVLINK20"] = "1"  # before pymavlink is imported
    try:
        for module in modules:
            importlib.import_module(module)
    except ImportError as missing:
        if len(sys.argv) > at and os.path.exists(sys.argv[at]) and sys.argv[at] != sys.executable:
            os.execv(sys.argv[at], [sys.argv[at], *sys.argv[:at]])
        print(f"SKIPPED: {missing.name} is not installed; `./dev test` puts it into build/venv")
        sys.exit(77)
