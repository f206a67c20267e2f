// SPDX-License-Identifier: Apache-2.0
// The time offset between images and IMU that the calibration does not know: found by gyroscope and tracks (gyro_alignment.hpp),
// before the first start at once, in flight in steps. And the noise of the stamps, by which single images are early or late
// (docs/derivations/gyro_alignment.md, Y6-Y8).
//
//   TimeAlignment alignment(rig, true, {});
//   if (alignment.add(frame, running)) initialiser.reset();       // frames from here on are cut by another offset
//   apply(alignment.correction());                                // two images later: the feedback's way
//
// One owner, one thread.
#pragma once

#include <optional>

#include "fbvins/camera/camera.hpp"
#include "fbvins/imu/gyro_alignment.hpp"
#include "fbvins/types/imu_state.hpp"

namespace fbvins {

class TimeAlignment {
 public:
  /// `kept`: of the flight before. A calibration that knows the offset since then leaves nothing of it.
  TimeAlignment(const StereoRig& rig, bool enabled, const std::optional<TimeOffsetEstimate>& kept);

  /// Each frame. True where it was cut by an offset that differs from the frame's before by more than a step in flight, and where
  /// the line delay is another from here on.
  bool add(const TrackedFrame& frame, bool running);
  /// Whether enough was seen to notice an offset that would spoil a start in motion, and the newest frame was cut by what was
  /// found.
  bool known() const;
  Duration correction() const { return correction_; }
  /// Of the correction, 0 before it is known to anything.
  double sigma_s() const;
  /// It has changed, so lately that the window still has images of before.
  bool settling() const { return changed_ && (now_ - *changed_).seconds() < kForgotten_s; }
  /// What the line delay of the rig's shutters is corrected by.
  double line_delay_correction_s() const { return line_delay_s_; }
  /// How far a gyroscope's bias is from what tracks alone say of it, in standard deviations of both; 0 where they say nothing.
  double off_sigmas(const Vec3& gyro_bias_radps, const Mat3& covariance) const;
  /// Standard deviation of when an image was taken: the noise of its stamp, and what the offset is known to be wrong by.
  double stamp_sigma_s() const;

 private:
  static constexpr double kForgotten_s = 3;
  /// Each pair shows an error of the rotation as well as any, whatever the rate: what their offset is known to, a start may be
  /// wrong by.
  static constexpr int kFewestForStart = 8, kEnoughForStart = 24;
  static constexpr double kPreciseForStart_s = 0.005;
  /// Where no pairs come, because camera 0 sees too little, a start does not wait for longer than so many images.
  static constexpr int kLongestWait = 40;
  static constexpr double kUnknown_s = 1;
  void solve(bool running);
  /// The newest frame was cut by what has been found since.
  bool is_applied() const;

  bool enabled_;
  Duration given_;
  GyroAlignment alignment_;
  int frames_ = 0;
  Duration correction_{}, found_{};
  double found_sigma_s_ = kUnknown_s;  ///< of the best solution that agrees with what was found
  double line_delay_s_ = 0, jitter_s_ = 0, sigma_s_ = kUnknown_s;
  bool suspected_ = false;                           ///< by the newest solution, what was found is off
  int solves_ = 0, off_ = 0;                         ///< and those in a row that found the offset off
  std::optional<Time> changed_;                      ///< the correction, last
  std::optional<GyroAlignmentEstimate> fits_turns_;  ///< the newest solution, where the tracks do
  Time now_;
  std::optional<Duration> cut_by_;
};

}  // namespace fbvins
