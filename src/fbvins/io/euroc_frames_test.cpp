// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/euroc_frames.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace euroc_frames_test {

constexpr std::int64_t kMs = 1'000'000;

std::vector<ImageRow> at_ms(std::initializer_list<int> stamps) {
  std::vector<ImageRow> rows;
  for (int ms : stamps) rows.push_back({Time{ms * kMs}, std::to_string(ms)});
  return rows;
}

TEST(PairFrames, TakesTheNearestWithinTheTolerance) {
  const PairedFrames p = pair_frames(at_ms({0, 50, 100, 150}), at_ms({1, 49, 104, 151}), Duration{3 * kMs});
  ASSERT_EQ(p.frames.size(), 4u) << "every left image is a frame";
  EXPECT_EQ(p.frames[0].file(1), "1");
  EXPECT_EQ(p.frames[1].file(1), "49");
  EXPECT_EQ(p.frames[2].file(1), "") << "4 ms are too much";
  EXPECT_EQ(p.frames[3].file(1), "151");
  EXPECT_EQ(p.left_only, 1);
  EXPECT_EQ(p.right_only, 1);
}

TEST(PairFrames, ARightImageServesOnce) {
  const PairedFrames p = pair_frames(at_ms({0, 2, 100, 200, 300}), at_ms({1}), Duration{3 * kMs});
  EXPECT_EQ(p.left_only, 4);
  EXPECT_EQ(p.right_only, 0);
}

TEST(PairFrames, HalfTheIntervalBoundsAGenerousTolerance) {
  // Right is late by 30 of 50 ms: it belongs to the next left image, not to the one before.
  const PairedFrames p = pair_frames(at_ms({0, 50, 100}), at_ms({30, 80, 130}), Duration{1000 * kMs});
  EXPECT_EQ(p.frames[0].file(1), "");
  EXPECT_EQ(p.frames[1].file(1), "30");
  EXPECT_EQ(p.frames[2].file(1), "80");
  EXPECT_EQ(p.right_only, 1);
}

TEST(PairFrames, RightImagesAreFramesWhereLeftOnesAreMissing) {
  const PairedFrames p =
      pair_frames(at_ms({100, 150, 200, 300}), at_ms({50, 100, 150, 200, 250, 304, 350, 400}), Duration{3 * kMs});
  std::vector<std::string> frames;
  for (const FrameEntry& f : p.frames) frames.push_back(f.file(0) + "/" + f.file(1));
  EXPECT_EQ(frames, (std::vector<std::string>{"/50", "100/100", "150/150", "200/200", "/250", "300/", "/350", "/400"}));
  EXPECT_EQ(p.left_only, 1);
  EXPECT_EQ(p.right_only, 5) << "304 ms is too near to 300 ms to be an instant of its own";
}

std::vector<std::string> offsets_in(const std::vector<FrameEntry>& frames, int camera) {
  std::vector<std::string> out;
  for (const FrameEntry& f : frames)
    out.push_back(f.file(0) + "/" + f.file(1) + " " + std::to_string(f.offsets.of(camera).ns / kMs));
  return out;
}

TEST(PairFrames, WithoutACommonTriggerTheOffsetsAreKept) {
  const PairedFrames late = pair_frames(at_ms({0, 50, 100, 150}), at_ms({30, 80, 130, 180}), Duration{3 * kMs});
  EXPECT_TRUE(late.untriggered);
  EXPECT_EQ(offsets_in(late.frames, 1), (std::vector<std::string>{"0/ 0", "50/30 -20", "100/80 -20", "150/130 -20"}));
  EXPECT_EQ(late.left_only, 1);
  EXPECT_EQ(late.right_only, 1);
  const PairedFrames soon = pair_frames(at_ms({0, 50, 100, 150}), at_ms({5, 55, 105, 155}), Duration{3 * kMs});
  EXPECT_EQ(offsets_in(soon.frames, 1), (std::vector<std::string>{"0/5 5", "50/55 5", "100/105 5", "150/155 5"}))
      << "a short way ahead is nearer than a long one back";
  EXPECT_EQ(
      untriggered_sentence(soon.frames, 1, 3),
      "cameras 0 and 1 have no common trigger: by stamps and time offsets their images are more than 3 ms apart, 5.0 ms in the median, and count as taken then; of images that were taken at once, and only stamped apart, --pair-tolerance says so");
}

