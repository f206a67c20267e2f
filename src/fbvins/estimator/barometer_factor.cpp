// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/barometer_factor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/estimator/height_factor.hpp"
#include "fbvins/estimator/window_equations.hpp"

namespace fbvins {
namespace {

/// Metres for a unit of the logarithm of pressure, at 15 degrees: R T / g of air.
constexpr double kScaleHeight_m = 8434;
/// A level lasts so long: within, the drift is small.
constexpr double kLevel_s = 2;
/// What differs by so much, and by so many standard deviations, is not the drift.
constexpr double kJump_m = 0.4, kJump_sigma = 4;
/// A jump that stays so long is the new pressure.
constexpr double kStays_s = 2;
/// What the readings of one frame, and of neighbouring ones, have in common: gusts.
constexpr double kGust_m = 0.1;

}  // namespace

double pressure_height_m(double pressure_pa, double reference_pa) {
  return kScaleHeight_m * std::log(reference_pa / pressure_pa);
}

double LevelDrift::residual(const WindowProblem& w) const {
  return (w.own_variable(after_).value(0) - w.own_variable(before_).value(0)) / sigma_m_;
}

double LevelDrift::cost(const WindowProblem& w) const { return 0.5 * residual(w) * residual(w); }

double LevelDrift::linearise(const WindowProblem& w, NormalEquations& out) const {
  Eigen::MatrixXd J(1, 2);
  J << -1 / sigma_m_, 1 / sigma_m_;
  add_residual(w, {Variable::own_one(before_), Variable::own_one(after_)}, J, Eigen::VectorXd::Constant(1, residual(w)), 1, out);
  return cost(w);
}

std::shared_ptr<const Factor> LevelDrift::without(const DroppedFrame& d) const {
  return std::make_shared<const LevelDrift>(d.successor, before_, after_, sigma_m_);
}

std::optional<BarometerMaker::Height> BarometerMaker::height_of(const NewFrame& f) {
  const std::vector<PressureSample> readings = readings_of<PressureSample>(f.tracked.aiding);
  if (readings.empty()) return std::nullopt;
  double pressure_pa = 0, variance = 0;
  for (const PressureSample& r : readings) pressure_pa += r.pressure_pa, variance += r.sigma_pa * r.sigma_pa;
  const auto n = static_cast<double>(readings.size());
  pressure_pa /= n;
  if (!reference_pa_) reference_pa_ = pressure_pa;
  const double noise_m = kScaleHeight_m / pressure_pa * std::sqrt(variance) / n;
  Height out{pressure_height_m(pressure_pa, *reference_pa_), 0, hypotenuse(noise_m, kGust_m), f.frame.t};
  out.level_m = f.window.tilt().gravity_G(-1).dot(f.frame.state.T_FB.p) - out.above_m;
  return out;
}

bool BarometerMaker::fits(const Height& height, const SlidingWindow& window) const {
  const double drift_m = drift_m_rts_ * std::sqrt((height.t - level_->seen).seconds());
  const double off_m = height.level_m - window.own(level_->number)->value(0);
  return std::abs(off_m) < std::max(kJump_m, kJump_sigma * hypotenuse(height.sigma_m, drift_m));
}

bool BarometerMaker::stays(const Height& height) {
  const double apart_m = std::max(kJump_m, kJump_sigma * hypotenuse(height.sigma_m, height.sigma_m));
  const auto same = [&](const Height& other) { return std::abs(other.level_m - height.level_m) < apart_m; };
  if (!std::ranges::all_of(apart_, same)) apart_.clear();
  apart_.push_back(height);
  return (height.t - apart_.front().t).seconds() > kStays_s;
}

void BarometerMaker::begin_level(const Height& height, double level_m, SlidingWindow& window) {
  apart_.clear();
  level_ = {window.add_own("pressure level", Eigen::VectorXd::Constant(1, level_m)), height.t, height.t};
}

std::vector<std::shared_ptr<const Factor>> BarometerMaker::make(const NewFrame& f) {
  if (level_ && f.window.own(level_->number) == nullptr) level_.reset(), ended_.reset();  // a new window
  if (ended_) f.window.end_own(*std::exchange(ended_, std::nullopt));                     // the drift's factor names it by now
  const std::optional<Height> height = height_of(f);
  if (!height) return {};
  std::vector<std::shared_ptr<const Factor>> out;
  if (!level_) begin_level(*height, height->level_m, f.window);
  const bool fits_now = fits(*height, f.window);
  doubt_.count(height->t, fits_now);
  if (!fits_now) {
    if (!stays(*height)) return {};
    ended_ = level_->number;
    begin_level(*height, height->level_m, f.window);
  } else if (const double age_s = (height->t - level_->begun).seconds(); age_s > kLevel_s) {
    const int before = level_->number;
    begin_level(*height, f.window.own(before)->value(0), f.window);
    out.push_back(std::make_shared<const LevelDrift>(f.frame.id, before, level_->number, drift_m_rts_ * std::sqrt(age_s)));
    ended_ = before;
  }
  apart_.clear();
  level_->seen = height->t;
  out.push_back(std::make_shared<const HeightFactor>(f.frame.id, level_->number, Vec3::Zero(), height->sigma_m, height->above_m));
  return out;
}

}  // namespace fbvins
