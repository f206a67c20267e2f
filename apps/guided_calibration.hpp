// SPDX-License-Identifier: Apache-2.0
// `fbvins calibrate --source`: records from live sensors and says meanwhile how to hold the board, until the aims are reached,
// the source ends, or Ctrl-C. What it recorded is in files before anything is made of it.
//
//   auto guided = GuidedCalibration::open(options);
//   Result<GuidedRecording> recorded = (*guided)->record();
//   ... calibrate ...
//   (*guided)->end("done", "results in rig");
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/guided_page.hpp"
#include "fbvins/calibration/growing_calibration.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins::app {

struct GuidedOptions {
  std::string source;            ///< as `fbvins live --source` has it
  std::vector<ImageSize> sizes;  ///< of images from sources that have no calibration to tell them
  std::string web;               ///< [ADDRESS:]PORT; empty: no page
  std::string out;               ///< an existing folder
  Board board;
  GrowingOptions growing = {};
  bool given_noise = false;  ///< growing.imu_noise is the user's
  int threads = 2;           ///< that look for the board; one more adjusts
  bool quiet = false;
};

/// As `--detections` and `--imu` read it from the files again, to the bit.
struct GuidedRecording {
  Detections detections;
  std::vector<ImuSample> imu;
  std::optional<ImuNoise> imu_noise;  ///< the source's
};

class GuidedCalibration {
 public:
  static Result<std::unique_ptr<GuidedCalibration>> open(GuidedOptions options);
  ~GuidedCalibration();

  /// Writes detections.csv and imu0.csv. An error where the source fails before it showed the board, or a file cannot be written.
  Result<GuidedRecording> record();
  /// Tells the page what became of it. `stage`: "done" or "failed".
  void end(const std::string& stage, const std::string& sentence);

 private:
  class Session;
  explicit GuidedCalibration(std::unique_ptr<Session> session);
  std::unique_ptr<Session> session_;
};

}  // namespace fbvins::app
