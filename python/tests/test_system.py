# SPDX-License-Identifier: Apache-2.0
import gc
import pickle
import sys
import threading
import time
import weakref

import numpy as np
import pytest

import fbvins


def feed(system, recording):
    for event in recording:
        if isinstance(event, fbvins.StereoFrame):
            system.push_images(event.t, event.left, event.right)
        else:
            system.push_imu(event.t, event.gyro, event.accel)
    system.finish()


def test_arrays_pushed_give_the_same_poses_as_a_run(flight):
    run = fbvins.run(flight, "orb")
    for threaded in (False, True):
        recording = fbvins.open(flight)
        system = fbvins.System({"frontend.kind": "orb"}, recording.rig, threaded=threaded)
        feed(system, recording)
        poses = system.poll()
        assert np.array_equal([o.p for o in poses], run.p, equal_nan=True) and np.array_equal([o.q for o in poses], run.q, equal_nan=True)
        assert system.poll() == []
    assert system.input_counts["images"] == len(run.t) and system.input_counts["imu_invalid"] == 0


def test_readings_come_one_by_one_or_many_at_once(flight):
    def fly(batch):
        recording, poses, readings = fbvins.open(flight, max_frames=60), [], []
        with fbvins.System(None, recording.rig, on_odometry=poses.append) as system:
            for event in recording:
                if isinstance(event, fbvins.ImuSample) and batch:
                    readings.append(event)
                    continue
                if readings:
                    system.push_imu(np.array([r.t for r in readings]), np.array([r.gyro for r in readings]),
                                    np.array([r.accel for r in readings]))
                    readings.clear()
                system.push(event)
        return np.array([o.p for o in poses])

    assert np.array_equal(fly(batch=False), fly(batch=True), equal_nan=True)


def test_images_are_not_copied_and_are_released(flight):
    recording = fbvins.open(flight, max_frames=30)
    rig = recording.rig
    system = fbvins.System(None, rig, threaded=True)
    kept, waiting = [], 0
    for event in recording:
        if isinstance(event, fbvins.StereoFrame):
            left = event.left.copy()
            kept.append(weakref.ref(left))
            system.push_images(event.t, left, event.right)
            del left
            waiting += kept[-1]() is not None
        else:
            system.push(event)
    assert waiting > 0, "images in the queue are read where they lie"
    system.finish()
    del system
    gc.collect()
    assert all(r() is None for r in kept), "an image was never released"


def test_the_map_beside_it(flight, tmp_path):
    recording, updates = fbvins.open(flight), []
    flat = fbvins.Map(recording.rig)
    system = fbvins.System({"frontend.kind": "orb"}, recording.rig, map=flat, on_map_update=updates.append, threaded=True)
    feed(system, recording)
    flat.finish()
    flat.save(str(tmp_path / "flat.fbm"))
    contents = fbvins.load_map(tmp_path / "flat.fbm")
    assert flat.keyframes == len(contents.keyframes) > 5 and contents.points.shape[1] == 3 and len(contents.points) > 100
    in_map = flat.corrected([o for o in system.poll() if o.has_pose])
    assert fbvins.evaluate(recording.ground_truth, in_map).absolute_m.rmse < 0.1
    assert updates[-1].localised and updates[-1].T_MW.shape == (4, 4)
    again = fbvins.Map(recording.rig, tmp_path / "flat.fbm")
    assert again.keyframes == flat.keyframes


