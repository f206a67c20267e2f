// SPDX-License-Identifier: Apache-2.0
// A flight with cameras and a flight controller that are simulated here, in wall time.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "fbvins/io/dataset.hpp"
#include "fbvins/live/live_system.hpp"
#include "tests/support/fake_flight_controller.hpp"
#include "tests/support/running_source.hpp"

namespace fbvins {
namespace v4l2_flight_test {

using namespace running_source;

void sleep_until(Time t) {
  if (const Duration left = t - host_now(); left.ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(left.ns));
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
      all.push_back({frame.t, {}, padded(*frame.left()), padded(*frame.right())});
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

/// What was delivered, and by how much the slowest delivery was late.
struct Played {
  std::size_t readings = 0;
  int images_lost = 0;
  Duration behind{0};
};

/// Delivers in wall time; `stamps` is told what the controller reads when. The cameras stamp `late`.
Played play(const std::vector<Delivery>& all, Time began, Duration late, FakeVideo& left, FakeVideo& right,
            FakeFlightController& controller, StampCheck& stamps) {
  Played played;
  for (const Delivery& next : all) {
    const Time t = began + (next.t - all.front().t);
    sleep_until(t);
    played.behind = std::max(played.behind, host_now() - t);
    if (next.reading) {
      ++played.readings;
      stamps.taken(*next.reading, t);
      controller.read(t, next.reading->gyro_radps, next.reading->accel_mps2);
    } else {
      const bool both = left.deliver(t + late, next.left) & right.deliver(t + late, next.right);
      played.images_lost += both ? 0 : 1;
    }
  }
  return played;
}

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
TEST(V4l2Flight, FliesWithTheFlightControllersImu) {
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

  const Time began = host_now();
  const Played played = play(all, began, late, left, right, controller, stamps);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  running.source->stop();
  ASSERT_TRUE(live->finish());
  const LiveCounts counts = live->status().counts;
  // In wall time, with devices that are threads of this program: on a busy machine images are dropped and readings overflow the
  // socket, but what comes is stamped as it should be, and what does not is counted.
  EXPECT_LT(std::abs(stamps.median_s()), 1e-3) << "the flight controller's clock";
  EXPECT_LE(counts.images_estimated + counts.images_dropped + counts.images_late, counts.images);
  EXPECT_GE(counts.images_estimated + counts.images_dropped + counts.images_late, counts.images - 1) << "one may wait at the end";
  const bool in_time = played.behind.ns < 1'000 * kMs;
  if (in_time) {
    EXPECT_EQ(stamps.readings(), played.readings) << "none is lost or refused";
    EXPECT_EQ(counts.clock_leaps, 0);
  }
  if (!in_time || counts.images_dropped + played.images_lost > 0) return;
  ASSERT_GT(poses.size(), 100u) << counts.images << " images, " << counts.imu << " readings";

  // The displacement's length must be the truth's; the frame of reference is free.
  const auto truth = (*dataset)->ground_truth();
  const Duration since_recorded = began - all.front().t + late;
  const double flown = (poses.back().T_WB.p - poses.front().T_WB.p).norm(),
               wanted = (true_position(truth, poses.back().t - since_recorded) -
                         true_position(truth, poses.front().t - since_recorded))
                            .norm();
  EXPECT_NEAR(flown, wanted, 0.05 + 0.02 * wanted);
}

}  // namespace v4l2_flight_test
}  // namespace fbvins
