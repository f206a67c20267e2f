# SPDX-License-Identifier: Apache-2.0
"""FB-VINS: stereo visual-inertial odometry for drones.

    import fbvins
    run = fbvins.run("MH_01_easy", frontend="orb", loop=True)
    print(fbvins.evaluate(run.ground_truth, run))

Frames: W is the odometry frame (gravity-aligned, z up), M the map frame, G the gauge frame, in which the estimator computes, B the body frame,
which is the IMU's, C0 and C1 the left and right camera (z forward, x right, y down). T_WB takes body coordinates to world. Quaternions are Hamilton, w first. SI units and radians; time
is int64 nanoseconds of the sensors' clock. Covariances of poses are of (dp in W [m], dtheta in B [rad]).
"""
from __future__ import annotations

import functools
import json
import os
import tempfile
from typing import TYPE_CHECKING, Any, Callable, Dict, Iterable, Mapping, Optional, Tuple, Union

import numpy

from . import _fbvins
from ._fbvins import (Camera, Config, DepthSensor, ErrorStatistics, Evaluation, Features, ImuNoise, ImuSample, MapContents, MapUpdate, Odometry,
                      PressureSample, RangeSample, Recording, Rig,
                      SensorPacket, StatePrior, StereoFrame, Trajectory, VelocitySample, __version__, orb, register_frontend, simulation_presets)
from ._fbvins import Booster
from . import calibration
from ._run import Run
from ._tools import Diagnosis, Finding

if TYPE_CHECKING:
    PathLike = Union[str, "os.PathLike[str]"]
    AnyConfig = Union[Config, Mapping, PathLike, None]
    AnyTrajectory = Union[Trajectory, Run, PathLike, Tuple["numpy.ndarray", "numpy.ndarray", "numpy.ndarray"]]

__all__ = ["Booster", "Camera", "Config", "DepthSensor", "Diagnosis", "ErrorStatistics", "Finding", "Evaluation", "Features", "ImuNoise", "ImuSample", "Map", "MapContents",
           "MapUpdate", "Odometry", "PressureSample", "RangeSample", "Recording", "Rig", "Run",
           "SensorPacket", "StatePrior", "StereoFrame", "System", "Trajectory", "VelocitySample", "__version__", "boost",
           "calibration", "config", "convert", "doctor", "evaluate", "info", "load_map", "open", "orb", "register_frontend", "report", "run", "simulate", "simulation_presets"]


def __dir__() -> Iterable[str]:
    return sorted(__all__)


def _assignments(options: Mapping, prefix: str = "") -> Iterable[str]:
    for name, value in options.items():
        if isinstance(value, Mapping):
            yield from _assignments(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}={str(value).lower() if isinstance(value, bool) else value}"


def config(file: Optional[PathLike] = None, options: Optional[Mapping] = None) -> Config:
    """The options of odometry, map and live sensors: the defaults, changed by a YAML file (or by the options of a flight record), then
    by `options`, such as {"frontend.kind": "orb"} or {"frontend": {"kind": "orb"}}. ValueError for an unknown option."""
    return Config(os.fspath(file) if file is not None else "", list(_assignments(options or {})))


_configured = config  # under a name that no parameter hides


def _as_config(value: AnyConfig) -> Config:
    if isinstance(value, Config):
        return value
    if isinstance(value, Mapping):
        return _configured(options=value)
    return _configured(value)


def _path(value: Optional[PathLike]) -> str:
    return "" if value is None else os.fspath(value)


def _openable(opened_by: Callable[..., Recording], *arguments: Any) -> Recording:
    """A recording that doctor() can open again."""
    again = functools.partial(opened_by, *arguments)
    recording = again()
    recording._again = again
    return recording


