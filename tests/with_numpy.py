# SPDX-License-Identifier: Apache-2.0
"""For scripts that need numpy: `import with_numpy`, then `import numpy`. A Python without it hands the script to the one that is its
argument; without one it is skipped."""
import os
import sys

try:
    import numpy  # noqa: F401
except ImportError:
    if len(sys.argv) > 1 and os.path.exists(sys.argv[1]) and sys.argv[1] != sys.executable:
        os.execv(sys.argv[1], [sys.argv[1], sys.argv[0]])
    print("SKIPPED: numpy is not installed; `./dev test` puts it into build/venv")
    sys.exit(77)
