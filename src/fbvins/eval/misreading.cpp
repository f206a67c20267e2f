// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/misreading.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "fbvins/eval/alignment.hpp"
#include "fbvins/eval/evaluation.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kFewestPairs = 10;

using Reading = Quat (*)(const Quat&);
/// As read, and as meant: (w, x, y, z) of a file that has x y z w, and the other way round.
Quat last_was_w(const Quat& q) { return {q.z(), q.w(), q.x(), q.y()}; }
Quat first_was_w(const Quat& q) { return {q.x(), q.y(), q.z(), q.w()}; }
Quat conjugate(const Quat& q) { return q.conjugate(); }
Quat last_was_w_conjugate(const Quat& q) { return last_was_w(q).conjugate(); }
Quat first_was_w_conjugate(const Quat& q) { return first_was_w(q).conjugate(); }

struct Variant {
  Reading meant;
  const char* said;
};
constexpr std::array<Variant, 5> kVariants{{{last_was_w, "quaternions are x y z w"},
                                            {first_was_w, "quaternions are w x y z"},
                                            {conjugate, "quaternions are conjugated (world to body)"},
                                            {last_was_w_conjugate, "quaternions are x y z w and conjugated (world to body)"},
                                            {first_was_w_conjugate, "quaternions are w x y z and conjugated (world to body)"}}};

/// Root mean square angle between the orientations, degrees, after the rotation between the worlds that suits them best.
double off_deg(const std::vector<PosePair>& pairs, Reading meant) {
  Mat3 sum = Mat3::Zero();
  for (const PosePair& pair : pairs)
    sum += (pair.truth.T.q * (meant ? meant(pair.estimate.T.q) : pair.estimate.T.q).conjugate()).toRotationMatrix();
  // |sum|^2 is n^2 x 3 where all rotations are one; the mean of what is missing is the spread.
  const auto n = static_cast<double>(pairs.size());
  const double together = std::min(1.0, sum.squaredNorm() / (3 * n * n));
  return 180 / std::numbers::pi * std::sqrt(3 * (1 - together) / 2);
}

}  // namespace

Misreading find_misreading(const AnyTrajectory& truth, const AnyTrajectory& estimate, const AssociationOptions& options) {
  Misreading out{estimate, ""};
  const std::vector<PosePair> pairs = associate(truth, estimate, options);
  if (pairs.size() < kFewestPairs) return out;
  constexpr double kWrong_deg = 15, kExplained = 0.2;
  const bool oriented = has_orientations(truth) && has_orientations(estimate);
  const double as_read_deg = oriented ? off_deg(pairs, nullptr) : 0;
  const Variant* best = nullptr;
  double best_deg = kExplained * as_read_deg;
  for (const Variant& variant : kVariants)
    if (const double deg = off_deg(pairs, variant.meant); as_read_deg > kWrong_deg && deg < best_deg)
      best = &variant, best_deg = deg;
  if (best) {
    for (auto& pose : out.estimate.poses) pose.T.q = best->meant(pose.T.q);
    out.said = best->said;
  }
  constexpr double kMillimetres = 1e-3, kNear = 0.03;
  const Result<Similarity> scaled = align(pairs, Alignment::sim3);
  if (scaled && std::abs(scaled->scale / kMillimetres - 1) < kNear) {
    for (auto& pose : out.estimate.poses) pose.T.p *= kMillimetres;
    out.said += std::string(out.said.empty() ? "" : ", ") + "positions are in millimetres";
  }
  return out;
}

}  // namespace fbvins