def open(path: PathLike, *, calibration: Optional[PathLike] = None, imu_calibration: Optional[PathLike] = None,  # noqa: A001
         skip_frames: int = 0, max_frames: int = 0, topics: Tuple[str, ...] = (), start_s: float = 0.0,
         duration_s: float = 0.0) -> Recording:
    """A recording: a EuRoC or TUM-VI folder, an EuRoC zip, a flight record, a ROS 1 or ROS 2 bag, an MCAP file of ROS messages.
    `calibration` is a file of any format that fbvins.calibration.load() knows, instead of the recording's own. `topics` of a bag, where they are
    not found automatically: those of the cameras in their order, of the IMU and of depth images. max_frames 0: all. start_s, duration_s: only events stamped from start_s
    seconds after the first stereo frame on, for duration_s seconds (0: to the end)."""
    return _openable(_fbvins.open, os.fspath(path), _path(calibration), _path(imu_calibration), skip_frames, max_frames, start_s, duration_s, list(topics))


def simulate(preset: str = "normal", seed: int = 1, seconds: float = 0) -> Recording:
    """A synthetic flight with exact ground truth, rendered image by image while it is iterated: the same events on every machine.
    `seconds` 0: the preset's length. simulation_presets() lists the presets."""
    return _openable(_fbvins.simulate, preset, seed, seconds)


def run(recording: Union[Recording, PathLike], frontend: Optional[str] = None, loop: bool = False, *, config: AnyConfig = None,
        options: Optional[Mapping] = None, threaded: bool = False, final_ba: bool = False, boosted_map: bool = False,
        load_map: Optional[PathLike] = None, save_map: Optional[PathLike] = None, vocabulary: Optional[PathLike] = None,
        imu_state: Optional[PathLike] = None, calibration: Optional[PathLike] = None, imu_calibration: Optional[PathLike] = None,
        positions: Optional[PathLike] = None, tags: Optional[PathLike] = None, max_images: int = 0,
        progress: Optional[Callable[[int, int], object]] = None) -> Run:
    """Estimates a whole recording, as `fbvins run` does: the same results to the byte.

    recording: a path, or a Recording that has not been iterated yet.  frontend: "klt", "orb" or "boost"; None: as configured.
    loop: loop closure with a map; load_map, save_map, final_ba, boosted_map, positions, tags imply it.  positions, tags: files of anchors
    (docs/maps.md), by which the map comes into the frame of a building.  config: a Config, a file or a dict of options;
    `options` override it.  imu_state: file that carries the IMU's biases and time offset from flight to flight.  progress(done, all) is called every 16 images.
    """
    if isinstance(recording, Recording):
        if calibration or imu_calibration or max_images:
            raise ValueError("calibration and max_images belong to open() where a Recording is given")
    else:
        recording = open(recording, calibration=calibration, imu_calibration=imu_calibration, max_frames=max_images)
    changed = dict(options or {})
    if frontend is not None:
        changed["frontend.kind"] = frontend
    if isinstance(config, Config):
        if changed:
            raise ValueError("give options and frontend to config() where a Config is given")
        effective = config
    elif isinstance(config, Mapping):
        effective = _configured(options={**config, **changed})
    else:
        effective = _configured(config, changed)
    return Run(_fbvins.run(recording, effective, threaded, loop, final_ba, boosted_map, _path(load_map), _path(save_map), _path(vocabulary),
                           _path(imu_state), _path(positions), _path(tags), progress))


def _opened(recording: Union[Recording, PathLike], calibration: Optional[PathLike], imu_calibration: Optional[PathLike],
            topics: Tuple[str, ...]) -> Recording:
    if not isinstance(recording, Recording):
        return open(recording, calibration=calibration, imu_calibration=imu_calibration, topics=topics)
    if calibration or imu_calibration or topics:
        raise ValueError("calibration and topics belong to open() where a Recording is given")
    return recording


def info(recording: Union[Recording, PathLike], *, calibration: Optional[PathLike] = None, imu_calibration: Optional[PathLike] = None,
         topics: Tuple[str, ...] = ()) -> Dict[str, Any]:
    """What is in a recording, as `fbvins info --json` says it: rates, gaps, calibration, stamps, warnings. Of a bag that lacks a calibration, or
    whose topics must be chosen: its topics with rates, and what is missing ("question", "unreadable", "no_calibration")."""
    try:
        return json.loads(_fbvins.info(_opened(recording, calibration, imu_calibration, topics)))
    except (ValueError, OSError):
        if isinstance(recording, Recording):
            raise
        survey = _fbvins.survey(os.fspath(recording), _path(calibration)) if not topics else ""
        if not survey:
            raise
    return json.loads(survey)