def test_positions_bring_the_map_into_the_building(flight):
    recording, truth = fbvins.open(flight), fbvins.open(flight).ground_truth
    flat = fbvins.Map(recording.rig)
    system = fbvins.System({"frontend.kind": "klt"}, recording.rig, map=flat)
    shift, rng = np.array([20.0, -3.0, 5.0]), np.random.default_rng(3)
    waiting = [(int(t), p + shift + rng.normal(0, 0.02, 3)) for t, p in zip(truth.t[::20], truth.p[::20])]
    for event in recording:
        if isinstance(event, fbvins.StereoFrame):
            while waiting and waiting[0][0] <= event.t:
                system.push_position(*waiting.pop(0), 0.02)
        system.push(event)
    with pytest.raises(ValueError, match="impossible"):
        system.push_position(0, np.array([np.nan, 0, 0]), 0.1)
    with pytest.raises(ValueError, match="impossible"):
        system.push_height(0, 1.0, 0.0)
    upright, sure = np.array([1.0, 0, 0, 0]), 1e-4 * np.eye(6)
    with pytest.raises(ValueError, match="both or neither"):
        system.push_tag(0, 3, np.ones(3), upright, sure, place=np.ones(3))
    with pytest.raises(ValueError, match="impossible"):
        system.push_tag(0, 3, np.ones(3), 2 * upright, sure)
    system.finish()
    flat.finish()
    updates = system.poll_map()
    moved = [u for u in updates if u.M_moved is not None]
    assert moved[-1].anchored and all(not u.anchored for u in moved[:-1])  # before, M is levelled
    assert moved[-1].M_moved.shape == (4, 4) and not updates[0].anchored
    in_map = flat.corrected([o for o in system.poll() if o.has_pose])
    at = np.searchsorted(truth.t, in_map.t).clip(max=len(truth.t) - 1)
    assert np.linalg.norm(in_map.p - shift - truth.p[at], axis=1).max() < 0.1
    with pytest.raises(ValueError, match="none"):
        fbvins.System(None, recording.rig).push_height(0, 1.0, 0.1)


@pytest.mark.parametrize("threaded", [False, True])
def test_an_exception_in_a_callback_is_raised_unchanged(flight, threaded):
    class Mine(Exception):
        pass

    def raise_mine(odometry):
        raise Mine("at frame %d" % odometry.frame)

    recording = fbvins.open(flight, max_frames=20)
    system = fbvins.System(None, recording.rig, threaded=threaded, on_odometry=raise_mine)
    with pytest.raises(Mine, match="at frame 0"):
        feed(system, recording)


def test_other_threads_run_while_it_works(flight):
    recording, ticks, stop = fbvins.open(flight, max_frames=40), [], threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    worker = threading.Thread(target=tick)
    system = fbvins.System({"frontend.kind": "orb"}, recording.rig)
    worker.start()
    switch, begin = sys.getswitchinterval(), time.perf_counter()
    sys.setswitchinterval(100)  # no forced switches: there are ticks only where the GIL is released
    try:
        feed(system, recording)
    finally:
        sys.setswitchinterval(switch)
        stop.set()
        worker.join()
    during = [t for t in ticks if t > begin]
    assert len(during) > 20


def test_a_system_that_refers_to_itself_is_collected(flight):
    rig = fbvins.open(flight, max_frames=1).rig
    system = fbvins.System(None, rig, threaded=True, on_odometry=lambda o: system)
    gone = weakref.ref(system) if hasattr(system, "__weakref__") else None
    del system
    gc.collect()
    assert gone is None or gone() is None


def wrong_images(good):
    yield "float64", good.astype(float)
    yield "uint16", good.astype(np.uint16)
    yield r"\(240, 376\)", np.ascontiguousarray(good[::2, ::2])
    yield "bool", good > 0
    yield r"\(480, 752, 3\)", np.dstack([good] * 3)
    yield "list", good.tolist()
    yield "str", "image.png"


def test_wrong_arrays_are_refused_with_what_was_expected(flight):
    rig = fbvins.open(flight, max_frames=1).rig
    system = fbvins.System(None, rig)
    good = np.zeros((rig.left.height, rig.left.width), np.uint8)
    for message, wrong in wrong_images(good):
        with pytest.raises(ValueError, match=r"left: a NumPy array of uint8 \(480, 752\) in C order is expected.*" + message):
            system.push_images(1, wrong, good)
        with pytest.raises(ValueError, match="right: .*" + message):
            system.push_images(1, good, wrong)
    v = np.zeros(3)
    for gyro in (np.zeros(4), np.zeros(3, complex), np.zeros((1, 3)), "gyro"):
        with pytest.raises(ValueError, match=r"gyro: a NumPy array of float64 \(3,\)"):
            system.push_imu(0, gyro, v)
    with pytest.raises(ValueError, match=r"accel: a NumPy array of float64 \(5, 3\)"):
        system.push_imu(np.arange(5), np.zeros((5, 3)), np.zeros((4, 3)))
    with pytest.raises(ValueError, match=r"t: a NumPy array of int64 \(N,\)"):
        system.push_imu(np.arange(5.0), np.zeros((5, 3)), np.zeros((5, 3)))
    system.push_imu(0, [0, 0, 0], (0, 0, 9.81))
    system.push_images(10, good, None)
    with pytest.raises(TypeError):
        system.push_images(0.5, good, good)
    system.finish()
    with pytest.raises(ValueError, match="after finish"):
        system.push_images(20, good, good)