TEST(PairFrames, CamerasWithoutATriggerMayHaveOtherRates) {
  const PairedFrames p = pair_frames(at_ms({0, 50, 100, 150, 200}), at_ms({-10, 23, 57, 90, 123, 157, 190}), Duration{3 * kMs});
  EXPECT_EQ(offsets_in(p.frames, 1),
            (std::vector<std::string>{"0/-10 -10", "50/23 -27", "100/90 -10", "150/123 -27", "200/190 -10"}));
  const PairedFrames slow = pair_frames(at_ms({0, 50, 100, 150, 200}), at_ms({-10, 90, 190}), Duration{3 * kMs});
  EXPECT_EQ(offsets_in(slow.frames, 1), (std::vector<std::string>{"0/-10 -10", "50/ 0", "100/90 -10", "150/ 0", "200/190 -10"}));
}

TEST(PairFrames, WithoutATriggerRightImagesAreFramesWhereLeftOnesAreMissing) {
  const PairedFrames p = pair_frames(at_ms({0, 50, 100, 400}), at_ms({-20, 30, 80, 230, 280, 380}), Duration{3 * kMs});
  EXPECT_EQ(offsets_in(p.frames, 1),
            (std::vector<std::string>{"0/-20 -20", "50/30 -20", "100/80 -20", "/230 0", "/280 0", "400/380 -20"}));
}

TEST(PairFrames, OneSideMayBeEmpty) {
  EXPECT_EQ(pair_frames(at_ms({0, 50}), {}, Duration{kMs}).left_only, 2);
  EXPECT_EQ(pair_frames({}, at_ms({0, 50}), Duration{kMs}).right_only, 2);
  EXPECT_EQ(pair_frames({}, at_ms({0, 50}), Duration{kMs}).frames.size(), 2u);
}

TEST(MeasureIntervals, MedianIsTheRateAndTheLongestIsFound) {
  const Intervals i = measure_intervals({Time{0}, Time{50 * kMs}, Time{100 * kMs}, Time{400 * kMs}, Time{450 * kMs}});
  EXPECT_EQ(i.median.ns, 50 * kMs);
  EXPECT_DOUBLE_EQ(i.rate_hz, 20);
  EXPECT_EQ(i.longest.ns, 300 * kMs);
  EXPECT_EQ(i.longest_start.ns, 100 * kMs);
  EXPECT_EQ(measure_intervals({Time{5}}).rate_hz, 0);
}

TEST(ImageRows, NamesThatLeadOutOfTheFolderAreRefused) {
  const auto rows = read_image_rows("1,a.png\n2,../../etc/passwd\n3,/etc/passwd\n4,b.png\n5,c.png\n", "cam0/data.csv");
  ASSERT_TRUE(rows) << rows.error().message;
  ASSERT_EQ(rows->rows.size(), 3u);
  EXPECT_EQ(rows->rows[1].file, "b.png");
  EXPECT_EQ(rows->counts.first_bad, "cam0/data.csv:2: '../../etc/passwd' is not the name of an image file");
}

TEST(ImuRows, GyroComesBeforeTheAccelerometer) {
  ImuRowParser parse;
  ImuSample sample;
  std::string problem;
  ASSERT_EQ(parse("7, 1,2,3, 4,5,6", sample, problem), RowVerdict::good);
  EXPECT_EQ(sample.t.ns, 7);
  EXPECT_EQ(sample.gyro_radps, Vec3(1, 2, 3));
  EXPECT_EQ(sample.accel_mps2, Vec3(4, 5, 6));
  EXPECT_EQ(parse("7,1,2,3,4,5", sample, problem), RowVerdict::malformed);
  EXPECT_EQ(problem, "6 columns where 7 are needed");
  EXPECT_EQ(parse("7,1,2,3,4,5,inf", sample, problem), RowVerdict::not_finite);
}

