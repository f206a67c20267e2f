// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/next_view.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "fbvins/calibration/board_pose.hpp"
#include "fbvins/calibration/calibration_checks.hpp"
#include "fbvins/calibration/lens_certainty.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"

namespace fbvins {
namespace {

constexpr double kImages = 10;              // that one way of holding the board is worth
constexpr double kTilt_rad = 0.6;           // that is asked for
constexpr double kTiltSeen_rad = 0.3;       // from which on a board counts as tilted
constexpr double kFar = 0.35, kNear = 0.8;  // fill that is asked for
constexpr double kFillSeen = 1.4;           // factor that is a change
constexpr double kSteep_rad = 0.5;          // rays beyond this angle: the board follows them, as it could not be seen
constexpr std::array<double, 3> kPlaces = {0.2, 0.5, 0.8};

/// What a sentence says of a place in an image of `camera`.
std::string place_name(int place, int camera) {
  constexpr std::array<const char*, 9> kNames = {"into the upper left corner",
                                                 "to the top",
                                                 "into the upper right corner",
                                                 "to the left",
                                                 "into the middle",
                                                 "to the right",
                                                 "into the lower left corner",
                                                 "to the bottom",
                                                 "into the lower right corner"};
  return fmt::format("{} of cam{}'s image", kNames[static_cast<std::size_t>(place)], camera);
}

/// Takes the optical axis towards a ray, by as much as the ray is steep.
Quat lean(const Vec3& ray) {
  const Vec3 axis = Vec3::UnitZ().cross(ray);
  const double angle = std::acos(std::clamp(ray.normalized().z(), -1.0, 1.0));
  if (angle <= kSteep_rad || axis.norm() < 1e-9) return Quat::Identity();
  return so3_exp((angle - kSteep_rad) * axis.normalized());
}

/// Its extent along x and y.
Vec3 extent_of(const Board& board) {
  Vec3 most = Vec3::Zero();
  for (int i = 0; i < board.corner_count(); ++i) most = most.cwiseMax(board.corner(i));
  return most;
}

std::optional<SeenBoard> seen_by(const RigKnowledge& known, const Board& board, int camera, const Pose<C0, T>& T_C0T) {
  const auto k = static_cast<std::size_t>(camera);
  SeenBoard out{camera, {}};
  BoardView view{{}, camera, {}};
  for (int index = 0; index < board.corner_count(); ++index) {
    const Vec3 p_T = board.corner(index);
    const auto pixel = known.cameras[k].project(known.T_CnC0[k] * (T_C0T * p_T));
    if (!pixel ||
        !(pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < known.cameras[k].width() && pixel->y() < known.cameras[k].height()))
      continue;
    out.corners.push_back({index, p_T, *pixel});
    view.corners.push_back({index, *pixel});
  }
  return enough_corners(view, board) ? std::optional(std::move(out)) : std::nullopt;
}

/// What is not known, over the aims, squared; and what an image more would change about it.
class Ignorance {
 public:
  Ignorance(const RigKnowledge& known, const CertaintyAims& aims)
      : known_(known), aims_(aims), adjustment_(known.rig(), {}), sum_(known.information) {
    for (std::size_t k = 0; k < known.cameras.size(); ++k) {
      const int first = adjustment_.first_of(static_cast<int>(k)), count = lens_parameter_count(known.cameras[k].model());
      const double width = known.cameras[k].width(), noise2 = known.noise_px * known.noise_px;
      for (int i = 0; i < count; ++i) sum_(first + i, first + i) += noise2 / std::pow(i < 4 ? 0.3 * width : 1.0, 2);
      for (int i = 0; k > 0 && i < 6; ++i) sum_(first + count + i, first + count + i) += noise2;
      motions_.emplace_back(known.cameras[k], ImageCells::of(known.cameras[k]), known.used[k]);
    }
  }

  double now() const { return with(Eigen::MatrixXd::Zero(sum_.rows(), sum_.cols())); }