def test_what_loses_nothing_is_taken(flight):
    """NumPy's scalars, float32, other integers and views with steps give the same poses as what they are made from."""
    def fly(stamp, vector, image):
        recording = fbvins.open(flight, max_frames=40)
        with fbvins.System({"frontend.kind": "klt"}, recording.rig) as system:
            for event in recording:
                if isinstance(event, fbvins.StereoFrame):
                    system.push_images(stamp(event.t), image(event.left), image(event.right))
                else:
                    system.push_imu(stamp(event.t), vector(event.gyro), vector(event.accel))
            return np.array([o.p for o in system.poll()])

    def float32(v):
        return v.astype(np.float32)

    def with_steps(v):
        return np.repeat(v, 2)[::2]

    def mirrored_twice(image):
        return np.ascontiguousarray(image[:, ::-1])[:, ::-1]

    plain = fly(int, lambda v: v, lambda i: i)
    assert np.array_equal(fly(np.int64, with_steps, mirrored_twice), plain, equal_nan=True)
    assert np.array_equal(fly(np.uint64, with_steps, np.asfortranarray), plain, equal_nan=True)
    rounded = fly(int, lambda v: v.astype(np.float32).astype(float), lambda i: i)
    assert np.array_equal(fly(np.array, float32, lambda i: i), rounded, equal_nan=True)  # stamps as arrays without axes


def test_what_a_recording_must_not_have_raises(flight):
    rig = fbvins.open(flight, max_frames=1).rig
    image, v = np.zeros((rig.left.height, rig.left.width), np.uint8), np.zeros(3)
    system = fbvins.System(None, rig)
    system.push_imu(100, v, v)
    with pytest.raises(ValueError, match="gyro: .*nan.* at 200 ns is not finite"):
        system.push_imu(200, np.array([0, np.nan, 0]), v)
    with pytest.raises(ValueError, match="accel: .*inf"):
        system.push_imu(np.array([200, 300]), np.zeros((2, 3)), np.array([[0, 0, 9.81], [0, 0, np.inf]]))
    for t in (100, 50, np.array([200, 150])):
        with pytest.raises(ValueError, match="is not after"):
            system.push_imu(t, np.zeros((2, 3)) if np.ndim(t) else v, np.zeros((2, 3)) if np.ndim(t) else v)
    assert system.input_counts["imu_accepted"] == 1, "of a batch that is refused nothing is taken"
    system.push_images(100, image, image)
    with pytest.raises(ValueError, match="the stamp 100 ns is not after 100 ns, that of the image before"):
        system.push_images(100, image, image)
    with pytest.raises(TypeError, match="t: a whole number is expected, not float"):
        system.push_images(1.5, image, image)
    with pytest.raises(ValueError, match="all None"):
        system.push_images(200, None, None)
    system.finish()


def test_a_recording_is_read_once(flight):
    recording = fbvins.open(flight, max_frames=3)
    assert sum(isinstance(e, fbvins.StereoFrame) for e in recording) == 3
    with pytest.raises(ValueError, match="read to its end: open it again"):
        for _ in recording:
            pass
    for use in (fbvins.run, fbvins.doctor, lambda r: fbvins.convert(r, "/nowhere/x.bag")):
        with pytest.raises(ValueError, match="iterated already: open it again"):
            use(recording)


