// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/accel_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "fbvins/doctor/axes.hpp"
#include "fbvins/doctor/block_fit.hpp"
#include "fbvins/imu/preintegration.hpp"
#include "fbvins/imu/propagation.hpp"

namespace fbvins {
namespace {

// Unknowns: the matrix that multiplies the readings, row by row, the accelerometer's bias, and what the camera's position in
// the body must be changed by; the last two in metres of the cameras.
constexpr int kMatrix = 9, kLever = 12, kUnknowns = 15;
using Vec9 = Eigen::Matrix<double, kMatrix, 1>;
using VecA = Eigen::Matrix<double, kUnknowns, 1>;
using MatA = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Mat3A = Eigen::Matrix<double, 3, kUnknowns>;
using Mat3R = Eigen::Matrix<double, 3, kLever>;

constexpr double kWindow_s = 2;
constexpr std::size_t kFewestPairs = 8, kFewestWindows = 4;
/// The accelerometer is judged only where its readings leave less than this share of the seen acceleration unexplained.
constexpr double kMostUnexplained = 0.5;
constexpr double kLeastAcceleration_mps2 = 0.15;
/// Other axes must leave less than half of what the delivered ones leave, and so much less of the acceleration.
constexpr double kAxesLeave = 0.02;
/// Gravity confirms a bias where it is off by so much, and without the bias by less than this share of it, or by no more than
/// so many of the bias' largest sigmas.
constexpr double kGravityOff_mps2 = 0.5, kGravityLeft = 0.5, kGravityLeft_sigmas = 2;
/// Stretches of a recording agree on an axis better than it is right: good recordings show 1.9 +- 0.03 m/s^2.
constexpr double kBiasResolution_mps2 = 0.1;

/// Preintegrated readings of a pair: delta_q, and delta_v and delta_p as linear functions of matrix and bias.
struct PairDeltas {
  Quat q;
  Mat3R v, p;
};

PairDeltas deltas_of(const ImuSegment& segment, const ImuNoise& noise, const Vec3& gyro_bias) {
  PairDeltas out;
  out.q = integrate_gyro(segment, gyro_bias);
  for (int k = 0; k < kLever; ++k) {
    ImuSegment one = segment;
    for (ImuSample& sample : one.samples)
      sample.accel_mps2 = k < kMatrix ? Vec3(sample.accel_mps2(k % 3) * Vec3::Unit(k / 3)) : Vec3(Vec3::Unit(k - kMatrix));
    Preintegration sum(noise, {gyro_bias, Vec3::Zero()});
    sum.integrate(one);
    out.v.col(k) = sum.delta_v();
    out.p.col(k) = sum.delta_p();
  }
  return out;
}

/// Half of the sum of squared residuals as a function of the unknowns a: a^T H a / 2 - b^T a + c / 2. Velocity and gravity of
/// each window are eliminated.
struct Agreement {
  MatA H = MatA::Zero();
  VecA b = VecA::Zero();
  double c = 0;

  void operator+=(const Agreement& other) { H += other.H, b += other.b, c += other.c; }
};

/// Gravity in a window's first frame, in metres of the cameras: at - by * a.
struct WindowGravity {
  Vec3 at = Vec3::Zero();
  Mat3A by = Mat3A::Zero();
};

struct Window {
  std::size_t first, last;  ///< pairs [first, last)
};

std::vector<Window> windows_of(const std::vector<FramePair>& pairs, const ImuSeries& imu, Duration offset) {
  std::vector<Window> windows;
  std::size_t first = 0;
  const auto close = [&](std::size_t last) {
    if (last - first >= kFewestPairs) windows.push_back({first, last});
    first = last;
  };
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (k > first && pairs[k].frame_a != pairs[k - 1].frame_b) close(k);
    if (!imu.covers(pairs[k].a + offset, pairs[k].b + offset)) {
      close(k);
      first = k + 1;
      continue;
    }
    if ((pairs[k].b - pairs[first].a).seconds() > kWindow_s) close(k + 1);
  }
  if (first < pairs.size()) close(pairs.size());
  return windows;
}

Agreement agreement_of(const Window& window, const std::vector<FramePair>& pairs, const std::vector<PairDeltas>& deltas,
                       const Pose<B, C0>& T_BC0, double scale, WindowGravity& gravity) {
  using Mat36 = Eigen::Matrix<double, 3, 6>;
  using Mat6A = Eigen::Matrix<double, 6, kUnknowns>;
  Mat6 N = Mat6::Zero();
  Mat6A M = Mat6A::Zero();
  Vec6 m = Vec6::Zero();
  Agreement out;
  Quat R = Quat::Identity();       // of the pair's first frame in the window's
  Mat3R velocity = Mat3R::Zero();  // gained so far
  double elapsed_s = 0;
  for (std::size_t k = window.first; k < window.last; ++k) {
    const double dt = pairs[k].dt_s();
    const Mat3 E = deltas[k].q.toRotationMatrix(), R_now = R.toRotationMatrix();
    const Vec3 y = R_now * (T_BC0.R() * pairs[k].p_CaCb + (T_BC0.p - E * T_BC0.p) * scale);
    Mat3A X;
    X << dt * velocity + R_now * deltas[k].p, -R_now * (Mat3::Identity() - E);
    Mat36 Z;
    Z << dt * Mat3::Identity(), (elapsed_s * dt + 0.5 * dt * dt) * Mat3::Identity();
    N += Z.transpose() * Z;
    M += Z.transpose() * X;
    m += Z.transpose() * y;
    out.H += X.transpose() * X;
    out.b += X.transpose() * y;
    out.c += y.squaredNorm();
    velocity += R_now * deltas[k].v;
    elapsed_s += dt;
    R = (R * deltas[k].q).normalized();
  }
  const Mat6 inverse = N.inverse();
  out.H -= M.transpose() * inverse * M;
  out.b -= M.transpose() * inverse * m;
  out.c -= m.dot(inverse * m);
  gravity = {(inverse * m).tail<3>(), (inverse * M).bottomRows<3>()};
  return out;
}

Vec9 row_by_row(const Mat3& A) {
  Vec9 a;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) a(3 * i + j) = A(i, j);
  return a;
}