TEST(AddCamera, JoinsTheNearestFrameOrIsOneOfItsOwn) {
  std::vector<FrameEntry> frames = pair_frames(at_ms({0, 50, 100, 300}), at_ms({0, 50, 100, 300}), Duration{3 * kMs}).frames;
  // One that is late, one near none, two where the others have a gap, one of them near a frame.
  EXPECT_EQ(add_camera(frames, at_ms({1, 52, 120, 200, 299}), 2, Duration{3 * kMs}), 2);
  ASSERT_EQ(frames.size(), 5u);
  EXPECT_FALSE(frames[0].file(2).empty());
  EXPECT_FALSE(frames[1].file(2).empty());
  EXPECT_TRUE(frames[2].file(2).empty());
  EXPECT_TRUE(frames[3].file(0).empty() && frames[3].file(1).empty());
  EXPECT_EQ(frames[3].t.ns, 200 * kMs);
  EXPECT_FALSE(frames[3].without_images());
  EXPECT_FALSE(frames[4].file(2).empty());
}

TEST(AddCamera, WithoutACommonTriggerTheOffsetIsKept) {
  std::vector<FrameEntry> frames = pair_frames(at_ms({0, 50, 100, 150}), at_ms({0, 50, 100, 150}), Duration{3 * kMs}).frames;
  EXPECT_EQ(add_camera(frames, at_ms({-15, 35, 85, 135}), 2, Duration{3 * kMs}), 0);
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_EQ(frames[2].file(2), "85");
  EXPECT_EQ(frames[2].offsets.of(2).ns, -15 * kMs);
  EXPECT_EQ(frames[2].offsets.of(1).ns, 0);
}

TEST(AddCamera, FramesOfACameraAloneAreSharedByTheNext) {
  std::vector<FrameEntry> frames = pair_frames(at_ms({0, 50, 100, 300}), {}, Duration{3 * kMs}).frames;
  EXPECT_EQ(add_camera(frames, at_ms({200}), 2, Duration{3 * kMs}), 1);
  EXPECT_EQ(add_camera(frames, at_ms({201}), 3, Duration{3 * kMs}), 0);
  ASSERT_EQ(frames.size(), 5u);
  EXPECT_FALSE(frames[3].file(2).empty() || frames[3].file(3).empty());
}

/// The right camera's stamps are 8 ms late, as its calibration says: the images are of one instant, and the offsets say what the
/// stamps are.
TEST(JoinImages, OwnOffsetsOfCamerasCountBeforeTheStamps) {
  const ExposureOffsets own({{}, Duration{-8 * kMs}});
  DatasetInfo info;
  const std::vector<FrameEntry> frames = join_images({at_ms({0, 50, 100, 200}), at_ms({8, 58, 108, 158, 208})}, {}, own, 3, info);
  ASSERT_EQ(frames.size(), 5u);
  std::string given;
  for (FrameEntry frame : frames) {
    given += frame.file(0) + "/" + frame.file(1) + " ";
    EXPECT_EQ(frame.offsets.of(1).ns, 8 * kMs) << "of the stamp";
    frame.offsets += own;
    EXPECT_TRUE(frame.offsets.all_zero()) << "of the exposure";
  }
  EXPECT_EQ(given, "0/8 50/58 100/108 /158 200/208 ");
  EXPECT_EQ(frames[3].t.ns, 150 * kMs);
  const std::vector<FrameEntry> as_stamped = join_images({at_ms({0, 50, 100}), at_ms({0, 50, 100})}, {}, own, 3, info);
  EXPECT_EQ(as_stamped[1].file(1), "50");
  EXPECT_EQ(as_stamped[1].offsets.of(1).ns, 0) << "8 ms before the left one, which the stamps do not say";
}

}  // namespace euroc_frames_test
}  // namespace fbvins
