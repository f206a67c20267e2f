// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/monitor.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "fbvins/core/angle.hpp"
#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

/// Landmarks in an image without which it proves nothing, for a camera and for a pose.
constexpr std::size_t kFewest = 15;
/// Median residuals at the predicted pose, in standard deviations of a feature: up to 1 where all is well. More is expected
/// after a longer time.
constexpr double kUsual_sigma = 1.5, kUsualFor_s = 0.06;
/// Times as much while the calibration is being found.
constexpr double kCalibrating = 6;
/// Where the images' own pose does not explain them much better, the prediction is not what is wrong.
constexpr double kBetter = 0.6;
/// Share of the landmarks that agree with one pose where images can be right against the readings.
constexpr double kAgreeing = 0.6;
/// CUSUM of (median / usual - 1): a contradiction from here on; no more is kept.
constexpr double kContradiction = 1, kMost = 2;
/// What all that a camera sees is off by, in one direction, added up with this memory: up to 2.3 where all is well. A gyroscope's
/// axes may be off by this share of the turn.
constexpr double kDrift_sigma = 4, kDrift_s = 0.5, kScale = 0.005;
/// A smaller drift that lasts: cumulative sum (CUSUM) of (drift / usual - 1) over time, s. Usual is this much, and this part of
/// what the axes explain, twice their standard deviation (W23).
constexpr double kLasting_sigma = 1.5, kLastingScale = 0.4, kLasting_s = 0.5;
/// What is left of a sudden drift does not last: it is forgotten after this time.
constexpr double kForgotten_s = 1;
/// The window's turns against the readings', in standard deviations, beyond what axes that are off by this share of the turn
/// explain: up to 3 where all is well, up to 6.4 where images are rendered along a measured trajectory. From the first on the
/// readings count less, from the second on they contradict each other, until they are below the third.
constexpr double kTurnSuspected_sigma = 5, kTurn_sigma = 7, kTurnOver_sigma = 3, kTurnScale = 0.002;
/// By then the pose may have moved by about as much, in each direction.
constexpr double kTurnedAway_m = 0.1;
/// The other camera, where only one drifts. A camera that was excluded for drift alone is used again after this time: the
/// landmarks triangulated without it may be what is wrong.
constexpr double kOther = 0.5, kReadmitted_s = 1;
constexpr double kCalm_s = 0.5, kBlind_s = 0.3;
/// After darkness of this length the velocity has to be found again, and the first predictions are as wrong as it is.
constexpr double kDark_s = 0.15;
constexpr int kSettling = 5;
/// A doubt that is told as a reset; two of them within a few seconds are no way to fly.
constexpr double kReset_m = 0.1, kReset_rad = 3 * kDegree, kNextReset_s = 5;
/// A doubt about the tilt has to be confirmed by gravity: by biases that are where they were, for this time.
constexpr double kTilt_rad = 1 * kDegree, kConfirmed_s = 1.5, kAccelBack_mps2 = 0.1, kGyroBack_radps = 0.005;
/// No bias moves so far in so short a time. On flights without a fault no estimated one does.
constexpr double kJump_s = 2, kAccelJump_mps2 = 0.25, kGyroJump_radps = 0.005, kMoved_sigma = 5;
/// At the beginning, when the first errors of the start are found, they do.
constexpr double kBegun_s = 2;
/// Nor is it another one after a restart that this has caused.
constexpr double kRemembered_s = 30;

/// A change of a bias in standard deviations, of which `floor` is the least. Of a consistent estimate the covariance of a change
/// is what it gained or lost meanwhile.
double change_sigma(const Vec3& change, const Mat3& before, const Mat3& after, double floor) {
  const Eigen::SelfAdjointEigenSolver<Mat3> gained(before - after);
  const Vec3 along = gained.eigenvectors().transpose() * change;
  return std::sqrt((along.array().square() / (gained.eigenvalues().array().abs() + floor * floor)).sum());
}

bool moved(const Monitor::Biases& from, const Monitor::Biases& to, double accel_mps2, double gyro_radps) {
  return change_sigma(to.bias.accel_mps2 - from.bias.accel_mps2, from.accel, to.accel, accel_mps2 / kMoved_sigma) >
             kMoved_sigma ||
         change_sigma(to.bias.gyro_radps - from.bias.gyro_radps, from.gyro, to.gyro, gyro_radps / kMoved_sigma) > kMoved_sigma;
}

struct Medians {
  std::array<std::optional<double>, kMostCameras> norm;  ///< of the residuals' norms; none with few landmarks
  std::array<Vec2, kMostCameras> shift;                  ///< of the residuals themselves
  double focal = 0;                                      ///< standard deviations for a radian

  bool of(int camera) const { return norm[static_cast<std::size_t>(camera)].has_value(); }
  double worst() const {
    double worst = 0;
    for (const std::optional<double>& n : norm) worst = std::max(worst, n.value_or(0));
    return worst;
  }
};

