// SPDX-License-Identifier: Apache-2.0
// On librealsense's software device and its recorder, no camera at hand.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <thread>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/live/live_system.hpp"
#include "fbvins/realsense/realsense_source.hpp"
#include "tests/support/collected_input.hpp"
#include "tests/support/kalibr_test_files.hpp"
#include "tests/support/realsense_test_device.hpp"

namespace fbvins {
namespace realsense_test {

using namespace test;

/// Plays camera and IMU for this many images, whose grey values are their numbers; right ones have later stamps by `right_late`.
void play(SoftwareCamera& camera, int images, Time start = kStart, Duration right_late = {}) {
  for (int ms = 0; ms < images * 33; ++ms) {
    const Time t = start + Duration{ms * kMs};
    if (ms % 5 == 0) camera.gyro(t, Vec3(0.1, 0, 0.001 * ms));
    if (ms % 4 == 0) camera.accel(t, Vec3(0, -9.8, 0.01 * ms));
    if (ms % 33 == 0)
      for (int side : {0, 1})
        camera.image(side, side == 0 ? t : t + right_late, Image(640, 480, static_cast<std::uint8_t>(2 * (ms / 33) + side)));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// The recorder does not write a software device's extrinsics: they come from Kalibr's files.
SourceOptions calibrated_by(const KalibrFiles& files) {
  SourceOptions options;
  options.dataset.kalibr_camchain = files.camchain();
  options.dataset.kalibr_imu = files.imu();
  return options;
}

/// A recording of the library's own, made by its recorder.
std::string record(const std::string& name, int images, std::chrono::milliseconds pause = {}, Duration right_late = {}) {
  const std::string path = (std::filesystem::temp_directory_path() / name).string();
  std::filesystem::remove(path);
  SoftwareCamera camera(rig());
  rs2::recorder recorder(path, camera.device());
  CollectedInput collected;
  auto recorded = RealsenseCamera::open(recorder, [](const std::string&) {});
  EXPECT_TRUE(recorded) << recorded.error().message;
  EXPECT_TRUE((*recorded)->start(collected));
  play(camera, images, kStart, right_late);
  if (pause.count() > 0) {
    std::this_thread::sleep_for(pause);
    play(camera, images, kStart + Duration{images * 33 * kMs} + Duration{pause.count() * kMs});
  }
  (*recorded)->stop();
  return path;
}

TEST(Realsense, TakesTheDevicesCalibration) {
  SoftwareCamera device(rig());
  auto camera = RealsenseCamera::open(device.device(), [](const std::string&) {});
  ASSERT_TRUE(camera) << camera.error().message;
  ASSERT_TRUE((*camera)->rig()) << (*camera)->rig().error().message;
  const StereoRig &seen = *(*camera)->rig(), wanted = rig();
  EXPECT_EQ(seen.left().width(), 640);
  EXPECT_NEAR(std::get<PinholeRadtan>(seen.left().model()).cx, 320.5, 1e-9);
  EXPECT_LT((seen.T_BC0().p - wanted.T_BC0().p).norm(), 1e-8);
  EXPECT_LT((seen.T_BC1().p - wanted.T_BC1().p).norm(), 1e-8);
  EXPECT_EQ(seen.image_rate_hz, 30);
  EXPECT_EQ(seen.imu_noise.rate_hz, 200);
  EXPECT_EQ(device.emitter(), 0) << "the emitter is off";
}

TEST(Realsense, RotationsAreColumnByColumn) {
  StereoRig turned = rig();
  turned.cameras[0].T_BC.q = so3_exp(Vec3(0.3, -0.2, 0.9));
  SoftwareCamera device(turned);
  auto camera = RealsenseCamera::open(device.device(), [](const std::string&) {});
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_LT((*camera)->rig()->T_BC0().q.angularDistance(turned.T_BC0().q), 1e-6);
}

TEST(Realsense, TakesBrownsModelAndRefusesACameraWithoutStereo) {
  StereoRig bent = rig();
  bent.cameras[0].camera = Camera(PinholeRadtan{380, 381, 320.5, 239.5, -0.3, 0.1, 0, 0}, 640, 480);
  SoftwareCamera device(bent);
  auto camera = RealsenseCamera::open(device.device(), [](const std::string&) {});
  ASSERT_TRUE(camera) << "Brown's model is supported: " << camera.error().message;
  EXPECT_NEAR(std::get<PinholeRadtan>((*camera)->rig()->left().model()).k1, -0.3, 1e-7);
  rs2::software_device blind;
  auto sensor = blind.add_sensor("Motion Module");
  sensor.add_motion_stream({RS2_STREAM_GYRO, 0, 1, 200, RS2_FORMAT_MOTION_XYZ32F, {}});
  const auto refused = RealsenseCamera::open(blind, [](const std::string&) {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("no left infrared"), std::string::npos) << refused.error().message;
}

TEST(Realsense, StreamsBecomePairsAndOneImu) {
  SoftwareCamera device(rig());
  CollectedInput got;
  auto camera = RealsenseCamera::open(device.device(), [](const std::string& s) { ADD_FAILURE() << s; });
  ASSERT_TRUE(camera);
  ASSERT_TRUE((*camera)->start(got));
  play(device, 10);
  ASSERT_TRUE(got.wait_for_frames(10, kPatience));
  (*camera)->stop();
  EXPECT_EQ(got.frames.size(), 10u);
  for (std::size_t i = 0; i < got.frames.size(); ++i) {
    const StereoFrame& frame = got.frames[i];
    ASSERT_TRUE(frame.left() && frame.right());
    EXPECT_EQ((frame.t - kStart).ns, static_cast<std::int64_t>(i) * 33 * kMs);
    EXPECT_EQ(frame.left()->at(639, 479), 2 * i);
    EXPECT_EQ(frame.right()->at(0, 0), 2 * i + 1);
  }
  ASSERT_GT(got.readings.size(), 60u);
  for (const ImuSample& sample : got.readings) {
    const double ms = static_cast<double>((sample.t - kStart).ns) / kMs;
    EXPECT_LT((sample.gyro_radps - Vec3(0.1, 0, 0.001 * ms)).norm(), 1e-6);
    EXPECT_LT((sample.accel_mps2 - Vec3(0, -9.8, 0.01 * ms)).norm(), 1e-5) << ms;
  }
}

TEST(Realsense, LeavesOutStampsOfAnotherClock) {
  SoftwareCamera device(rig());
  CollectedInput got;
  std::vector<std::string> said;
  auto camera = RealsenseCamera::open(device.device(), [&](const std::string& s) { said.push_back(s); });
  ASSERT_TRUE(camera && (*camera)->start(got));
  play(device, 3);
  device.domain = RS2_TIMESTAMP_DOMAIN_HARDWARE_CLOCK;
  play(device, 3, Time{5000 * kMs});
  (*camera)->stop();
  EXPECT_EQ(got.frames.size(), 3u);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("two clocks"), std::string::npos);
}

TEST(Realsense, SaysWhatItIsAndHowItIsSet) {
  SoftwareCamera device(rig());
  CollectedInput got;
  auto camera = RealsenseCamera::open(device.device(), [](const std::string&) {});
  ASSERT_TRUE(camera && (*camera)->start(got));
  device.tell(RS2_FRAME_METADATA_ACTUAL_EXPOSURE, 4500);
  device.tell(RS2_FRAME_METADATA_FRAME_EMITTER_MODE, 0);
  play(device, 2);
  const DeviceFacts facts = (*camera)->facts();
  EXPECT_EQ(facts.model, "Intel RealSense D435I");
  EXPECT_EQ(facts.firmware, "5.12.7.100");
  EXPECT_EQ(facts.recommended_firmware, "5.16.0.1");
  EXPECT_EQ(facts.usb, "2.1");
  EXPECT_EQ(facts.driver, "kernel");
  EXPECT_EQ(facts.clock, "global");
  EXPECT_EQ(facts.emitter, "off");
  EXPECT_EQ(facts.mode, "640x480@30");
  EXPECT_EQ(facts.other_modes, "848x480@60");
  EXPECT_EQ(facts.exposure_ms, 4.5);
  EXPECT_EQ(facts.longest_exposure_ms, kLongestExposure_ms);
  EXPECT_EQ(device.exposure_limit_us(), 8000) << "automatic exposure is limited";
  EXPECT_EQ(facts.imu_calibrated, false);
  device.tell(RS2_FRAME_METADATA_FRAME_EMITTER_MODE, 1);
  play(device, 2, kStart + Duration{100 * kMs});
  EXPECT_EQ((*camera)->facts().emitter, "alternating");
  (*camera)->stop();
}

TEST(Realsense, TakesTheWantedMode) {
  SoftwareCamera device(rig());
  const auto open = [&](RealsenseMode mode) {
    return RealsenseCamera::open(
        device.device(), [](const std::string&) {}, mode);
  };
  for (const RealsenseMode& mode : {RealsenseMode{848, 480, 60}, RealsenseMode{848, 480, 0}}) {
    auto wide = open(mode);
    ASSERT_TRUE(wide) << wide.error().message;
    EXPECT_EQ((*wide)->width_px(), 848);
    EXPECT_EQ((*wide)->rig()->image_rate_hz, 60);
  }
  const auto none = open({848, 480, 90});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().message, "the camera 123456 has no mode 848x480@90, but 640x480@30 848x480@60");
}

TEST(Realsense, NamesOfCamerasAndModes) {
  const auto parsed = [](const std::string& text) {
    const RealsenseName name = parse_realsense_name(text);
    return fmt::format("{} {} {} {}{}", name.which, name.mode.width_px, name.mode.height_px, name.mode.rate_hz,
                       name.mode.depth ? " depth" : "");
  };
  EXPECT_EQ(parsed(""), " 0 0 0");
  EXPECT_EQ(parsed("123456"), "123456 0 0 0");
  EXPECT_EQ(parsed("848x480@60"), " 848 480 60");
  EXPECT_EQ(parsed("848x480"), " 848 480 0");
  EXPECT_EQ(parsed("123456:848x480@30"), "123456 848 480 30");
  EXPECT_EQ(parsed("a/b:c.bag"), "a/b:c.bag 0 0 0");
  EXPECT_EQ(parsed("depth"), " 0 0 0 depth");
  EXPECT_EQ(parsed("depth:848x480@60"), " 848 480 60 depth");
  EXPECT_EQ(parsed("a/depth.bag:depth"), "a/depth.bag 0 0 0 depth");
  EXPECT_EQ(parsed("123456:depth:848x480"), "123456 848 480 0 depth");
}

/// A recorded camera whose images pause for three seconds.
TEST(Realsense, StreamsThatStopAreStartedAgain) {
  const std::string camera = record("fbvins_realsense_stall.bag", 10, std::chrono::milliseconds(3000)) + ".camera";
  std::filesystem::rename(camera.substr(0, camera.size() - 7), camera);
  rs2::context context;
  const rs2::device plugged = context.load_device(camera);
  const KalibrFiles files(rig());
  SourceOptions options = calibrated_by(files);
  std::vector<std::string> said;
  CollectedInput got;
  options.say = [&](const std::string& s) { said.push_back(s); };
  auto source = RealsenseSource::open(context, camera, options);
  ASSERT_TRUE(source) << source.error().message;
  std::thread running([&] { EXPECT_TRUE((*source)->run(got)); });
  EXPECT_TRUE(got.wait_for_frames(14, kPatience));
  (*source)->stop();
  running.join();
  ASSERT_GE(said.size(), 2u) << "what is connected, and what stopped";
  EXPECT_NE(said[1].find("no image comes"), std::string::npos) << said[1];
  const auto findings = (*source)->device_findings();
  ASSERT_FALSE(findings.empty());
  EXPECT_NE(findings.back().text.find("0 resets of the USB device, 1 stalls"), std::string::npos) << findings.back().text;
  std::filesystem::remove(camera);
}

TEST(Realsense, PlaysARecordingToItsEnd) {
  const std::string path = record("fbvins_realsense_end.bag", 30);
  const KalibrFiles files(rig());
  auto source = RealsenseSource::open(path, calibrated_by(files));
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_LT(((*source)->rig().T_BC1().p - rig().T_BC1().p).norm(), 1e-6);
  CollectedInput got;
  ASSERT_TRUE((*source)->run(got));
  EXPECT_GE(got.frames.size(), 28u);
  EXPECT_GT(got.readings.size(), 180u);
  std::filesystem::remove(path);
}

/// By when they were taken, and not by their stamps; offsets are of the stamps.
TEST(Realsense, JoinsImagesByTheCamerasOwnTimeOffsets) {
  constexpr Duration kLate{12 * kMs};
  const std::string path = record("fbvins_realsense_late.bag", 8, {}, kLate);  // fewer than show that there is no common trigger
  const auto played = [&](const StereoRig& calibrated, std::string& said) {
    const KalibrFiles files(calibrated);
    SourceOptions options = calibrated_by(files);
    options.say = [&](const std::string& s) { said += s; };
    auto source = RealsenseSource::open(path, options);
    EXPECT_TRUE(source) << source.error().message;
    CollectedInput got;
    EXPECT_TRUE((*source)->run(got));
    return got.frames;
  };
  std::string said;
  const auto frames = played(with_times(rig(), {{}, {.time_offset_s = -kLate.seconds()}}), said);
  EXPECT_GE(std::count_if(frames.begin(), frames.end(), [](const StereoFrame& f) { return f.left() && f.right(); }), 6);
  for (const StereoFrame& frame : frames)
    if (frame.left() && frame.right()) {
      EXPECT_EQ(frame.offsets, ExposureOffsets({{}, kLate}));
    }
  said.clear();
  for (const StereoFrame& frame : played(rig(), said)) EXPECT_FALSE(frame.left() && frame.right()) << "12 ms are no pair";
  EXPECT_NE(said.find("without partner within 3 ms"), std::string::npos) << said;
  std::filesystem::remove(path);
}

TEST(Realsense, NamesARecordingThatIsNone) {
  const auto source = RealsenseSource::open("/no/such.bag", {});
  ASSERT_FALSE(source);
  EXPECT_NE(source.error().message.find("/no/such.bag"), std::string::npos) << source.error().message;
}

TEST(Realsense, GoesOnWhenItIsPluggedInAgain) {
  const std::string bag = record("fbvins_realsense_plug.bag", 40), camera = bag + ".camera";
  std::filesystem::rename(bag, camera);  // as a camera of this name, which the test plugs in
  rs2::context context;
  rs2::device plugged = context.load_device(camera);
  std::vector<std::string> said;
  std::mutex said_mutex;
  const auto heard = [&](const std::string& what) {
    const std::lock_guard lock(said_mutex);
    return std::any_of(said.begin(), said.end(), [&](const std::string& s) { return s.find(what) != std::string::npos; });
  };
  const KalibrFiles files(rig());
  SourceOptions options = calibrated_by(files);
  options.say = [&](const std::string& s) {
    const std::lock_guard lock(said_mutex);
    said.push_back(s);
  };
  auto source = RealsenseSource::open(context, camera, options);
  ASSERT_TRUE(source) << source.error().message;
  CollectedInput got;
  std::thread running([&] { EXPECT_TRUE((*source)->run(got)); });
  EXPECT_TRUE(got.wait_for_frames(5, kPatience));
  context.unload_device(camera);
  for (int i = 0; i < 100 && !heard("unplugged"); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_TRUE(heard("unplugged"));
  std::size_t before = 0;
  {
    const std::lock_guard lock(got.mutex);
    before = got.frames.size();
  }
  plugged = context.load_device(camera);
  EXPECT_TRUE(got.wait_for_frames(before + 5, kPatience));
  (*source)->stop();
  running.join();
  std::filesystem::remove(camera);
}

/// A real flight through the library's recorder and player, in real time.
TEST(Realsense, FliesARecordedFlight) {
  const char* data = std::getenv("FBVINS_DATA");
  const std::string flight = std::string(data != nullptr ? data : FBVINS_SOURCE_DIR "/../shared/data") + "/MH_01_easy_17s";
  if (!std::filesystem::exists(flight)) GTEST_SKIP() << flight << " is not there";
  auto dataset = open_dataset(flight);
  ASSERT_TRUE(dataset) << dataset.error().message;
  SoftwareCamera device((*dataset)->rig());
  const std::string bag = (std::filesystem::temp_directory_path() / "fbvins_realsense_flight.bag").string();
  std::filesystem::remove(bag);
  {
    rs2::recorder recorder(bag, device.device());
    auto camera = RealsenseCamera::open(recorder, [](const std::string&) {});
    ASSERT_TRUE(camera) << camera.error().message;
    CollectedInput unused;
    ASSERT_TRUE((*camera)->start(unused));
    const auto begin = std::chrono::steady_clock::now();
    std::optional<Time> first;
    while (auto event = (*dataset)->next()) {
      const Time t = stamp_of(*event);
      if (!first) first = t;
      if (t - *first > Duration::from_seconds(12)) break;
      std::this_thread::sleep_until(begin + std::chrono::nanoseconds((t - *first).ns));
      if (const auto* sample = std::get_if<ImuSample>(&*event)) {
        device.gyro(t, sample->gyro_radps);
        device.accel(t, sample->accel_mps2);
      } else {
        const auto& frame = std::get<StereoFrame>(*event);
        device.image(0, t, *frame.left());
        device.image(1, t, *frame.right());
      }
    }
    (*camera)->stop();
  }
  const KalibrFiles files((*dataset)->rig());
  auto source = RealsenseSource::open(bag, calibrated_by(files));
  ASSERT_TRUE(source) << source.error().message;
  struct Poses final : Sink {
    explicit Poses(std::vector<Odometry>& poses) : all(poses) {}
    std::string_view name() const override { return "poses"; }
    Result<void> take(const LiveEvent& event) override {
      if (const auto* odometry = std::get_if<Odometry>(&event)) all.push_back(*odometry);
      return {};
    }
    std::vector<Odometry>& all;
  };
  std::vector<Odometry> poses;
  auto live = LiveSystem::create({}, {}, (*source)->rig());
  ASSERT_TRUE(live) << live.error().message;
  live->add_sink(std::make_unique<Poses>(poses));
  ASSERT_TRUE((*source)->run(live->input()));
  ASSERT_TRUE(live->finish());
  const auto with_pose = std::count_if(poses.begin(), poses.end(), [](const Odometry& o) { return o.health.has_pose(); });
  EXPECT_GT(with_pose, 100) << "of " << poses.size();
  std::filesystem::remove(bag);
}

}  // namespace realsense_test
}  // namespace fbvins
