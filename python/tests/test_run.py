# SPDX-License-Identifier: Apache-2.0
import json
import subprocess

import numpy as np
import pytest

import fbvins

SAME = ["trajectory_tum.txt", "trajectory.csv", "covariance.csv", "gauge.csv", "statistics.csv", "config.yaml", "ground_truth.csv"]
OF_THE_MAP = ["map_trajectory_tum.txt", "map_causal_tum.txt", "map_bounded_tum.txt", "map_updates.csv"]


def fly_both(program, recording, folder, frontend, loop=False, **arguments):
    most = arguments.get("max_images", 0)
    command = [program, "run", str(recording), "--frontend", frontend, "--out", str(folder / "program"), "--quiet", "--max-images", str(most)]
    subprocess.run(command + (["--loop"] if loop else []), check=True)
    run = fbvins.run(recording, frontend=frontend, loop=loop, **arguments)
    run.save(str(folder / "python"))
    return run


def differing(folder, names):
    return [n for n in names if (folder / "program" / n).read_bytes() != (folder / "python" / n).read_bytes()]


@pytest.mark.parametrize("frontend", ["klt", "orb", "boost"])
def test_the_same_bytes_as_the_program(program, flight, tmp_path, frontend):
    run = fly_both(program, flight, tmp_path, frontend, loop=frontend == "orb", threaded=frontend == "klt")
    assert differing(tmp_path, SAME + (OF_THE_MAP if frontend == "orb" else [])) == []
    said, own = (json.loads((tmp_path / who / "summary.json").read_text())["result"] for who in ("program", "python"))
    assert said == own
    assert len(run.trajectory) > 50


def test_the_same_bytes_on_a_real_flight(program, real_flight, tmp_path):
    fly_both(program, real_flight, tmp_path, "orb", loop=True, max_images=150)
    assert differing(tmp_path, SAME + OF_THE_MAP) == []


@pytest.fixture(scope="module")
def run(flight):
    return fbvins.run(flight, "orb", loop=True)


def test_arrays_have_a_row_an_image(run):
    n = len(run.t)
    assert n == 120 and run.t.dtype == np.int64 and np.all(np.diff(run.t) > 0)
    shapes = {"p": (n, 3), "q": (n, 4), "v": (n, 3), "w": (n, 3), "gyro_bias": (n, 3), "accel_bias": (n, 3), "covariance": (n, 6, 6),
              "velocity_covariance": (n, 3, 3), "health": (n,), "reason": (n,), "reset_counter": (n,), "has_pose": (n,)}
    assert {name: getattr(run, name).shape for name in shapes} == shapes
    good = run.has_pose
    assert good.dtype == bool and set(run.health[good]) <= {"good", "degraded"}
    assert np.allclose(np.linalg.norm(run.q[good], axis=1), 1, atol=1e-12)
    assert np.all(np.linalg.eigvalsh(run.covariance[good]) > 0)
    assert np.array_equal(run.trajectory.p, run.p[good]) and np.array_equal(run.trajectory.t, run.t[good])
    assert len(run.odometry) == n and np.array_equal(run.odometry[-1].p, run.p[-1])


def test_what_has_no_pose_is_nan(run):
    without = ~run.has_pose
    assert without.any() and run.has_pose.any()
    for name in ("p", "q", "v", "w", "gyro_bias", "accel_bias", "covariance", "velocity_covariance", "gyro_bias_covariance", "accel_bias_covariance",
                 "tilt_sigma_rad"):
        values = getattr(run, name)
        assert np.isnan(values[without]).all() and np.isfinite(values[run.has_pose]).all(), name
    first = run.odometry[0]
    assert not first.has_pose and np.isnan(first.p).all() and np.isnan(first.T_WB).all() and np.isnan(first.covariance).all()


def test_poses_are_near_the_truth_in_every_frame_asked_for(run):
    for estimate in (run, run.map_trajectory, run.map_causal):
        e = fbvins.evaluate(run.ground_truth, estimate)
        assert e.pairs > 50 and e.absolute_m.rmse < 0.1
    assert "RMSE" in str(fbvins.evaluate(run.ground_truth, run))
    speed = np.linalg.norm(run.v[run.has_pose], axis=1)
    moved = np.linalg.norm(np.diff(run.trajectory.p, axis=0), axis=1) / (np.diff(run.trajectory.t) * 1e-9)
    assert abs(np.median(speed[1:] - moved)) < 0.02


def test_statistics_are_columns(run):
    f, e = run.frontend_statistics, run.estimator_statistics
    assert np.array_equal(f["t"], run.t) and f["tracked"].max() > 50
    assert e["keyframe"].sum() > 3 and set(np.unique(e["keyframe"])) <= {0, 1}
    assert all(len(c) == len(f["t"]) for c in f.values())


def test_pandas(run):
    pytest.importorskip("pandas")
    table = run.pandas()
    assert list(table.index) == list(run.t)
    assert np.array_equal(table["p_x"], run.p[:, 0], equal_nan=True) and "landmarks" in table and "sigma_theta_z" in table


def test_progress_and_interruption(flight):
    seen = []
    fbvins.run(flight, "klt", max_images=40, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(16, 40), (32, 40), (40, 40)]

    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fbvins.run(flight, "klt", max_images=40, progress=stop)


def test_wrong_arguments_are_refused_with_a_message(flight, tmp_path):
    with pytest.raises(FileNotFoundError, match="nowhere"):
        fbvins.run("/nowhere")
    with pytest.raises(ValueError, match="frontend.kind"):
        fbvins.run(flight, frontend="sift")
    with pytest.raises(ValueError, match="max_features"):
        fbvins.run(flight, options={"frontend": {"orb": {"max_feature": 3}}})
    with pytest.raises(OSError):
        fbvins.run(flight, save_map=tmp_path / "no" / "folder.fbm")


def test_options_reach_the_estimator(flight):
    config = fbvins.config(options={"estimator": {"max_iterations": 3}, "frontend.kind": "orb", "frontend.orb.recognition.enabled": False})
    assert config["estimator.max_iterations"] == 3 and config["frontend.orb.recognition.enabled"] is False
    assert "max_iterations: 3" in config.to_yaml() and "frontend.kind" in config.keys()
    with pytest.raises(KeyError, match="max_iterations"):
        config["estimator.max_iteration"]
    run = fbvins.run(flight, config=config, max_images=60)
    assert run.estimator_statistics["iterations"][-10:].max() <= 3  # the start solves more
    assert run.config["frontend.kind"] == "orb"
