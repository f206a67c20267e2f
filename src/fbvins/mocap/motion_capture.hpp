// SPDX-License-Identifier: Apache-2.0
// Recordings of motion-capture systems. Pure functions but for the file, any thread.
//
//   Result<MotionCapture> file = read_motion_capture("take.csv");
//   Result<MarkerBody> body = choose_body(*std::move(file), "quad", "take.csv");
//
// Recognised by content: Motive CSV (Y up, turned to z up here), Vicon CSV, Qualisys TSV (6D), TUM, EuRoC CSV, and topics of
// PoseStamped or Odometry in MCAP. docs/mocap.md describes each. Results are in metres and seconds of the file's own clock.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/byte_source.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/io/row_counts.hpp"
#include "fbvins/types/motion_capture.hpp"

namespace fbvins {

struct MarkerBody {
  std::string name;  ///< in MCAP its topic; empty in formats without names
  MarkerTrack track;
  int unseen = 0;  ///< rows in which the body was not seen
};

struct MotionCapture {
  std::string format;              ///< "Motive CSV", "Vicon CSV", ...
  std::vector<MarkerBody> bodies;  ///< as in the file, at least one
  RowCounts counts;                ///< rows left out
};

Result<MotionCapture> parse_motion_capture(std::string_view text, const std::string& file);
/// PoseStamped and Odometry of MCAP; without compression.
Result<MotionCapture> read_marker_topics(std::shared_ptr<const ByteSource> bytes, const std::string& file);
Result<MotionCapture> read_motion_capture(const std::string& path);

/// The body of that name; with an empty name the only one. The error lists those that there are.
Result<MarkerBody> choose_body(MotionCapture recording, std::string_view name, const std::string& file);

}  // namespace fbvins
