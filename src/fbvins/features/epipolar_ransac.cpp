// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/epipolar_ransac.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "fbvins/geometry/five_point.hpp"
#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

constexpr int kMinMatchesKnownRotation = 3;
constexpr int kMinMatches = 6;

struct Matches {
  std::span<const Vec2> a, b;
  int size() const { return static_cast<int>(a.size()); }
};

struct Model {
  Mat3 R = Mat3::Identity();
  Vec3 t = Vec3::UnitX();
  Mat3 E() const { return hat(t) * R; }
};

/// Truncated squared distance summed over all matches (MSAC): lower is better.
double msac_cost(const Mat3& E, const Matches& m, double threshold) {
  const double limit = threshold * threshold;
  double cost = 0;
  for (int i = 0; i < m.size(); ++i) {
    const double d = sampson_distance(E, m.a[i], m.b[i]);
    cost += std::min(d * d, limit);
  }
  return cost;
}

int count_inliers(const Mat3& E, const Matches& m, double threshold) {
  int n = 0;
  for (int i = 0; i < m.size(); ++i) n += std::abs(sampson_distance(E, m.a[i], m.b[i])) < threshold;
  return n;
}

/// One Gauss-Newton step on (rotation, direction of translation) over the matches closer than
/// `threshold`, Sampson denominators held fixed. False when there is nothing to solve.
bool refine_step(Model& model, const Matches& m, double threshold) {
  const Mat3 E = model.E();
  Eigen::Matrix<double, 3, 2> tangent;
  const Vec3 axis = std::abs(model.t.x()) < 0.6 ? Vec3::UnitX() : Vec3::UnitY();
  tangent.col(0) = model.t.cross(axis).normalized();
  tangent.col(1) = model.t.cross(tangent.col(0));

  using Mat5 = Eigen::Matrix<double, 5, 5>;
  using Vec5 = Eigen::Matrix<double, 5, 1>;
  Mat5 H = Mat5::Zero();
  Vec5 g = Vec5::Zero();
  int used = 0;
  for (int i = 0; i < m.size(); ++i) {
    const Vec3 a = m.a[i].homogeneous(), b = m.b[i].homogeneous();
    const Vec3 Ea = E * a, Etb = E.transpose() * b;
    const double s2 = Ea.head<2>().squaredNorm() + Etb.head<2>().squaredNorm();
    if (s2 < 1e-18) continue;
    const double inv_s = 1.0 / std::sqrt(s2);
    const double r = b.dot(Ea) * inv_s;
    if (std::abs(r) >= threshold) continue;
    // b.(t x R Exp(d) a) = b.(t x Ra) + (a x E^T b).d ;  b.((t + dt) x Ra) = ... + (Ra x b).dt
    Vec5 J;
    J.head<3>() = a.cross(Etb) * inv_s;
    J.tail<2>() = tangent.transpose() * (model.R * a).cross(b) * inv_s;
    const double u = 1.0 - (r * r) / (threshold * threshold);
    const double weight = u * u;  // Tukey: fades out towards the threshold
    H += weight * J * J.transpose();
    g += weight * r * J;
    ++used;
  }
  if (used < 5) return false;
  // Damping: directions that the matches do not determine (no parallax) stay where they are.
  H.diagonal().array() += 1e-6 * used;
  const Vec5 d = -Ldlt<5>(H).solve(g);
  if (!d.allFinite()) return false;
  model.R = model.R * so3_exp(d.head<3>()).toRotationMatrix();
  model.t = (model.t + tangent * d.tail<2>()).normalized();
  return true;
}

struct Candidate {
  Model model;
  double cost = 0;
};

