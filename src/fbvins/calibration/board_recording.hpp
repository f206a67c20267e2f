// SPDX-License-Identifier: Apache-2.0
// The images of a recording to look for a board in, without any calibration: EuRoC's layout with one to eight cameras. One
// thread at a time.
//
//   Result<BoardRecording> recording = BoardRecording::open("board");
//   while (std::optional<TakenImage> image = recording->next()) ...
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// An image as it was recorded, not yet decoded.
struct TakenImage {
  Time t;
  int camera = 0;
  std::string name;   ///< of the file
  std::string bytes;  ///< PNG or JPEG; empty where `image` is there, or the file could not be read
  std::shared_ptr<const Image> image = {};
};

class BoardRecording {
 public:
  /// A folder or zip in EuRoC's layout: cam0 to cam7 without a gap, imu0 if there is one. Calibrations in it are not read, the
  /// IMU's noise is.
  static Result<BoardRecording> open(const std::string& path);
  BoardRecording(BoardRecording&&) noexcept;
  BoardRecording& operator=(BoardRecording&&) noexcept;
  ~BoardRecording();

  int cameras() const;
  int images() const;
  /// In order of time, all cameras.
  std::optional<TakenImage> next();
  /// Empty without imu0.
  const std::vector<ImuSample>& imu() const;
  const std::optional<ImuNoise>& imu_noise() const;

 private:
  struct State;
  explicit BoardRecording(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace fbvins
