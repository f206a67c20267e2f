# SPDX-License-Identifier: Apache-2.0
"""The result of fbvins.run: the compiled one, or its numbers alone after pickling or slicing."""
from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any, Dict, Optional

import numpy

from . import _fbvins

if TYPE_CHECKING:
    from ._fbvins import Config, Odometry, Trajectory

#: One row per image.
ARRAYS = ("t", "has_pose", "p", "q", "v", "w", "gyro_bias", "accel_bias", "covariance", "velocity_covariance", "gyro_bias_covariance",
          "accel_bias_covariance", "health", "reason", "reset_counter", "tilt_sigma_rad")
TRAJECTORIES = ("trajectory", "map_trajectory", "map_adjusted", "map_causal", "map_bounded")
STATISTICS = ("frontend_statistics", "estimator_statistics")
OTHERS = ("ground_truth", "config", "summary")


class Run:
    """Result of a run: arrays with one row per image, trajectories, statistics. Rows without a pose are NaN.

    len(run) is the number of images, run[rows] a Run of some of them (a slice, a mask or numbers of rows). It can be pickled; a Run that was
    pickled or sliced has the numbers, but not the list `odometry`, and cannot be saved.
    """

    if TYPE_CHECKING:
        t: numpy.ndarray
        has_pose: numpy.ndarray
        p: numpy.ndarray
        q: numpy.ndarray
        v: numpy.ndarray
        w: numpy.ndarray
        gyro_bias: numpy.ndarray
        accel_bias: numpy.ndarray
        covariance: numpy.ndarray
        velocity_covariance: numpy.ndarray
        gyro_bias_covariance: numpy.ndarray
        accel_bias_covariance: numpy.ndarray
        health: numpy.ndarray
        reason: numpy.ndarray
        reset_counter: numpy.ndarray
        tilt_sigma_rad: numpy.ndarray
        trajectory: Trajectory
        ground_truth: Trajectory
        map_trajectory: Optional[Trajectory]
        map_adjusted: Optional[Trajectory]
        map_causal: Optional[Trajectory]
        map_bounded: Optional[Trajectory]
        frontend_statistics: Dict[str, numpy.ndarray]
        estimator_statistics: Dict[str, numpy.ndarray]
        config: Config
        summary: str

    def __init__(self, native: Optional[_fbvins.Run], values: Optional[Dict[str, Any]] = None):
        self._native = native
        self._values = dict(values or {})

    def _value(self, name: str) -> Any:
        """Arrays are made when they are asked for first."""
        if name not in self._values:
            self._values[name] = str(self._native) if name == "text" else repr(self._native) if name == "name" else getattr(self._native, name)
        return self._values[name]

    def _all(self) -> Dict[str, Any]:
        return {name: self._value(name) for name in (*ARRAYS, *TRAJECTORIES, *STATISTICS, *OTHERS, "text", "name")}

    def _whole(self) -> _fbvins.Run:
        if self._native is None:
            raise ValueError("this Run was pickled or sliced: it has the numbers only, so ask the one that fbvins.run returned")
        return self._native

    @property
    def odometry(self) -> list[Odometry]:
        """The list of Odometry."""
        return self._whole().odometry

    def save(self, folder: str) -> None:
        """Writes the files of `fbvins run --out FOLDER`, the same to the byte."""
        self._whole().save(str(folder))

    def pandas(self) -> Any:
        """A pandas.DataFrame with one row per image, indexed by t; needs pandas."""
        from ._pandas import frame_of
        return frame_of(self)

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, rows: Any) -> Run:
        values = self._all()
        which = numpy.atleast_1d(numpy.arange(len(self))[rows])
        for name in ARRAYS:
            values[name] = values[name][which]
        for name in TRAJECTORIES:
            if values[name] is not None:
                values[name] = values[name][numpy.isin(values[name].t, values["t"])]
        for name in STATISTICS:
            kept = numpy.isin(values[name]["t"], values["t"])
            values[name] = {column: numbers[kept] for column, numbers in values[name].items()}
        whole = values["text"].split("\n", 1)[0]
        values["text"] = f"{len(which)} images, {int(values['has_pose'].sum())} of them with a pose, out of the {len(self)} of: {whole}"
        values["name"] = f"<fbvins.Run of {len(which)} images out of {values['name'].strip('<>')}>"
        return Run(None, values)

    def __reduce__(self):
        return Run, (None, self._all())

    def __str__(self) -> str:
        return self._value("text")

    def __repr__(self) -> str:
        return self._value("name")

    def _repr_html_(self) -> str:
        return f"<div>{html.escape(repr(self))}{path_html(self.trajectory.p)}<pre>{html.escape(str(self))}</pre></div>"


for _name in (*ARRAYS, *TRAJECTORIES, *STATISTICS, *OTHERS):
    setattr(Run, _name, property(lambda self, name=_name: self._value(name), doc=getattr(_fbvins.Run, _name).__doc__))


def path_html(p: numpy.ndarray, side_px: int = 240) -> str:
    """The path from above, as SVG; empty for less than two poses."""
    if len(p) < 2:
        return ""
    xy = p[:: max(1, len(p) // 500), :2]
    span = max(float(numpy.ptp(xy, axis=0).max()), 1e-6)
    at = (xy - xy.min(axis=0)) / span * (side_px - 20) + 10
    points = " ".join(f"{x:.1f},{side_px - y:.1f}" for x, y in at)
    return (f'<br><svg width="{side_px}" height="{side_px + 18}"><polyline points="{points}" fill="none" stroke="#2a6fdb" stroke-width="1.5"/>'
            f'<text x="10" y="{side_px + 14}" font-size="11">from above, {span:.3g} m across</text></svg>')


def trajectory_html(trajectory: Trajectory) -> str:
    seconds = (trajectory.t[-1] - trajectory.t[0]) * 1e-9 if len(trajectory) else 0.0
    return f"<div>{html.escape(repr(trajectory))}, {seconds:.1f} s{path_html(trajectory.p)}</div>"


def evaluation_html(evaluation: _fbvins.Evaluation) -> str:
    rows = (("position [m]", evaluation.absolute_m), ("orientation [deg]", evaluation.absolute_deg), ("over a metre [m]", evaluation.per_metre_m),
            ("over a second [m]", evaluation.per_second_m))
    names = ("rmse", "median", "mean", "max", "std", "count")
    head = "".join(f"<th>{name}</th>" for name in names)
    body = "".join(f"<tr><th>{title}</th>" + "".join(f"<td>{getattr(s, name):.4g}</td>" for name in names) + "</tr>" for title, s in rows)
    return f"<table><caption>{evaluation.pairs} poses compared</caption><tr><th></th>{head}</tr>{body}</table>"


_fbvins.Trajectory._repr_html_ = trajectory_html  # type: ignore[attr-defined]
_fbvins.Evaluation._repr_html_ = evaluation_html  # type: ignore[attr-defined]