struct Explained {
  double scale = 0, unexplained = 1;
  Vec3 bias = Vec3::Zero(), lever = Vec3::Zero();  ///< in the readings' unit, and in metres
};

/// By readings with these axes, a scale and a bias, and with `lever_free` a change of the camera's position.
Explained explained_by(const Mat3& axes, const Agreement& all, bool lever_free = false) {
  constexpr int kBias = 1, kPosition = 4, kMost = 7;
  Eigen::Matrix<double, kUnknowns, kMost> chosen = Eigen::Matrix<double, kUnknowns, kMost>::Zero();
  chosen.block<kMatrix, 1>(0, 0) = row_by_row(axes);
  chosen.bottomRightCorner<6, 6>().setIdentity();
  const int n = lever_free ? kMost : kPosition;
  Eigen::MatrixXd H = (chosen.transpose() * all.H * chosen).topLeftCorner(n, n);
  for (int first = kBias; first < n; first += 3)  // without rotation neither bias nor position is observable
    H.diagonal().segment<3>(first).array() += 1e-6 * H.diagonal().segment<3>(first).sum();
  const Eigen::VectorXd b = (chosen.transpose() * all.b).head(n), x = H.ldlt().solve(b);
  if (!x.allFinite() || !(x(0) > 0)) return {};
  Explained out{x(0), 1 - b.dot(x) / all.c, -x.segment<3>(kBias) / x(0), Vec3::Zero()};
  if (lever_free) out.lever = x.segment<3>(kPosition) / x(0);
  return out;
}

struct Summed {
  Agreement all;
  std::array<Agreement, BlockFit::kStretches> stretch;
  std::vector<WindowGravity> gravity;
};

Summed sum_up(const std::vector<Window>& windows, const std::vector<FramePair>& pairs, const std::vector<PairDeltas>& deltas,
              const Pose<B, C0>& T_BC0, double scale) {
  Summed out;
  for (std::size_t w = 0; w < windows.size(); ++w) {
    out.gravity.emplace_back();
    const Agreement one = agreement_of(windows[w], pairs, deltas, T_BC0, scale, out.gravity.back());
    out.stretch[w * BlockFit::kStretches / windows.size()] += one;
    out.all += one;
  }
  return out;
}

/// Standard deviations of scale, bias and lever, by a jackknife over the stretches.
Eigen::Matrix<double, 7, 1> sigmas_of(const Summed& sums, const Mat3& axes, bool lever_free) {
  using Vec7 = Eigen::Matrix<double, 7, 1>;
  std::vector<Vec7> without;
  for (const Agreement& stretch : sums.stretch) {
    if (stretch.c == 0) continue;
    Agreement rest = sums.all;
    rest.H -= stretch.H, rest.b -= stretch.b, rest.c -= stretch.c;
    const Explained one = explained_by(axes, rest, lever_free);
    without.emplace_back((Vec7() << one.scale, one.bias, one.lever).finished());
  }
  Vec7 mean = Vec7::Zero(), square = Vec7::Zero();
  const auto n = static_cast<double>(without.size());
  for (const Vec7& s : without) mean += s / n;
  for (const Vec7& s : without) square += (s - mean).cwiseAbs2();
  return ((n - 1) / n * square).cwiseSqrt();
}

