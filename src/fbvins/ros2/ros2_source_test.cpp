// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <thread>

#include "fbvins/io/ros_messages.hpp"
#include "tests/support/ros2_test_graph.hpp"

namespace fbvins {
namespace ros2_source_test {

namespace fs = std::filesystem;
using test::node;

constexpr int kWidth = 8, kHeight = 6;

/// A Kalibr file of small cameras.
class CameraFile {
 public:
  explicit CameraFile(int cameras = 2) {
    std::ofstream file(path_);
    for (int camera = 0; camera < cameras; ++camera) {
      file << "cam" << camera << ":\n  camera_model: pinhole\n  intrinsics: [5.0, 5.0, 4.0, 3.0]\n  distortion_model: radtan\n"
           << "  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]\n  resolution: [" << kWidth << ", " << kHeight << "]\n"
           << "  T_cam_imu:\n  - [1.0, 0.0, 0.0, " << -0.1 * camera
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

TEST(Ros2Topics, AreThoseOfCamerasAndIMU) {
  const auto topics = parse_ros2_topics("/left,/right,/imu/data");
  ASSERT_TRUE(topics);
  EXPECT_EQ(topics->cameras, (std::vector<std::string>{"/left", "/right"}));
  EXPECT_EQ(topics->imu, "/imu/data");
  EXPECT_EQ(parse_ros2_topics("/a,/b,/c,/d,/imu")->cameras.size(), 4u);
  EXPECT_EQ(parse_ros2_topics("/a,/imu,depth=/d")->depth, "/d");
  for (const char* wrong :
       {"", "/a", "/a,,/c", "/a,b,/c", "/a,/b,", "/0,/1,/2,/3,/4,/5,/6,/7,/8,/imu", "/a,/b,/imu,depth=/d", "/a,/imu,depth=d"})
    EXPECT_FALSE(parse_ros2_topics(wrong)) << wrong;
}

TEST(Ros2Source, TopicsAreThoseOfTheCalibration) {
  const CameraFile four(4);
  EXPECT_TRUE(Ros2Source::open(node(), *parse_ros2_topics("/a,/b,/c,/d,/imu"), four.options()));
  const auto two = Ros2Source::open(node(), *parse_ros2_topics("/a,/b,/imu"), four.options());
  ASSERT_FALSE(two);
  EXPECT_NE(two.error().message.find("has 4 cameras, and there are 2 ROS 2 topics"), std::string::npos) << two.error().message;
  const CameraFile one(1);
  const auto depth = Ros2Source::open(node(), *parse_ros2_topics("/a,/imu,depth=/d"), one.options());
  ASSERT_TRUE(depth) << depth.error().message;
  EXPECT_TRUE((*depth)->rig().depth);
  EXPECT_FALSE((*depth)->rig().depth->own);
  const CameraFile of_both(2);
  const auto elsewhere = Ros2Source::open(node(), *parse_ros2_topics("/a,/imu,depth=/d"), of_both.options());
  ASSERT_TRUE(elsewhere) << elsewhere.error().message;
  EXPECT_EQ((*elsewhere)->rig().camera_count(), 1);
  ASSERT_TRUE((*elsewhere)->rig().depth->own) << "the second camera is the depth sensor's";
  EXPECT_GT(((*elsewhere)->rig().depth->own->T_BC.p - (*elsewhere)->rig().T_BC0().p).norm(), 0.01);
  const CameraFile three(3);
  EXPECT_FALSE(Ros2Source::open(node(), *parse_ros2_topics("/a,/imu,depth=/d"), three.options()));
}

TEST(Ros2Source, WithoutACalibrationItSaysWhatItWants) {
  const auto source = Ros2Source::open(node(), {{"/left", "/right"}, "/imu"}, {});
  ASSERT_FALSE(source);
  EXPECT_NE(source.error().message.find("--calibration"), std::string::npos);
  SourceOptions to_calibrate;
  to_calibrate.uncalibrated = StereoRig{};
  EXPECT_TRUE(Ros2Source::open(node(), {{"/left", "/right"}, "/imu"}, to_calibrate));
}

TEST(Ros2Source, DeliversPairsAndReadingsAndSaysWhatItCannotTake) {
  const CameraFile camera;
  Notes notes;
  SourceOptions options = camera.options();
  options.say = [&](const std::string& sentence) { notes.note([&] { notes.said.push_back(sentence); }); };
  auto source = Ros2Source::open(node(), {{"/src/left", "/src/right"}, "/src/imu"}, options);
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
  const auto pair = [&] {
    return std::ranges::find_if(notes.frames, [](const StereoFrame& f) { return f.left() && f.right(); });
  };
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
  for (const auto& image : {pair()->left(), pair()->right()})
    EXPECT_EQ(image->at(3, 2), static_cast<std::uint8_t>(pair()->t.ns / 50'000'000));
  EXPECT_EQ(notes.readings.front().accel_mps2, Vec3(4, 5, 6));
}

TEST(Ros2Source, DepthImagesComeWithTheirCamera) {
  const CameraFile camera(1);
  Notes notes;
  auto source = Ros2Source::open(node(), *parse_ros2_topics("/rgbd/grey,/rgbd/imu,depth=/rgbd/depth"), camera.options());
  ASSERT_TRUE(source) << source.error().message;
  std::thread runs([&] { EXPECT_TRUE((*source)->run(notes)); });
  const auto grey = Ros2Publisher::create(node(), "/rgbd/grey", "sensor_msgs/msg/Image");
  const auto depth = Ros2Publisher::create(node(), "/rgbd/depth", "sensor_msgs/msg/Image");
  ASSERT_TRUE(grey && depth);
  const auto came = [&] {
    const std::lock_guard lock(notes.mutex);
    return std::ranges::any_of(notes.frames, [](const StereoFrame& f) { return f.left() && f.depth; });
  };
  for (int k = 1; !came(); ++k) {
    const Time t{k * 50'000'000LL};
    const Image image(kWidth, kHeight, static_cast<std::uint8_t>(k));
    DepthImage distances{kWidth, kHeight, {}};
    distances.mm.assign(std::size_t{kWidth} * kHeight, static_cast<std::uint16_t>(1000 + k));
    std::string first, second;
    append_image(first, t, kLeftFrame, &image);
    append_depth_image(second, t, kLeftFrame, distances);
    EXPECT_TRUE(grey->publish(std::move(first)) && depth->publish(std::move(second)));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ASSERT_LT(k, 3000);
  }
  (*source)->stop();
  runs.join();
  const auto both = std::ranges::find_if(notes.frames, [](const StereoFrame& f) { return f.left() && f.depth; });
  EXPECT_EQ(both->depth->row(5)[7], 1000 + both->t.ns / 50'000'000);
}

}  // namespace ros2_source_test
}  // namespace fbvins
