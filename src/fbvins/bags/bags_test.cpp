// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <unistd.h>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "fbvins/bags/bag_contents.hpp"
#include "fbvins/bags/bag_survey.hpp"
#include "fbvins/bags/grey_image.hpp"
#include "fbvins/bags/recording.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/bags/topic_choice.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/io/image_decode.hpp"

namespace fbvins {
namespace bags_test {

namespace fs = std::filesystem;

class Bags : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("fbvins_bags_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const char* name) const { return (folder_ / name).string(); }

  static StereoRig rig() {
    StereoRig rig;
    rig.cameras.resize(2);
    rig.cameras[0].camera = Camera(PinholeRadtan{90, 91, 40, 30, 0.1, 0.2, 0.01, 0.02}, 80, 60);
    rig.cameras[1].camera = Camera(PinholeRadtan{92, 93, 41, 31, 0.1, 0.2, 0.01, 0.02}, 80, 60);
    rig.cameras[0].T_BC = {so3_exp({0.1, -0.2, 1.5}), {0.01, -0.02, 0.03}};
    rig.cameras[1].T_BC = {so3_exp({0.12, -0.19, 1.49}), {0.01, 0.09, 0.03}};
    return rig;
  }
  static std::shared_ptr<const Image> image(int number) {
    auto out = std::make_shared<Image>(80, 60);
    for (int y = 0; y < 60; ++y)
      for (int x = 0; x < 80; ++x) out->at(x, y) = static_cast<std::uint8_t>(x + 3 * y + number);
    return out;
  }
  /// Twenty frames, ten readings each.
  void write(const std::string& file) const {
    auto bag = Ros1BagWriter::create(file, rig(), Time{1'000'000'000});
    ASSERT_TRUE(bag) << bag.error().message;
    for (int i = 0; i < 200; ++i) {
      const Time t{1'000'000'000 + 5'000'000 * static_cast<std::int64_t>(i)};
      ASSERT_TRUE(bag->add(ImuSample{t, Vec3(0.1 * i, 0, 1e-9), Vec3(0, 9.81, i)}));
      if (i % 10 != 5) continue;
      ASSERT_TRUE(bag->add(StereoFrame{t, {image(i), image(i + 1)}}));
    }
    ASSERT_TRUE(bag->finish());
  }
  fs::path folder_;
};

std::string bytes_of(const std::string& file) {
  std::ostringstream out;
  out << std::ifstream(file, std::ios::binary).rdbuf();
  return out.str();
}

TEST_F(Bags, WhatIsWrittenIsRead) {
  write(path("flight.bag"));
  auto data = open_recording(path("flight.bag"));
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data)->info().frames, 20);
  EXPECT_EQ((*data)->info().imu_samples, 200);
  EXPECT_LT(((*data)->rig().T_BC1().R() - rig().T_BC1().R()).norm(), 1e-12);
  EXPECT_EQ(std::get<PinholeRadtan>((*data)->rig().right().model()).p2, 0.02);
  int readings = 0, frames = 0;
  while (auto event = (*data)->next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) {
      EXPECT_EQ(sample->gyro_radps, Vec3(0.1 * readings, 0, 1e-9));
      EXPECT_EQ(sample->accel_mps2.z(), readings++);
      continue;
    }
    const auto& frame = std::get<StereoFrame>(*event);
    EXPECT_EQ(frame.left()->at(7, 11), image(5 + 10 * frames)->at(7, 11));
    EXPECT_EQ(frame.right()->at(79, 59), image(6 + 10 * frames++)->at(79, 59));
  }
  EXPECT_EQ(readings, 200);
  EXPECT_EQ(frames, 20);
}

/// A recording that is converted has its whole calibration afterwards, and the poses of its truth.
TEST_F(Bags, NoiseTimeOffsetAndTruthAreKept) {
  StereoRig given = rig();
  given.imu_noise = {1e-3, 2e-2, 3e-5, 4e-4, 201, 12, 80};
  given.time_offset_s = 0.0125;
  given.image_rate_hz = 20;
  auto bag = Ros1BagWriter::create(path("whole.bag"), given, Time{1'000'000'000});
  ASSERT_TRUE(bag) << bag.error().message;
  for (int i = 0; i < 50; ++i) {
    const Time t{1'000'000'000 + 5'000'000 * static_cast<std::int64_t>(i)};
    ASSERT_TRUE(bag->add(ImuSample{t, Vec3::Zero(), Vec3(0, 0, 9.81)}));
    if (i % 10 != 0) continue;
    ASSERT_TRUE(bag->add(StereoFrame{t, {image(i), image(i)}}));
    ASSERT_TRUE(bag->add_truth(t, {so3_exp({0.1, 0.2, 0.01 * i}), {1, 2, 0.1 * i}}));
  }
  ASSERT_TRUE(bag->finish());
  auto data = open_recording(path("whole.bag"));
  ASSERT_TRUE(data) << data.error().message;
  const StereoRig& read = (*data)->rig();
  EXPECT_EQ(read.imu_noise.accel_noise_density_mps2_rthz, 2e-2);
  EXPECT_EQ(read.imu_noise.rate_hz, 201);
  EXPECT_EQ(read.imu_noise.max_accel_mps2, 80);
  EXPECT_EQ(read.time_offset_s, 0.0125);
  EXPECT_EQ(read.T_BC0().q.coeffs(), given.T_BC0().q.coeffs());
  EXPECT_TRUE((*data)->info().warnings.empty()) << (*data)->info().warnings.front();
  ASSERT_EQ((*data)->ground_truth().size(), 5u);
  EXPECT_LT(((*data)->ground_truth()[3].T_WB.p - Vec3(1, 2, 3)).norm(), 1e-12);
  // Of exchanged topics the cameras are exchanged.
  const auto swapped = open_recording(path("whole.bag"), {.topics = {"/cam1/image_raw", "/cam0/image_raw"}});
  ASSERT_TRUE(swapped) << swapped.error().message;
  EXPECT_EQ((*swapped)->rig().time_offset_s, 0.0125);
  EXPECT_EQ((*swapped)->rig().left().focal_px(), 92.5);
}

/// What comes before the cut is there, whatever the place, and more of it the later the cut.
TEST_F(Bags, ABagCutOffAnywhereIsReadAsFarAsItIsWhole) {
  write(path("flight.bag"));
  const std::string whole = bytes_of(path("flight.bag"));
  Rng rng(1, 2);
  for (int i = 0; i < 200; ++i) {
    const auto length = static_cast<std::size_t>(rng.uniform() * static_cast<double>(whole.size()));
    auto bag = read_ros1_bag(bytes_in_memory(whole.substr(0, length)), "cut.bag");
    if (length < 13) {
      EXPECT_FALSE(bag);
      continue;
    }
    ASSERT_TRUE(bag) << bag.error().message;
    const BagContents contents = read_contents(**bag);
    const std::size_t readings = contents.imu.empty() ? 0 : contents.imu.at("/imu0").samples.size();
    EXPECT_TRUE((*bag)->damage().ends_early) << length;
    EXPECT_EQ((*bag)->damage().parts, 0) << (*bag)->damage().first;
    EXPECT_GE(readings + 40, 200 * length / whole.size()) << length;
  }
}

TEST_F(Bags, BytesThatAreWrongAreLeftOutOrRefused) {
  write(path("flight.bag"));
  const std::string whole = bytes_of(path("flight.bag"));
  Rng rng(3, 4);
  for (int i = 0; i < 300; ++i) {
    std::string broken = whole;
    for (int k = 0; k < 8; ++k)
      broken[static_cast<std::size_t>(rng.uniform() * static_cast<double>(i % 2 == 0 ? broken.size() : 6000))] =
          static_cast<char>(256 * rng.uniform());
    std::ofstream(path("broken.bag"), std::ios::binary) << broken;
    auto data = open_recording(path("broken.bag"));
    if (!data) {
      EXPECT_EQ(data.error().message.find('\n'), std::string::npos);
      continue;
    }
    while (auto event = (*data)->next()) {
    }
  }
}

TEST_F(Bags, TopicsThatCannotBeFoundAreListed) {
  write(path("flight.bag"));
  EXPECT_EQ(open_recording(path("flight.bag"), {.topics = {"/left", "/cam1/image_raw"}}).error().message,
            path("flight.bag") +
                ": there are neither images nor IMU readings on '/left'; there are images on /cam0/image_raw, "
                "/cam1/image_raw, readings on /imu0");
  const auto swapped = open_recording(path("flight.bag"), {.topics = {"/cam1/image_raw", "/cam0/image_raw"}});
  ASSERT_TRUE(swapped) << swapped.error().message;
  EXPECT_EQ((*swapped)->rig().left().focal_px(), 92.5);
}

/// Messages one after the other, in ROS 1's encoding.
class ListedMessages final : public BagReader {
 public:
  void add(const std::string& topic, const std::string& type, std::string data) {
    topics_.push_back({topic, type, Encoding::ros1});
    data_.push_back(std::move(data));
  }
  std::string format() const override { return "list"; }
  std::string_view read(const MessagePlace& place) override { return data_[place.offset]; }

 protected:
  std::optional<BagMessage> advance() override {
    if (at_ == data_.size()) return std::nullopt;
    const std::size_t i = at_++;
    return BagMessage{i, Time{1}, data_[i], {0, i, data_[i].size()}};
  }

 private:
  std::vector<std::string> data_;
  std::size_t at_ = 0;
};

template <class Number>
std::string raw(std::initializer_list<Number> numbers) {
  return {reinterpret_cast<const char*>(numbers.begin()), numbers.size() * sizeof(Number)};
}

/// librealsense writes a version where other writers name a frame.
std::string header(std::uint32_t stamp_ns) {
  std::string out = raw<std::uint32_t>({7, 1, stamp_ns, 1});
  out.push_back('1');
  return out;
}

/// A D435i as librealsense records it: a stream's transform takes the coordinates of its group's first stream, which is the left
/// camera's, to its own.
TEST(BagContents, StreamsOfLibrealsenseAreKnownByTheirTopics) {
  const std::string device = "/device_0/", left = device + "sensor_0/Infrared_1", right = device + "sensor_0/Infrared_2",
                    gyro = device + "sensor_2/Gyro_0", accel = device + "sensor_2/Accel_0";
  ListedMessages bag;
  const auto transform = [&](const std::string& stream, const Vec3& p, const Quat& q) {
    bag.add(stream + "/tf/0", "geometry_msgs/Transform", raw<double>({p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}));
  };
  const Quat turned(Eigen::AngleAxisd(0.1, Vec3::UnitY()));
  for (const std::string& stream : {left, right}) {
    std::string info = header(0) + raw<std::uint32_t>({480, 848, 13}) + "Brown Conrady" + raw<std::uint32_t>({5});
    info += raw<double>({0, 0, 0, 0, 0, 425, 0, 424, 0, 426, 240, 0, 0, 1}) + std::string(21 * 8, '\0');
    bag.add(stream + "/info/camera_info", "sensor_msgs/CameraInfo", info);
    bag.add(stream + "/image/data", "sensor_msgs/Image", header(5) + raw<std::uint32_t>({0, 0, 0}));
    transform(stream, stream == left ? Vec3(0, 0, 0) : Vec3(-0.05, 0, 0), Quat::Identity());
  }
  bag.add(device + "sensor_0/Depth_0/image/data", "sensor_msgs/Image", header(5) + raw<std::uint32_t>({0, 0, 0}));
  for (const std::string& stream : {gyro, accel}) {
    bag.add(stream + "/imu/data", "sensor_msgs/Imu", header(5) + std::string(37 * 8, '\0'));
    transform(stream, {-0.0055, 0.0051, 0.0117}, turned);
  }
  const BagContents contents = read_contents(bag);
  const auto topics = choose_topics(contents, {}, {});
  ASSERT_TRUE(topics) << topics.error().message;
  EXPECT_EQ(topics->cameras, (std::vector{left + "/image/data", right + "/image/data"}));
  EXPECT_EQ(topics->imu, gyro + "/imu/data");
  EXPECT_EQ(topics->accel, accel + "/imu/data");
  const auto rig = rig_of(contents, *topics);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->left().intrinsics(), (std::array{425.0, 426.0, 424.0, 240.0}));
  const Vec3 p_C0(1, 2, 3);
  EXPECT_LT((rig->T_BC0() * p_C0 - (turned * p_C0 + Vec3(-0.0055, 0.0051, 0.0117))).norm(), 1e-12);
  EXPECT_LT((rig->T_C1C0() * p_C0 - Vec3(0.95, 2, 3)).norm(), 1e-12);
}

TEST(BagContents, NamesOfTopicsDoNotBreakASentence) {
  BagContents contents;
  contents.images["/a\n"], contents.images["/b"], contents.images["/c"];
  EXPECT_EQ(choose_topics(contents, {}, {}).error().message,
            "has 3 image topics (/a?, /b, /c): say which are the cameras' with --topics CAM0[,CAM1,...][,IMU][,DEPTH]");
}

TEST(BagContents, TwoRigsAreAQuestion) {
  BagContents contents;
  contents.imu["/imu"];
  for (const char* topic : {"/front/left", "/front/right", "/front/left/compressed", "/front/right/compressed", "/front/depth"})
    contents.images[topic];
  const auto one = choose_topics(contents, {}, {});
  ASSERT_TRUE(one) << one.error().message;  // raw and compressed images of one rig are one pair
  EXPECT_EQ(one->cameras[1], "/front/right");
  contents.images["/rear/left"], contents.images["/rear/right"];
  EXPECT_EQ(
      choose_topics(contents, {}, {}).error().message,
      "has 2 stereo pairs (/front/left and /front/right, /rear/left and /rear/right): say which are the cameras' with --topics "
      "CAM0[,CAM1,...][,IMU][,DEPTH]");
}

TEST(BagSurvey, SaysWhatIsThereWithoutACalibration) {
  ListedMessages bag;
  for (const char* topic : {"/left", "/right"})
    bag.add(
        topic, "sensor_msgs/Image",
        header(5) + raw<std::uint32_t>({2, 3, 7}) + "bad\nred" + std::string(1, '\0') + raw<std::uint32_t>({3, 6}) + "pixels");
  bag.add("/imu", "sensor_msgs/Imu", header(5) + std::string(37 * 8, '\0'));
  const BagSurvey survey = survey_bag(bag, {});
  ASSERT_EQ(survey.topics.size(), 3u);
  EXPECT_EQ(survey.topics[0].first, "frame '1'");
  EXPECT_EQ(survey.topics[1].name, "/left");
  EXPECT_EQ(survey.topics[1].first, "images encoded as 'bad?red' cannot be read");
  EXPECT_EQ(survey.cameras, (std::vector<std::string>{"/left", "/right"}));
  EXPECT_EQ(survey.imu + survey.depth, "/imu");
  EXPECT_EQ(survey.question, "");
  EXPECT_EQ(survey.unreadable, "/left: images encoded as 'bad?red' cannot be read");
  EXPECT_EQ(survey.no_calibration, "holds no calibration (no camera_info for /left): give one with --calibration");
}

std::string grey_of(std::string_view encoding, std::uint32_t width, std::uint32_t step, std::string_view pixels,
                    bool big_endian = false) {
  const auto image = grey_image({width, static_cast<std::uint32_t>(pixels.size() / step), step, encoding, big_endian, pixels});
  if (!image) return image.error().message;
  std::string out;
  for (int y = 0; y < image->height(); ++y)
    out.append(reinterpret_cast<const char*>(image->row(y)), static_cast<std::size_t>(image->width()));
  return out;
}

TEST(GreyImage, EveryEncodingBecomesBrightness) {
  EXPECT_EQ(grey_of("mono8", 2, 3, "ab_cd_"), "abcd");
  EXPECT_EQ(grey_of("mono16", 2, 4,
                    "\x01"
                    "a"
                    "\x02"
                    "b"),
            "ab");
  EXPECT_EQ(grey_of("mono16", 2, 4,
                    "a\x01"
                    "b\x02",
                    true),
            "ab");
  EXPECT_EQ(grey_of("rgb8", 1, 3, std::string_view("\xff\0\0", 3)), "\x4c");
  EXPECT_EQ(grey_of("bgr8", 1, 3, std::string_view("\xff\0\0", 3)), "\x1d");
  EXPECT_EQ(grey_of("rgba8", 1, 4, "aaaZ"), "a");
  EXPECT_EQ(grey_of("yuv422", 2, 4, "uavb"), "ab");
  EXPECT_EQ(grey_of("uyvy", 2, 4, "uavb"), "ab");
  EXPECT_EQ(grey_of("yuyv", 2, 4, "aubv"), "ab");
  EXPECT_EQ(grey_of("rgb16", 1, 6, std::string_view("\0\xff\0\0\0\0", 6)), "\x4c");
  EXPECT_EQ(grey_of("bgr16", 1, 6, std::string_view("\xff\0\0\0\0\0", 6), true), "\x1d");
  EXPECT_EQ(grey_of("rgba16", 1, 8, "_a_a_a_Z"), "a");
  EXPECT_EQ(grey_of("bayer_rggb16", 2, 4, "_a_a_a_a"), "aaaa");
  EXPECT_EQ(grey_of("jpeg2000", 1, 1, "a"), "images encoded as 'jpeg2000' cannot be read");
  EXPECT_EQ(grey_of("a\nb", 1, 1, "a"), "images encoded as 'a?b' cannot be read");  // one sentence on one line
  EXPECT_EQ(grey_of("mono8", 3, 2, "abcd"), "this image has fewer pixels than its header says");
}

TEST(GreyImage, PlanesOfBrightnessComeFirst) {
  for (const char* encoding : {"nv12", "nv21"}) {
    const auto image = grey_image({2, 2, 2, encoding, false, "abcduv"});
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->at(0, 0), 'a');
    EXPECT_EQ(image->at(1, 1), 'd');
    const auto of_all_planes = grey_image({2, 2, 4, encoding, false, "abcduv"});
    ASSERT_TRUE(of_all_planes) << of_all_planes.error().message;
    EXPECT_EQ(of_all_planes->at(1, 1), 'd');
  }
  EXPECT_FALSE(grey_image({2, 2, 2, "nv12", false, "abc"}));
}

TEST(GreyImage, TwelveBitsInSixteenAreScaled) {
  const std::string_view values("\x10\x02\xf0\x0f", 4);  // 0x210, 0xff0
  RawImage raw{2, 1, 4, "mono16", false, values};
  EXPECT_EQ(largest_value(raw), 0xff0);
  EXPECT_EQ(largest_value({2, 1, 2, "mono8", false, "ab"}), std::nullopt);
  EXPECT_EQ(bits_used_for(0xff0), 12);
  EXPECT_EQ(bits_used_for(0x3ff), 10);
  EXPECT_EQ(bits_used_for(0x1000), 16);
  EXPECT_EQ(bits_used_for(0), 16);
  raw.used_bits = 12;
  EXPECT_EQ(grey_image(raw)->at(0, 0), 0x21);
  raw.used_bits = 10;  // a later image that is brighter than those that were tried
  EXPECT_EQ(grey_image(raw)->at(0, 0), 0x84);
  EXPECT_EQ(grey_image(raw)->at(1, 0), 255);
}

/// Red 40, green 80, blue 120 everywhere: (40 + 2 80 + 120) / 4 at every pixel, at the edges as well.
TEST(GreyImage, AMosaicOfOneColourIsOneGrey) {
  std::string pixels;
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 8; ++x) pixels += static_cast<char>(y % 2 == 0 ? (x % 2 == 0 ? 40 : 80) : (x % 2 == 0 ? 80 : 120));
  EXPECT_EQ(grey_of("bayer_rggb8", 8, 8, pixels), std::string(48, 'P'));
}

}  // namespace bags_test
}  // namespace fbvins