/// Mean norm of the windows' gravity with readings as explained, and its standard deviation.
std::pair<double, double> gravity_of(const Summed& sums, const Mat3& axes, const Explained& by) {
  VecA a = VecA::Zero();
  a.head<kMatrix>() = by.scale * row_by_row(axes);
  a.segment<3>(kMatrix) = -by.scale * by.bias;
  double sum = 0, square = 0;
  const auto n = static_cast<double>(sums.gravity.size());
  for (const WindowGravity& window : sums.gravity) {
    const double norm = (window.at - window.by * a).norm();
    sum += norm, square += norm * norm;
  }
  const double mean = sum / n;
  return {mean, std::sqrt(std::max(square / n - mean * mean, 0.0) / n)};
}

/// Acceleration of the seen motion, root mean square, from what a constant velocity and gravity do not explain of it.
double acceleration_of(const Summed& sums, const std::vector<Window>& windows, const std::vector<FramePair>& pairs) {
  // An acceleration a changes the velocity by about a * kWindow_s / 4 in a window, and a pair's displacement by dt times that.
  double count = 0, dt2 = 0;
  for (const Window& w : windows)
    for (std::size_t k = w.first; k < w.last; ++k) count += 1, dt2 += std::pow(pairs[k].dt_s(), 2);
  const double per_pair_m = std::sqrt(sums.all.c / std::max(count, 1.0));
  return per_pair_m / (std::sqrt(dt2 / std::max(count, 1.0)) * 0.25 * kWindow_s);
}

}  // namespace

AccelFit fit_accelerations(const std::vector<FramePair>& pairs, const ImuSeries& imu, const StereoRig& rig,
                           const AccelStart& start) {
  AccelFit fit;
  const Duration offset = Duration::from_seconds(start.offset_s);
  const std::vector<Window> windows = windows_of(pairs, imu, offset);
  if (windows.size() < kFewestWindows) return fit;
  std::vector<PairDeltas> deltas(pairs.size());
  for (const Window& w : windows)
    for (std::size_t k = w.first; k < w.last; ++k)
      deltas[k] = deltas_of(imu.segment(pairs[k].a + offset, pairs[k].b + offset), rig.imu_noise, start.gyro_bias_radps);
  Summed sums = sum_up(windows, pairs, deltas, rig.T_BC0(), 1);
  const Explained as_named = explained_by(Mat3::Identity(), sums.all);
  Explained best = as_named;
  for (const Mat3& axes : signed_permutations()) {
    const Explained one = explained_by(axes, sums.all);
    if (one.unexplained < best.unexplained) best = one, fit.axes = axes;
  }
  if (as_named.unexplained <= 2 * best.unexplained + kAxesLeave) best = as_named, fit.axes.setIdentity();
  if (best.scale > 0)
    sums = sum_up(windows, pairs, deltas, rig.T_BC0(), best.scale);  // the lever arm is in metres of the readings
  best = explained_by(fit.axes, sums.all);
  fit.unexplained = best.unexplained;
  fit.unexplained_as_named = explained_by(Mat3::Identity(), sums.all).unexplained;
  fit.scale = best.scale;
  fit.scale_sigma = sigmas_of(sums, fit.axes, false)(0);
  std::tie(fit.gravity_mps2, fit.gravity_sigma_mps2) = gravity_of(sums, fit.axes, best);
  const Explained elsewhere = explained_by(fit.axes, sums.all, true);
  const Eigen::Matrix<double, 7, 1> sigma = sigmas_of(sums, fit.axes, true);
  fit.bias = elsewhere.bias, fit.bias_sigma = sigma.segment<3>(1);
  fit.lever_m = elsewhere.lever, fit.lever_sigma_m = sigma.tail<3>();
  fit.unexplained_elsewhere = elsewhere.unexplained;
  fit.acceleration_mps2 = acceleration_of(sums, windows, pairs);
  fit.seen = best.scale > 0 && fit.unexplained < kMostUnexplained && fit.acceleration_mps2 > kLeastAcceleration_mps2;
  return fit;
}

double bias_significance(const AccelFit& fit, double gravity_off_mps2, double off_without_bias_mps2) {
  const double largest_sigma = fit.bias_sigma.maxCoeff();
  const double explained = std::max(kGravityLeft * gravity_off_mps2, kGravityLeft_sigmas * largest_sigma);
  if (gravity_off_mps2 > kGravityOff_mps2 && off_without_bias_mps2 < std::min(explained, gravity_off_mps2))
    return fit.bias.cwiseQuotient(fit.bias_sigma.cwiseMax(kBiasResolution_mps2)).norm();
  return fit.bias.norm() / largest_sigma;
}

}  // namespace fbvins