def test_a_rig_of_ones_own(flight):
    rig = fbvins.open(flight, max_frames=1).rig
    camera = fbvins.Camera(752, 480, *rig.left.intrinsics, distortion=rig.left.distortion)
    own = fbvins.Rig(camera, camera, rig.T_BC0, rig.T_BC1, imu_noise=fbvins.ImuNoise(rate_hz=400), time_offset_s=0.002)
    assert np.array_equal(own.T_BC0, rig.T_BC0) and own.imu_noise.rate_hz == 400 and own.left.model == rig.left.model
    with pytest.raises(ValueError, match="T_BC1: a rotation and a translation"):
        fbvins.Rig(camera, camera, rig.T_BC0, 2 * rig.T_BC1)
    with pytest.raises(ValueError, match="apart"):
        fbvins.Rig(camera, camera, rig.T_BC0, rig.T_BC0)
    with pytest.raises(ValueError, match="'radtan', 'radtan5', 'rational', 'equidistant', 'ds', 'eucm' or 'omni'"):
        fbvins.Camera(752, 480, 1, 1, 1, 1, model="fov")
    wide = fbvins.Camera(512, 512, 158, 158, 255, 257, model="ds", distortion=[-0.17, 0.59])
    assert wide.model == "ds" and wide.distortion == [-0.17, 0.59] and wide.intrinsics == [158, 158, 255, 257]
    with pytest.raises(ValueError, match="alpha is 1.5, not between 0 and 1"):
        fbvins.Camera(512, 512, 158, 158, 255, 257, model="ds", distortion=[-0.17, 1.5])
    backwards = fbvins.Camera(512, 512, 100, 100, 255, 257, model="eucm", distortion=[0.63, 1.04])  # more than 180 degrees
    fbvins.System(None, fbvins.Rig(backwards, wide, rig.T_BC0, rig.T_BC1)).finish()
    fbvins.System(None, own).finish()


def test_each_camera_has_its_times(flight):
    rig = fbvins.open(flight, max_frames=1).rig
    make = lambda **times: fbvins.Rig(rig.left, rig.right, rig.T_BC0, rig.T_BC1, **times)
    assert make(time_offset_s=0.002, line_delay_s=3e-5).time_offsets_s == [0.002, 0.002]
    own = make(time_offset_s=[0.002, 0.0035], line_delay_s=[0, 3e-5])
    assert own.time_offset_s == 0.002 and own.time_offsets_s == [0.002, 0.0035] and own.line_delays_s == [0, 3e-5]
    again = pickle.loads(pickle.dumps(own))
    assert again.time_offsets_s == own.time_offsets_s and again.line_delays_s == own.line_delays_s
    with pytest.raises(ValueError, match="line_delay_s: the rig has 2 cameras, not 3"):
        make(line_delay_s=[0, 0, 0])
    with pytest.raises(ValueError, match="the time offset of camera 1 differs from camera 0's by 300.0 ms"):
        make(time_offset_s=[0, 0.3])


def test_four_cameras():
    recording = fbvins.simulate("quad", seed=5, seconds=2)
    rig = recording.rig
    own = fbvins.Rig(rig.left, rig.right, rig.T_BC0, rig.T_BC1, imu_noise=rig.imu_noise, more=rig.more)
    assert len(own.more) == 2 and np.allclose(own.more[1][1], rig.more[1][1], atol=1e-12)
    again = pickle.loads(pickle.dumps(own))
    assert np.array_equal(again.more[0][1], own.more[0][1]) and "3 further cameras" in repr(again)
    alone = fbvins.Rig(rig.left, rig.right, rig.T_BC0, rig.T_BC1, imu_noise=rig.imu_noise)
    system, pair = fbvins.System(None, own), fbvins.System(None, alone)
    for event in recording:
        if isinstance(event, fbvins.StereoFrame):
            assert len(event.more) == 2 and event.more[0].shape == event.left.shape
            system.push_images(event.t, event.left, event.right, more=event.more)
            pair.push_images(event.t, event.left, event.right)
        else:
            system.push(event)
            pair.push(event)
    system.finish()
    pair.finish()
    newest = system.poll()[-1]
    assert newest.health == "good" and not np.array_equal(newest.T_WB, pair.poll()[-1].T_WB)
    with pytest.raises(ValueError, match="more: the rig has 2 further cameras, not 3"):
        fbvins.System(None, own).push_images(0, None, more=[None, None, None])
    with pytest.raises(ValueError, match="go with a left and a right one"):
        fbvins.Rig(rig.left, T_BC0=rig.T_BC0, more=rig.more)


