// SPDX-License-Identifier: Apache-2.0
// Paths and archives that are no recording, and recordings as a whole: parts of them, one camera, another calibration.
#include <sys/stat.h>

#include <fstream>

#include "tests/broken_datasets/delivered.hpp"

namespace fbvins::test {
namespace broken_datasets_test {

// ---------------------------------------------------------------- archives and paths

class BrokenPath : public testing::Test {
 protected:
  void expect_refused(const std::string& path, const std::string& sentence) {
    const auto data = open_dataset(path);
    ASSERT_FALSE(data);
    EXPECT_TRUE(data.error().message.starts_with(path + sentence)) << data.error().message;
    EXPECT_EQ(data.error().message.find('\n'), std::string::npos);
  }
  std::string written(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_.path() + "/" + name, std::ios::binary) << bytes;
    return folder_.path() + "/" + name;
  }
  std::string zip_bytes(const std::string& top = "mav0/") {
    write_zip(toy_dataset(), folder_.path() + "/whole.zip", top);
    std::ifstream in(folder_.path() + "/whole.zip", std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  TemporaryFolder folder_;
};

TEST_F(BrokenPath, Nothing) { expect_refused(folder_.path() + "/nowhere", ": no such file or folder"); }
TEST_F(BrokenPath, EmptyFolder) { expect_refused(folder_.path(), ": no cam0/data.csv in it"); }
TEST_F(BrokenPath, TextFile) { expect_refused(written("a.txt", "hello"), ": neither a EuRoC folder nor a zip archive"); }
TEST_F(BrokenPath, EmptyFile) { expect_refused(written("a.zip", ""), ": neither a EuRoC folder nor a zip archive"); }
TEST_F(BrokenPath, RosBag) {
  expect_refused(written("a.bag", "#ROSBAG V2.0\n"), ": ROS bags are read by fbvins-bags; `fbvins convert`");
}
TEST_F(BrokenPath, PipeDoesNotBlock) {
  const std::string path = folder_.path() + "/pipe";
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  expect_refused(path, ": neither a file nor a folder");
}
TEST_F(BrokenPath, PipeInsideDoesNotBlock) {
  Files files = toy_dataset();
  files.erase(kImu);
  write_folder(files, folder_.path() + "/toy");
  ASSERT_EQ(mkfifo((folder_.path() + "/toy/imu0/data.csv").c_str(), 0600), 0);
  const auto data = open_dataset(folder_.path() + "/toy");
  ASSERT_FALSE(data);
  EXPECT_EQ(data.error().message, folder_.path() + "/toy/imu0/data.csv: not a plain file");
}

TEST_F(BrokenPath, ZipCutOff) {
  const std::string bytes = zip_bytes();
  for (const double part : {0.01, 0.5, 0.99}) {
    const std::string path =
        written("cut.zip", bytes.substr(0, static_cast<std::size_t>(part * static_cast<double>(bytes.size()))));
    expect_refused(path, ": not a whole zip archive (");
  }
}
TEST_F(BrokenPath, ZipOfSomethingElse) {
  write_zip({{"readme.txt", "hello"}}, folder_.path() + "/other.zip", "");
  expect_refused(folder_.path() + "/other.zip", ": no cam0/data.csv in it");
}
TEST_F(BrokenPath, ZipWithTwoDatasets) {
  Files both;
  for (const auto& [name, bytes] : toy_dataset()) both["a/mav0/" + name] = both["b/mav0/" + name] = bytes;
  write_zip(both, folder_.path() + "/two.zip", "");
  expect_refused(folder_.path() + "/two.zip", ": holds 2 datasets (a/mav0/ ...), give one of them");
}
TEST_F(BrokenPath, ZipWithoutImu) {
  Files files = toy_dataset();
  files.erase(kImu);
  write_zip(files, folder_.path() + "/noimu.zip", "mav0/");
  expect_refused(folder_.path() + "/noimu.zip", ":mav0/imu0/data.csv: not in the archive");
}
TEST_F(BrokenPath, ZipWithShadowFilesOfAMac) {
  Files files;
  for (const auto& [name, bytes] : toy_dataset()) files["mav0/" + name] = bytes;
  files["__MACOSX/mav0/cam0/data.csv"] = "shadow";
  write_zip(files, folder_.path() + "/mac.zip", "");
  const auto data = open_dataset(folder_.path() + "/mac.zip");
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data)->info().name, "mac");
  EXPECT_EQ(deliver(**data), "20/20/20/221");
}
TEST_F(BrokenPath, ZipWithDamagedMember) {
  std::string bytes = zip_bytes();
  // The image's bytes lie behind its local header; the directory stays whole, the checksum fails.
  const std::size_t name = bytes.find("mav0/" + toy_image(0, 4));
  bytes[name + 60] ^= 0x55;
  const auto data = open_dataset(written("damaged.zip", bytes));
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ(deliver(**data), "20/19/20/221; left: 1 corrupt");
}

// ---------------------------------------------------------------- whole recordings, options

std::vector<std::int64_t> fingerprint(Dataset& data, int stop_after = 1 << 30) {
  std::vector<std::int64_t> out;
  while (auto event = data.next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) out.push_back(sample->t.ns);
    else {
      const StereoFrame& f = std::get<StereoFrame>(*event);
      out.push_back(-f.t.ns);
      for (int y = 0; y < kToyHeight; ++y)
        for (int x = 0; x < kToyWidth; ++x) out.push_back(f.left()->at(x, y) * 256 + f.right()->at(x, y));
    }
    if (std::ssize(out) > stop_after) break;
  }
  return out;
}

