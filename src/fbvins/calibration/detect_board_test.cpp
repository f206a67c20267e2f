// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/kept_detections.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>

#include "fbvins/calibration/board_image.hpp"
#include "fbvins/calibration/detect_board.hpp"
#include "fbvins/calibration/simulated_board.hpp"

namespace fbvins {
namespace detect_board_test {

namespace fs = std::filesystem;

constexpr int kImages = 120, kFew = 60;  // two whole parts and a short one; one and a short one
const Board kBoard{.columns = 3, .rows = 3, .size_m = 0.088, .spacing = 0.3};

class DetectBoard : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    for (int i = 0; i < kImages; ++i) images_.push_back({Time{1000 + i}, i % 2, "image" + std::to_string(i)});
    few_.assign(images_.begin(), images_.begin() + kFew);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static ImageFindings random_findings(const std::vector<ListedImage>& images) {
    Rng rng(8);
    ImageFindings out;
    for (const ListedImage& image : images) {
      ImageFinding found{{image.t, image.camera, {}}, {752, 480}, 4, 1, 2, out.size() % 3 == 0};
      for (int corner = 0; corner < 5; ++corner)
        found.view.corners.push_back({corner, Vec2(752 * rng.uniform(), 480 * rng.uniform() / 3)});
      if (out.size() % 7 == 0) found = {{image.t, image.camera, {}}, {}, 0, 0, 0, false, "a: cannot be read"};
      out.push_back(found);
    }
    return out;
  }

  std::string folder_ = fs::temp_directory_path() / ("fbvins_kept_" + std::to_string(::getpid()));
  std::vector<ListedImage> images_, few_;
};

TEST_F(DetectBoard, IsReadAsItWasFoundToTheBit) {
  const ImageFindings found = random_findings(images_);
  const KeptDetections kept(folder_, kBoard, images_);
  for (const std::size_t part : {2, 0}) ASSERT_TRUE(kept.keep(part, found));
  const ImageFindings read = KeptDetections(folder_, kBoard, images_).read();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const bool kept_part = i < 50 || i >= 100;
    EXPECT_TRUE(read[i] == (kept_part ? found[i] : std::nullopt)) << i;
  }
}

TEST_F(DetectBoard, OfOtherImagesOrAnotherBoardIsForgotten) {
  const ImageFindings found = random_findings(images_);
  std::vector<ListedImage> others = images_;
  others[30].t.ns += 1;
  Board other = kBoard;
  other.spacing = 0.25;
  for (const auto& [board, images] : {std::pair{kBoard, others}, {other, images_}}) {
    ASSERT_TRUE(KeptDetections(folder_, kBoard, images_).keep(0, found));
    const KeptDetections kept(folder_, board, images);
    for (const auto& finding : kept.read()) EXPECT_FALSE(finding);
    EXPECT_FALSE(fs::exists(folder_));
  }
}

TEST_F(DetectBoard, ADamagedFileIsLookedForAgain) {
  const ImageFindings found = random_findings(images_);
  const KeptDetections kept(folder_, kBoard, images_);
  for (const std::size_t part : {0, 1, 2}) ASSERT_TRUE(kept.keep(part, found));
  fs::resize_file(folder_ + "/000001.found", 900);
  std::ofstream(folder_ + "/000002.found", std::ios::app) << "image 1 2 3\n";
  const ImageFindings read = kept.read();
  EXPECT_TRUE(read[49]);
  for (std::size_t i = 50; i < read.size(); ++i) EXPECT_FALSE(read[i]) << i;
}

#ifdef FBVINS_WITH_APRILTAG

/// The board at three distances, again and again; counts the images that are looked at.
CameraRecording rendered(const std::vector<ListedImage>& images, std::atomic<int>& looks) {
  const BoardCamera renderer(Camera(PinholeRadtan{190, 190, 119.5, 89.5, 0, 0, 0, 0}, 240, 180), *BoardPattern::create(kBoard));
  auto shown = std::make_shared<std::vector<Image>>();
  Rng rng(4);
  for (const double distance_m : {0.45, 0.5, 0.55})
    shown->push_back(renderer.render({Pose<Cn, T>(Quat(0, 1, 0, 0), Vec3(-0.16, 0.16, distance_m))}, {}, rng));
  CameraRecording out;
  out.images = images;
  out.take = [shown, &looks](std::size_t index) {
    ++looks;
    return [shown, index]() -> Result<Image> {
      if (index == 4) return Error{ErrorCode::unreadable, "cannot be read"};
      return (*shown)[index % 3];
    };
  };
  return out;
}

TEST_F(DetectBoard, AnInterruptedSearchGoesOnAndFindsTheSame) {
  std::atomic<int> looks = 0;
  const CameraRecording recording = rendered(few_, looks);
  const auto whole = detect_board(kBoard, recording, {.threads = 1});
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(whole->unreadable, 1);

  looks = 0;
  const auto stopped = detect_board(kBoard, recording, {.threads = 2, .keep = folder_, .stop = [&] { return looks == 55; }});
  ASSERT_TRUE(stopped);
  EXPECT_EQ(stopped->stopped_after, 55);
  looks = 0;
  int resumed = 0, told = 0;
  const auto rest = detect_board(
      kBoard, recording,
      {.threads = 2, .keep = folder_, .progress = [&](int done) { told = done; }, .resumed = [&](int n) { resumed = n; }});
  ASSERT_TRUE(rest) << rest.error().message;
  EXPECT_EQ(resumed, 49);  // without the one that could not be read
  EXPECT_EQ(looks, 12);    // eleven that were missing, and one again, to see that the recording is the same
  EXPECT_EQ(told, kFew);
  EXPECT_EQ(detections_to_csv(rest->detections), detections_to_csv(whole->detections));
  EXPECT_TRUE(rest->detections.views == whole->detections.views);
  EXPECT_EQ(rest->first_unreadable, whole->first_unreadable);
}

TEST_F(DetectBoard, OtherPixelsUnderTheSameNamesAreLookedAt) {
  std::atomic<int> looks = 0;
  CameraRecording recording = rendered(few_, looks);
  ASSERT_TRUE(detect_board(kBoard, recording, {.threads = 1, .keep = folder_}));
  const auto before = recording.take;
  recording.take = [&](std::size_t index) { return before(index + 1); };
  looks = 0;
  ASSERT_TRUE(detect_board(kBoard, recording, {.threads = 1, .keep = folder_}));
  EXPECT_EQ(looks, kFew + 1);
}

TEST_F(DetectBoard, TheCameraThatMirrorsIsNamed) {
  std::atomic<int> looks = 0;
  CameraRecording recording = rendered(few_, looks);
  recording.take = [&, plain = recording.take](std::size_t index) {
    return [decode = plain(index), mirrored = few_[index].camera == 1]() -> Result<Image> {
      Result<Image> image = decode();
      if (image && mirrored)
        for (int y = 0; y < image->height(); ++y) std::reverse(&image->at(0, y), &image->at(0, y) + image->width());
      return image;
    };
  };
  const auto found = detect_board(kBoard, recording, {.threads = 2});
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message.find("the images of cam1 are mirrored"), std::string::npos) << found.error().message;
}

#endif

}  // namespace detect_board_test
}  // namespace fbvins
