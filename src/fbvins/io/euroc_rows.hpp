// SPDX-License-Identifier: Apache-2.0
// Private to io: the rows of all sensors of a recording in EuRoC's layout, on one clock that runs on. Pure but for reading files.
//
//   Result<EurocRows> rows = read_euroc_rows(files, root, {{"cam0/", "cam1/"}, "", true});
#pragma once

#include <string>
#include <vector>

#include "fbvins/io/clock_steps.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/trajectory.hpp"

namespace fbvins {

/// Folders below the recording's root, each with a slash at the end.
struct EurocSensors {
  std::vector<std::string> cameras;
  std::string depth;  ///< empty: none
  bool imu = false;
};

struct EurocRows {
  std::vector<StampedRows<ImageRow>> cameras;
  StampedRows<ImageRow> depth;
  StampedRows<ImuSample> imu;
  JoinedClock clock;
  std::vector<std::string> warnings;  ///< of rows that were left out, and of the clock
};

Result<EurocRows> read_euroc_rows(const FileSource& files, const std::string& root, const EurocSensors& sensors);

/// What is said of rows that were left out; empty where none was.
std::vector<std::string> row_warnings(const RowCounts& counts, const std::string& file);

/// A recording's ground truth on the clock of its sensors: where that stepped back and the truth's did, too, each part is shifted
/// alike; where the truth's did not, only what lies before the step is used.
Result<TrajectoryFile> parse_truth(const std::string& csv, const std::string& file, const JoinedClock& clock);

/// The same poses of the IMU, from those of a sensor that lies at T_SI; the identity in EuRoC.
void refer_to_imu(std::vector<TrajectoryPoint>& truth, const Pose<B, B>& T_SI);

}  // namespace fbvins