/// Keeps the better of `best` and `model`, after polishing a model that is a new best.
void consider(const Model& model, const Matches& m, double threshold, std::optional<Candidate>& best) {
  const double cost = msac_cost(model.E(), m, threshold);
  if (best && cost >= best->cost) return;
  best = Candidate{model, cost};
  Model polished = model;
  for (const double widen : {3.0, 3.0, 2.0, 1.5, 1.5}) {
    if (!refine_step(polished, m, widen * threshold)) return;
    const double polished_cost = msac_cost(polished.E(), m, threshold);
    if (polished_cost < best->cost) best = Candidate{polished, polished_cost};
  }
}

/// Final refinement: steps at the final threshold while they lower the cost.
void settle(const Matches& m, double threshold, Candidate& best) {
  for (int i = 0; i < 10; ++i) {
    Model next = best.model;
    if (!refine_step(next, m, 1.5 * threshold)) return;
    const double cost = msac_cost(next.E(), m, threshold);
    if (cost >= best.cost * (1.0 - 1e-4)) return;
    best = {next, cost};
  }
}

/// Probability that one sample was free of outliers.
constexpr double kConfidence = 0.999;

int iterations_needed(double inlier_share, int sample_size, const EpipolarOptions& options) {
  const double good = std::pow(inlier_share, sample_size);
  if (good > 1.0 - 1e-9) return 1;
  const double n = std::log(1.0 - kConfidence) / std::log(1.0 - std::max(good, 1e-12));
  return static_cast<int>(std::clamp(std::ceil(n), 1.0, static_cast<double>(options.max_iterations)));
}

template <std::size_t N>
std::array<int, N> draw(int n, Rng& rng) {
  std::array<int, N> picked{};
  for (std::size_t k = 0; k < N; ++k) {
    do picked[k] = static_cast<int>(rng.below(static_cast<std::uint32_t>(n)));
    while (std::find(picked.begin(), picked.begin() + k, picked[k]) != picked.begin() + k);
  }
  return picked;
}

/// Samples of two: the translation lies in both planes through the rotated ray and its match.
int search_translation(const Matches& m, const Mat3& R, const EpipolarOptions& options, Rng& rng,
                       std::optional<Candidate>& best) {
  for (int axis = 0; axis < 3; ++axis) consider({R, Vec3::Unit(axis)}, m, options.threshold, best);
  int needed = options.max_iterations, iteration = 0;
  for (; iteration < needed; ++iteration) {
    const auto [i, j] = draw<2>(m.size(), rng);
    const Vec3 ni = (R * m.a[i].homogeneous()).cross(m.b[i].homogeneous());
    const Vec3 nj = (R * m.a[j].homogeneous()).cross(m.b[j].homogeneous());
    const Vec3 t = ni.cross(nj);
    if (t.norm() < 1e-3 * options.threshold * options.threshold) continue;
    const double before = best->cost;
    consider({R, t.normalized()}, m, options.threshold, best);
    if (best->cost < before || iteration == 0) {
      const double share = count_inliers(best->model.E(), m, options.threshold) / static_cast<double>(m.size());
      needed = iterations_needed(share, 2, options);
    }
  }
  return iteration;
}

/// Rotation that takes two rays onto two others in the least-squares sense.
Mat3 rotation_of_two(const Matches& m, int i, int j) {
  const auto frame = [](const Vec2& p, const Vec2& q) {
    const Vec3 u = p.homogeneous().normalized(), v = q.homogeneous().normalized();
    Mat3 F;
    F.col(0) = (u + v).normalized();
    F.col(2) = u.cross(v).normalized();
    F.col(1) = F.col(2).cross(F.col(0));
    return F;
  };
  return frame(m.b[i], m.b[j]) * frame(m.a[i], m.a[j]).transpose();
}

int count_rotation_only(const Mat3& R, const Matches& m, double threshold) {
  int n = 0;
  for (int i = 0; i < m.size(); ++i) {
    const Vec3 turned = R * m.a[i].homogeneous();
    n += turned.z() > 1e-9 && (turned.hnormalized() - m.b[i]).squaredNorm() < threshold * threshold;
  }
  return n;
}

constexpr int kRotationSamples = 40;

