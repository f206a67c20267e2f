// SPDX-License-Identifier: Apache-2.0
// The landmarks' part of the normal equations, which takes nearly all of a solve's time.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "fbvins/core/simd.hpp"
#include "fbvins/estimator/window_equations.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

/// What an observation without a projection costs: a residual of this many sigmas, with no slope.
constexpr double kUnprojectableSigma = 100.0;

/// A frame's observations of a landmark, two rows each: those of more cameras are added two by two.
constexpr int kMostObservations = 2;
template <int Columns>
using ObservationRows = double[kMostObservations][2][Columns];

/// G = J^T J of the rows of one or two observations. Both triangles: plain loops over fixed lanes.
template <int Columns>
FBVINS_INLINE void gram(const ObservationRows<Columns>& rows, int observations, double* G) {
  const double *a = rows[0][0], *b = rows[0][1], *c = rows[1][0], *d = rows[1][1];
  if (observations == 1)
    for (int i = 0; i < Columns; ++i)
      for (int j = 0; j < Columns; ++j) G[i * Columns + j] = a[i] * a[j] + b[i] * b[j];
  else
    for (int i = 0; i < Columns; ++i)
      for (int j = 0; j < Columns; ++j) G[i * Columns + j] = (a[i] * a[j] + b[i] * b[j]) + (c[i] * c[j] + d[i] * d[j]);
}
FBVINS_KERNEL void gram_of(const ObservationRows<16>& rows, int observations, double* G) { gram<16>(rows, observations, G); }
FBVINS_KERNEL void gram_of(const ObservationRows<32>& rows, int observations, double* G) { gram<32>(rows, observations, G); }

double landmark_prior_cost(const WindowProblem& w, const CameraGeometry& cameras, const WindowLandmark& l) {
  const Vec3 r = landmark_prior_residual(cameras, w.frames[l.host].state.T_FB, l, w.landmark_priors[l.prior]);
  return huber(r.squaredNorm(), w.weights.huber_sigma).cost;
}

double add_landmark_prior(const WindowProblem& w, const CameraGeometry& cameras, const WindowLandmark& l, int host_block,
                          PointBlock& point, NormalEquations& out) {
  const LandmarkPrior& prior = w.landmark_priors[l.prior];
  const Vec3 r = landmark_prior_residual(cameras, w.frames[l.host].state.T_FB, l, prior);
  const RobustValue robust = huber(r.squaredNorm(), w.weights.huber_sigma);
  const LandmarkPriorJacobian J(cameras, w.linearisation_point(l.host).T_FB, l, prior);
  const int host = out.layout.pose_row(l.host);
  out.H.block<6, 6>(host, host) += robust.weight * J.host.transpose() * J.host;
  out.g.segment<6>(host) += robust.weight * J.host.transpose() * r;
  point.V += robust.weight * J.point.transpose() * J.point;
  point.w += robust.weight * J.point.transpose() * r;
  out.points.coupling(point, host_block) += robust.weight * J.point.transpose() * J.host;
  if (w.calibrating() && is_refined(l.camera)) {
    const int row = out.layout.calibration_row() + 6 * l.camera;
    out.H.block<6, 6>(row, row) += robust.weight * J.extrinsic.transpose() * J.extrinsic;
    out.H.block<6, 6>(host, row) += robust.weight * J.host.transpose() * J.extrinsic;
    out.g.segment<6>(row) += robust.weight * J.extrinsic.transpose() * r;
    out.points.coupling(point, l.camera) += robust.weight * J.point.transpose() * J.extrinsic;
  }
  return robust.cost;
}

/// The blocks of the dense system that a landmark is coupled to, ascending: calibration's, if it is estimated, then poses'.
template <int Columns>
void list_blocks(const WindowLayout& at, const WindowLandmark& l, const WindowObservation* begin, const WindowObservation* end,
                 std::vector<int>& offsets) {
  offsets.clear();
  if constexpr (Columns == 32)
    for (int k = 0; k < 3; ++k) offsets.push_back(at.calibration_row() + 6 * k);
  bool host_listed = false;
  for (const WindowObservation* o = begin; o != end; ++o) {
    if (!host_listed && o->frame >= l.host) {
      host_listed = true;
      offsets.push_back(at.pose_row(l.host));
    }
    if (o->frame != l.host && (o == begin || o->frame != o[-1].frame)) offsets.push_back(at.pose_row(o->frame));
  }
  if (!host_listed) offsets.push_back(at.pose_row(l.host));
}

/// Of an observation that can be projected: the point in its camera, the residual, and how much it counts.
struct WeighedResidual {
  Vec3 p_C;
  Vec2 r;
  double weight;
};

