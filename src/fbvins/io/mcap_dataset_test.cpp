// SPDX-License-Identifier: Apache-2.0
// A flight record read as a recording: the same events in the same order, whatever their stamps.
#include "fbvins/io/mcap_dataset.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "fbvins/io/file_source.hpp"
#include "fbvins/io/flight_record.hpp"
#include "tests/support/kalibr_test_files.hpp"

namespace fbvins {
namespace mcap_dataset_test {

namespace fs = std::filesystem;

constexpr std::int64_t kStart_ns = 1'600'000'000'000'000'123, kMs = 1'000'000;

StereoRig small_rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{40, 41, 15, 11, -0.1, 0.01, 1e-4, -2e-4}, 32, 24), {}});
  rig.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
  return rig;
}

std::shared_ptr<const Image> picture(int seed, int width = 32, int height = 24) {
  auto image = std::make_shared<Image>(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image->at(x, y) = static_cast<std::uint8_t>(3 * x + 5 * y + 7 * seed);
  return image;
}

ImuSample reading(std::int64_t ms) { return {Time{kStart_ns + ms * kMs}, Vec3(0.1, -0.2, 1.0 / 3), Vec3(0, 1e-9, 9.81)}; }

StereoFrame frame(std::int64_t ms, bool left = true, bool right = true) {
  const int seed = static_cast<int>(ms);
  return {Time{kStart_ns + ms * kMs}, {left ? picture(seed) : nullptr, right ? picture(seed + 100) : nullptr}};
}

/// As an estimator may have received them: an image before its readings, missing readings, one camera alone, neither, a stamp
/// that goes back.
std::vector<SensorEvent> eventful_flight() {
  return {reading(0),
          reading(5),
          reading(10),
          frame(10),
          reading(15),
          frame(20),
          reading(25),
          reading(30),
          frame(30, true, false),
          frame(40, false, true),
          frame(50, false, false),
          reading(12),
          reading(500),
          frame(500),
          frame(90),
          reading(505),
          reading(510)};
}

bool same_image(const std::shared_ptr<const Image>& a, const std::shared_ptr<const Image>& b) {
  if (!a || !b) return !a && !b;
  return a->width() == b->width() && a->height() == b->height() &&
         std::equal(a->row(0), a->row(0) + static_cast<std::ptrdiff_t>(a->width()) * a->height(), b->row(0));
}

void add_to(FlightRecord& record, const SensorEvent& event) {
  EXPECT_TRUE(std::visit([&](const auto& e) { return record.add(e); }, event));
}

bool same_event(const SensorEvent& a, const SensorEvent& b) {
  if (a.index() != b.index()) return false;
  if (const auto* s = std::get_if<ImuSample>(&a)) {
    const auto& o = std::get<ImuSample>(b);
    return s->t == o.t && s->gyro_radps == o.gyro_radps && s->accel_mps2 == o.accel_mps2;
  }
  const auto &f = std::get<StereoFrame>(a), &g = std::get<StereoFrame>(b);
  for (int i = 0; i < kMostCameras; ++i)
    if (!same_image(f.image(i), g.image(i)) || f.offsets.of(i) != g.offsets.of(i)) return false;
  return f.t == g.t && !f.depth == !g.depth && (!f.depth || f.depth->mm == g.depth->mm);
}

/// A flight with two further cameras: triggered ones and others, frames of theirs alone, an image missing.
std::vector<SensorEvent> flight_of_four(bool triggered) {
  std::vector<SensorEvent> out;
  for (int k = 0; k < 8; ++k) {
    out.emplace_back(reading(50 * k));
    StereoFrame all = frame(50 * k, k != 3, k != 3 && k != 4);
    all.set_image(2, picture(k + 7)), all.set_image(3, k == 5 ? nullptr : picture(k + 9));
    if (!triggered)
      for (int i = 1; i < 4; ++i)
        if (all.image(i)) all.offsets.set(i, Duration{-(10 + i) * kMs});
    out.emplace_back(std::move(all));
  }
  return out;
}

class FlightRecordTest : public ::testing::Test {
 protected:
  FlightRecordTest() { fs::create_directories(folder_); }
  ~FlightRecordTest() override { fs::remove_all(folder_); }

  FlightRecord create(bool images = true) {
    auto record = FlightRecord::create(path_, rig_, {.program = "a test", .images = images});
    EXPECT_TRUE(record) << record.error().message;
    return *std::move(record);
  }
  void write(const std::vector<SensorEvent>& events, bool images = true) {
    FlightRecord record = create(images);
    for (const SensorEvent& event : events) add_to(record, event);
    EXPECT_TRUE(record.finish());
  }
  void expect_refused(const std::string& sentence, const DatasetOptions& options = {}) {
    const auto data = open_dataset(path_, options);
    ASSERT_FALSE(data);
    EXPECT_EQ(data.error().message, path_ + sentence);
  }

  StereoRig rig_ = small_rig();
  const std::string folder_ = ::testing::TempDir() + "/fbvins_record_" + std::to_string(getpid());
  const std::string path_ = folder_ + "/flight.mcap";
};

std::vector<SensorEvent> drain(Dataset& data) {
  std::vector<SensorEvent> out;
  while (auto event = data.next()) out.push_back(*std::move(event));
  return out;
}

TEST_F(FlightRecordTest, GivesBackTheEventsAndTheirOrder) {
  const std::vector<SensorEvent> events = eventful_flight();
  write(events);
  for (const int prefetch : {0, 8}) {
    auto data = open_dataset(path_, {.prefetch_frames = prefetch});
    ASSERT_TRUE(data) << data.error().message;
    const std::vector<SensorEvent> back = drain(**data);
    ASSERT_EQ(back.size(), events.size());
    for (std::size_t i = 0; i < events.size(); ++i) EXPECT_TRUE(same_event(back[i], events[i])) << "event " << i;
    EXPECT_EQ((*data)->rig().T_BC1().p, small_rig().T_BC1().p);
    EXPECT_EQ((*data)->info().name, "flight");
    EXPECT_EQ((*data)->info().camera(0).unpaired, 1);
    EXPECT_EQ((*data)->info().camera(1).unpaired, 1);
  }
}

/// Also where they sit, and on the images' clock whatever the time offset.
TEST_F(FlightRecordTest, KeepsReadingsOfAidingSensors) {
  rig_.time_offset_s = 0.01;
  std::vector<SensorEvent> events;
  for (int k = 0; k < 6; ++k) {
    const Time t = frame(50 * k).t;
    events.emplace_back(reading(50 * k + 10));
    RangeSample down{.t = t, .distance_m = 1.25 + k, .sigma_m = 0.5, .p_B = Vec3(0.1, 0, 0)}, ahead = down;
    ahead.direction_B = Vec3::UnitX(), ahead.t = t - Duration{kMs};
    VelocitySample wheel{.t = t, .v_mps = Vec3(k, 0.1, 0), .sigma_mps = Vec3(0.1, 0.2, kUnmeasured_mps), .p_B = Vec3(0, 0, -0.3)};
    wheel.q_BS = so3_exp(Vec3(0.1, 0.2, 0.3));
    for (const AidingSample& r :
         {AidingSample(ahead), AidingSample(down), AidingSample(wheel), AidingSample(PressureSample{t, 1e5 + k, 3})})
      events.emplace_back(r);
    events.emplace_back(frame(50 * k));
  }
  write(events);
  auto data = open_dataset(path_, {});
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data)->info().aiding.size(), 3u);
  std::vector<AidingSample> written, back;
  for (const SensorEvent& event : events)
    if (const auto* r = std::get_if<AidingSample>(&event)) written.push_back(*r);
  for (const SensorEvent& event : drain(**data))
    if (const auto* r = std::get_if<AidingSample>(&event)) back.push_back(*r);
  ASSERT_EQ(back.size(), written.size());
  for (std::size_t i = 0; i < written.size(); ++i) EXPECT_EQ(stamp_of(back[i]), stamp_of(written[i])) << i;
  const auto ranges = readings_of<RangeSample>(back);
  ASSERT_EQ(ranges.size(), 12u);
  EXPECT_LT((ranges[0].direction_B - Vec3::UnitX()).norm(), 1e-12);
  EXPECT_LT((ranges[1].direction_B + Vec3::UnitZ()).norm(), 1e-12);
  EXPECT_LT((ranges[1].p_B - Vec3(0.1, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(ranges[3].distance_m, 2.25);
  EXPECT_EQ(ranges[3].sigma_m, 0.5);
  const auto velocity = readings_of<VelocitySample>(back).back();
  EXPECT_EQ(velocity.v_mps, Vec3(5, 0.1, 0));
  EXPECT_LT(velocity.q_BS.angularDistance(so3_exp(Vec3(0.1, 0.2, 0.3))), 1e-9);
  EXPECT_EQ(readings_of<PressureSample>(back).back().pressure_pa, 100'005);
}

TEST_F(FlightRecordTest, KeepsTheOffsetsOfCamerasWithoutACommonTrigger) {
  std::vector<SensorEvent> events;
  for (int k = 0; k < 6; ++k) {
    events.emplace_back(reading(50 * k));
    events.emplace_back(frame(50 * k));
    std::get<StereoFrame>(events.back()).offsets.set(1, Duration{-(20 + k) * kMs});
  }
  write(events);
  auto data = open_dataset(path_, {});
  ASSERT_TRUE(data) << data.error().message;
  const std::vector<SensorEvent> back = drain(**data);
  ASSERT_EQ(back.size(), events.size());
  for (std::size_t i = 0; i < events.size(); ++i) EXPECT_TRUE(same_event(back[i], events[i])) << "event " << i;
}

/// The right camera's stamps are 8 ms late, as its calibration says: its images are those of their frames again, also where the
/// left one's are missing.
TEST_F(FlightRecordTest, KeepsFramesOfCamerasWithTimesOfTheirOwn) {
  rig_.cameras.push_back({rig_.left(), Pose<B, C0>(Quat::Identity(), Vec3(0, 0.1, 0))});
  rig_.cameras[1].camera.set_own_times({.time_offset_s = -0.008});
  std::vector<SensorEvent> events;
  for (int k = 0; k < 8; ++k) {
    events.emplace_back(reading(50 * k));
    StereoFrame all = frame(50 * k, k != 3, k != 5);
    all.set_image(2, picture(k + 7));
    all.offsets.set(1, Duration{8 * kMs});
    events.emplace_back(std::move(all));
  }
  write(events);
  auto data = open_dataset(path_);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data)->rig().times(1).time_offset_s, -0.008);
  for (const std::string& warning : (*data)->info().warnings) EXPECT_EQ(warning.find("trigger"), std::string::npos) << warning;
  const std::vector<SensorEvent> back = drain(**data);
  ASSERT_EQ(back.size(), events.size());
  for (std::size_t i = 0; i < events.size(); ++i) EXPECT_TRUE(same_event(back[i], events[i])) << "event " << i;
}

TEST_F(FlightRecordTest, KeepsFourCameras) {
  for (int i = 2; i < 4; ++i) rig_.cameras.push_back({rig_.left(), Pose<B, C0>(Quat::Identity(), Vec3(0, 0.1 * i, 0))});
  for (const bool triggered : {true, false}) {
    const std::vector<SensorEvent> events = flight_of_four(triggered);
    write(events);
    auto data = open_dataset(path_);
    ASSERT_TRUE(data) << data.error().message;
    EXPECT_EQ((*data)->rig().camera_count(), 4);
    EXPECT_EQ((*data)->rig().T_BC(3).p, rig_.T_BC(3).p);
    const std::vector<SensorEvent> back = drain(**data);
    ASSERT_EQ(back.size(), events.size());
    for (std::size_t i = 0; i < events.size(); ++i)
      EXPECT_TRUE(same_event(back[i], events[i])) << "event " << i << (triggered ? "" : ", without a trigger");
    fs::remove(path_);
  }
}

TEST_F(FlightRecordTest, OfFourCamerasBreakingOffCostsTheEndOnly) {
  for (int i = 2; i < 4; ++i) rig_.cameras.push_back({rig_.left(), Pose<B, C0>(Quat::Identity(), Vec3(0, 0.1 * i, 0))});
  const std::vector<SensorEvent> events = flight_of_four(true);
  write(events);
  const std::string whole = *read_file(path_, 1u << 24u);
  std::size_t most = 0;
  for (std::size_t size = 0; size < whole.size(); size += 89) {
    auto contents = read_mcap(bytes_in_memory(whole.substr(0, size)), "flight.mcap", {});
    if (!contents) continue;
    Dataset data(*std::move(contents), {});
    const std::vector<SensorEvent> back = drain(data);
    most = std::max(most, back.size());
    for (std::size_t i = 0; i < back.size(); ++i) ASSERT_TRUE(same_event(back[i], events[i])) << "event " << i << " of " << size;
  }
  EXPECT_EQ(most, events.size());
}

TEST_F(FlightRecordTest, KeepsDepths) {
  DepthSensor elsewhere;  // with images of another size
  elsewhere.own = MountedCamera{Camera(PinholeRadtan{20, 21, 19.5, 7.5, 0, 0, 0, 0}, 40, 16), {Quat::Identity(), rig_.T_BC0().p}};
  rig_ = with_depth(rig_, elsewhere);
  std::vector<SensorEvent> events;
  for (int k = 0; k < 4; ++k) {
    events.emplace_back(reading(50 * k));
    StereoFrame with = frame(50 * k, k != 2, false);
    auto depth = std::make_shared<DepthImage>(DepthImage{40, 16, std::vector<std::uint16_t>(40 * 16)});
    for (std::size_t i = 0; i < depth->mm.size(); ++i) depth->mm[i] = static_cast<std::uint16_t>(1000 * k + 3 * i);
    if (k != 1) with.depth = depth;
    events.emplace_back(std::move(with));
  }
  write(events);
  auto data = open_dataset(path_);
  ASSERT_TRUE(data) << data.error().message;
  ASSERT_TRUE((*data)->rig().depth && (*data)->rig().depth->own);
  EXPECT_EQ((*data)->rig().depth->own->camera.intrinsics()[3], 7.5);
  EXPECT_EQ((*data)->info().camera(0).unpaired, 0) << "one camera has no partner";
  const std::vector<SensorEvent> back = drain(**data);
  ASSERT_EQ(back.size(), events.size());
  for (std::size_t i = 0; i < events.size(); ++i) EXPECT_TRUE(same_event(back[i], events[i])) << "event " << i;
}

TEST_F(FlightRecordTest, CanBeReadFromALaterFrameOn) {
  write(eventful_flight());
  auto data = open_dataset(path_, {.skip_frames = 2, .max_frames = 1});
  ASSERT_TRUE(data) << data.error().message;
  const std::vector<SensorEvent> back = drain(**data);
  ASSERT_EQ(back.size(), 7u) << "six readings, of the second before it, and the frame";
  EXPECT_TRUE(same_event(back.back(), frame(30, true, false)));
}

/// Other messages of a record do not disturb its events.
TEST_F(FlightRecordTest, PosesAndHealthChangeNothing) {
  FlightRecord record = create();
  Odometry odometry;
  odometry.t = Time{kStart_ns};
  odometry.health = {HealthState::good, HealthReason::none};
  MapUpdate update;
  update.t = odometry.t;
  update.localised = true;
  const std::vector<SensorEvent> events = eventful_flight();
  for (const SensorEvent& event : events) {
    add_to(record, event);
    EXPECT_TRUE(record.add(odometry));
    EXPECT_TRUE(record.add_live({odometry.t, odometry.T_WB}));
    EXPECT_TRUE(record.add(update));
    EXPECT_TRUE(record.add_health(odometry.t, {0, "live", "good", {{"key", "value"}}}));
  }
  EXPECT_TRUE(record.finish());
  auto data = open_dataset(path_);
  ASSERT_TRUE(data) << data.error().message;
  const std::vector<SensorEvent> back = drain(**data);
  ASSERT_EQ(back.size(), events.size());
  for (std::size_t i = 0; i < events.size(); ++i) EXPECT_TRUE(same_event(back[i], events[i])) << "event " << i;
  EXPECT_EQ((*data)->info().warnings.size(), 3u)
      << "two gaps and images without partner, no damage: " << (*data)->info().warnings[0];
}

TEST_F(FlightRecordTest, BreakingOffCostsTheEndOnly) {
  write(eventful_flight());
  const std::string whole = *read_file(path_, 1u << 24u);
  const std::vector<SensorEvent> events = eventful_flight();
  std::size_t opened = 0, most = 0;
  for (std::size_t size = 0; size < whole.size(); size += 97) {
    auto contents = read_mcap(bytes_in_memory(whole.substr(0, size)), "flight.mcap", {});
    if (!contents) {
      EXPECT_EQ(opened, 0u) << "once there is an image it can be opened";
      EXPECT_EQ(contents.error().message.find('\n'), std::string::npos);
      continue;
    }
    ++opened;
    Dataset data(*std::move(contents), {});
    const std::vector<SensorEvent> back = drain(data);
    ASSERT_GE(back.size(), most) << "more bytes, more events";
    most = back.size();
    for (std::size_t i = 0; i < back.size(); ++i) ASSERT_TRUE(same_event(back[i], events[i])) << "event " << i << " of " << size;
  }
  EXPECT_GT(opened, 50u);
  EXPECT_EQ(most, events.size());
}

TEST_F(FlightRecordTest, WithoutImagesItIsRefused) {
  write(eventful_flight(), false);
  expect_refused(": holds no images, so the flight cannot be run again");
}

TEST_F(FlightRecordTest, WithoutReadingsItIsRefusedWhereTheyAreNeeded) {
  write({frame(10), frame(20)});
  expect_refused(": holds no IMU readings");
  EXPECT_TRUE(open_dataset(path_, {.require_imu = false}));
}

TEST_F(FlightRecordTest, WithoutCalibrationItIsRefusedUnlessOneIsGiven) {
  auto file = McapWriter::create(path_, {"ros2", "someone else"},
                                 {{"/imu", "sensor_msgs/msg/Imu", ""}, {"/camera/left", "sensor_msgs/msg/Image", ""}});
  ASSERT_TRUE(file);
  append_imu(file->begin_message(0, Time{5}), reading(0), {});
  file->end_message();
  append_image(file->begin_message(1, Time{5}), Time{5}, "x", picture(1).get());
  file->end_message();
  ASSERT_TRUE(file->finish());
  expect_refused(": holds no calibration, and none is given with it");
}

TEST_F(FlightRecordTest, ACamchainReplacesTheCamerasAndNotTheNoise) {
  StereoRig own = small_rig(), kalibr = small_rig();
  own.imu_noise.gyro_noise_density_radps_rthz = 3e-4;
  kalibr.imu_noise.gyro_noise_density_radps_rthz = 5e-4;
  kalibr.cameras[1].T_BC.p = Vec3(0.2, 0, 0);
  const KalibrFiles files(kalibr);
  auto record = FlightRecord::create(path_, own, {.program = "a test", .images = true});
  ASSERT_TRUE(record);
  for (const SensorEvent& event : eventful_flight()) add_to(*record, event);
  ASSERT_TRUE(record->finish());
  const auto cameras = open_dataset(path_, {.kalibr_camchain = files.camchain()});
  ASSERT_TRUE(cameras) << cameras.error().message;
  EXPECT_NEAR((*cameras)->rig().T_BC1().p.x(), 0.2, 1e-12);
  EXPECT_DOUBLE_EQ((*cameras)->rig().imu_noise.gyro_noise_density_radps_rthz, 3e-4);
  const auto both = open_dataset(path_, {.kalibr_camchain = files.camchain(), .kalibr_imu = files.imu()});
  ASSERT_TRUE(both) << both.error().message;
  EXPECT_DOUBLE_EQ((*both)->rig().imu_noise.gyro_noise_density_radps_rthz, 5e-4);
}

TEST_F(FlightRecordTest, MalformedMessagesAreNamedAndLeftOut) {
  {
    auto file = McapWriter::create(path_, {"ros2", "a test"},
                                   {{"/imu", "sensor_msgs/msg/Imu", ""}, {"/camera/left", "sensor_msgs/msg/Image", ""}});
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->attach("calibration.yaml", "application/yaml", *read_file(path_, 1u << 20u)));
    file->begin_message(0, Time{5}) += "nonsense";
    file->end_message();
    file->begin_message(1, Time{5}) += "nonsense";
    file->end_message();
    ASSERT_TRUE(file->finish());
  }
  const auto data = open_dataset(path_);
  ASSERT_FALSE(data);
  EXPECT_TRUE(data.error().message.starts_with(path_ + ": byte ")) << data.error().message;
  EXPECT_TRUE(data.error().message.ends_with(": this is not an IMU reading")) << data.error().message;
}

