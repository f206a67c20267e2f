// SPDX-License-Identifier: Apache-2.0
// Trajectory files, read and written. Readers are pure but for the file; a writer belongs to one thread.
//
//   Result<TrajectoryFile> truth = read_trajectory("groundtruth.csv");   // TUM or EuRoC CSV, by content
//   Result<TumWriter> tum = TumWriter::create("trajectory.txt");
//   tum->write(o.t, o.T_WB);
//   Result<void> done = tum->close();                                    // the file appears here
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/io/output_file.hpp"
#include "fbvins/io/row_counts.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

struct TrajectoryPoint {
  Time t;
  Pose<W, B> T_WB;
  std::optional<Vec3> v_WB;  ///< m/s, in W
  std::optional<ImuBias> bias;
};

struct TrajectoryFile {
  std::vector<TrajectoryPoint> points;  ///< in order of time
  RowCounts counts;                     ///< what was left out
  int without_pose = 0;                 ///< rows of an odometry CSV whose health says that there is no pose
  std::string recognised;               ///< how the file is written, for people; empty for plain TUM and EuRoC files

  /// In the frame that the caller names; the file does not say.
  template <class Frame = W>
  Trajectory<Frame> poses() const {
    Trajectory<Frame> out;
    out.reserve(points.size());
    for (const TrajectoryPoint& point : points) out.push_back({point.t, {point.T_WB.q, point.T_WB.p}});
    return out;
  }
};

/// What a file does not say itself, or says wrongly.
struct TrajectoryFormat {
  double unit_ns = 0;                          ///< of the stamps; 0: by their size
  std::optional<bool> w_first = std::nullopt;  ///< quaternions are w x y z, or x y z w; none: by the rest
};
/// "ns", "us", "ms" or "s" and "wxyz" or "xyzw", one of them or both with a comma between.
Result<TrajectoryFormat> parse_trajectory_format(const std::string& text);

/// Told apart by content: commas and whole stamps mean EuRoC's CSV (ns, p, q wxyz[, v[, gyro bias, accelerometer bias[, ...]]]),
/// blanks mean TUM (s, p, q xyzw[, ...]); other units of the stamps, separators, a running number and columns that follow are
/// recognised, and told in TrajectoryFile::recognised. Rows with NaN are counted and left out. `file` is only for messages.
Result<TrajectoryFile> parse_trajectory(std::string_view text, const std::string& file, const TrajectoryFormat& format = {});
Result<TrajectoryFile> read_trajectory(const std::string& path, const TrajectoryFormat& format = {});

/// `t x y z qx qy qz qw`, seconds with nine decimals.
class TumWriter {
 public:
  static Result<TumWriter> create(const std::string& path);
  template <class Frame = W>
  void write(Time t, const Pose<Frame, B>& T) {
    write(t, T.q, T.p);
  }
  Result<void> close() { return file_.close(); }

 private:
  explicit TumWriter(OutputFile file) : file_(std::move(file)) {}
  void write(Time t, const Quat& q, const Vec3& p);
  OutputFile file_;
};

/// EuRoC's ground-truth columns, then the upper triangle of the 6x6 pose covariance row by row,
/// health, reason and reset counter. One row a frame; of frames without a pose all numbers are NaN.
class OdometryCsvWriter {
 public:
  static Result<OdometryCsvWriter> create(const std::string& path);
  void write(const Odometry& odometry);
  Result<void> close() { return file_.close(); }

 private:
  explicit OdometryCsvWriter(OutputFile file) : file_(std::move(file)) {}
  OutputFile file_;
};

}  // namespace fbvins