def test_cameras_without_a_common_trigger():
    recording = fbvins.simulate("untriggered", seed=5, seconds=2)
    system, as_it_is, wrong = (fbvins.System(None, recording.rig) for _ in range(3))
    for event in recording:
        as_it_is.push(event)
        if isinstance(event, fbvins.StereoFrame):
            assert event.offsets[0] == 0 and event.offsets[1] <= 0
            system.push_images(event.t, event.left, event.right, offsets=event.offsets)
            wrong.push_images(event.t, event.left, event.right)
        else:
            system.push(event)
            wrong.push(event)
    poses = []
    for one in (system, as_it_is, wrong):
        one.finish()
        poses.append(one.poll()[-1].T_WB)
    assert np.array_equal(poses[0], poses[1]) and not np.array_equal(poses[0], poses[2])
    with pytest.raises(ValueError, match="offsets: the rig has 2 cameras, not 3"):
        fbvins.System(None, recording.rig).push_images(0, None, offsets=[0, 0, 0])


def test_a_camera_with_a_depth_sensor():
    recording = fbvins.simulate("rgbd", seed=5, seconds=2)
    sensor = recording.rig.depth
    assert sensor.noise_at_1m == 0.003 and recording.rig.right.width == 0
    own = fbvins.Rig(recording.rig.left, T_BC0=recording.rig.T_BC0, imu_noise=recording.rig.imu_noise, depth=sensor)
    assert pickle.loads(pickle.dumps(own)).depth.farthest == sensor.farthest
    system, n = fbvins.System(None, own), 0
    for event in recording:
        if isinstance(event, fbvins.StereoFrame):
            assert event.right is None and event.depth.dtype == np.uint16 and event.depth.shape == event.left.shape
            system.push_images(event.t, event.left, depth=event.depth)
            n += 1
        else:
            system.push(event)
    system.finish()
    poses = system.poll()
    assert len(poses) == n and poses[-1].health == "good"
    with pytest.raises(ValueError, match="depth: a NumPy array of uint16"):
        fbvins.System(None, own).push_images(0, None, depth=np.zeros((480, 752)))
    small = fbvins.Camera(320, 240, 200, 200, 159.5, 119.5)
    T_BD = own.T_BC0 @ np.array([[1, 0, 0, 0.02], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    elsewhere = fbvins.Rig(own.left, T_BC0=own.T_BC0, depth=fbvins.DepthSensor(camera=small, T_BD=T_BD))
    assert sensor.camera is None and sensor.T_BD is None
    assert elsewhere.depth.camera.width == 320 and np.allclose(pickle.loads(pickle.dumps(elsewhere)).depth.T_BD, T_BD)
    fbvins.System(None, elsewhere).push_images(0, np.zeros((480, 752), np.uint8), depth=np.zeros((240, 320), np.uint16))
    with pytest.raises(ValueError, match="depth: a NumPy array of uint16"):
        fbvins.System(None, elsewhere).push_images(0, None, depth=np.zeros((480, 752), np.uint16))
    with pytest.raises(ValueError, match="camera and T_BD go together"):
        fbvins.DepthSensor(camera=small)
    with pytest.raises(ValueError, match="the rig has no depth sensor"):
        fbvins.System(None, fbvins.Rig(own.left, T_BC0=own.T_BC0)).push_images(0, None, depth=np.zeros((480, 752), np.uint16))
    with pytest.raises(ValueError, match="goes with one camera"):
        fbvins.Rig(own.left, own.left, own.T_BC0, np.eye(4), depth=sensor)
    with pytest.raises(ValueError, match="go together"):
        fbvins.Rig(own.left, own.left, own.T_BC0)


def test_a_mask(flight):
    rig = fbvins.open(flight, max_frames=1).rig
    assert rig.left.mask is None
    seen = np.full((480, 752), 255, np.uint8)
    seen[300:] = 0
    camera = fbvins.Camera(752, 480, *rig.left.intrinsics, distortion=rig.left.distortion, mask=seen)
    assert np.array_equal(camera.mask, seen)
    own = fbvins.Rig(camera, rig.right, rig.T_BC0, rig.T_BC1)
    assert np.array_equal(pickle.loads(pickle.dumps(own)).left.mask, seen)
    with pytest.raises(ValueError, match="mask"):
        fbvins.Camera(752, 480, *rig.left.intrinsics, mask=seen[:100])
    with pytest.raises(ValueError, match="left camera's mask hides all of the image"):
        black = fbvins.Camera(752, 480, *rig.left.intrinsics, mask=0 * seen)
        fbvins.Rig(black, rig.right, rig.T_BC0, rig.T_BC1)
