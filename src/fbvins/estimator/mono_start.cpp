// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/mono_start.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/core/median.hpp"
#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/imu/alignment.hpp"
#include "fbvins/imu/preintegration.hpp"
#include "fbvins/imu/static_initialiser.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

using Vec8 = Eigen::Matrix<double, 8, 1>;
using Mat8 = Eigen::Matrix<double, 8, 8>;
using Vec9 = Eigen::Matrix<double, 9, 1>;
using Mat9 = Eigen::Matrix<double, 9, 9>;

/// Tracks in at least so many of the frames, and the fewest of them.
constexpr std::size_t kFewestObservations = 4, kFewestTracks = 20;
/// Pairs of frames so far apart are compared for the gyroscope's bias.
constexpr std::size_t kNear = 1, kFar = 3;
constexpr std::size_t kFewestInPair = 15;
constexpr int kRotationIterations = 8, kGravityIterations = 4, kDepthIterations = 3;
/// At first all points are this far away, for the weights.
constexpr double kFirstDepth_m = 3;
constexpr double kHuber_sigmas = 2;
/// What the solution has to be: share of the points in front of the camera, residuals in standard deviations, way
/// of the camera as a share of the typical depth, scale.
constexpr double kInFront = 0.9, kMaxRms_sigma = 3, kLeastParallax = 0.03, kMaxScaleSigma = 0.15;

/// Directions of one track in the frames that see it, in the body's axes there.
struct Sight {
  std::size_t frame;
  Vec3 ray_B;    ///< of length 1
  double sigma;  ///< rad
};
using Track = std::vector<Sight>;

std::vector<Track> tracks_of(std::span<const TrackedFrame> frames, const Mat3& R_BC) {
  std::unordered_map<TrackId, std::size_t> index;
  std::vector<Track> tracks;
  for (std::size_t k = 0; k < frames.size(); ++k)
    for (const TrackedFeature& f : frames[k].features) {
      const Observation* o = f.lead == 0 ? f.by(0) : nullptr;  // by camera 0 alone
      if (!o) continue;
      const auto [at, is_new] = index.try_emplace(f.id, tracks.size());
      if (is_new) tracks.emplace_back();
      const Vec3 ray(o->normalised.x(), o->normalised.y(), 1);
      // A length of the normalised plane is shorter as an angle, far from the axis.
      const double sigma = 1 / (std::sqrt(std::abs(o->sqrt_information.determinant())) * ray.norm());
      tracks[at->second].push_back({k, R_BC * ray.normalized(), sigma});
    }
  std::erase_if(tracks, [](const Track& t) { return t.size() < kFewestObservations; });
  return tracks;
}

/// The motion from the first frame's body to each frame's, by the readings, with gravity and velocity left out.
struct Integrated {
  Mat3 R = Mat3::Identity();                ///< R_B0Bk
  Vec3 p = Vec3::Zero(), v = Vec3::Zero();  ///< in B0
  Mat3 J_R_bg = Mat3::Zero(), J_p_ba = Mat3::Zero(), J_v_ba = Mat3::Zero();
  double t_s = 0;
};

std::vector<Integrated> integrated(std::span<const TrackedFrame> frames, const ImuNoise& noise, const ImuBias& bias) {
  Preintegration total(noise, bias);
  std::vector<Integrated> out(1);
  for (const TrackedFrame& frame : frames.subspan(1)) {
    total.integrate(frame.imu);
    out.push_back({total.delta_q().toRotationMatrix(), total.delta_p(), total.delta_v(), total.J_theta_bg(), total.J_p_ba(),
                   total.J_v_ba(), total.dt_s()});
  }
  return out;
}

/// The directions of a track in two frames and the direction of the translation between them lie in a plane (O1).
struct Plane {
  Vec3 a, b;  ///< in the bodies' axes
  double sigma;
};
struct FramePair {
  std::size_t from, to;
  std::vector<Plane> planes;
};

std::vector<FramePair> pairs_of(const std::vector<Track>& tracks, std::size_t frames) {
  std::vector<FramePair> pairs;
  for (const std::size_t apart : {kNear, kFar})
    for (std::size_t k = 0; k + apart < frames; ++k) pairs.push_back({k, k + apart, {}});
  for (FramePair& pair : pairs)
    for (const Track& track : tracks) {
      const auto seen = [&](std::size_t frame) {
        return std::find_if(track.begin(), track.end(), [&](const Sight& s) { return s.frame == frame; });
      };
      const auto a = seen(pair.from), b = seen(pair.to);
      if (a != track.end() && b != track.end()) pair.planes.push_back({a->ray_B, b->ray_B, hypotenuse(a->sigma, b->sigma)});
    }
  std::erase_if(pairs, [](const FramePair& p) { return p.planes.size() < kFewestInPair; });
  return pairs;
}

