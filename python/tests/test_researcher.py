# SPDX-License-Identifier: Apache-2.0
"""What a researcher does with results and recordings in a notebook."""
import json
import pathlib
import pickle
import subprocess

import numpy as np
import pytest

import fbvins
from fbvins import bench


@pytest.fixture(scope="module")
def run(flight):
    return fbvins.run(flight, "klt", loop=True, max_images=60)


def same(a, b):
    return np.array_equal(a, b, equal_nan=np.asarray(a).dtype.kind == "f")


def test_results_pickle(run):
    again = pickle.loads(pickle.dumps(run))
    for name in ("t", "p", "q", "covariance", "health", "has_pose", "tilt_sigma_rad"):
        assert same(getattr(run, name), getattr(again, name)), name
    assert np.array_equal(again.trajectory.q, run.trajectory.q) and np.array_equal(again.map_trajectory.p, run.map_trajectory.p)
    assert again.config["frontend.kind"] == "klt" and again.config.to_yaml() == run.config.to_yaml()
    assert str(again) == str(run) and repr(again) == repr(run) and again.summary == run.summary
    assert all(same(v, again.estimator_statistics[k]) for k, v in run.estimator_statistics.items())
    assert str(fbvins.evaluate(again.ground_truth, again)) == str(fbvins.evaluate(run.ground_truth, run))
    with pytest.raises(ValueError, match="has the numbers only"):
        again.save("/nowhere")

    for odometry in (run.odometry[0], run.odometry[-1]):
        copy = pickle.loads(pickle.dumps(odometry))
        assert same(copy.T_GB, odometry.T_GB) and same(copy.covariance, odometry.covariance) and same(copy.p, odometry.p)
        assert (copy.t, copy.frame, copy.health, copy.reason, copy.level) == (odometry.t, odometry.frame, odometry.health, odometry.reason, odometry.level)
    evaluation = fbvins.evaluate(run.ground_truth, run)
    copy = pickle.loads(pickle.dumps(evaluation))
    assert str(copy) == str(evaluation) and same(copy.T_truth_estimate, evaluation.T_truth_estimate)
    assert repr(pickle.loads(pickle.dumps(evaluation.absolute_m))) == repr(evaluation.absolute_m)


def test_a_rig_pickles_to_the_last_bit(flight):
    rig = fbvins.open(flight, max_frames=1).rig
    copy = pickle.loads(pickle.dumps(rig))
    assert np.array_equal(copy.T_BC0, rig.T_BC0) and copy.left.intrinsics == rig.left.intrinsics and copy.imu_noise.rate_hz == rig.imu_noise.rate_hz


def test_results_have_parts(run):
    part = run[20:40]
    assert len(run) == 60 and len(part) == 20 and same(part.p, run.p[20:40]) and list(part.t) == list(run.t[20:40])
    assert np.array_equal(part.trajectory.t, part.t[part.has_pose]) and len(part.frontend_statistics["t"]) == 20
    assert str(part).startswith(f"20 images, {part.has_pose.sum()} of them with a pose, out of the 60 of: ") and "RMSE" not in str(part), "not the figures of the whole flight"
    assert "20 images out of" in repr(part) and np.array_equal(run[run.has_pose].p, run.trajectory.p)
    trajectory = run.trajectory
    assert np.array_equal(trajectory[::5].p, trajectory.p[::5]) and len(trajectory[trajectory.p[:, 0] > 0]) == np.sum(trajectory.p[:, 0] > 0)
    assert len(trajectory[3]) == 1 and trajectory[-1].t[0] == trajectory.t[-1]
    with pytest.raises(IndexError):
        trajectory[len(trajectory)]


def test_results_show_themselves_in_a_notebook(run):
    evaluation = fbvins.evaluate(run.ground_truth, run)
    assert "<polyline" in run._repr_html_() and "klt" in run._repr_html_()
    assert "<polyline" in run.trajectory._repr_html_()
    assert "<table>" in evaluation._repr_html_() and f"{evaluation.absolute_m.rmse:.4g}" in evaluation._repr_html_()


def test_truth_from_a_folder_and_from_evo(run, flight, tmp_path):
    expected = fbvins.evaluate(run.ground_truth, run).absolute_m.rmse
    assert fbvins.evaluate(flight, run).absolute_m.rmse == expected
    run.save(tmp_path)
    assert fbvins.evaluate(flight, tmp_path).absolute_m.rmse == pytest.approx(expected, abs=1e-8)  # files have nine digits
    assert fbvins.evaluate(tmp_path, run).absolute_m.rmse == pytest.approx(expected, abs=1e-4), "the folder's truth, not its estimate"
    with pytest.raises(ValueError, match="holds no ground truth"):
        without = tmp_path / "without"
        subprocess.run(["cp", "-r", flight, without], check=True)
        subprocess.run(["rm", "-r", without / "mav0" / "state_groundtruth_estimate0"], check=True)
        fbvins.evaluate(without, run)


def test_evos_paths_are_taken(run):
    trajectory = pytest.importorskip("evo.core.trajectory")
    expected = fbvins.evaluate(run.ground_truth, run).absolute_m.rmse
    truth = run.ground_truth
    path = trajectory.PoseTrajectory3D(truth.p, truth.q, truth.t * 1e-9)
    assert fbvins.evaluate(path, run).absolute_m.rmse == pytest.approx(expected, abs=1e-5)
    estimate = run.trajectory
    bare = trajectory.PosePath3D(estimate.p + [0, 0, 1.0], estimate.q)
    assert fbvins.evaluate(estimate, bare).absolute_m.rmse < 1e-9 and fbvins.evaluate(bare, estimate, align="none").absolute_m.rmse == pytest.approx(1)
    with pytest.raises(ValueError, match="as many poses"):
        fbvins.evaluate(truth, bare)