  /// Nothing where the board could not be seen so.
  std::optional<double> after(const Board& board, const BoardHold& hold) const {
    const auto k = static_cast<std::size_t>(hold.camera);
    const auto T_CnT = pose_of(known_.cameras[k], board, hold);
    if (!T_CnT) return std::nullopt;
    RigFrame frame{{}, {}, known_.T_CnC0[k].inverse() * *T_CnT};
    bool seen = false;
    for (int c = 0; c < static_cast<int>(known_.cameras.size()); ++c) {
      if (c != hold.camera && !(known_.joined[k] && known_.joined[static_cast<std::size_t>(c)])) continue;
      auto view = seen_by(known_, board, c, frame.T_C0T);
      seen = seen || (view && c == hold.camera);
      if (view) frame.views.push_back(*std::move(view));
    }
    if (!seen) return std::nullopt;
    return with(kImages * adjustment_.evidence(frame).information);
  }

 private:
  double with(const Eigen::MatrixXd& more) const {
    const Eigen::MatrixXd sum = sum_ + more;
    const Eigen::VectorXd scale = sum.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * sum * scale.asDiagonal();
    const Eigen::MatrixXd inverse = scaled.ldlt().solve(Eigen::MatrixXd::Identity(sum.rows(), sum.cols()));
    const Eigen::MatrixXd P = known_.noise_px * known_.noise_px * (scale.asDiagonal() * inverse * scale.asDiagonal());
    double out = 0;
    for (std::size_t k = 0; k < motions_.size(); ++k) {
      const int first = adjustment_.first_of(static_cast<int>(k)), count = lens_parameter_count(known_.cameras[k].model());
      out += lens_part(motions_[k].sigma_px(P.block(first, first, count, count)));
      if (k == 0 || !known_.joined[k]) continue;
      out += P.diagonal().segment<3>(first + count).mean() / (aims_.baseline_m * aims_.baseline_m);
      out += P.diagonal().segment<3>(first + count + 3).mean() / (aims_.between_cameras_rad * aims_.between_cameras_rad);
    }
    return out;
  }

  double lens_part(const std::vector<double>& sigma_px) const {
    double sum = 0;
    int cells = 0;
    for (const double sigma : sigma_px)
      if (std::isfinite(sigma)) sum += sigma * sigma / (aims_.lens_px * aims_.lens_px), ++cells;
    return sum / std::max(1, cells);
  }

  const RigKnowledge& known_;
  const CertaintyAims& aims_;
  RigAdjustment adjustment_;
  Eigen::MatrixXd sum_;
  std::vector<LensMotions> motions_;
};

struct Candidate {
  BoardHold hold;
  HoldChange change;
  std::string sentence;
};

std::string tilt_sentence(const BoardHold& hold) {
  const bool horizontal = hold.tilt_x_rad != 0;
  const double tilt = horizontal ? hold.tilt_x_rad : hold.tilt_y_rad;
  if (tilt == 0) return fmt::format("hold the board parallel to cam{}'s image", hold.camera);
  const char* edge = horizontal ? (tilt > 0 ? "upper" : "lower") : (tilt > 0 ? "right" : "left");
  return fmt::format("tilt the board about its {} axis, its {} edge towards cam{}", horizontal ? "horizontal" : "vertical", edge,
                     hold.camera);
}

std::vector<BoardHold> tilted(const BoardHold& hold) {
  std::vector<BoardHold> out;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {kTilt_rad, 0.0}, {-kTilt_rad, 0.0}, {0.0, kTilt_rad}, {0.0, -kTilt_rad}}) {
    out.push_back(hold);
    out.back().tilt_x_rad = x, out.back().tilt_y_rad = y;
  }
  return out;
}

bool tilted_otherwise(const BoardHold& a, const BoardHold& b) {
  return std::hypot(a.tilt_x_rad - b.tilt_x_rad, a.tilt_y_rad - b.tilt_y_rad) > kTiltSeen_rad;
}

/// Changes of one thing about how the board is held.
void add_changes(const BoardHold& now, std::vector<Candidate>& out) {
  for (int place = 0; place < 9; ++place) {
    if (place == now.place) continue;
    BoardHold hold = now;
    hold.place = place;
    out.push_back({hold, HoldChange::place, "hold the board " + place_name(place, now.camera)});
  }
  for (const double fill : {kFar, kNear}) {
    if (std::max(fill / now.fill, now.fill / fill) < kFillSeen) continue;
    BoardHold hold = now;
    hold.fill = fill;
    out.push_back({hold, HoldChange::distance,
                   fill > now.fill ? fmt::format("bring the board closer to cam{}", now.camera)
                                   : fmt::format("take the board farther away from cam{}", now.camera)});
  }
  for (const BoardHold& hold : tilted(now))
    if (tilted_otherwise(hold, now)) out.push_back({hold, HoldChange::tilt, tilt_sentence(hold)});
}

