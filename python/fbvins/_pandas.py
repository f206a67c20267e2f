# SPDX-License-Identifier: Apache-2.0
"""A Run as a pandas.DataFrame."""
import numpy


def frame_of(run):
    try:
        import pandas
    except ImportError as missing:
        raise ImportError("Run.pandas() needs pandas: pip install pandas") from missing
    columns = {"has_pose": run.has_pose, "health": run.health, "reason": run.reason, "reset_counter": run.reset_counter}
    for name, axes in {"p": "xyz", "q": "wxyz", "v": "xyz", "w": "xyz", "gyro_bias": "xyz", "accel_bias": "xyz"}.items():
        for values, axis in zip(getattr(run, name).T, axes):
            columns[f"{name}_{axis}"] = values
    deviations = numpy.sqrt(numpy.diagonal(run.covariance, axis1=1, axis2=2)).T
    for values, name in zip(deviations, ["p_x", "p_y", "p_z", "theta_x", "theta_y", "theta_z"]):
        columns[f"sigma_{name}"] = values
    columns["tilt_sigma"] = run.tilt_sigma_rad
    table = pandas.DataFrame(columns, index=pandas.Index(run.t, name="t"))
    for statistics in (run.frontend_statistics, run.estimator_statistics):
        extra = pandas.DataFrame(statistics).set_index("t")
        table = table.join(extra[~extra.index.duplicated()])
    return table