def test_trajectories_of_nan_or_backwards_are_refused():
    t, p, q = np.arange(3), np.zeros((3, 3)), np.tile([1.0, 0, 0, 0], (3, 1))
    assert len(fbvins.Trajectory(t.astype(np.int32), p.astype(np.float32), q[:, ::-1][:, ::-1])) == 3
    with pytest.raises(ValueError, match="row 1 is not finite"):
        fbvins.Trajectory(t, np.array([[0, 0, 0], [np.nan, 0, 0], [0, 0, 0]]), q)
    with pytest.raises(ValueError, match="row 2 has 0 ns, which is not after 1 ns"):
        fbvins.Trajectory(np.array([0, 1, 0]), p, q)


def test_info(program, flight, tmp_path):
    said = json.loads(subprocess.run([program, "info", flight, "--json"], check=True, capture_output=True, text=True).stdout)
    assert fbvins.info(flight) == said and fbvins.info(fbvins.open(flight)) == said
    bag = tmp_path / "flight.bag"
    assert fbvins.convert(flight, bag) == said["frames"] and fbvins.info(bag)["ground_truth_poses"] == said["ground_truth_poses"]
    with pytest.raises(FileNotFoundError):
        fbvins.info("/nowhere")
    with pytest.raises(OSError, match="exists already"):
        fbvins.convert(flight, bag)
    rosbags = pytest.importorskip("rosbags.rosbag1")
    bare = tmp_path / "bare.bag"  # as a driver records it: without calibration
    with rosbags.Reader(bag) as reader, rosbags.Writer(bare) as writer:
        kept = [c for c in reader.connections if c.topic.startswith(("/cam0/image", "/cam1/image", "/imu0"))]
        connections = {c.id: writer.add_connection(c.topic, c.msgtype, msgdef=c.msgdef.data, md5sum=c.digest) for c in kept}
        for connection, stamp, data in reader.messages(connections=kept):
            writer.write(connections[connection.id], stamp, data)
    survey = fbvins.info(bare)
    assert survey["left"] == "/cam0/image_raw" and "--calibration" in survey["no_calibration"] and len(survey["topics"]) == 3
    assert fbvins.info(bare, calibration=flight)["frames"] == said["frames"]


def test_doctor(flight, tmp_path):
    diagnosis = fbvins.doctor(flight)
    assert diagnosis.ok and str(diagnosis).splitlines()[-1].startswith("nothing wrong in ") and len(diagnosis.measured) > 3
    wrong = tmp_path / "wrong"
    subprocess.run(["cp", "-r", flight, wrong], check=True)
    imu = wrong / "mav0" / "imu0" / "data.csv"
    lines = imu.read_text().splitlines()
    imu.write_text("\n".join([lines[0], *(",".join([*f[:4], *(repr(float(x) / 9.81) for x in f[4:])]) for f in (line.split(",") for line in lines[1:]))]) + "\n")
    diagnosis = fbvins.doctor(wrong)
    assert not diagnosis.ok and any("g" in finding.measured for finding in diagnosis.findings) and diagnosis.findings[0].text in str(diagnosis)
    assert "<pre>" in diagnosis._repr_html_()


def test_doctor_compares_common_mistakes_as_the_command_does(program, flight, tmp_path):
    wrong = tmp_path / "wrong"
    subprocess.run(["cp", "-r", flight, wrong], check=True)
    for camera in ("cam0", "cam1"):
        file = wrong / "mav0" / camera / "sensor.yaml"
        text = file.read_text()
        start = text.index("data:", text.index("T_BS")) + len("data:")
        end = text.index("]", start) + 1
        inverse = np.linalg.inv(np.array(json.loads(text[start:end])).reshape(4, 4))
        file.write_text(text[:start] + " " + json.dumps(inverse.ravel().tolist()) + text[end:])
    diagnosis = fbvins.doctor(fbvins.open(wrong))
    assert [finding.kind for finding in diagnosis.findings] == ["extrinsics_inverted"]
    assert str(diagnosis) == subprocess.run([program, "doctor", wrong], capture_output=True, text=True).stdout.rstrip("\n")


def test_report(run, tmp_path):
    page = pathlib.Path(fbvins.report(run, tmp_path / "report.html"))
    run.save(tmp_path / "folder") if (tmp_path / "folder").mkdir() is None else None
    both = pathlib.Path(fbvins.report([run, tmp_path / "folder"], tmp_path / "both.html", title="Two of them"))
    assert "klt" in page.read_text() and "<title>Two of them</title>" in both.read_text()
    with pytest.raises((OSError, ValueError), match="summary.json"):
        fbvins.report(tmp_path)


def test_stubs_need_no_package_but_numpy():
    stubs = (pathlib.Path(fbvins.__file__).parent / "_fbvins.pyi").read_text()
    imported = {line.split()[1].split(".")[0] for line in stubs.splitlines() if line.startswith(("import ", "from "))}
    assert imported <= {"collections", "typing", "numpy", "enum", "os", "pathlib"}, imported


def test_a_scheduler_that_is_not_there_is_one_sentence(program, tmp_path, capsys, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(bench, "CONNECT_S", 1)
    matrix = tmp_path / "matrix.yaml"
    matrix.write_text("title: x\n")
    assert bench.main([str(matrix), "--out", str(tmp_path), "--program", program, "--dask", "tcp://127.0.0.1:9"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and said[0].startswith("--dask tcp://127.0.0.1:9: no scheduler answers there within 1 s"), said