TEST_F(FlightRecordTest, TruthOfAConvertedRecordingIsKept) {
  FlightRecord record = create();
  ASSERT_TRUE(record.add(reading(0)));
  ASSERT_TRUE(record.add_truth(Time{kStart_ns}, {so3_exp({0.1, 0.2, 0.3}), {1, 2, 3}}));
  ASSERT_TRUE(record.add(frame(0)));
  ASSERT_TRUE(record.finish());
  const auto data = open_dataset(path_);
  ASSERT_TRUE(data) << data.error().message;
  ASSERT_EQ((*data)->ground_truth().size(), 1u);
  EXPECT_EQ((*data)->ground_truth()[0].T_WB.p, Vec3(1, 2, 3));
  EXPECT_EQ((*data)->info().ground_truth_poses, 1);
}

TEST_F(FlightRecordTest, AnImageOfAnotherSizeIsLeftOut) {
  write({reading(0), frame(0), reading(5), StereoFrame{Time{kStart_ns + 5 * kMs}, {picture(1, 8, 8), picture(2)}}, reading(10),
         frame(10)});
  auto data = open_dataset(path_);
  ASSERT_TRUE(data) << data.error().message;
  const std::vector<SensorEvent> back = drain(**data);
  EXPECT_EQ(std::get<StereoFrame>(back[3]).left(), nullptr);
  EXPECT_EQ((*data)->info().camera(0).images.wrong_size, 1);
  EXPECT_TRUE((*data)->info().warnings.back().ends_with(": 8 x 8 pixels where the calibration says 32 x 24"));
}

TEST_F(FlightRecordTest, StampsBeyondRosAreRefused) {
  FlightRecord record = create();
  EXPECT_FALSE(record.add(ImuSample{Time{-1}}));
  EXPECT_FALSE(record.add(ImuSample{ros_time_end()}));
  EXPECT_TRUE(record.add(ImuSample{Time{ros_time_end().ns - 1}}));
  EXPECT_TRUE(record.finish());
}

TEST_F(FlightRecordTest, AFileThatIsNoMcapIsRefused) {
  std::ofstream(path_) << "hello";
  expect_refused(": does not begin as an MCAP file does");
}

}  // namespace mcap_dataset_test
}  // namespace fbvins