/// A board that a camera does not see.
void add_showing(int camera, std::vector<Candidate>& out) {
  for (int place = 0; place < 9; ++place)
    for (const double fill : {kFar, kNear})
      for (const BoardHold& hold : tilted({camera, place, fill, 0, 0}))
        out.push_back(
            {hold, HoldChange::camera,
             place == 4 ? fmt::format("hold the board before cam{}", camera) : "hold the board " + place_name(place, camera)});
}

}  // namespace

std::optional<BoardHold> hold_of(const Camera& camera, const Board& board, const BoardView& view) {
  if (!enough_corners(view, board)) return std::nullopt;
  const auto posed = find_board_pose(camera, board, view.corners);
  if (!posed) return std::nullopt;
  const Vec3 middle_C = posed->T_CnT * (0.5 * extent_of(board));
  const auto pixel = camera.project(middle_C);
  if (!pixel || !(middle_C.norm() > 0)) return std::nullopt;
  const auto third = [](double part) { return std::clamp(static_cast<int>(3 * part), 0, 2); };
  BoardHold out{.camera = view.camera};
  out.place = 3 * third(pixel->y() / camera.height()) + third(pixel->x() / camera.width());
  out.fill = camera.focal_px() * extent_of(board).x() / (middle_C.norm() * camera.width());
  Vec3 normal = lean(middle_C.normalized()).conjugate() * (posed->T_CnT.q * Vec3::UnitZ());
  if (normal.z() > 0) normal = -normal;
  out.tilt_x_rad = std::asin(std::clamp(normal.y(), -1.0, 1.0));
  out.tilt_y_rad = std::asin(std::clamp(-normal.x(), -1.0, 1.0));
  return out;
}

std::optional<Pose<Cn, T>> pose_of(const Camera& camera, const Board& board, const BoardHold& hold) {
  const Vec2 pixel(kPlaces[static_cast<std::size_t>(hold.place % 3)] * camera.width(),
                   kPlaces[static_cast<std::size_t>(hold.place / 3)] * camera.height());
  const auto xy = camera.undistort(pixel);
  if (!xy) return std::nullopt;
  const Vec3 ray = Vec3(xy->x(), xy->y(), 1).normalized();
  const double distance_m = camera.focal_px() * extent_of(board).x() / (hold.fill * camera.width());
  const Quat q = lean(ray) * so3_exp(Vec3(hold.tilt_x_rad, 0, 0)) * so3_exp(Vec3(0, hold.tilt_y_rad, 0)) * Quat(0, 1, 0, 0);
  return Pose<Cn, T>(q, Vec3(distance_m * ray - q * (0.5 * extent_of(board))));
}

bool followed(const NextView& asked, const std::vector<BoardHold>& now) {
  const auto hold = std::ranges::find(now, asked.hold.camera, &BoardHold::camera);
  if (hold == now.end()) return false;
  switch (asked.change) {
    case HoldChange::camera: return true;
    case HoldChange::place: return hold->place == asked.hold.place;
    case HoldChange::distance: return std::max(hold->fill / asked.hold.fill, asked.hold.fill / hold->fill) < kFillSeen;
    case HoldChange::tilt: return !tilted_otherwise(*hold, asked.hold);
  }
  return true;
}

NextView next_view(const RigKnowledge& known, const Board& board, const std::vector<BoardHold>& now, const CertaintyAims& aims) {
  std::vector<Candidate> candidates;
  for (int k = 0; k < static_cast<int>(known.cameras.size()); ++k) {
    const auto hold = std::ranges::find(now, k, &BoardHold::camera);
    if (hold != now.end()) add_changes(*hold, candidates);
    else add_showing(k, candidates);
  }
  const Ignorance ignorance(known, aims);
  NextView best;
  double least = std::numeric_limits<double>::infinity();
  for (const Candidate& candidate : candidates) {
    const auto after = ignorance.after(board, candidate.hold);
    if (after && *after < least) least = *after, best = {candidate.hold, candidate.change, candidate.sentence, 0};
  }
  if (std::isfinite(least)) best.gain = ignorance.now() / std::max(least, 1e-12);
  return best;
}

}  // namespace fbvins
