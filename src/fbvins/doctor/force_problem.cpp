// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/force_problem.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "fbvins/core/median.hpp"
#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/imu/nav_state.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {

using namespace doctor::force;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::array<double, kUnknowns> kPriorSigma{0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.4, 0.4, 0.4};
constexpr int kIterations = 4, kSettling = 3;
constexpr double kMostOfWindow_px = 4;
constexpr double kCap_px = 2, kHuberSigmas = 2, kLeastSigma_px = 0.1;
/// What is known of a window: velocity, the magnitude of gravity, and what is left of the gyroscope's bias.
constexpr double kVelocity_mps = 5, kGravity_sigma = 0.01, kGyroBias_radps = 2e-3;
/// Points nearer or farther say nothing, or are none.
constexpr double kNearest_m = 0.15, kFarthest_m = 50;
constexpr double kLeastInformation = 1e-6;

using Mat23 = Eigen::Matrix<double, 2, 3>;
using Mat9 = Eigen::Matrix<double, 9, 9>;
using Vec9 = Eigen::Matrix<double, 9, 1>;
using MatX = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Mat9X = Eigen::Matrix<double, 9, kUnknowns>;
using Mat3X = Eigen::Matrix<double, 3, kUnknowns>;

Mat3 matrix_of(const VectorXd& x) {
  Mat3 M = Mat3::Zero();
  for (int i = 0; i < 3; ++i) M(i, i) = std::exp(x(kScale) + x(kAxis + i));
  for (int k = 0; k < 6; ++k) M(kRow[k], kColumn[k]) = x(kCross + k);
  return M;
}

/// Position by the unknowns' small changes.
Mat3X by_unknowns(const Sight& s, const Mat3& M) {
  Mat3X out;
  out.col(kScale).setZero();
  for (int i = 0; i < 3; ++i) {
    out.col(kAxis + i) = M(i, i) * s.p_matrix.col(3 * i + i);
    out.col(kScale) += out.col(kAxis + i);
  }
  for (int k = 0; k < 6; ++k) out.col(kCross + k) = s.p_matrix.col(3 * kRow[k] + kColumn[k]);
  out.rightCols<3>() = s.p_bias;
  return out;
}

Vec3 position(const Sight& s, const Mat3& M, const Vec3& c, const Vec9& motion) {
  Vec3 p = s.t_s * motion.head<3>() + 0.5 * s.t_s * s.t_s * motion.segment<3>(3) + s.p_bias * c + s.p_gyro * motion.tail<3>();
  for (int k = 0; k < 9; ++k) p += M(k / 3, k % 3) * s.p_matrix.col(k);
  return p;
}

/// A sight's residual and its derivatives; of a point that is not known yet in metres across the ray, else in pixels.
struct Linear {
  Vec2 r;
  Mat23 J_point;
  Eigen::Matrix<double, 2, 9> J_motion;
  Eigen::Matrix<double, 2, kUnknowns> J_x;
  double distance_m = 0;
};

}  // namespace

struct ForceProblem::Reduced {
  MatX H = MatX::Zero();
  VecX g = VecX::Zero();
  Mat9 H_motion = Mat9::Zero();
  Vec9 g_motion = Vec9::Zero();
  Mat9X H_cross = Mat9X::Zero();
  std::vector<Mat3> H_point;
  std::vector<Vec3> g_point;
  std::vector<Eigen::Matrix<double, 3, 9>> H_point_motion;
  std::vector<Mat3X> H_point_x;
};

