# SPDX-License-Identifier: Apache-2.0
"""Functions that pickles name: pickle finds Python's functions, not compiled ones."""
from . import _fbvins


def trajectory(state):
    return _fbvins._restore_trajectory(state)


def rig(yaml):
    return _fbvins._restore_rig(yaml)


def config(yaml):
    return _fbvins._restore_config(yaml)