/// Adds to `cost`, also where the observation cannot be projected.
inline std::optional<WeighedResidual> weigh(const WindowProblem& w, const CameraGeometry& cameras, const PairGeometry& pair,
                                            const WindowLandmark& l, const Vec3& x_h, const WindowObservation& o, double& cost) {
  std::optional<WeighedResidual> out(std::in_place);
  if (!reproject(cameras, pair, x_h, l.alpha_beta_rho.z(), o, out->p_C, out->r)) {
    cost += huber(kUnprojectableSigma * kUnprojectableSigma, w.weights.huber_sigma).cost;
    return std::nullopt;
  }
  const RobustValue robust = huber(out->r.squaredNorm(), w.weights.huber_sigma);
  cost += robust.cost;
  out->weight = robust.weight;
  return out;
}

/// Linearises observations of a landmark in one frame, `o` on: one row of Jacobian and residual for each coordinate, weighed
/// robustly. Adds to `cost`; `o` is the next one afterwards, of another frame or beyond the two. Returns how many there are.
template <int Columns>
int linearise_observations(const WindowProblem& w, const CameraGeometry& cameras, const PairGeometry& pair,
                           const WindowLandmark& l, const Vec3& x_h, const WindowObservation*& o, const WindowObservation* end,
                           ObservationRows<Columns>& rows, double& cost) {
  const int target = o->frame;
  int observations = 0;
  for (; o != end && o->frame == target && observations < kMostObservations; ++o) {
    const std::optional<WeighedResidual> seen = weigh(w, cameras, pair, l, x_h, *o, cost);
    if (!seen) continue;
    double(&observation)[2][Columns] = rows[observations++];
    fill_jacobian_rows<Columns>(cameras, pair, target == l.host, l, x_h, *o, seen->p_C, seen->r, observation);
    if (seen->weight < 1) {
      const double s = std::sqrt(seen->weight);
      for (int k = 0; k < 2; ++k)
        for (double& x : observation[k]) x *= s;
    }
  }
  return observations;
}

/// Where the frames of a pair and the landmark stand in the system.
struct PairPlace {
  int host_row, target_row, host_block, target_block;
  bool same;  ///< host and target are one frame
};

/// Adds the Gram matrix of a landmark's observations in one frame to the dense system and to the landmark's own block.
template <int Columns>
void add_gram(const Eigen::Map<const Eigen::Matrix<double, Columns, Columns>>& gram, const PairPlace& at, PointBlock& point,
              NormalEquations& out) {
  Eigen::MatrixXd& H = out.H;
  Eigen::VectorXd& g = out.g;
  point.V += gram.template block<3, 3>(kPoint, kPoint);
  point.w += gram.template block<3, 1>(kPoint, kResidual);
  if (!at.same) {
    H.block<6, 6>(at.host_row, at.host_row) += gram.template block<6, 6>(kHost, kHost);
    H.block<6, 6>(at.target_row, at.target_row) += gram.template block<6, 6>(kTarget, kTarget);
    if (at.target_row > at.host_row) H.block<6, 6>(at.target_row, at.host_row) += gram.template block<6, 6>(kTarget, kHost);
    else H.block<6, 6>(at.host_row, at.target_row) += gram.template block<6, 6>(kHost, kTarget);
    g.segment<6>(at.host_row) += gram.template block<6, 1>(kHost, kResidual);
    g.segment<6>(at.target_row) += gram.template block<6, 1>(kTarget, kResidual);
    out.points.coupling(point, at.host_block) += gram.template block<3, 6>(kPoint, kHost);
    out.points.coupling(point, at.target_block) += gram.template block<3, 6>(kPoint, kTarget);
  }
  if constexpr (Columns == 32) {
    const int row = out.layout.calibration_row();
    H.block<14, 14>(row, row) += gram.template block<14, 14>(kExtrinsic0, kExtrinsic0);
    g.segment<14>(row) += gram.template block<14, 1>(kExtrinsic0, kResidual);
    if (!at.same) {
      H.block<6, 14>(at.host_row, row) += gram.template block<6, 14>(kHost, kExtrinsic0);
      H.block<6, 14>(at.target_row, row) += gram.template block<6, 14>(kTarget, kExtrinsic0);
    }
    for (int k = 0; k < 2; ++k) out.points.coupling(point, k) += gram.template block<3, 6>(kPoint, kExtrinsic0 + 6 * k);
    out.points.coupling(point, 2).leftCols<2>() += gram.template block<3, 2>(kPoint, kTimeOffset);
  }
}

