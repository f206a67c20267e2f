// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/lens_jacobian.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
namespace fbvins {
namespace {

/// Every parameter of a model, in order.
template <class Model, class Visit>
void each(Model& m, Visit&& visit) {
  for (auto* value : {&m.fx, &m.fy, &m.cx, &m.cy}) visit(*value);
  using Plain = std::remove_const_t<Model>;
  if constexpr (std::is_same_v<Plain, PinholeRadtan>)
    for (auto* value : {&m.k1, &m.k2, &m.p1, &m.p2}) visit(*value);
  if constexpr (std::is_same_v<Plain, KannalaBrandt>)
    for (auto* value : {&m.k1, &m.k2, &m.k3, &m.k4}) visit(*value);
  if constexpr (std::is_same_v<Plain, PinholeRadtan5>)
    for (auto* value : {&m.k1, &m.k2, &m.p1, &m.p2, &m.k3}) visit(*value);
  if constexpr (std::is_same_v<Plain, PinholeRational>)
    for (auto* value : {&m.k1, &m.k2, &m.p1, &m.p2, &m.k3, &m.k4, &m.k5, &m.k6}) visit(*value);
  if constexpr (std::is_same_v<Plain, DoubleSphere>)
    for (auto* value : {&m.xi, &m.alpha}) visit(*value);
  if constexpr (std::is_same_v<Plain, ExtendedUnified>)
    for (auto* value : {&m.alpha, &m.beta}) visit(*value);
  if constexpr (std::is_same_v<Plain, UnifiedRadtan>)
    for (auto* value : {&m.xi, &m.k1, &m.k2, &m.p1, &m.p2}) visit(*value);
}

void limit(PinholeRadtan&) {}
void limit(KannalaBrandt&) {}
void limit(PinholeRadtan5&) {}
void limit(PinholeRational&) {}
void limit(DoubleSphere& m) {
  m.xi = std::clamp(m.xi, -0.999, 0.999);
  m.alpha = std::clamp(m.alpha, 0.0, 1.0);
}
void limit(ExtendedUnified& m) {
  m.alpha = std::clamp(m.alpha, 0.0, 1.0);
  m.beta = std::clamp(m.beta, 1e-3, 99.0);
}
void limit(UnifiedRadtan& m) { m.xi = std::clamp(m.xi, 0.0, 9.9); }

/// Focal lengths near the axis in place of fx, fy: f / (1 + xi).
std::vector<double> straightened(const DoubleSphere& m) {
  return {m.fx / (1 + m.xi), m.fy / (1 + m.xi), m.cx, m.cy, m.xi, m.alpha};
}
DoubleSphere bent(const DoubleSphere&, const std::vector<double>& v) {
  return {v[0] * (1 + v[4]), v[1] * (1 + v[4]), v[2], v[3], v[4], v[5]};
}

/// The projection's own share of the radial function u = f/(1+xi) r (1 + first r^2 + second r^4 + ...).
struct Series {
  double first, second;
};
Series series(double xi) {
  const double q = xi / (1 + xi);
  return {-0.5 * q, q / 8 + q * q / 4};
}

/// Focal lengths near the axis, coefficients of the whole radial function in place of k1 and k2.
std::vector<double> straightened(const UnifiedRadtan& m) {
  const double e = 1 + m.xi, k1 = m.k1 / (e * e);
  const Series own = series(m.xi);
  return {m.fx / e, m.fy / e, m.cx, m.cy, m.xi, own.first + k1, own.second + 3 * own.first * k1 + m.k2 / std::pow(e, 4),
          m.p1 / e, m.p2 / e};
}
UnifiedRadtan bent(const UnifiedRadtan&, const std::vector<double>& v) {
  const double e = 1 + v[4];
  const Series own = series(v[4]);
  const double k1 = v[5] - own.first, k2 = v[6] - own.second - 3 * own.first * k1;
  return {v[0] * e, v[1] * e, v[2], v[3], v[4], k1 * e * e, k2 * std::pow(e, 4), v[7] * e, v[8] * e};
}

/// The series of N/D in place of N: the coefficients of both trade off against one another.
std::vector<double> straightened(const PinholeRational& m) {
  const double c1 = m.k1 - m.k4, c2 = m.k2 - m.k5 - m.k4 * c1, c3 = m.k3 - m.k6 - m.k5 * c1 - m.k4 * c2;
  return {m.fx, m.fy, m.cx, m.cy, c1, c2, m.p1, m.p2, c3, m.k4, m.k5, m.k6};
}
PinholeRational bent(const PinholeRational&, const std::vector<double>& v) {
  const double c1 = v[4], c2 = v[5], c3 = v[8], k4 = v[9], k5 = v[10], k6 = v[11];
  return {v[0], v[1], v[2], v[3], c1 + k4, c2 + k5 + k4 * c1, v[6], v[7], c3 + k6 + k5 * c1 + k4 * c2, k4, k5, k6};
}

template <class Model>
std::vector<double> straightened(const Model& m) {
  std::vector<double> out;
  each(m, [&](const double& value) { out.push_back(value); });
  return out;
}
template <class Model>
Model bent(Model m, const std::vector<double>& v) {
  auto next = v.begin();
  each(m, [&](double& value) { value = *next++; });
  return m;
}

/// How the straight parameters change with a small step of the others, times one over the part of the step.
template <class Model>
std::vector<double> direction(const Model& lens, const double* step) {
  constexpr double kPart = 1e-3;
  const auto at = [&](double part) {
    Model m = lens;
    const double* d = step;
    each(m, [&](double& value) { value += part * *d++; });
    return straightened(m);
  };
  std::vector<double> out = at(kPart);
  const std::vector<double> less = at(-kPart);
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = (out[k] - less[k]) / (2 * kPart);
  return out;
}

/// So that 1 + xi stays positive.
void limit_straight(const DoubleSphere&, std::vector<double>& v) { v[4] = std::clamp(v[4], -0.999, 0.999); }
void limit_straight(const UnifiedRadtan&, std::vector<double>& v) { v[4] = std::clamp(v[4], 0.0, 9.9); }
void limit_straight(const auto&, std::vector<double>&) {}

std::vector<std::string> own_names(const LensModel& lens) {
  constexpr const char* kNames[][8] = {{"k1", "k2", "p1", "p2"},
                                       {"k1", "k2", "k3", "k4"},
                                       {"xi", "alpha"},
                                       {"alpha", "beta"},
                                       {"xi", "k1", "k2", "p1", "p2"},
                                       {"k1", "k2", "p1", "p2", "k3"},
                                       {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}};
  const int count = lens_parameter_count(lens) - 4;
  return {kNames[lens.index()], kNames[lens.index()] + count};
}

}  // namespace

std::vector<double> lens_parameters(const LensModel& lens) {
  std::vector<double> out;
  std::visit([&](const auto& m) { each(m, [&](const double& value) { out.push_back(value); }); }, lens);
  return out;
}

int lens_parameter_count(const LensModel& lens) {
  constexpr int kCounts[] = {8, 8, 6, 6, 9, 9, 12};
  static_assert(std::size(kCounts) == std::variant_size_v<LensModel>);
  return kCounts[lens.index()];
}

std::vector<std::string> lens_parameter_names(const LensModel& lens) {
  std::vector<std::string> out = {"fx", "fy", "cx", "cy"};
  for (std::string& name : own_names(lens)) out.push_back(std::move(name));
  return out;
}

LensModel with_parameters(const LensModel& lens, const double* parameters) {
  return std::visit(
      [&](auto m) -> LensModel {
        each(m, [&](double& value) { value = *parameters++; });
        m.fx = std::max(m.fx, 1.0);
        m.fy = std::max(m.fy, 1.0);
        limit(m);
        return m;
      },
      lens);
}

std::vector<double> straight_parameters(const LensModel& lens) {
  return std::visit([](const auto& m) { return straightened(m); }, lens);
}

Eigen::MatrixXd straight_jacobian(const LensModel& lens) {
  const int count = lens_parameter_count(lens);
  Eigen::MatrixXd J(count, count);
  for (int k = 0; k < count; ++k) {
    std::array<double, kMostLensParameters> unit{};
    unit[k] = 1e-3;
    const std::vector<double> column = std::visit([&](const auto& m) { return direction(m, unit.data()); }, lens);
    for (int i = 0; i < count; ++i) J(i, k) = column[i] / unit[k];
  }
  return J;
}

LensModel moved_lens(const LensModel& lens, const double* step) {
  return std::visit(
      [&](const auto& m) {
        std::vector<double> values = straightened(m);
        const std::vector<double> change = direction(m, step);
        for (std::size_t k = 0; k < values.size(); ++k) values[k] += change[k];
        limit_straight(m, values);
        return with_parameters(lens, lens_parameters(bent(m, values)).data());
      },
      lens);
}

std::vector<std::string> lens_names() {
  return {"pinhole-radtan", "pinhole-equidistant", "ds", "eucm", "omni-radtan", "pinhole-radtan5", "pinhole-rational"};
}

std::optional<LensModel> plain_lens(std::string_view name, double focal_px, const Vec2& centre_px) {
  const double f = focal_px, cx = centre_px.x(), cy = centre_px.y();
  if (name == "pinhole-radtan") return PinholeRadtan{f, f, cx, cy};
  if (name == "pinhole-equidistant") return KannalaBrandt{f, f, cx, cy};
  if (name == "pinhole-radtan5") return PinholeRadtan5{f, f, cx, cy};
  if (name == "pinhole-rational") return PinholeRational{f, f, cx, cy};
  if (name == "ds") return DoubleSphere{f, f, cx, cy, 0, 0.5};
  if (name == "eucm") return ExtendedUnified{f, f, cx, cy, 0.5, 1};
  if (name == "omni-radtan") return UnifiedRadtan{2 * f, 2 * f, cx, cy, 1};
  return std::nullopt;
}

}  // namespace fbvins
