// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/time_alignment.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/imu/stamp_noise.hpp"

namespace fbvins {
namespace {

/// Solved after so many images: before the first start, while pairs are few, and otherwise.
constexpr int kEachBefore = 2, kEachInFlight = 20;
/// An offset is corrected where it is certain: by this much, and by so many standard deviations.
constexpr double kLeast_s = 0.0015, kCertain_sigma = 3;
/// A start waits for more pairs where it may be off: 99 % of the solutions of rigs without an offset are nearer (524 of 28
/// flights).
constexpr double kSuspected_sigma = 1.7;
/// Before the start one that was found is improved by less.
constexpr double kImproved_sigma = 1;
/// In flight, where it was known well enough for a start, so often in a row, and the noise of stamps is a mean of so many
/// solutions: a fault of the gyroscope is no offset.
constexpr int kInARow = 3, kSolvesOfNoise = 20;
/// A line delay likewise: global shutters stay what they are. Where the offset was wrong nobody has calibrated the line delay,
/// either.
constexpr double kLeastLine_s = 8e-6, kCertainLine_sigma = 4, kDoubtedLine_sigma = 2.5;
/// In flight the correction is made in steps: a pose must not lie before the one before it.
constexpr Duration kStep{4'000'000};
/// The gyroscope's bias is taken from tracks that fit turns to this many of their standard deviations. Where things are close and
/// the camera moves, its standard deviation is too small by up to the second (docs/experiments/sensors.md).
constexpr double kFitsTurns_rms = 1, kBiasShared = 2;
/// Drivers keep their delay from flight to flight to this, at best.
constexpr double kKept_s = 0.005;

/// Beyond the rig's. More than can be found is not used.
std::optional<TimeOffsetEstimate> correction_of(const std::optional<TimeOffsetEstimate>& kept, const StereoRig& rig) {
  if (!kept) return kept;
  const TimeOffsetEstimate beyond{kept->s - rig.time_offset_s, hypotenuse(kept->sigma_s, kKept_s)};
  if (std::abs(beyond.s) > GyroAlignment::kLargestOffset_s) return std::nullopt;
  return beyond;
}

}  // namespace

TimeAlignment::TimeAlignment(const StereoRig& rig, bool enabled, const std::optional<TimeOffsetEstimate>& kept)
    : enabled_(enabled),
      given_(Duration::from_seconds(rig.time_offset_s)),
      alignment_(rig.T_BC0().R(), 0.5 * rig.left().height(), rig.line_delay_s, {.known_offset = correction_of(kept, rig)}) {
  const auto known = correction_of(kept, rig);
  if (!known || !enabled) return;
  correction_ = found_ = Duration::from_seconds(known->s);
  sigma_s_ = known->sigma_s;  // and is so after a flight that shows nothing of it, too
}

bool TimeAlignment::add(const TrackedFrame& frame, bool running) {
  if (!enabled_) return false;
  now_ = frame.t;
  const bool changed = cut_by_ && std::abs((frame.imu.time_offset - *cut_by_).seconds()) > kStep.seconds();
  cut_by_ = frame.imu.time_offset;
  alignment_.add(frame, given_);
  const bool few = !running && alignment_.pairs() <= kEnoughForStart;
  const double line_delay_before_s = line_delay_s_;
  if (++frames_ % (few ? kEachBefore : kEachInFlight) == 0) solve(running);
  if (correction_ != found_) changed_ = now_;
  const Duration missing = found_ - correction_;
  correction_ = running ? correction_ + std::clamp(missing, -kStep, kStep) : found_;
  return changed || line_delay_s_ != line_delay_before_s;
}

bool TimeAlignment::is_applied() const {
  return !cut_by_ || std::abs((*cut_by_ - given_ - found_).seconds()) < std::max(kLeast_s, sigma_s_);
}

bool TimeAlignment::known() const {
  if (!enabled_ || frames_ >= kLongestWait) return true;
  const bool precise = alignment_.pairs() >= kFewestForStart && sigma_s_ < kPreciseForStart_s && !suspected_;
  return (precise || alignment_.pairs() >= kEnoughForStart) && is_applied();
}

void TimeAlignment::solve(bool running) {
  const std::optional<GyroAlignmentEstimate> found = alignment_.solve();
  if (!found || found->pairs < kFewestForStart) return;
  sigma_s_ = found->time_offset_sigma_s();
  fits_turns_ = found->pairs >= kEnoughForStart && found->rms < kFitsTurns_rms ? found : std::nullopt;
  solves_ = std::min(solves_ + 1, kSolvesOfNoise);
  jitter_s_ += (found->stamp_sigma_s - jitter_s_) / solves_;
  const double off_s = std::abs(found->time_offset_s() - found_.seconds());
  const double certain = running || found_ == Duration{} ? kCertain_sigma : kImproved_sigma;
  off_ = off_s > kLeast_s && off_s > certain * found->time_offset_sigma_s() ? off_ + 1 : 0;
  suspected_ = off_s > std::max(kLeast_s, kSuspected_sigma * found->time_offset_sigma_s());
  const bool better = found->time_offset_sigma_s() < found_sigma_s_;
  if (off_ == 0) found_sigma_s_ = std::min(found_sigma_s_, found->time_offset_sigma_s());
  else if (off_ >= (running && found_sigma_s_ < kPreciseForStart_s ? kInARow : 1) && (running || better)) {
    found_ = Duration::from_seconds(found->time_offset_s());
    found_sigma_s_ = found->time_offset_sigma_s();
  }
  const double line_off_s = std::abs(found->line_delay_s() - line_delay_s_);
  const double line_sigmas = found_ == Duration{} ? kCertainLine_sigma : kDoubtedLine_sigma;
  if (found->pairs < kEnoughForStart || line_off_s < std::max(kLeastLine_s, line_sigmas * found->line_delay_sigma_s())) return;
  line_delay_s_ = found->line_delay_s();
}

/// An offset that is less than kLeast_s off is left as it is.
double TimeAlignment::sigma_s() const {
  if (sigma_s_ >= kUnknown_s) return 0;
  return std::hypot(sigma_s_, kLeast_s / std::sqrt(3.0), (found_ - correction_).seconds());
}

double TimeAlignment::off_sigmas(const Vec3& gyro_bias_radps, const Mat3& covariance) const {
  if (!fits_turns_) return 0;
  const Vec3 off = gyro_bias_radps - fits_turns_->gyro_bias_radps();
  const Mat3 of_both = kBiasShared * kBiasShared * fits_turns_->covariance.topLeftCorner<3, 3>() + covariance;
  return std::sqrt(std::max(0.0, off.dot(Ldlt<3>(of_both).solve(off))));
}

double TimeAlignment::stamp_sigma_s() const {
  const double jitter_s = std::sqrt(std::max(0.0, jitter_s_ * jitter_s_ - kUnseenStampNoise_s * kUnseenStampNoise_s));
  return hypotenuse(jitter_s, settling() ? std::max(0.002, std::abs((found_ - correction_).seconds())) : 0.0);
}

}  // namespace fbvins