namespace {

struct At {
  Mat3 M;
  Vec3 c, p_BC;
  double focal_px;
};

bool linearise_sight(const Sight& s, const Vec3& point, const Vec9& motion, const At& at, bool first, Linear& out) {
  const Vec3 D = point - position(s, at.M, at.c, motion);
  const Vec3 q = s.R.transpose() * (D + D.cross(s.turn_gyro * motion.tail<3>())) - at.p_BC;
  const Vec3 e = s.ray_B.unitOrthogonal(), f = s.ray_B.cross(e);
  out.distance_m = q.dot(s.ray_B);
  if (!first && (out.distance_m < kNearest_m || out.distance_m > kFarthest_m)) return false;
  const double scale = first ? 1 : at.focal_px / out.distance_m;
  Mat23 across;
  across << e.transpose(), f.transpose();
  across *= scale;
  out.r = across * q;
  out.J_point = across * s.R.transpose();
  out.J_motion.leftCols<3>() = -s.t_s * out.J_point;
  out.J_motion.middleCols<3>(3) = -0.5 * s.t_s * s.t_s * out.J_point;
  out.J_motion.rightCols<3>() = out.J_point * (hat(D) * s.turn_gyro - s.p_gyro);
  out.J_x = -out.J_point * by_unknowns(s, at.M);
  return true;
}

/// What is known of a window beside its tracks.
void add_knowledge(const Vec9& motion, double sigma, bool first, Mat9& H, Vec9& g) {
  const double px2 = sigma * sigma;
  for (int i = 0; i < 3; ++i) {
    H(i, i) += px2 / (kVelocity_mps * kVelocity_mps);
    g(i) += px2 / (kVelocity_mps * kVelocity_mps) * motion(i);
    const double bias = first ? 1e12 : px2 / (kGyroBias_radps * kGyroBias_radps);
    H(6 + i, 6 + i) += bias;
    g(6 + i) += bias * motion(6 + i);
  }
  if (first) return;
  const Vec3 up = motion.segment<3>(3).normalized();
  const double weight = px2 / (kGravity_sigma * kGravity_sigma), off = motion.segment<3>(3).norm() - kGravity_mps2;
  H.block<3, 3>(3, 3) += weight * up * up.transpose();
  g.segment<3>(3) += weight * off * up;
}

}  // namespace

ForceProblem::ForceProblem(std::vector<Window> windows, const Vec3& p_BC, double focal_px)
    : x(VectorXd::Zero(kUnknowns)), windows_(std::move(windows)), p_BC_(p_BC), focal_px_(focal_px) {}

std::size_t ForceProblem::windows() const {
  return static_cast<std::size_t>(std::ranges::count_if(windows_, [](const Window& w) { return w.usable; }));
}

/// No accelerometer is off by a third.
bool ForceProblem::plausible() const { return x.head(kBias).cwiseAbs().maxCoeff() < 0.3; }

Mat3 ForceProblem::matrix() const { return matrix_of(x); }

ForceProblem::Reduced ForceProblem::linearise(const Window& window, double sigma, bool first) const {
  Reduced out;
  const At at{matrix(), Vec3(x.segment<3>(kBias)), p_BC_, focal_px_};
  for (const Track& track : window.tracks) {
    Mat3 H_p = kLeastInformation * Mat3::Identity();
    Vec3 g_p = Vec3::Zero();
    Eigen::Matrix<double, 3, 9> H_pm = Eigen::Matrix<double, 3, 9>::Zero();
    Mat3X H_px = Mat3X::Zero();
    for (const Sight& sight : track.sights) {
      Linear l;
      if (!linearise_sight(sight, track.point, window.motion, at, first, l)) continue;
      const double weight = first ? 1 : huber(l.r.squaredNorm(), kHuberSigmas * sigma).weight;
      H_p += weight * l.J_point.transpose() * l.J_point, g_p += weight * l.J_point.transpose() * l.r;
      H_pm += weight * l.J_point.transpose() * l.J_motion, H_px += weight * l.J_point.transpose() * l.J_x;
      out.H_motion += weight * l.J_motion.transpose() * l.J_motion, out.g_motion += weight * l.J_motion.transpose() * l.r;
      out.H_cross += weight * l.J_motion.transpose() * l.J_x;
      out.H += weight * l.J_x.transpose() * l.J_x, out.g += weight * l.J_x.transpose() * l.r;
    }
    const Mat3 inverse = H_p.inverse();
    out.H_motion -= H_pm.transpose() * inverse * H_pm, out.g_motion -= H_pm.transpose() * inverse * g_p;
    out.H_cross -= H_pm.transpose() * inverse * H_px;
    out.H -= H_px.transpose() * inverse * H_px, out.g -= H_px.transpose() * inverse * g_p;
    out.H_point.push_back(inverse), out.g_point.push_back(g_p), out.H_point_motion.push_back(H_pm);
    out.H_point_x.push_back(H_px);
  }
  add_knowledge(window.motion, sigma, first, out.H_motion, out.g_motion);
  return out;
}

/// The best points and motion under the present unknowns, from the present ones; at first by one linear step.
bool ForceProblem::settle(Window& window, double sigma) const {
  for (int iteration = 0; iteration < (window.settled ? 1 : kSettling); ++iteration) {
    const bool first = !window.settled;
    const Reduced at = linearise(window, sigma, first);
    const Vec9 step = -Ldlt<9>(at.H_motion).solve(at.g_motion);
    if (!step.allFinite()) return false;
    for (std::size_t k = 0; k < window.tracks.size(); ++k)
      window.tracks[k].point -= at.H_point[k] * (at.g_point[k] + at.H_point_motion[k] * step);
    window.motion += step;
    window.settled = true;
  }
  return window.motion.allFinite();
}