/// Direction of least spread of the planes' normals: of the translation.
Vec3 translation_direction(const FramePair& pair, const Mat3& R_ab) {
  Mat3 spread = Mat3::Zero();
  for (const Plane& p : pair.planes) {
    const Vec3 n = p.a.cross(R_ab * p.b);
    spread += n * n.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvectors().col(0);
}

/// Gauss-Newton on the gyroscope's bias, each pair's direction of translation eliminated (O2, O3).
Vec3 gyro_bias(const std::vector<FramePair>& pairs, const std::vector<Integrated>& motion, const ImuBiasEstimate& prior) {
  const Mat3 prior_information = prior.gyro_covariance.inverse();
  Vec3 change = Vec3::Zero();  // from the bias that the motion was integrated with, the prior's mean
  for (int i = 0; i < kRotationIterations; ++i) {
    Mat3 H = prior_information;
    Vec3 g = prior_information * change;
    for (const FramePair& pair : pairs) {
      const Integrated &a = motion[pair.from], &b = motion[pair.to];
      const auto turned = [&](const Integrated& m) -> Mat3 { return m.R * so3_exp(Vec3(m.J_R_bg * change)).toRotationMatrix(); };
      const Mat3 R_ab = turned(a).transpose() * turned(b);
      // Of R_ab by a change of the bias, in the axes of b.
      const Mat3 J = b.J_R_bg - R_ab.transpose() * a.J_R_bg;
      const Vec3 t = translation_direction(pair, R_ab);
      const Vec3 e = t.unitOrthogonal(), f = t.cross(e);
      Mat2 V = 1e-12 * Mat2::Identity();
      Vec2 w = Vec2::Zero();
      Mat3 U = Mat3::Zero();
      Vec3 u = Vec3::Zero();
      Eigen::Matrix<double, 3, 2> X = Eigen::Matrix<double, 3, 2>::Zero();
      for (const Plane& p : pair.planes) {
        const Vec3 n = p.a.cross(R_ab * p.b);
        const double r = t.dot(n) / p.sigma;
        const double weight = huber(r * r, kHuber_sigmas).weight;
        const Vec3 J_bias = (-(t.cross(p.a)).transpose() * R_ab * hat(p.b) * J / p.sigma).transpose();
        const Vec2 J_direction = Vec2(e.dot(n), f.dot(n)) / p.sigma;
        U += weight * J_bias * J_bias.transpose(), u += weight * r * J_bias;
        V += weight * J_direction * J_direction.transpose(), w += weight * r * J_direction;
        X += weight * J_bias * J_direction.transpose();
      }
      const Eigen::Matrix<double, 3, 2> gain = X * V.inverse();
      H += U - gain * X.transpose();
      g += u - gain * w;
    }
    const Vec3 step = -Ldlt<3>(H).solve(g);
    if (!step.allFinite()) break;
    change += step;
    if (step.norm() < 1e-5) break;
  }
  return prior.bias.gyro_radps + change;
}

/// Velocity of the first frame and gravity, both in B0, and the accelerometer's bias beyond that of the integration; normal
/// equations with the points eliminated (O4-O6).
struct Linear {
  Mat9 H = Mat9::Zero();
  Vec9 b = Vec9::Zero();
  double constant = 0;
  int rows = 0;
};

/// Two rows of a sight: N^T (p_f - p_k - R_k t_BC) = 0, with N orthogonal to the ray and p_k linear in x.
struct Rows {
  Eigen::Matrix<double, 2, 3> point;
  Eigen::Matrix<double, 2, 9> x;
  Vec2 constant;
};

Rows rows_of(const Sight& sight, const Integrated& m, const Vec3& t_BC, double depth_m) {
  const Vec3 ray = m.R * sight.ray_B, e = ray.unitOrthogonal();
  Rows out;
  out.point << e.transpose(), ray.cross(e).transpose();
  out.point /= sight.sigma * depth_m;
  out.x << -m.t_s * out.point, -0.5 * m.t_s * m.t_s * out.point, -out.point * m.J_p_ba;
  out.constant = -out.point * (m.p + m.R * t_BC);
  return out;
}

Linear linear_problem(const std::vector<Track>& tracks, const std::vector<Integrated>& motion, const Vec3& t_BC,
                      const std::vector<std::vector<double>>& depths) {
  Linear out;
  for (std::size_t j = 0; j < tracks.size(); ++j) {
    if (depths[j].empty()) continue;
    Mat3 V = Mat3::Zero();
    Eigen::Matrix<double, 3, 9> X = Eigen::Matrix<double, 3, 9>::Zero();
    Vec3 w = Vec3::Zero();
    for (std::size_t i = 0; i < tracks[j].size(); ++i) {
      const Rows r = rows_of(tracks[j][i], motion[tracks[j][i].frame], t_BC, depths[j][i]);
      V += r.point.transpose() * r.point;
      X += r.point.transpose() * r.x;
      w += r.point.transpose() * r.constant;
      out.H += r.x.transpose() * r.x;
      out.b -= r.x.transpose() * r.constant;
      out.constant += r.constant.squaredNorm();
      out.rows += 2;
    }
    const Ldlt<3> ldlt(V);
    if (!ldlt.succeeded() || !(ldlt.least_pivot() > 1e-12)) continue;
    out.H -= X.transpose() * ldlt.solve(X);
    out.b += X.transpose() * ldlt.solve(w);
    out.constant -= w.dot(ldlt.solve(w));
    out.rows -= 3;
  }
  return out;
}

struct Solved {
  Vec9 x = Vec9::Zero();
  Mat3 velocity_covariance = Mat3::Zero();
  double cost = 0;
};

/// Minimum with gravity of its known length: on the tangent plane of the sphere, again and again (O7).
std::optional<Solved> solve(const Linear& problem, double gravity_mps2, const Mat3& accel_information) {
  Mat9 H = problem.H;
  H.bottomRightCorner<3, 3>() += accel_information;
  const Ldlt<9> free(H);
  if (!free.succeeded()) return std::nullopt;
  Vec3 direction = free.solve(problem.b).segment<3>(3);
  if (!(direction.norm() > 1e-3)) return std::nullopt;
  Solved out;
  for (int i = 0; i < kGravityIterations; ++i) {
    direction.normalize();
    const Vec3 e = direction.unitOrthogonal();
    Eigen::Matrix<double, 9, 8> S = Eigen::Matrix<double, 9, 8>::Zero();
    S.topLeftCorner<3, 3>().setIdentity();
    S.bottomRightCorner<3, 3>().setIdentity();
    S.block<3, 1>(3, 3) = gravity_mps2 * e;
    S.block<3, 1>(3, 4) = gravity_mps2 * direction.cross(e);
    Vec9 base = Vec9::Zero();
    base.segment<3>(3) = gravity_mps2 * direction;
    const Mat8 A = S.transpose() * H * S;
    const Ldlt<8> ldlt(A);
    if (!ldlt.succeeded() || !(ldlt.least_pivot() > 0)) return std::nullopt;
    out.x = base + S * ldlt.solve(Vec8(S.transpose() * (problem.b - H * base)));
    direction = out.x.segment<3>(3);
    out.x.segment<3>(3) = gravity_mps2 * direction.normalized();
    const Mat8 covariance = ldlt.solve(Mat8(Mat8::Identity()));
    out.velocity_covariance = covariance.topLeftCorner<3, 3>();
  }
  out.cost = out.x.dot(problem.H * out.x) - 2 * problem.b.dot(out.x) + problem.constant;
  if (!out.x.allFinite()) return std::nullopt;
  return out;
}

Vec3 position(const Integrated& m, const Vec9& x) {
  return m.p + m.t_s * x.head<3>() + 0.5 * m.t_s * m.t_s * x.segment<3>(3) + m.J_p_ba * x.tail<3>();
}

/// Depths along the rays at the solution; none for a point that is behind a camera. Returns the share of the others.
double update_depths(const std::vector<Track>& tracks, const std::vector<Integrated>& motion, const Vec3& t_BC, const Vec9& x,
                     std::vector<std::vector<double>>& depths) {
  int used = 0, in_front = 0;
  for (std::size_t j = 0; j < tracks.size(); ++j) {
    if (depths[j].empty()) continue;
    ++used;
    Mat3 V = Mat3::Zero();
    Vec3 w = Vec3::Zero();
    for (std::size_t i = 0; i < tracks[j].size(); ++i) {
      const Rows r = rows_of(tracks[j][i], motion[tracks[j][i].frame], t_BC, depths[j][i]);
      V += r.point.transpose() * r.point;
      w += r.point.transpose() * (r.x * x + r.constant);
    }
    const Vec3 p = -Ldlt<3>(V).solve(w);
    bool good = p.allFinite();
    for (std::size_t i = 0; i < tracks[j].size() && good; ++i) {
      const Integrated& m = motion[tracks[j][i].frame];
      depths[j][i] = (m.R * tracks[j][i].ray_B).dot(p - position(m, x) - m.R * t_BC);
      good = depths[j][i] > 0.05;
    }
    if (good) ++in_front;
    else depths[j].clear();
  }
  return used > 0 ? static_cast<double>(in_front) / used : 0;
}

/// The farthest that the camera has moved from where it was first, by the median depth of the points.
double parallax(const std::vector<Integrated>& motion, const Vec3& t_BC, const Vec9& x,
                const std::vector<std::vector<double>>& depths) {
  std::vector<double> all;
  for (const std::vector<double>& track : depths) all.insert(all.end(), track.begin(), track.end());
  double moved_m = 0;
  for (const Integrated& m : motion) moved_m = std::max(moved_m, (position(m, x) + m.R * t_BC - t_BC).norm());
  return all.empty() ? 0 : moved_m / median(all);
}

}  // namespace