def doctor(recording: Union[Recording, PathLike], *, calibration: Optional[PathLike] = None, imu_calibration: Optional[PathLike] = None,
           topics: Tuple[str, ...] = ()) -> Diagnosis:
    """What is wrong with a setup, from its recording (a path, or a Recording that has not been iterated): units, axes, clocks, calibration, images,
    common mistakes, as `fbvins doctor` finds it."""
    opened = _opened(recording, calibration, imu_calibration, topics)
    found = _fbvins.doctor(opened, opened._again, calibration is not None)
    return Diagnosis([Finding(**finding) for finding in found["findings"]], found["measured"], found["not_judged"], found["text"], found["rig"])


def convert(recording: Union[Recording, PathLike], out: PathLike, *, calibration: Optional[PathLike] = None,
            imu_calibration: Optional[PathLike] = None, topics: Tuple[str, ...] = ()) -> int:
    """Writes a recording as ROS 1 bag (FILE.bag), flight record (FILE.mcap) or EuRoC folder (any other name), with calibration and truth. Returns the
    number of stereo frames. The output must not exist."""
    record = "" if calibration or isinstance(recording, Recording) else os.fspath(recording)
    return _fbvins.convert(_opened(recording, calibration, imu_calibration, topics), record, os.fspath(out))


def report(runs: Union[Run, PathLike, Iterable[Union[Run, PathLike]]], out: PathLike = "report.html", *, truth: Optional[PathLike] = None,
           title: Optional[str] = None) -> str:
    """Writes runs (Run, or folders that `fbvins run` or Run.save() wrote) as one HTML page. truth: a recording or trajectory file with the truth of
    all of them, where they have none. Returns the page's path."""
    if isinstance(runs, (Run, str, os.PathLike)):
        runs = [runs]
    with tempfile.TemporaryDirectory() as scratch:
        folders = []
        for number, run in enumerate(runs):
            if isinstance(run, Run):
                about = json.loads(run.summary)["result"]
                folder = os.path.join(scratch, str(number), f"{about['dataset']}-{about['frontend']}".replace(os.sep, "_"))
                os.makedirs(folder)
                run.save(folder)
                folders.append(folder)
            else:
                folders.append(os.fspath(run))
        _fbvins.report(folders, os.fspath(out), _path(truth), title or "")
    return os.fspath(out)


class Map(_fbvins.Map):
    __doc__ = _fbvins.Map.__doc__

    def __init__(self, rig: Rig, file: Optional[PathLike] = None, *, vocabulary: Optional[PathLike] = None, boosted: bool = False,
                 config: AnyConfig = None):
        """file: a map to relocalise in and to extend; None: a new one, whose M starts equal to W."""
        super().__init__(rig, _path(file), _path(vocabulary), boosted, _as_config(config))


def load_map(path: PathLike) -> MapContents:
    """Contents of a map file that `fbvins run --save-map` or Map.save() wrote."""
    return _fbvins.load_map(os.fspath(path))


class System(_fbvins.System):
    __doc__ = _fbvins.System.__doc__

    def __init__(self, config: AnyConfig, rig: Rig, *, threaded: bool = False, map: Optional[Map] = None,  # noqa: A002
                 on_odometry: Optional[Callable[[Odometry], object]] = None,
                 on_map_update: Optional[Callable[[MapUpdate], object]] = None, imu_state: Optional[PathLike] = None):
        """config: a Config, a file, a dict of options or None for the defaults. Without callbacks results wait for poll()."""
        super().__init__(_as_config(config), rig, threaded, map, on_odometry, on_map_update, _path(imu_state))


def _of_file(path: str) -> Trajectory:
    """A trajectory file; the estimate of a folder of `fbvins run`; the truth of a recording."""
    if os.path.isfile(os.path.join(path, "trajectory_tum.txt")):
        return Trajectory.read(os.path.join(path, "trajectory_tum.txt"))
    if not (os.path.isdir(path) or path.endswith((".zip", ".mcap", ".bag"))):
        return Trajectory.read(path)
    truth = open(path).ground_truth
    if not len(truth):
        raise ValueError(f"{path}: the recording holds no ground truth")
    return truth


