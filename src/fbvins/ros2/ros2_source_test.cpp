// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <thread>

#include "fbvins/io/ros_messages.hpp"
#include "fbvins/ros2/ros2_test_graph.hpp"

namespace fbvins {
namespace ros2_source_test {

namespace fs = std::filesystem;
using test::node;

constexpr int kWidth = 8, kHeight = 6;

/// A Kalibr file of two small cameras.
class CameraFile {
 public:
  CameraFile() {
    std::ofstream file(path_);
    for (const char* camera : {"cam0", "cam1"}) {
      file << camera << ":\n  camera_model: pinhole\n  intrinsics: [5.0, 5.0, 4.0, 3.0]\n  distortion_model: radtan\n"
           << "  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]\n  resolution: [" << kWidth << ", " << kHeight << "]\n"
           << "  T_cam_imu:\n  - [1.0, 0.0, 0.0, " << (camera[3] == '0' ? "0.0" : "-0.1")
           << "]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, 0.0, 0.0, 1.0]\n";
    }
  }
  ~CameraFile() { fs::remove(path_); }
  SourceOptions options() const {
    SourceOptions options;
    options.dataset.kalibr_camchain = path_;
    return options;
  }

 private:
  std::string path_ = (fs::temp_directory_path() / ("fbvins_ros2_" + std::to_string(getpid()) + ".yaml")).string();
};

struct Notes final : SensorInput {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<ImuSample> readings;
  std::vector<StereoFrame> frames;
  std::vector<std::string> said;

  void push(const ImuSample& sample) override {
    note([&] { readings.push_back(sample); });
  }
  void push(StereoFrame frame) override {
    note([&] { frames.push_back(std::move(frame)); });
  }
  template <class Note>
  void note(const Note& add) {
    const std::lock_guard lock(mutex);
    add();
    changed.notify_all();
  }
  template <class Fact>
  bool wait(const Fact& fact) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, std::chrono::seconds(60), fact);
  }
};

TEST(Ros2Topics, AreThree) {
  const auto topics = parse_ros2_topics("/left,/right,/imu/data");
  ASSERT_TRUE(topics);
  EXPECT_EQ(topics->imu, "/imu/data");
  for (const char* wrong : {"", "/a", "/a,/b", "/a,/b,/c,/d", "/a,,/c", "/a,b,/c"})
    EXPECT_FALSE(parse_ros2_topics(wrong)) << wrong;
}

TEST(Ros2Source, WithoutACalibrationItSaysWhatItWants) {
  const auto source = Ros2Source::open(node(), {"/left", "/right", "/imu"}, {});
  ASSERT_FALSE(source);
  EXPECT_NE(source.error().message.find("--calibration"), std::string::npos);
  SourceOptions to_calibrate;
  to_calibrate.uncalibrated = StereoRig{};
  EXPECT_TRUE(Ros2Source::open(node(), {"/left", "/right", "/imu"}, to_calibrate));
}

TEST(Ros2Source, DeliversPairsAndReadingsAndSaysWhatItCannotTake) {
  const CameraFile camera;
  Notes notes;
  SourceOptions options = camera.options();
  options.say = [&](const std::string& sentence) { notes.note([&] { notes.said.push_back(sentence); }); };
  auto source = Ros2Source::open(node(), {"/src/left", "/src/right", "/src/imu"}, options);
  ASSERT_TRUE(source) << source.error().message;
  std::thread runs([&] { EXPECT_TRUE((*source)->run(notes)); });
  const auto left = Ros2Publisher::create(node(), "/src/left", "sensor_msgs/msg/Image");
  const auto right = Ros2Publisher::create(node(), "/src/right", "sensor_msgs/msg/Image");
  const auto imu = Ros2Publisher::create(node(), "/src/imu", "sensor_msgs/msg/Imu", {.depth = 1000});
  ASSERT_TRUE(left && right && imu);
  const auto send = [](const Ros2Publisher& to, int k, int width, int height) {
    const Image image(width, height, static_cast<std::uint8_t>(k));
    std::string message;
    append_image(message, Time{k * 50'000'000LL}, kLeftFrame, &image);
    EXPECT_TRUE(to.publish(std::move(message)));
  };
  // Publishers are found within moments, one after the other; messages sent before are lost, and a pair may lack an image.
  const auto pair = [&] { return std::ranges::find_if(notes.frames, [](const StereoFrame& f) { return f.left && f.right; }); };
  const auto both_came = [&] {
    const std::lock_guard lock(notes.mutex);
    return pair() != notes.frames.end() && !notes.readings.empty();
  };
  for (int k = 1; !both_came(); ++k) {
    send(*left, k, kWidth, kHeight);
    send(*right, k, kWidth, kHeight);
    std::string reading;
    append_imu(reading, {Time{k * 50'000'000LL}, Vec3(1, 2, 3), Vec3(4, 5, 6)}, {});
    ASSERT_TRUE(imu->publish(std::move(reading)));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ASSERT_LT(k, 3000);
  }
  send(*left, 100'000, kWidth + 1, kHeight);
  EXPECT_TRUE(notes.wait([&] { return !notes.said.empty(); }));
  (*source)->stop();
  runs.join();
  EXPECT_EQ(notes.said.front(), "/src/left: images are 9 x 6, in the calibration they are 8 x 6");
  for (const auto& image : {pair()->left, pair()->right})
    EXPECT_EQ(image->at(3, 2), static_cast<std::uint8_t>(pair()->t.ns / 50'000'000));
  EXPECT_EQ(notes.readings.front().accel_mps2, Vec3(4, 5, 6));
}

}  // namespace ros2_source_test
}  // namespace fbvins
