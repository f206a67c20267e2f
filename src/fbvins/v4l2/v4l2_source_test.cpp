// SPDX-License-Identifier: Apache-2.0
// Cameras and a flight controller that are simulated here, in wall time.
#include "fbvins/v4l2/v4l2_source.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "fbvins/io/dataset.hpp"
#include "fbvins/io/kalibr_test_files.hpp"
#include "fbvins/live/collected_input.hpp"
#include "fbvins/live/host_clock.hpp"
#include "fbvins/live/live_system.hpp"
#include "fbvins/mavlink/wire.hpp"
#include "fbvins/v4l2/fake_video.hpp"

namespace fbvins {
namespace v4l2_source_test {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::chrono::seconds kPatience{10};

void sleep_until(Time t) {
  if (const Duration left = t - host_now(); left.ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(left.ns));
}

/// A flight controller on a UDP port: heartbeats, answers to TIMESYNC, readings on request. Its clock is ahead.
class FakeFlightController {
 public:
  explicit FakeFlightController(Duration ahead) : ahead_(ahead), socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(socket_.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    socklen_t size = sizeof address;
    ::getsockname(socket_.number(), reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    listener_ = std::thread([this] { listen(); });
  }
  ~FakeFlightController() {
    ending_ = true;
    listener_.join();
  }
  std::string address() const { return fmt::format("udp:127.0.0.1:{}:0", port_); }
  bool was_synchronised() const { return answers_ > 10; }
  void read(Time t, const Vec3& gyro, const Vec3& accel) {
    HighresImuMessage m;
    m.time_usec = static_cast<std::uint64_t>((t + ahead_).ns / 1000);
    for (int i = 0; i < 3; ++i) {
      m.gyro[static_cast<std::size_t>(i)] = static_cast<float>(gyro[i]);
      m.acc[static_cast<std::size_t>(i)] = static_cast<float>(accel[i]);
    }
    m.fields_updated = 0xffff;
    say(m);
  }

 private:
  void say(const MavlinkMessage& message) {
    const std::lock_guard lock(mutex_);
    if (peer_.sin_port == 0) return;
    const auto frame = encode_mavlink(message, {1, 1}, sequence_++);
    ::sendto(socket_.number(), frame.data(), frame.size(), 0, reinterpret_cast<const sockaddr*>(&peer_), sizeof peer_);
  }
  void listen() {
    MavlinkDecoder decoder;
    Time next_beat = host_now();
    while (!ending_) {
      if (host_now() >= next_beat) {
        HeartbeatMessage beat;
        beat.autopilot = 12;
        say(beat);
        next_beat = next_beat + Duration{200 * kMs};
      }
      pollfd waiting{socket_.number(), POLLIN, 0};
      if (::poll(&waiting, 1, 20) <= 0) continue;
      std::uint8_t bytes[2048];
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const ssize_t got = ::recvfrom(socket_.number(), bytes, sizeof bytes, 0, reinterpret_cast<sockaddr*>(&from), &size);
      if (got <= 0) continue;
      {
        const std::lock_guard lock(mutex_);
        peer_ = from;
      }
      for (const MavlinkFrame& frame : decoder.push({bytes, static_cast<std::size_t>(got)}))
        if (const auto* question = std::get_if<TimesyncMessage>(&frame.message); question && question->tc1 == 0) {
          say(TimesyncMessage{(host_now() + ahead_).ns, question->ts1});
          ++answers_;
        }
    }
  }

  Duration ahead_;
  FileDescriptor socket_;
  int port_ = 0;
  std::mutex mutex_;
  sockaddr_in peer_{};
  std::uint8_t sequence_ = 0;
  std::atomic<bool> ending_ = false;
  std::atomic<int> answers_ = 0;
  std::thread listener_;
};

StereoRig small_rig() {
  StereoRig rig;
  rig.left = rig.right = Camera(PinholeRadtan{100, 100, 31.5, 23.5, 0, 0, 0, 0}, 64, 48);
  rig.T_BC1.p = Vec3(0.1, 0, 0);
  return rig;
}

std::vector<std::uint8_t> filled(std::size_t size, int value) {
  return std::vector<std::uint8_t>(size, static_cast<std::uint8_t>(value));
}

/// A source that runs in a thread, and its messages.
struct Running {
  Running(const std::string& devices, const StereoRig& rig) : files(rig) {
    options.dataset.kalibr_camchain = files.camchain();
    options.dataset.kalibr_imu = files.imu();
    options.say = [this](const std::string& sentence) {
      const std::lock_guard lock(mutex);
      said.push_back(sentence);
    };
    auto opened = V4l2Source::open(devices, options);
    EXPECT_TRUE(opened) << opened.error().message;
    source = std::move(*opened);
  }
  void start(SensorInput& input) {
    thread = std::thread([this, &input] { EXPECT_TRUE(source->run(input)); });
  }
  ~Running() {
    source->stop();
    if (thread.joinable()) thread.join();
  }
  bool heard(const std::string& what) {
    for (int i = 0; i < 100; ++i) {
      {
        const std::lock_guard lock(mutex);
        if (std::any_of(said.begin(), said.end(), [&](const std::string& s) { return s.find(what) != std::string::npos; }))
          return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  }
  KalibrFiles files;
  SourceOptions options;
  std::mutex mutex;
  std::vector<std::string> said;
  std::unique_ptr<V4l2Source> source;
  std::thread thread;
};

/// Delivers as soon as the camera streams and has a buffer.
bool deliver(FakeVideo& camera, Time t, const std::vector<std::uint8_t>& bytes) {
  for (const Time end = host_now() + Duration{10'000 * kMs}; host_now() < end;) {
    if (camera.deliver(t, bytes)) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

TEST(V4l2Source, PutsTwoCamerasTogether) {
  FakeVideo left("/fake/left", {fourcc("MJPG"), fourcc("YUYV")}), right("/fake/right", {fourcc("GREY")});
  Running running("/fake/left,/fake/right,udp:127.0.0.1:9:0", small_rig());
  CollectedInput got;
  running.start(got);
  // Stamps at a camera's pace, however fast they come: within 2 ms another frame's image would be a partner as good.
  const Time begin = host_now();
  for (int i = 0; i < 8; ++i) {
    const Time t = begin + Duration{i * 33 * kMs};
    ASSERT_TRUE(deliver(left, t, filled((128 + 32) * 48, 10 + i)));
    ASSERT_TRUE(deliver(right, t + Duration{kMs / 2}, filled((64 + 32) * 48, 30 + i)));
    if (i == 3) left.damage_next();
  }
  ASSERT_TRUE(got.wait_for_frames(8, kPatience));
  int pairs = 0;
  for (const StereoFrame& frame : got.frames) {
    if (!frame.left || !frame.right) continue;
    ++pairs;
    EXPECT_EQ(frame.right->at(63, 47) - frame.left->at(0, 0), 20);
  }
  EXPECT_EQ(pairs, 7) << "a damaged image is none";
  EXPECT_TRUE(running.heard("64 x 48 pixels of YUYV"));
}

TEST(V4l2Source, CutsOneCameraInTwo) {
  FakeVideo both("/fake/both", {fourcc("GREY")});
  Running running("/fake/both,udp:127.0.0.1:9:0", small_rig());
  CollectedInput got;
  running.start(got);
  std::vector<std::uint8_t> bytes = filled((128 + 32) * 48, 1);
  for (std::size_t y = 0; y < 48; ++y)
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(y * 160 + 64), 64, std::uint8_t{2});
  ASSERT_TRUE(deliver(both, Time{5}, bytes));
  ASSERT_TRUE(got.wait_for_frames(1, kPatience));
  EXPECT_EQ(got.frames[0].left->at(63, 47), 1);
  EXPECT_EQ(got.frames[0].right->at(0, 0), 2);
}

StereoRig rig_of_three() {
  StereoRig rig = small_rig();
  rig.more.push_back({Camera(PinholeRadtan{50, 50, 15.5, 11.5, 0, 0, 0, 0}, 32, 24), {Quat::Identity(), Vec3(0.2, 0, 0)}});
  return rig;
}

TEST(V4l2Source, PutsThreeCamerasTogether) {
  FakeVideo left("/fake/left", {fourcc("GREY")}), right("/fake/right", {fourcc("GREY")}), small("/fake/small", {fourcc("GREY")});
  Running running("/fake/left,/fake/right,/fake/small,udp:127.0.0.1:9:0", rig_of_three());
  CollectedInput got;
  running.start(got);
  const Time begin = host_now();
  for (int i = 0; i < 3; ++i) {
    const Time t = begin + Duration{i * 33 * kMs};
    ASSERT_TRUE(deliver(left, t, filled((64 + 32) * 48, 10 + i)));
    ASSERT_TRUE(deliver(right, t, filled((64 + 32) * 48, 30 + i)));
    ASSERT_TRUE(deliver(small, t, filled((32 + 32) * 24, 50 + i)));
  }
  ASSERT_TRUE(got.wait_for_frames(3, kPatience));
  ASSERT_TRUE(got.frames[1].image(2));
  EXPECT_EQ(got.frames[1].image(2)->width(), 32);
  EXPECT_EQ(got.frames[1].image(2)->at(31, 23) - got.frames[1].left->at(0, 0), 40);
}

TEST(V4l2Source, OneDeviceMayHaveOneCameraOrSeveralSideBySide) {
  StereoRig alike = small_rig();
  alike.more.push_back({alike.left, {Quat::Identity(), Vec3(0.2, 0, 0)}});
  for (const StereoRig& rig : {with_one_camera(alike), alike}) {
    const int cameras = rig.camera_count();
    FakeVideo device("/fake/all", {fourcc("GREY")});
    Running running("/fake/all,udp:127.0.0.1:9:0", rig);
    CollectedInput got;
    running.start(got);
    std::vector<std::uint8_t> bytes = filled(static_cast<std::size_t>(64 * cameras + 32) * 48, 1);
    bytes[static_cast<std::size_t>(64 * cameras - 1)] = 7;
    ASSERT_TRUE(deliver(device, Time{5}, bytes));
    ASSERT_TRUE(got.wait_for_frames(1, kPatience));
    EXPECT_EQ(got.frames[0].image(cameras - 1)->at(63, 0), 7);
    EXPECT_EQ(got.frames[0].right != nullptr, cameras > 1);
  }
}

TEST(V4l2Source, DevicesAreThoseOfTheCalibration) {
  const KalibrFiles three(rig_of_three());
  SourceOptions options;
  options.dataset.kalibr_camchain = three.camchain();
  const auto said = [&](const char* devices) { return V4l2Source::open(devices, options).error().message; };
  EXPECT_NE(said("/a,/b,udp:127.0.0.1:9:0").find("has 3 cameras, and there are 2 video devices"), std::string::npos);
  EXPECT_NE(said("/a,udp:127.0.0.1:9:0").find("camera 2 has another than camera 0"), std::string::npos);
  options.dataset.kalibr_camchain = "";
  options.uncalibrated = small_rig();
  const auto source = V4l2Source::open("/a,/b,/c,/d,udp:127.0.0.1:9:0", options);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->rig().camera_count(), 4) << "to calibrate";
}

TEST(V4l2Source, WaitsForACameraThatIsUnplugged) {
  auto camera = std::make_unique<FakeVideo>("/fake/both", std::vector{fourcc("GREY")});
  Running running("/fake/both,udp:127.0.0.1:9:0", small_rig());
  CollectedInput got;
  running.start(got);
  ASSERT_TRUE(deliver(*camera, host_now(), filled(160 * 48, 1)));
  ASSERT_TRUE(got.wait_for_frames(1, kPatience));
  camera.reset();
  EXPECT_TRUE(running.heard("is gone"));
  camera = std::make_unique<FakeVideo>("/fake/both", std::vector{fourcc("GREY")});
  ASSERT_TRUE(deliver(*camera, host_now(), filled(160 * 48, 2)));
  ASSERT_TRUE(got.wait_for_frames(2, kPatience));
}

TEST(V4l2Source, SaysWhatIsWrong) {
  FakeVideo narrow("/fake/narrow", {fourcc("GREY")}, 100), colours("/fake/colours", {fourcc("RGB3")}),
      silent("/fake/silent", {fourcc("GREY")});
  silent.say_no_time();
  {
    Running running("/fake/narrow,/fake/colours,udp:127.0.0.1:9:0", [] {
      StereoRig rig = small_rig();
      rig.left = rig.right = Camera(PinholeRadtan{100, 100, 60, 23.5, 0, 0, 0, 0}, 128, 48);
      return rig;
    }());
    CollectedInput got;
    running.start(got);
    EXPECT_TRUE(running.heard("delivers 100 x 48 pixels of GREY, wanted are 128 x 48"));
    EXPECT_TRUE(running.heard("has formats RGB3"));
  }
  Running running("/fake/silent,/fake/none,udp:127.0.0.1:9:0", small_rig());
  CollectedInput got;
  running.start(got);
  EXPECT_TRUE(running.heard("/fake/none: cannot be opened: No such file"));
  ASSERT_TRUE(deliver(silent, Time{1}, filled(96 * 48, 1)));
  EXPECT_TRUE(running.heard("gives no time stamps"));
  EXPECT_TRUE(running.heard("no flight controller is heard"));
}

TEST(V4l2Source, RefusesWordsItDoesNotUnderstand) {
  for (const char* text : {"", "/dev/video0", "/dev/video0,,udp:127.0.0.1:9:0", "0,1,2,3,4,5,6,7,8,udp:127.0.0.1:9:0"})
    EXPECT_FALSE(parse_v4l2_devices(text)) << text;
  const KalibrFiles files(small_rig());
  SourceOptions options;
  EXPECT_FALSE(V4l2Source::open("/dev/video0,udp:127.0.0.1:9:0", options)) << "no calibration";
  options.uncalibrated = small_rig();
  EXPECT_TRUE(V4l2Source::open("/dev/video0,udp:127.0.0.1:9:0", options)) << "to calibrate";
  options.dataset.kalibr_camchain = files.camchain();
  EXPECT_FALSE(V4l2Source::open("/dev/video0,/dev/imu", options)) << "no kind of IMU";
}

/// An image as a driver delivers it: rows with 32 bytes of padding.
std::vector<std::uint8_t> padded(const Image& image) {
  std::vector<std::uint8_t> bytes;
  for (int y = 0; y < image.height(); ++y) {
    bytes.insert(bytes.end(), image.row(y), image.row(y) + image.width());
    bytes.resize(bytes.size() + 32);
  }
  return bytes;
}

/// A recording's beginning as devices deliver it; nothing is decoded in flight.
struct Delivery {
  Time t;  ///< as recorded
  std::optional<ImuSample> reading;
  std::vector<std::uint8_t> left, right;
};

std::vector<Delivery> deliveries(Dataset& dataset, int images) {
  std::vector<Delivery> all;
  while (auto event = dataset.next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) {
      all.push_back({sample->t, *sample, {}, {}});
    } else {
      if (images-- == 0) break;
      const auto& frame = std::get<StereoFrame>(*event);
      all.push_back({frame.t, {}, padded(*frame.left), padded(*frame.right)});
    }
  }
  return all;
}

/// Passes everything on, and compares the stamps of readings with the truth; readings are identified by their values.
class StampCheck final : public SensorInput {
 public:
  explicit StampCheck(SensorInput& input) : all_(input) {}
  void taken(const ImuSample& sample, Time t) {
    const std::lock_guard lock(mutex_);
    truth_[key(sample)] = t;
  }
  void push(const ImuSample& sample) override {
    {
      const std::lock_guard lock(mutex_);
      if (const auto truth = truth_.find(key(sample)); truth != truth_.end())
        off_s_.push_back((sample.t - truth->second).seconds());
    }
    all_.push(sample);
  }
  void push(StereoFrame frame) override { all_.push(std::move(frame)); }

  std::size_t readings() const {
    const std::lock_guard lock(mutex_);
    return off_s_.size();
  }
  double median_s() {
    const std::lock_guard lock(mutex_);
    std::nth_element(off_s_.begin(), off_s_.begin() + std::ssize(off_s_) / 2, off_s_.end());
    return off_s_[off_s_.size() / 2];
  }

 private:
  using Key = std::array<float, 6>;
  static Key key(const ImuSample& s) {
    Key key;
    for (std::size_t i = 0; i < 3; ++i) {
      key[i] = static_cast<float>(s.accel_mps2[static_cast<int>(i)]);
      key[i + 3] = static_cast<float>(s.gyro_radps[static_cast<int>(i)]);
    }
    return key;
  }
  SensorInput& all_;
  mutable std::mutex mutex_;
  std::map<Key, Time> truth_;
  std::vector<double> off_s_;
};

class KeptPoses final : public Sink {
 public:
  explicit KeptPoses(std::vector<Odometry>& poses) : all_(poses) {}
  std::string_view name() const override { return "poses"; }
  Result<void> take(const LiveEvent& event) override {
    if (const auto* odometry = std::get_if<Odometry>(&event); odometry && odometry->health.has_pose()) all_.push_back(*odometry);
    return {};
  }

 private:
  std::vector<Odometry>& all_;
};

Vec3 true_position(const std::vector<TrajectoryPoint>& truth, Time t) {
  const auto after = std::lower_bound(truth.begin(), truth.end(), t, [](const auto& p, Time at) { return p.t < at; });
  return after == truth.end() ? truth.back().T_WB.p : after->T_WB.p;
}

/// A real flight: images by two video devices, readings by MAVLink of a flight controller whose clock is ahead by 77 s, and
/// cameras that stamp 8 ms late, as the calibration says.
TEST(V4l2Source, FliesWithTheFlightControllersImu) {
  const char* data = std::getenv("FBVINS_DATA");
  const std::string flight = std::string(data != nullptr ? data : FBVINS_SOURCE_DIR "/../shared/data") + "/MH_01_easy_17s";
  if (!std::filesystem::exists(flight)) GTEST_SKIP() << flight << " is not there";
  auto dataset = open_dataset(flight);
  ASSERT_TRUE(dataset) << dataset.error().message;
  StereoRig rig = (*dataset)->rig();
  const Duration late{8 * kMs};
  rig.time_offset_s -= late.seconds();
  const std::vector<Delivery> all = deliveries(**dataset, 240);

  FakeVideo left("/fake/left", {fourcc("GREY")}), right("/fake/right", {fourcc("GREY")});
  FakeFlightController controller(Duration{77'123 * kMs});
  Running running("/fake/left,/fake/right," + controller.address(), rig);
  std::vector<Odometry> poses;
  auto live = LiveSystem::create({}, {}, running.source->rig());
  ASSERT_TRUE(live) << live.error().message;
  live->add_sink(std::make_unique<KeptPoses>(poses));
  StampCheck stamps(live->input());
  running.start(stamps);
  for (int i = 0; i < 500 && !controller.was_synchronised(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_TRUE(controller.was_synchronised());

  const Duration to_now = host_now() - all.front().t;
  std::size_t readings = 0;
  int images_lost = 0;
  Duration behind{0};
  for (const Delivery& next : all) {
    const Time t = next.t + to_now;
    sleep_until(t);
    behind = std::max(behind, host_now() - t);
    if (next.reading) {
      ++readings;
      stamps.taken(*next.reading, t);
      controller.read(t, next.reading->gyro_radps, next.reading->accel_mps2);
    } else {
      const bool both = left.deliver(t + late, next.left) & right.deliver(t + late, next.right);
      images_lost += both ? 0 : 1;
    }
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  running.source->stop();
  ASSERT_TRUE(live->finish());
  const LiveCounts counts = live->status().counts;
  RecordProperty("worst delay of a device, ms", static_cast<int>(behind.ns / kMs));
  // In wall time, with devices that are threads of this program.
  if (behind.ns > 1'000 * kMs) GTEST_SKIP() << "this machine is too busy: a device was " << behind.seconds() << " s late";
  EXPECT_EQ(stamps.readings(), readings) << "none is lost or refused";
  EXPECT_EQ(counts.clock_leaps, 0);
  EXPECT_LT(std::abs(stamps.median_s()), 1e-3) << "the flight controller's clock";
  if (counts.images_dropped + images_lost > 0)
    GTEST_SKIP() << "this machine is too busy: " << counts.images_dropped << " images dropped, " << images_lost << " not taken";
  ASSERT_GT(poses.size(), 100u) << counts.images << " images, " << counts.imu << " readings";

  // The displacement's length must be the truth's; the frame of reference is free.
  const auto truth = (*dataset)->ground_truth();
  const Time first = poses.front().t - late - to_now, last = poses.back().t - late - to_now;
  const double flown = (poses.back().T_WB.p - poses.front().T_WB.p).norm(),
               wanted = (true_position(truth, last) - true_position(truth, first)).norm();
  EXPECT_NEAR(flown, wanted, 0.05 + 0.02 * wanted);
}

}  // namespace v4l2_source_test
}  // namespace fbvins