double scale_sigma_of(const Vec3& velocity, const Mat3& covariance) {
  const double speed2 = velocity.squaredNorm();
  if (!(speed2 > 0)) return std::numeric_limits<double>::infinity();
  return std::sqrt(std::max(0.0, velocity.dot(covariance * velocity))) / speed2;
}

std::optional<std::vector<NavState<G>>> start_with_one_camera(std::span<const TrackedFrame> frames, const Pose<B, C0>& T_BC,
                                                              const ImuNoise& noise, const ImuBiasEstimate& biases,
                                                              double gravity_mps2) {
  const AlignmentOptions limits;
  if (std::ranges::any_of(frames.subspan(1),
                          [&](const TrackedFrame& f) { return f.imu.longest_gap.seconds() > limits.max_gap_s; }))
    return std::nullopt;
  const std::vector<Track> tracks = tracks_of(frames, T_BC.R());
  if (tracks.size() < kFewestTracks) return std::nullopt;
  ImuBias bias = biases.bias;
  bias.gyro_radps = gyro_bias(pairs_of(tracks, frames.size()), integrated(frames, noise, bias), biases);
  if (bias.gyro_radps.norm() > limits.max_gyro_bias_radps) return std::nullopt;
  const std::vector<Integrated> motion = integrated(frames, noise, bias);

  std::vector<std::vector<double>> depths;
  for (const Track& track : tracks) depths.emplace_back(track.size(), kFirstDepth_m);
  Solved solved;
  Linear problem;
  double in_front = 1;
  for (int i = 0; i < kDepthIterations; ++i) {
    problem = linear_problem(tracks, motion, T_BC.p, depths);
    const std::optional<Solved> found = solve(problem, gravity_mps2, biases.accel_covariance.inverse());
    if (!found) return std::nullopt;
    solved = *found;
    in_front = update_depths(tracks, motion, T_BC.p, solved.x, depths);
    if (in_front < 0.5) return std::nullopt;
  }
  const double rms = std::sqrt(std::max(0.0, solved.cost) / std::max(1, problem.rows));
  if (in_front < kInFront || rms > kMaxRms_sigma) return std::nullopt;
  if (parallax(motion, T_BC.p, solved.x, depths) < kLeastParallax) return std::nullopt;
  const Vec3 v_last = solved.x.head<3>() + motion.back().t_s * solved.x.segment<3>(3) + motion.back().v;
  const double speed = std::max(solved.x.head<3>().norm(), v_last.norm());
  const Mat3 covariance = std::max(1.0, rms * rms) * solved.velocity_covariance;
  if (std::sqrt(covariance.trace()) > kMaxScaleSigma * speed) return std::nullopt;

  bias.accel_mps2 += solved.x.tail<3>();
  const Quat q_GB0 = level_rotation(-solved.x.segment<3>(3));
  std::vector<NavState<G>> states;
  for (const Integrated& m : motion) {
    NavState<G> state;
    state.T_FB = {(q_GB0 * Quat(m.R)).normalized(), q_GB0 * position(m, solved.x)};
    state.v_FB = q_GB0 * Vec3(solved.x.head<3>() + m.t_s * solved.x.segment<3>(3) + m.v + m.J_v_ba * solved.x.tail<3>());
    state.bias = bias;
    states.push_back(state);
  }
  return states;
}

}  // namespace fbvins
