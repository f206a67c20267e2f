# SPDX-License-Identifier: Apache-2.0
"""Simulation, evaluation, features and booster, each by itself."""
import json
import pathlib
import subprocess

import numpy as np
import pytest

import fbvins


def test_a_simulation_is_an_iterator_of_the_same_bytes(program, flight):
    simulated, read = fbvins.simulate("fast", seed=3, seconds=6), fbvins.open(flight)
    assert len(simulated) == len(read) == 120 and "fast" in fbvins.simulation_presets()
    for count, (a, b) in enumerate(zip(simulated, read)):
        assert type(a) is type(b)
        if isinstance(a, fbvins.StereoFrame):
            assert a.t == b.t and np.array_equal(a.left, b.left) and np.array_equal(a.right, b.right)
        if count > 200:
            break
    assert not a.left.flags.writeable if isinstance(a, fbvins.StereoFrame) else True
    assert len(simulated.ground_truth) > 1000
    with pytest.raises(ValueError, match="no preset"):
        fbvins.simulate("foggy")


def line(n=60):
    t = np.arange(n) * 50_000_000
    p = np.column_stack([np.linspace(0, 6, n), np.sin(np.linspace(0, 6, n)), np.zeros(n)])
    q = np.tile([1.0, 0, 0, 0], (n, 1))
    return t, p, q


def test_evaluation_of_arrays_files_and_trajectories(tmp_path, program):
    t, p, q = line()
    turned = p @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]).T + [1, 2, 3]
    assert fbvins.evaluate((t, p, q), (t, turned, q)).absolute_m.rmse < 1e-12
    noisy = p + 0.01 * np.random.default_rng(1).standard_normal(p.shape)
    truth, estimate = fbvins.Trajectory(t, p, q), fbvins.Trajectory(t, noisy, q)
    truth.write(str(tmp_path / "truth.txt")), estimate.write(str(tmp_path / "estimate.txt"))
    e = fbvins.evaluate(tmp_path / "truth.txt", tmp_path / "estimate.txt", align="none")
    assert e.absolute_m.rmse == pytest.approx(np.sqrt(np.mean(np.sum((p - noisy) ** 2, axis=1))), rel=1e-6)
    said = subprocess.run([program, "eval", tmp_path / "truth.txt", tmp_path / "estimate.txt", "--align", "none", "--json"], check=True,
                          capture_output=True, text=True)
    assert json.loads(said.stdout)["ape_m"]["rmse"] == e.absolute_m.rmse
    assert fbvins.evaluate(truth, (t, 2 * p, q), align="sim3").scale == pytest.approx(0.5)
    with pytest.raises(ValueError, match="'se3', 'yaw', 'sim3' or 'none'"):
        fbvins.evaluate(truth, estimate, align="se2")
    with pytest.raises(ValueError, match=r"p: a NumPy array of float64 \(60, 3\)"):
        fbvins.Trajectory(t, p[:, :2].copy(), q)
    with pytest.raises(ValueError, match="row 0 has norm 2"):
        fbvins.Trajectory(t, p, 2 * q)
    with pytest.raises(ValueError, match="none of the 60 estimated poses belongs"):
        fbvins.evaluate(truth, (t + 10**12, p, q))


def image_of(flight, index):
    frames = (e for e in fbvins.open(flight) if isinstance(e, fbvins.StereoFrame))
    for _ in range(index):
        next(frames)
    return next(frames)


def matches(a, b):
    """Mutual nearest neighbours by Hamming distance."""
    d = np.unpackbits(a[:, None] ^ b[None], axis=2).sum(axis=2)
    best, back = d.argmin(axis=1), d.argmin(axis=0)
    own = np.arange(len(a))
    return own[back[best] == own], best[back[best] == own]


def test_orb_and_booster(flight):
    frame = image_of(flight, 60)
    left, right = fbvins.orb(frame.left), fbvins.orb(frame.right, max_features=500)
    assert 300 < len(left) <= 500 and left.size == (752, 480)
    assert left.keypoints.shape == (len(left), 6) and left.descriptors.shape == (len(left), 32) and left.margins.shape == (len(left), 512)
    bits = np.unpackbits(left.descriptors, axis=1, bitorder="little").astype(bool)
    assert np.array_equal(bits, left.margins[:, :256] > 0) or np.mean(bits == (left.margins[:, :256] > 0)) > 0.99
    boosted = fbvins.boost(left)
    assert np.array_equal(boosted, fbvins.boost(left.margins, left.keypoints, left.size)) and not np.array_equal(boosted, left.descriptors)

    def on_the_epipolar_line(a, b):
        i, j = matches(a, b)
        return np.sum(np.abs(left.keypoints[i, 1] - right.keypoints[j, 1] + np.median(right.keypoints[j, 1] - left.keypoints[i, 1])) < 3)

    assert on_the_epipolar_line(boosted, fbvins.boost(right)) > 0.9 * on_the_epipolar_line(left.descriptors, right.descriptors) > 50


def test_wrong_features_are_refused(flight):
    features = fbvins.orb(image_of(flight, 60).left)
    with pytest.raises(ValueError, match=r"margins, as these weights need.*int8 \(\d+, 512\)"):
        fbvins.boost(features.descriptors, features.keypoints, features.size)
    with pytest.raises(ValueError, match=r"keypoints: a NumPy array of float64 \(N, 6\)"):
        fbvins.boost(features.margins, features.keypoints[:, :5], features.size)
    with pytest.raises(ValueError, match="keypoints and size"):
        fbvins.boost(features.margins)
    with pytest.raises(ValueError, match=r"image: a NumPy array of uint8 \(N, N\)"):
        fbvins.orb(np.zeros((480, 752)))
    with pytest.raises(FileNotFoundError):
        fbvins.boost(features, weights="/nowhere.safetensors")
    assert len(fbvins.orb(np.zeros((480, 752), np.uint8))) == 0


def test_docstrings_and_type_stubs_exist():
    package = pathlib.Path(fbvins.__file__).parent
    assert (package / "py.typed").exists()
    stubs = (package / "_fbvins.pyi").read_text()
    for name in ("class System", "def push_images", "class Run", "def covariance", "class Map"):
        assert name in stubs
    undocumented = [f"{c}.{n}" for c in ("Run", "Odometry", "Recording", "Features", "Trajectory") for n, v in vars(getattr(fbvins, c)).items()
                    if not n.startswith("_") and not getattr(v, "__doc__", None)]
    assert [u for u in undocumented if u.split(".")[1] not in ("name", "format", "reason")] == []