/// The rotation that alone explains most matches, and how many.
std::pair<Mat3, int> search_rotation_only(const Matches& m, const EpipolarOptions& options, Rng& rng) {
  Mat3 best = Mat3::Identity();
  int count = count_rotation_only(best, m, options.threshold);
  for (int iteration = 0; iteration < std::min(kRotationSamples, options.max_iterations); ++iteration) {
    const auto [i, j] = draw<2>(m.size(), rng);
    if ((m.a[i] - m.a[j]).squaredNorm() < 1e-4) continue;
    const Mat3 R = rotation_of_two(m, i, j);
    if (!R.allFinite()) continue;
    const int n = count_rotation_only(R, m, options.threshold);
    if (n > count) count = n, best = R;
  }
  return {best, count};
}

int search_essential(const Matches& m, const EpipolarOptions& options, Rng& rng, std::optional<Candidate>& best) {
  const auto [R_only, explained] = search_rotation_only(m, options, rng);
  for (int axis = 0; axis < 3; ++axis) consider({R_only, Vec3::Unit(axis)}, m, options.threshold, best);
  // A rotation explains nearly all: five-point samples would be degenerate.
  if (explained > 0.95 * m.size()) return 0;
  int needed = options.max_iterations, iteration = 0;
  for (; iteration < needed; ++iteration) {
    const auto picked = draw<5>(m.size(), rng);
    std::array<Vec2, 5> a, b;
    for (int k = 0; k < 5; ++k) a[k] = m.a[picked[k]], b[k] = m.b[picked[k]];
    const double before = best->cost;
    for (const Mat3& E : five_point(a, b)) {
      if (msac_cost(E, m, options.threshold) >= best->cost) continue;
      const auto [R, t] = decompose_essential(E);
      consider({R, t}, m, options.threshold, best);
    }
    if (best->cost < before || iteration == 0) {
      const double share = count_inliers(best->model.E(), m, options.threshold) / static_cast<double>(m.size());
      needed = iterations_needed(share, 5, options);
    }
  }
  return iteration;
}

}  // namespace

double sampson_distance(const Mat3& E, const Vec2& a, const Vec2& b) {
  const double lx = E(0, 0) * a.x() + E(0, 1) * a.y() + E(0, 2);
  const double ly = E(1, 0) * a.x() + E(1, 1) * a.y() + E(1, 2);
  const double lz = E(2, 0) * a.x() + E(2, 1) * a.y() + E(2, 2);
  const double mx = E(0, 0) * b.x() + E(1, 0) * b.y() + E(2, 0);
  const double my = E(0, 1) * b.x() + E(1, 1) * b.y() + E(2, 1);
  const double s2 = lx * lx + ly * ly + mx * mx + my * my;
  return (b.x() * lx + b.y() * ly + lz) / std::sqrt(std::max(s2, 1e-18));
}

EpipolarResult ransac_epipolar(std::span<const Vec2> a, std::span<const Vec2> b, const std::optional<Mat3>& R_ba,
                               const EpipolarOptions& options, Rng& rng) {
  assert(a.size() == b.size());
  const Matches m{a, b};
  EpipolarResult result;
  result.inlier.assign(a.size(), 1);
  result.inliers = m.size();
  if (R_ba) result.R_ba = *R_ba;
  if (m.size() < (R_ba ? kMinMatchesKnownRotation : kMinMatches)) return result;

  std::optional<Candidate> best;
  result.iterations = R_ba ? search_translation(m, *R_ba, options, rng, best) : search_essential(m, options, rng, best);
  settle(m, options.threshold, *best);

  result.R_ba = best->model.R;
  result.t_ba = best->model.t;
  result.E = best->model.E();
  result.inliers = 0;
  for (int i = 0; i < m.size(); ++i) {
    result.inlier[i] = std::abs(sampson_distance(result.E, a[i], b[i])) < options.threshold;
    result.inliers += result.inlier[i];
  }
  return result;
}

}  // namespace fbvins