class ToyDataset : public testing::Test {
 protected:
  ToyDataset() { write_folder(toy_dataset(), path()); }
  std::string path() const { return folder_.path() + "/toy/mav0"; }
  TemporaryFolder folder_;
};

TEST_F(ToyDataset, IsTheSameWithAndWithoutDecodingAhead) {
  const auto first = fingerprint(**open_dataset(path(), {.prefetch_frames = 0}));
  EXPECT_EQ(std::ssize(first), kToyImuSamples + kToyFrames * (1 + kToyWidth * kToyHeight));
  for (int ahead : {1, 2, 8, 100}) EXPECT_EQ(fingerprint(**open_dataset(path(), {.prefetch_frames = ahead})), first) << ahead;
}

TEST_F(ToyDataset, CanBeLeftEarly) {
  for (int stop : {0, 10, 5000, 20000}) {
    auto data = open_dataset(path(), {.prefetch_frames = 3});
    ASSERT_TRUE(data);
    if (stop > 0) fingerprint(**data, stop);
    data->reset();  // with frames ready and in work
  }
}

TEST_F(ToyDataset, SkipsAndStops) {
  auto data = open_dataset(path(), {.skip_frames = 5, .max_frames = 4});
  ASSERT_TRUE(data);
  EXPECT_EQ((*data)->info().frames, 4);
  EXPECT_EQ((*data)->info().first_image.ns, toy_stamp_ns(5));
  EXPECT_EQ((*data)->info().last_image.ns, toy_stamp_ns(8));
  EXPECT_EQ(deliver(**data), "4/4/4/101");  // IMU up to the stamp of frame 8
  EXPECT_EQ(open_dataset(path(), {.skip_frames = 20}).error().message,
            path() + "/cam0/data.csv: no frames are left after skipping 20");
  EXPECT_EQ(open_dataset(path(), {.skip_frames = -1}).error().message, "skip_frames = -1 is outside [0, 1000000000]");
}

TEST_F(ToyDataset, ImuComesJustFarEnoughToInterpolate) {
  auto data = open_dataset(path());
  ASSERT_TRUE(data);
  Time imu{0};
  while (auto event = (*data)->next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) imu = sample->t;
    else EXPECT_EQ(imu, std::get<StereoFrame>(*event).t);  // in the toy dataset both have the same stamps
  }
  EXPECT_EQ(imu.ns, kToyStart_ns + 1'000'000'000);
}

/// Stamps and left pixels of all frames, which have no right image.
std::vector<std::int64_t> left_images(Dataset& data) {
  std::vector<std::int64_t> out;
  while (auto event = data.next()) {
    const auto* frame = std::get_if<StereoFrame>(&*event);
    if (frame == nullptr) continue;
    EXPECT_EQ(frame->right(), nullptr);
    out.push_back(frame->t.ns);
    for (int y = 0; y < kToyHeight; ++y)
      for (int x = 0; x < kToyWidth; ++x) out.push_back(frame->left()->at(x, y));
  }
  return out;
}

