// SPDX-License-Identifier: Apache-2.0
// What tests of damaged recordings share: names of the toy recording's files, and what a recording delivers, in one line.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "fbvins/io/dataset.hpp"
#include "tests/broken_datasets/toy_dataset.hpp"

namespace fbvins::test {

using Lines = std::vector<std::string>;
using Damage = void (*)(Files&);

inline constexpr const char* kCam0 = "cam0/data.csv";
inline constexpr const char* kCam1 = "cam1/data.csv";
inline constexpr const char* kImu = "imu0/data.csv";
inline constexpr const char* kTruth = "state_groundtruth_estimate0/data.csv";

template <class Edit>
void edit(Files& files, const char* file, Edit&& change) {
  edit_lines(files.at(file), std::forward<Edit>(change));
}

inline std::string rows_left_out(const char* name, const RowCounts& c) {
  if (c.bad() == 0) return "";
  std::string out = fmt::format("; {}:", name);
  for (auto [count, what] : {std::pair{c.malformed, "malformed"},
                             {c.not_finite, "not finite"},
                             {c.duplicates, "duplicate"},
                             {c.backwards, "backwards"}})
    if (count > 0) out += fmt::format(" {} {}", count, what);
  return out + fmt::format(", first line {}", c.first_bad.substr(c.first_bad.find(".csv:") + 5,
                                                                 c.first_bad.find(": ") - c.first_bad.find(".csv:") - 5));
}

inline std::string images_left_out(const char* name, const CameraInfo& c) {
  std::string out;
  for (auto [count, what] : {std::pair{c.unpaired, "unpaired"},
                             {c.images.missing, "missing"},
                             {c.images.corrupt, "corrupt"},
                             {c.images.wrong_size, "wrong size"}})
    if (count > 0) out += fmt::format("; {}: {} {}", name, count, what);
  return out;
}

/// Reads to the end: "frames/left/right images/IMU samples[/readings of other sensors] delivered; what was left out".
inline std::string deliver(Dataset& data) {
  int frames = 0, left = 0, right = 0, imu = 0, aiding = 0;
  Time last_imu{-1}, last_image{-1};
  while (auto event = data.next()) {
    if (const auto* reading = std::get_if<AidingSample>(&*event)) {
      EXPECT_EQ(impossible(*reading), "");
      ++aiding;
      continue;
    }
    if (const auto* sample = std::get_if<ImuSample>(&*event)) {
      EXPECT_GT(sample->t, last_imu);
      EXPECT_TRUE(sample->gyro_radps.allFinite() && sample->accel_mps2.allFinite());
      last_imu = sample->t;
      ++imu;
      continue;
    }
    const StereoFrame& frame = std::get<StereoFrame>(*event);
    EXPECT_GT(frame.t, last_image);
    EXPECT_TRUE(frame.left() || frame.right());
    last_image = frame.t;
    ++frames;
    for (auto [image, count] : {std::pair{frame.left().get(), &left}, {frame.right().get(), &right}}) {
      if (!image) continue;
      EXPECT_EQ(image->width(), kToyWidth);
      EXPECT_EQ(image->height(), kToyHeight);
      ++*count;
    }
  }
  EXPECT_FALSE(data.next()) << "the end stays the end";
  const DatasetInfo& info = data.info();
  return fmt::format("{}/{}/{}/{}", frames, left, right, imu) + (aiding > 0 ? fmt::format("/{}", aiding) : "") +
         rows_left_out("left", info.camera(0).rows) + rows_left_out("right", info.camera(1).rows) +
         rows_left_out("imu", info.imu_rows) + rows_left_out("truth", info.ground_truth_rows) +
         images_left_out("left", info.camera(0)) + images_left_out("right", info.camera(1)) +
         (info.frames_without_image > 0 ? fmt::format("; {} empty frames", info.frames_without_image) : "");
}

}  // namespace fbvins::test