def _as_truth(value: AnyTrajectory) -> AnyTrajectory:
    """Of a folder of `fbvins run` that has a truth that one, of anything else itself."""
    file = os.path.join(os.fspath(value), "ground_truth.csv") if isinstance(value, (str, os.PathLike)) else ""
    return file if file and os.path.isfile(file) else value


def _as_trajectory(value: AnyTrajectory, stamps: Optional[numpy.ndarray] = None) -> Trajectory:
    if isinstance(value, Trajectory):
        return value
    if isinstance(value, Run):
        return value.trajectory
    if isinstance(value, (str, os.PathLike)):
        return _of_file(os.fspath(value))
    if isinstance(value, tuple) and len(value) == 3:
        return Trajectory(*value)
    if hasattr(value, "positions_xyz") and hasattr(value, "orientations_quat_wxyz"):  # evo's PosePath3D and PoseTrajectory3D
        return Trajectory(_stamps_of(value, stamps), numpy.asarray(value.positions_xyz, float), numpy.asarray(value.orientations_quat_wxyz, float))
    raise ValueError(f"a Trajectory, a Run, a file, a folder, arrays (t, p, q) or evo's path are expected, not {type(value).__name__}")


def _stamps_of(path: Any, others: Optional[numpy.ndarray]) -> numpy.ndarray:
    """ns. A path without stamps has those of the other one, pose by pose."""
    if hasattr(path, "timestamps"):
        return numpy.round(numpy.asarray(path.timestamps, float) * 1e9).astype(numpy.int64)
    if others is None or len(others) != len(path.positions_xyz):
        raise ValueError("a path without timestamps can be compared only with a trajectory of as many poses")
    return others


def evaluate(truth: AnyTrajectory, estimate: AnyTrajectory, align: str = "se3", *, max_difference_s: float = 0.01,
             interpolate: bool = False) -> Evaluation:
    """Absolute and relative errors of an estimate, as `fbvins eval` has them; they agree with evo.

    Both: a Trajectory, a Run, a TUM or EuRoC file, a recording (its truth), a folder of `fbvins run` (as truth: that in it, where there is one), evo's PoseTrajectory3D or PosePath3D, or arrays
    (t, p, q): int64 (N,) ns, float64 (N, 3) m, float64 (N, 4) w first.
    align: "se3", "yaw", "sim3" or "none". interpolate: the truth interpolated at the estimate's stamps instead of its nearest pose.
    """
    truth = _as_truth(truth)
    without_stamps = [hasattr(x, "positions_xyz") and not hasattr(x, "timestamps") for x in (truth, estimate)]
    if without_stamps[0]:
        compared = None if without_stamps[1] else _as_trajectory(estimate)
        return evaluate(_as_trajectory(truth, None if compared is None else compared.t), compared, align, max_difference_s=max_difference_s,
                        interpolate=interpolate)
    true = _as_trajectory(truth)
    return _fbvins.evaluate(true, _as_trajectory(estimate, true.t), align, max_difference_s, interpolate)


@functools.lru_cache(maxsize=8)
def _booster(weights: str) -> Booster:
    return Booster(weights)


def boost(descriptors: Union[Features, numpy.ndarray], keypoints: Optional[numpy.ndarray] = None,
          size: Optional[Tuple[int, int]] = None, *, weights: str = "boost-s") -> numpy.ndarray:
    """Descriptors of one image improved by the learned booster (paper 2.2.2): uint8 (N, 32), compared by Hamming distance with
    boosted ones only.

    boost(orb(image)), or its parts: descriptors, the int8 (N, 512) margins of Features (uint8 (N, 32) for weights trained on bits),
    keypoints, float64 (N, 6) as in Features, and size, (width, height) of the image. Pass all features of an image together:
    the result of each depends on all of them.
    """
    network = _booster(weights)
    if isinstance(descriptors, Features):
        keypoints, size = descriptors.keypoints, descriptors.size
        descriptors = descriptors.margins if network.takes_margins else descriptors.descriptors
    if keypoints is None or size is None:
        raise ValueError("keypoints and size are needed where descriptors are an array")
    return network(descriptors, keypoints, *size)
