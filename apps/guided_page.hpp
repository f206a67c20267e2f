// SPDX-License-Identifier: Apache-2.0
// The page of `fbvins calibrate --source --web`: live images with the corners that were found, what to do next, how far each part
// is. In a program built without Boost it is an error.
#pragma once

#include <memory>
#include <string>

#include "apps/board_watch.hpp"
#include "fbvins/calibration/growing_calibration.hpp"

namespace fbvins::app {

/// What page and terminal show.
struct GuidedState {
  CalibrationProgress progress;
  std::string stage = "recording";  ///< then "adjusting", then "done" or "failed"
  std::string action, reason;       ///< of this moment
  int images = 0, left_out = 0, readings = 0;
  double duration_s = 0;
};

class GuidedPage {
 public:
  /// `where`: [ADDRESS:]PORT, port 0 for any free one. Tells its address.
  static Result<std::unique_ptr<GuidedPage>> open(const std::string& where, const std::string& source);
  virtual ~GuidedPage() = default;
  // From one thread at a time.
  virtual void show(const GuidedState& state) = 0;
  /// Images only where somebody looks.
  virtual void show(const BoardWatch::Look& look) = 0;
  /// Waits a while for the viewers to receive the last message.
  virtual void finish() = 0;
};

}  // namespace fbvins::app