namespace {

template <class Take>
void for_each_error(const std::vector<Window>& windows, const At& at, Take&& take) {
  for (const Window& window : windows) {
    if (!window.usable) continue;
    for (const Track& track : window.tracks)
      for (const Sight& sight : track.sights) {
        Linear l;
        take(linearise_sight(sight, track.point, window.motion, at, false, l) ? l.r.norm() : kCap_px);
      }
  }
}

}  // namespace

double ForceProblem::typical_error() const {
  std::vector<double> norms;
  for_each_error(windows_, {matrix(), Vec3(x.segment<3>(kBias)), p_BC_, focal_px_}, [&](double norm) { norms.push_back(norm); });
  return norms.empty() ? kCap_px : 0.85 * median(norms);  // of a Rayleigh distribution
}

double ForceProblem::error_of(const Window& window) const {
  std::vector<double> norms;
  for_each_error({window}, {matrix(), Vec3(x.segment<3>(kBias)), p_BC_, focal_px_}, [&](double norm) { norms.push_back(norm); });
  return 0.85 * median(norms);
}

double ForceProblem::capped_error() const {
  double sum = 0, count = 0;
  for_each_error(windows_, {matrix(), Vec3(x.segment<3>(kBias)), p_BC_, focal_px_},
                 [&](double norm) { sum += std::pow(std::min(norm, kCap_px), 2), ++count; });
  return std::sqrt(sum / std::max(count, 1.0));
}

/// One linearisation at settled windows.
std::optional<BlockSolution> ForceProblem::solve(double sigma) const {
  BlockFit fit(Eigen::Map<const VectorXd>(kPriorSigma.data(), kUnknowns), sigma);
  for (std::size_t k = 0; k < windows_.size(); ++k) {
    if (!windows_[k].usable) continue;
    const Reduced at = linearise(windows_[k], sigma, false);
    const Mat9 inverse = at.H_motion.inverse();
    const MatX H = at.H - at.H_cross.transpose() * inverse * at.H_cross;
    const VecX g = at.g - at.H_cross.transpose() * inverse * at.g_motion;
    if (H.allFinite() && g.allFinite()) fit.add(static_cast<int>(k * BlockFit::kStretches / windows_.size()), H, g);
  }
  return fit.solve(free);
}

/// Points and motion where the unknowns' step moves them to.
void ForceProblem::follow(const VectorXd& step, double sigma) {
  for (Window& window : windows_) {
    if (!window.usable) continue;
    const Reduced at = linearise(window, sigma, false);
    const Vec9 moved = -Ldlt<9>(at.H_motion).solve(Vec9(at.g_motion + at.H_cross * step));
    for (std::size_t k = 0; k < window.tracks.size(); ++k)
      window.tracks[k].point -= at.H_point[k] * (at.g_point[k] + at.H_point_motion[k] * moved + at.H_point_x[k] * step);
    window.motion += moved;
    window.usable = window.motion.allFinite();
  }
}

void ForceProblem::settle_all(int times) {
  const bool first = std::ranges::any_of(windows_, [](const Window& w) { return w.usable && !w.settled; });
  for (int i = 0; i < times; ++i) {
    const double sigma = first && i == 0 ? 1 : std::max(typical_error(), kLeastSigma_px);
    for (Window& window : windows_) window.usable = window.usable && settle(window, sigma);
  }
}

/// Windows whose points and motion are not found would hide what the others say.
void ForceProblem::begin() {
  settle_all(kSettling);
  for (Window& window : windows_) window.usable = window.usable && error_of(window) < kMostOfWindow_px;
  settle_all(1);
}

std::optional<BlockSolution> ForceProblem::converge() {
  std::optional<BlockSolution> last;
  double error_px = capped_error();
  for (int i = 0; i < kIterations; ++i) {
    const auto solution = solve(std::max(typical_error(), kLeastSigma_px));
    if (!solution) return std::nullopt;
    const std::vector<Window> windows = windows_;
    const VectorXd before = x;
    bool better = false;
    for (double share = 1; share > 0.2 && !better; share /= 2) {
      x = before, windows_ = windows;
      follow(share * solution->x, std::max(typical_error(), kLeastSigma_px));
      x += share * solution->x;
      settle_all(1);
      better = capped_error() < error_px;
    }
    last = solution;
    if (!better) {
      x = before, windows_ = windows;
      break;
    }
    error_px = capped_error();
  }
  return last;
}

}  // namespace fbvins