CameraPair pair_of(int camera, const std::vector<LandmarkObservation>& observations) {
  for (const LandmarkObservation& l : observations)
    if (l.feature->cameras.left == camera || l.feature->cameras.right == camera) return l.feature->cameras;
  return {static_cast<std::int8_t>(camera), static_cast<std::int8_t>(camera)};
}

/// The camera that is off most, if the others are not, or else its pair, which sees the same things, if the others are not.
/// `off(camera)`: by how much; `fits(others, this)`.
template <class Off, class Fits>
std::optional<CameraPair> suspects(const std::vector<LandmarkObservation>& observations, const Medians& at, int camera_count,
                                   Off&& off, Fits&& fits) {
  int worst = 0;
  for (int c = 1; c < camera_count; ++c)
    if (off(c) > off(worst)) worst = c;
  if (!at.of(worst)) return std::nullopt;
  const auto alone = static_cast<std::int8_t>(worst);
  for (const CameraPair cameras : {CameraPair{alone, alone}, pair_of(worst, observations)}) {
    double of_others = 0;
    int others = 0;
    for (int c = 0; c < camera_count; ++c) {
      if (cameras.has(c)) continue;
      others += at.of(c);
      of_others = std::max(of_others, off(c));
    }
    if (others > 0 && fits(of_others, off(worst))) return cameras;
  }
  return std::nullopt;
}

Medians medians(const std::vector<LandmarkObservation>& observations, const CameraGeometry& cameras, int camera_count,
                const Pose<G, B>& T_GB, const Vec3& v_B) {
  const Mat3 R_BG = T_GB.R().transpose();
  Medians out;
  out.shift.fill(Vec2::Zero());
  for (int c = 0; c < camera_count; ++c) {
    std::vector<double> residuals, x, y;
    for (const LandmarkObservation& l : observations) {
      const auto [left, right] = l.feature->cameras;
      if (c != left && c != right) continue;
      const std::optional<Observation>& o = c == left ? l.feature->left : l.feature->right;
      if (!o) continue;
      const Vec3 p_C = cameras.R_CB[c] * (R_BG * (l.p_G - T_GB.p) - cameras.t_BC[c] - o->displacement_B(v_B));
      const Vec2 r =
          p_C.z() > kMinScaledDepth ? Vec2(o->sqrt_information * (p_C.head<2>() / p_C.z() - o->normalised)) : Vec2(1e3, 1e3);
      residuals.push_back(r.norm()), x.push_back(r.x()), y.push_back(r.y());
      out.focal = o->sqrt_information(0, 0);
    }
    if (residuals.size() < kFewest) continue;
    out.norm[static_cast<std::size_t>(c)] = median(residuals);
    out.shift[static_cast<std::size_t>(c)] = Vec2(median(x), median(y));
  }
  return out;
}

Vec3 middle_of(const std::vector<LandmarkObservation>& observations) {
  Vec3 middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const LandmarkObservation& l : observations) along.push_back(l.p_G(axis));
    middle(axis) = median(along);
  }
  return middle;
}

}  // namespace

void Monitor::restart() {
  const std::optional<Biases> refuted = refuted_;
  *this = Monitor(assumed_, calibrating_);
  refuted_ = refuted;
}

void Monitor::take(const WindowTurns& turns, const Pose<G, B>& now, Duration dt) {
  if (turns.sigma_rad <= 0) return;
  const double off = (turns.off_G.norm() - kTurnScale * turns.turned_rad) / (turns.sigma_rad * (calibrating_ ? kCalibrating : 1));
  if (off < (turning_noise_ > 1 ? kTurnOver_sigma : kTurnSuspected_sigma)) {
    turning_noise_ = 1;
    turns_contradict_ = false;
    return;
  }
  turning_noise_ = std::max(turning_noise_, off);
  if (!may_be_away_) may_be_away_ = true, shifts_G_ += kTurnedAway_m * kTurnedAway_m * Mat3::Identity();
  if (off < kTurn_sigma && !turns_contradict_) return;
  if (!turns_contradict_) turns_contradict_ = turned_away_ = true;
  const Vec3 turn_G = dt.seconds() / turns.span.seconds() * turns.off_G;
  take_doubt(now, now.q.conjugate() * turn_G, turn_G.cross(ahead_G_));
  contradicted_ = true;
  calm_s_ = 0;
}

void Monitor::pass(Duration dt) {
  calm_s_ += dt.seconds();
  blind_s_ = 0;
  since_reset_s_ += dt.seconds();
  contradicted_ = contradicted_ && calm_s_ < kCalm_s;
}

