// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/corner_refine.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace fbvins {
namespace {

constexpr int kIterations = 25;
constexpr double kConverged_px = 1e-3;
constexpr double kConvergedCost = 0.02;  ///< part of the cost
constexpr double kLargestMove_px = 0.7;  ///< by which the window may be off the corner
constexpr double kLeastContrast = 6;     ///< half the difference of the fields, grey values
constexpr double kLargestMisfit = 0.3;   ///< root mean square of the residuals, as a part of the contrast
constexpr double kLeastAngle = 0.35;     ///< sine of the angle between the edges

using Vec7 = Eigen::Matrix<double, 7, 1>;
using Mat7 = Eigen::Matrix<double, 7, 7>;

/// grey = level + contrast E(n1 . (x - corner)) E(n2 . (x - corner)) with E the error function of a blur: what a crossing of two
/// straight edges looks like, exactly where they are orthogonal, and with its point symmetry otherwise.
struct Crossing {
  Vec2 corner;
  double angle[2];  ///< of the edges' normals
  double level, contrast, blur_px;

  Crossing moved(const Vec7& d) const {
    return {corner + d.head<2>(),
            {angle[0] + d[2], angle[1] + d[3]},
            level + d[4],
            contrast + d[5],
            std::clamp(blur_px + d[6], 0.3, 6.0)};
  }
};

struct Sample {
  Vec2 at;
  double grey, weight;
};

/// Grey value of the model at a point, with its derivatives.
double grey_of(const Crossing& m, const Vec2& at, Vec7* J) {
  double E[2], slope[2], distance[2];
  Vec2 normal[2];
  const Vec2 offset = at - m.corner;
  for (int i = 0; i < 2; ++i) {
    normal[i] = {std::cos(m.angle[i]), std::sin(m.angle[i])};
    distance[i] = normal[i].dot(offset);
    const double x = distance[i] / (std::numbers::sqrt2 * m.blur_px);
    E[i] = std::erf(x);
    slope[i] = std::numbers::sqrt2 * std::numbers::inv_sqrtpi / m.blur_px * std::exp(-x * x);
  }
  if (J) {
    const double both[2] = {m.contrast * slope[0] * E[1], m.contrast * slope[1] * E[0]};
    J->head<2>() = -both[0] * normal[0] - both[1] * normal[1];
    for (int i = 0; i < 2; ++i) (*J)[2 + i] = both[i] * (normal[i].x() * offset.y() - normal[i].y() * offset.x());
    (*J)[4] = 1;
    (*J)[5] = E[0] * E[1];
    (*J)[6] = -(both[0] * distance[0] + both[1] * distance[1]) / m.blur_px;
  }
  return m.level + m.contrast * E[0] * E[1];
}

double cost_of(const Crossing& m, const std::vector<Sample>& samples) {
  double sum = 0;
  for (const Sample& s : samples) {
    const double r = grey_of(m, s.at, nullptr) - s.grey;
    sum += s.weight * r * r;
  }
  return sum;
}

/// Level and contrast by least squares, for the rest as it is.
void fit_greys(Crossing& m, const std::vector<Sample>& samples) {
  m.level = 0;
  m.contrast = 1;
  double w = 0, e = 0, ee = 0, g = 0, eg = 0;
  for (const Sample& s : samples) {
    const double E = grey_of(m, s.at, nullptr);
    w += s.weight, e += s.weight * E, ee += s.weight * E * E, g += s.weight * s.grey, eg += s.weight * E * s.grey;
  }
  const double determinant = w * ee - e * e;
  m.contrast = determinant > 0 ? (w * eg - e * g) / determinant : 0;
  m.level = (g - m.contrast * e) / w;
}

/// Levenberg-Marquardt; whether it converged.
bool fit(Crossing& m, const std::vector<Sample>& samples) {
  double cost = cost_of(m, samples), lambda = 1e-3;
  for (int i = 0; i < kIterations; ++i) {
    Mat7 H = Mat7::Zero();
    Vec7 b = Vec7::Zero(), J;
    for (const Sample& s : samples) {
      const double r = grey_of(m, s.at, &J) - s.grey;
      H.noalias() += s.weight * J * J.transpose();
      b -= s.weight * r * J;
    }
    for (int retry = 0;; ++retry) {
      Mat7 damped = H;
      damped.diagonal() *= 1 + lambda;
      damped.diagonal().array() += 1e-9;
      const Vec7 step = damped.ldlt().solve(b);
      const Crossing trial = m.moved(step);
      const double next = cost_of(trial, samples);
      const bool stays = step.head<2>().norm() < kConverged_px;
      if (next <= cost) {
        // A corner that starts where it is stays while blur and greys are found.
        const bool converged = stays && next >= (1 - kConvergedCost) * cost;
        m = trial;
        cost = next;
        lambda *= 0.1;
        if (converged) return true;
        break;
      }
      if (retry == 6) return stays;
      lambda *= 10;
    }
  }
  return false;
}

/// Pixels around a point, those near to it with more weight.
std::vector<Sample> samples_around(const ImageView& image, const Vec2& at, double radius_px) {
  std::vector<Sample> out;
  const int cx = static_cast<int>(std::lround(at.x())), cy = static_cast<int>(std::lround(at.y()));
  const int reach = static_cast<int>(std::ceil(radius_px));
  if (cx - reach < 0 || cy - reach < 0 || cx + reach > image.width - 1 || cy + reach > image.height - 1) return out;
  for (int y = cy - reach; y <= cy + reach; ++y)
    for (int x = cx - reach; x <= cx + reach; ++x) {
      const double square = (Vec2(x, y) - at).squaredNorm() / (radius_px * radius_px);
      if (square < 1) out.push_back({Vec2(x, y), static_cast<double>(image.row(y)[x]), (1 - square) * (1 - square)});
    }
  return out;
}

}  // namespace

std::optional<Vec2> refine_corner(const ImageView& image, const Vec2& start, const Vec2& first, const Vec2& second,
                                  double radius_px) {
  Crossing m{start, {std::atan2(first.x(), -first.y()), std::atan2(second.x(), -second.y())}, 0, 0, 1};
  // The window follows the corner.
  for (int round = 0; round < 3; ++round) {
    const Vec2 middle = m.corner;
    const std::vector<Sample> samples = samples_around(image, middle, radius_px);
    if (samples.size() < 9) return std::nullopt;
    if (round == 0) fit_greys(m, samples);
    if (!fit(m, samples) || !((m.corner - start).norm() <= radius_px)) return std::nullopt;
    if ((m.corner - middle).norm() > kLargestMove_px) continue;
    double weights = 0;
    for (const Sample& s : samples) weights += s.weight;
    const bool fits = std::sqrt(cost_of(m, samples) / weights) < kLargestMisfit * std::abs(m.contrast);
    const bool crosses = std::abs(m.contrast) > kLeastContrast && std::abs(std::sin(m.angle[0] - m.angle[1])) > kLeastAngle;
    return fits && crosses ? std::optional(m.corner) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace fbvins