TEST_F(ToyDataset, OneCamerasFolderIsARecordingOfThatCamera) {
  const Pose<B, C0> mounting[2] = {(*open_dataset(path()))->rig().T_BC0(),
                                   (*open_dataset(path()))->rig().T_BC1().cast_frames<B, C0>()};
  const char* chosen[2] = {"left", "right"};
  for (int camera = 0; camera < 2; ++camera) {
    Files files = toy_dataset();
    std::erase_if(files, [&](const auto& e) { return e.first.starts_with(camera == 0 ? "cam1/" : "cam0/"); });
    const TemporaryFolder folder;
    write_folder(files, folder.path() + "/toy/mav0");
    auto alone = open_dataset(folder.path() + "/toy");
    ASSERT_TRUE(alone) << alone.error().message;
    EXPECT_FALSE((*alone)->rig().has_right());
    EXPECT_EQ((*alone)->rig().T_BC0().p, mounting[camera].p);
    EXPECT_EQ((*alone)->info().frames, kToyFrames);
    EXPECT_EQ((*alone)->info().camera(0).unpaired, 0);
    const auto images = left_images(**alone);
    EXPECT_EQ(images.size(), static_cast<std::size_t>(kToyFrames * (1 + kToyWidth * kToyHeight)));
    // The same as one of the two chosen.
    auto of_two = open_dataset(path(), {.camera = chosen[camera]});
    ASSERT_TRUE(of_two);
    EXPECT_EQ((*of_two)->rig().T_BC0().p, mounting[camera].p);
    EXPECT_EQ(left_images(**of_two), images);
  }
}

TEST_F(ToyDataset, TakesAnotherCalibration) {
  const std::string camchain = folder_.path() + "/camchain.yaml", imu = folder_.path() + "/imu.yaml";
  std::ofstream(camchain) << "cam0:\n  T_cam_imu:\n  - [1, 0, 0, 0.5]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n"
                             "  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n  distortion_model: equidistant\n"
                             "  intrinsics: [41, 42, 31, 23]\n  resolution: [64, 48]\n  timeshift_cam_imu: 0.012\n"
                             "cam1:\n  T_cn_cnm1:\n  - [1, 0, 0, -0.2]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n"
                             "  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n  distortion_model: radtan\n"
                             "  intrinsics: [43, 44, 31, 23]\n  resolution: [64, 48]\n";
  std::ofstream(imu) << "imu0:\n  accelerometer_noise_density: 0.01\n  accelerometer_random_walk: 0.002\n"
                        "  gyroscope_noise_density: 0.003\n  gyroscope_random_walk: 0.0004\n  update_rate: 200.0\n";
  auto data = open_dataset(path(), {.kalibr_camchain = camchain, .kalibr_imu = imu});
  ASSERT_TRUE(data) << data.error().message;
  const StereoRig& rig = (*data)->rig();
  EXPECT_EQ(rig.left().model_name(), "pinhole-equidistant");
  EXPECT_EQ(rig.right().model_name(), "pinhole-radtan");
  EXPECT_LT((rig.T_BC0().p - Vec3(-0.5, 0, 0)).norm(), 1e-12);
  EXPECT_LT((rig.T_BC1().p - Vec3(-0.3, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(rig.time_offset_s, 0.012);
  EXPECT_EQ(rig.imu_noise.accel_noise_density_mps2_rthz, 0.01);
  EXPECT_NEAR(rig.image_rate_hz, 20, 1e-9);
  // 12 ms later on the IMU's clock: the third sample after each image is the first at or after it.
  Time last_imu{0};
  while (auto event = (*data)->next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) last_imu = sample->t;
    else EXPECT_EQ((last_imu - std::get<StereoFrame>(*event).t).ns, 15'000'000);
  }
  const auto imu_alone = open_dataset(path(), {.kalibr_imu = imu});
  ASSERT_TRUE(imu_alone) << imu_alone.error().message;
  EXPECT_EQ((*imu_alone)->rig().imu_noise.accel_noise_density_mps2_rthz, 0.01);
  EXPECT_EQ(
      open_dataset(path(), {.kalibr_camchain = imu}).error().message,
      imu +
          ": this is the noise of an IMU (Kalibr's imu.yaml): give it by --imu-calibration, beside a calibration of the cameras");
}

}  // namespace broken_datasets_test
}  // namespace fbvins::test