void Monitor::blind(Duration dt) {
  drift_ = none();
  since_reset_s_ += dt.seconds();
  blind_s_ += dt.seconds();
  if (!contradicted_) {
    if (blind_s_ > kDark_s) settling_ = kSettling;
    return;
  }
  doubt_tilt();  // readings that are doubted have to carry alone
  hopeless_ = hopeless_ || blind_s_ > kBlind_s;
}

/// `shift`: of the residuals.
void Monitor::add_drift(const OfEachCamera& shift, double focal, const Quat& predicted, double patience, Duration dt) {
  const double kept = std::exp(-dt.seconds() / kDrift_s);
  for (std::size_t c = 0; c < drift_.size(); ++c) {
    drift_[c] = kept * drift_[c] + shift[c];
    drift_[c] *= std::min(1.0, kMost * kDrift_sigma / std::max(1e-9, drift_[c].norm()));
  }
  turned_sigma_ = kept * turned_sigma_ + kScale * focal * predicted.angularDistance(predicted_);
  predicted_ = predicted;
  const double drift = largest_drift() / patience;
  since_sudden_s_ = drift > kDrift_sigma + turned_sigma_ ? 0 : since_sudden_s_ + dt.seconds();
  if (since_sudden_s_ < kForgotten_s) return;
  const double more = drift / (kLasting_sigma + kLastingScale * turned_sigma_) - 1;
  lasting_s_ = std::clamp(lasting_s_ + dt.seconds() * std::min(more, 1.0), 0.0, kLasting_s);
}

double Monitor::largest_drift() const {
  double largest = 0;
  for (const Vec2& drift : drift_) largest = std::max(largest, drift.norm());
  return largest;
}

void Monitor::doubt_tilt() {
  if (biases_.empty()) tilt_doubted_ = true;
  else doubt_tilt(biases_.front());
}

void Monitor::doubt_tilt(const Biases& before) {
  if (tilt_doubted_) return;
  tilt_doubted_ = true;
  before_ = before;
  confirmed_s_ = refuted_s_ = 0;
}

void Monitor::take(const Biases& now) {
  if (!begun_) begun_ = now.t;
  if ((now.t - *begun_).seconds() < kBegun_s && !refuted_) return;
  const double dt_s = biases_.empty() ? 0 : (now.t - biases_.back().t).seconds();
  biases_.push_back(now);
  while ((now.t - biases_.front().t).seconds() > kJump_s) biases_.pop_front();
  if (refuted_ && (now.t - refuted_->t).seconds() > kRemembered_s) refuted_.reset();
  const Biases& from = refuted_ ? *refuted_ : biases_.front();
  if (moved(from, now, kAccelJump_mps2, kGyroJump_radps)) doubt_tilt(from);
  if (!tilt_doubted_ || contradicted_) return;
  const bool away = before_ && moved(*before_, now, kAccelBack_mps2, kGyroBack_radps);
  (away ? refuted_s_ : confirmed_s_) += dt_s;
  (away ? confirmed_s_ : refuted_s_) = 0;
  if (refuted_s_ > kConfirmed_s) hopeless_ = true, refuted_ = before_;
  if (confirmed_s_ <= kConfirmed_s) return;
  tilt_doubted_ = false;
  tilt_G_.setZero();
  before_.reset(), refuted_.reset();
  biases_ = {now};
}

Monitor::Verdict Monitor::examine(const std::vector<LandmarkObservation>& observations, const Calibration& calibration,
                                  const Pose<G, B>& predicted, Duration dt, const Vec3& v_B) {
  Verdict out;
  if (observations.size() < kFewest) {
    blind(dt);
    return out;
  }
  if (settling_ > 0 && !contradicted_) {
    --settling_;
    pass(dt);
    return out;
  }
  out.noise.gyro = turning_noise_;
  ahead_G_ = middle_of(observations) - predicted.p;
  const double patience = (calibrating_ ? kCalibrating : 1) * std::max(1.0, dt.seconds() / kUsualFor_s);
  const CameraGeometry cameras(calibration);
  const int camera_count = calibration.camera_count();
  const Medians at_prediction = medians(observations, cameras, camera_count, predicted, v_B);
  const double excess = at_prediction.worst() / (patience * kUsual_sigma) - 1;
  add_drift(at_prediction.shift, at_prediction.focal, predicted.q, patience, dt);
  const bool drifting = largest_drift() > patience * (kDrift_sigma + turned_sigma_) || lasting_s_ >= kLasting_s;
  if (excess < 0 && !drifting) {
    take_agreement(excess, dt);
    return out;
  }
  const PoseRefinement seen = refine_pose(observations, calibration, predicted, v_B);
  const Medians at_seen = medians(observations, cameras, camera_count, seen.T_GB, v_B);
  const auto off = [&](int camera) {
    const auto c = static_cast<std::size_t>(camera);
    return excess < 0 ? drift_[c].norm() : at_prediction.norm[c].value_or(0);
  };
  const auto fits = [&](double others, double worst) { return others < (excess < 0 ? kOther * worst : patience * kUsual_sigma); };
  const std::optional<CameraPair> wrong = suspects(observations, at_prediction, camera_count, off, fits);
  if (excess < 0 && wrong && wrong->left != wrong->right) {
    pass(dt);  // something moves before one of several pairs
    return out;
  }
  const bool explained = seen.inliers >= kAgreeing * static_cast<double>(observations.size()) &&
                         (excess < 0 || at_seen.worst() < kBetter * at_prediction.worst());
  if (!explained && !wrong) {
    take_unexplained(dt);
    return out;
  }
  evidence_ = std::min(kMost, std::max(evidence_ + excess, drifting ? kContradiction : 0.0));
  if (evidence_ < kContradiction) {
    pass(dt);
    return out;
  }
  if (wrong) {
    if (exclude(excess < 0, dt)) out.wrong = wrong;
    pass(dt);  // the readings agree with the others
    return out;
  }
  follow(seen.T_GB, predicted, dt, out);
  return out;
}