template <int Columns>
double add_landmarks_of(const WindowProblem& w, const PairTable& pairs, NormalEquations& out) {
  const CameraGeometry cameras(w.calibration);
  const WindowLayout at = out.layout;
  double cost = 0;
  std::array<double, Columns * Columns> G;
  ObservationRows<Columns> rows;
  std::vector<int> offsets;
  constexpr int kFirstPoseBlock = Columns == 32 ? 3 : 0;
  for (const WindowLandmark& l : w.landmarks) {
    const Vec3 x_h = scaled_point_in_host(cameras, l);
    const WindowObservation* begin = w.observations.data() + l.first_observation;
    const WindowObservation* end = begin + l.observation_count;
    list_blocks<Columns>(at, l, begin, end, offsets);
    PointBlock& point = out.points.add(offsets);
    const auto block_of = [&](int row) {
      return static_cast<int>(std::lower_bound(offsets.begin() + kFirstPoseBlock, offsets.end(), row) - offsets.begin());
    };
    const int host_row = at.pose_row(l.host), host_block = block_of(host_row);
    if (l.prior >= 0) cost += add_landmark_prior(w, cameras, l, host_block, point, out);
    for (const WindowObservation* o = begin; o != end;) {
      const int target = o->frame, target_row = at.pose_row(target);
      const int observations = linearise_observations<Columns>(w, cameras, pairs(l.host, target), l, x_h, o, end, rows, cost);
      if (observations == 0) continue;
      gram_of(rows, observations, G.data());  // exactly symmetric
      const Eigen::Map<const Eigen::Matrix<double, Columns, Columns>> gram(G.data());
      add_gram<Columns>(gram, {host_row, target_row, host_block, block_of(target_row), target == l.host}, point, out);
    }
  }
  return cost;
}

}  // namespace

double landmark_cost(const WindowProblem& w, const PairTable& pairs) {
  const CameraGeometry cameras(w.calibration);
  double cost = 0;
  for (const WindowLandmark& l : w.landmarks) {
    const Vec3 x_h = scaled_point_in_host(cameras, l);
    for (int k = 0; k < l.observation_count; ++k) {
      const WindowObservation& o = w.observations[l.first_observation + k];
      Vec3 p_C;
      Vec2 r;
      const bool ok = reproject(cameras, pairs(l.host, o.frame), x_h, l.alpha_beta_rho.z(), o, p_C, r);
      cost += huber(ok ? r.squaredNorm() : kUnprojectableSigma * kUnprojectableSigma, w.weights.huber_sigma).cost;
    }
    if (l.prior >= 0) cost += landmark_prior_cost(w, cameras, l);
  }
  return cost;
}

double add_landmark_gradient(const WindowProblem& w, const PairTable& pairs, const WindowLayout& at, WindowGradient& out) {
  const CameraGeometry cameras(w.calibration);
  double cost = 0;
  out.landmarks.assign(w.landmarks.size(), Vec3::Zero());
  for (std::size_t i = 0; i < w.landmarks.size(); ++i) {
    const WindowLandmark& l = w.landmarks[i];
    const Vec3 x_h = scaled_point_in_host(cameras, l);
    auto of_host = out.dense.segment<6>(at.pose_row(l.host));
    const WindowObservation* begin = w.observations.data() + l.first_observation;
    for (const WindowObservation* o = begin; o != begin + l.observation_count; ++o) {
      const PairGeometry& pair = pairs(l.host, o->frame);
      const std::optional<WeighedResidual> seen = weigh(w, cameras, pair, l, x_h, *o, cost);
      if (!seen) continue;
      const Vec2 weighed = seen->weight * seen->r;
      add_gradient(cameras, pair, l, x_h, *o, seen->p_C, weighed, of_host, out.dense.segment<6>(at.pose_row(o->frame)),
                   out.landmarks[i]);
    }
    if (l.prior < 0) continue;
    const LandmarkPrior& prior = w.landmark_priors[l.prior];
    const Vec3 r = landmark_prior_residual(cameras, w.frames[l.host].state.T_FB, l, prior);
    const RobustValue robust = huber(r.squaredNorm(), w.weights.huber_sigma);
    const LandmarkPriorJacobian J(cameras, w.linearisation_point(l.host).T_FB, l, prior);
    cost += robust.cost;
    of_host += robust.weight * J.host.transpose() * r;
    out.landmarks[i] += robust.weight * J.point.transpose() * r;
  }
  return cost;
}

double add_landmarks(const WindowProblem& window, const PairTable& pairs, NormalEquations& out) {
  return window.calibrating() ? add_landmarks_of<32>(window, pairs, out) : add_landmarks_of<16>(window, pairs, out);
}

}  // namespace fbvins