void Monitor::take_agreement(double excess, Duration dt) {
  evidence_ = std::max(0.0, evidence_ + excess);
  unexplained_s_ = std::max(0.0, unexplained_s_ - dt.seconds());
  unexplained_ = unexplained_ && unexplained_s_ > 0;
  pass(dt);
}

void Monitor::take_unexplained(Duration dt) {
  unexplained_s_ = std::min(kCalm_s, unexplained_s_ + dt.seconds());
  unexplained_ = unexplained_ || unexplained_s_ > kDark_s;
  blind(dt);
}

/// Whether a camera that is off is left out of this image.
bool Monitor::exclude(bool for_drift_alone, Duration dt) {
  excluded_s_ = for_drift_alone ? excluded_s_ + dt.seconds() : 0;
  if (excluded_s_ <= kReadmitted_s) return true;
  excluded_s_ = evidence_ = lasting_s_ = 0;
  drift_ = none();
  return false;
}

/// The images are believed, and the readings count as much as they agree.
void Monitor::follow(const Pose<G, B>& seen, const Pose<G, B>& predicted, Duration dt, Verdict& out) {
  const Vec3 turn = so3_log((predicted.q.conjugate() * seen.q).normalized());
  const Vec3 shift = seen.p - predicted.p;
  out.imu_contradicts = true;
  out.seen = seen;
  out.noise.gyro = std::max(out.noise.gyro, turn.norm() / (assumed_.gyro_noise_density_radps_rthz * std::sqrt(dt.seconds())));
  out.noise.accel =
      std::max(1.0, shift.norm() / (assumed_.accel_noise_density_mps2_rthz * std::sqrt(std::pow(dt.seconds(), 3) / 3)));
  take_doubt(predicted, turn, shift);
  contradicted_ = true;
  calm_s_ = blind_s_ = 0;
}

void Monitor::take_doubt(const Pose<G, B>& predicted, const Vec3& turn_B, const Vec3& shift_G) {
  if (turn_G_.isZero(0)) where_G_ = predicted.p;
  const Vec3 turn_G = predicted.q * turn_B;
  turn_G_ += turn_G, shift_G_ += shift_G;
  turns_G_ += turn_G * turn_G.transpose(), shifts_G_ += shift_G * shift_G.transpose();
  tilt_G_ += Vec3(turn_G.x(), turn_G.y(), 0);
  if (tilt_G_.norm() > kTilt_rad) doubt_tilt();
}

bool Monitor::take_reset() {
  if (contradicted() || (shift_G_.norm() < kReset_m && turn_G_.norm() < kReset_rad && !turned_away_)) return false;
  turned_away_ = may_be_away_ = false;
  turn_G_.setZero(), shift_G_.setZero(), turns_G_.setZero(), shifts_G_.setZero();
  count_reset();
  return true;
}

void Monitor::count_reset() {
  hopeless_ = hopeless_ || since_reset_s_ < kNextReset_s;
  since_reset_s_ = 0;
}

Mat6 Monitor::doubt(const Pose<G, B>& T_GB) const {
  const Mat3 R_BG = T_GB.R().transpose();
  const Mat3 turns_G = turns();
  const Mat3 lever = hat(T_GB.p - where_G_);
  Mat6 out = Mat6::Zero();
  out.topLeftCorner<3, 3>() = shifts_G_ + shift_G_ * shift_G_.transpose() + lever * turns_G * lever.transpose();
  out.bottomRightCorner<3, 3>() = R_BG * turns_G * R_BG.transpose();
  return out;
}

Mat3 Monitor::velocity_doubt(const Vec3& v_GB) const { return hat(v_GB) * turns() * hat(v_GB).transpose(); }

}  // namespace fbvins
