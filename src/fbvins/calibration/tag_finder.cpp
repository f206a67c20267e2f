// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/tag_finder.hpp"

#include <algorithm>

#include "fbvins/calibration/board_pose.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/calibration/tag_alignment.hpp"
#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

/// Standard deviation of a corner against the calibrated lens, and the largest distance of one from its place in a tag.
constexpr double kCorner_px = 0.25, kLargestError_px = 1;
/// Shortest edge: a cell of the pattern is an eighth of it.
constexpr double kSmallest_px = 16;
/// The second pose of a small tag is possible up to this squared distance in standard deviations.
constexpr double kPossible = 9;

/// Adds that it may be the other pose (L25). The way from one to the other is no straight line: it grows to all sides.
void widen(Mat6& covariance, const Pose<Cn, T>& pose, const Pose<Cn, T>& other) {
  Vec6 apart;
  apart << other.p - pose.p, so3_log(pose.q.conjugate() * other.q);
  covariance += apart * apart.transpose();
  covariance.diagonal().head<3>().array() += apart.head<3>().squaredNorm();
  covariance.diagonal().tail<3>().array() += apart.tail<3>().squaredNorm();
}

struct TagPose {
  Pose<Cn, T> T_CnT;
  Mat6 covariance;  ///< of (dp in the camera, dtheta in the tag)
};

/// By the corners alone.
Mat6 covariance_of(const Camera& camera, const Board& board, const PosedBoard& posed) {
  Mat6 information = Mat6::Zero();
  const Mat3 R = posed.T_CnT.R();
  for (int k = 0; k < board.corner_count(); ++k) {
    const Vec3 p_T = board.corner(k);
    LensDerivatives d;
    if (!project_point(camera.model(), posed.T_CnT * p_T, &d)) continue;
    Eigen::Matrix<double, 2, 6> J;
    J << d.point, -d.point * R * hat(p_T);
    information += J.transpose() * J / (kCorner_px * kCorner_px);
  }
  Mat6 covariance = inverted(information);
  // Which of the two poses it is may be open: as far as one is from the other, it is not known.
  if (2 * posed.other_costs_px2 < kPossible * kCorner_px * kCorner_px) widen(covariance, posed.T_CnT, posed.other);
  return 0.5 * (covariance + covariance.transpose());
}

/// By all pixels, from both poses; nullopt where the image does not fit the pattern.
std::optional<TagPose> by_pixels(const ImageView& image, const Camera& camera, const TagCells& cells, double size_m,
                                 const PosedBoard& posed) {
  std::optional<AlignedTag> best = align_tag(image, camera, cells, size_m, posed.T_CnT),
                            other = align_tag(image, camera, cells, size_m, posed.other);
  if (!best || (other && other->squared_error < best->squared_error)) std::swap(best, other);
  if (!best) return std::nullopt;
  if (other && other->squared_error - best->squared_error < kPossible * best->variance)
    widen(best->covariance, best->T_CnT, other->T_CnT);
  return TagPose{best->T_CnT, best->covariance};
}

}  // namespace

Result<TagFinder> TagFinder::create(const StereoRig& rig, TagSurvey survey) {
  Result<TagDetector> detector = TagDetector::create();
  if (!detector) return detector.error();
  return TagFinder(rig, std::move(survey), *std::move(detector));
}

TagFinder::TagFinder(const StereoRig& rig, TagSurvey survey, TagDetector detector)
    : camera_(rig.left()),
      T_BC0_(rig.T_BC0()),
      survey_(std::move(survey)),
      board_{BoardKind::aprilgrid, 1, 1, survey_.size_m, 0.3},
      detector_(std::move(detector)) {
  for (const auto& [id, T_AT] : survey_.T_AT)
    if (const Result<TagCells> cells = tag_cells(id)) cells_[id] = *cells;
}

std::optional<TagAnchor> TagFinder::posed(const TagDetection& seen, const ImageView& image) const {
  std::vector<BoardCorner> corners;
  for (int k = 0; k < 4; ++k) {
    if ((seen.corners[k] - seen.corners[(k + 1) % 4]).norm() < kSmallest_px) return std::nullopt;
    corners.push_back({k, seen.corners[k]});
  }
  const auto posed = find_board_pose(camera_, board_, corners);
  if (!posed) return std::nullopt;
  for (const BoardCorner& corner : corners) {
    const auto pixel = project_point(camera_.model(), posed->T_CnT * board_.corner(corner.index));
    if (!pixel || (*pixel - corner.pixel).norm() > kLargestError_px) return std::nullopt;
  }
  std::optional<TagPose> pose;
  if (const auto cells = cells_.find(seen.id); cells != cells_.end())
    pose = by_pixels(image, camera_, cells->second, board_.size_m, *posed);
  if (!pose) pose = TagPose{posed->T_CnT, covariance_of(camera_, board_, *posed)};
  // From the board's frame, at the first corner, to the tag's, in its middle: the rotation's error moves the middle.
  const Vec3 middle(0.5 * board_.size_m, 0.5 * board_.size_m, 0);
  Mat6 J = Mat6::Identity();
  J.topRightCorner<3, 3>() = -pose->T_CnT.R() * hat(middle);
  Mat6 turn = Mat6::Identity();
  turn.topLeftCorner<3, 3>() = T_BC0_.R();
  TagAnchor out{.id = seen.id, .T_AT = survey_.T_AT.at(seen.id)};
  const Pose<C0, Tag> T_CT(pose->T_CnT.q, pose->T_CnT * middle);
  out.T_BT = T_BC0_ * T_CT;
  out.covariance = turn * J * pose->covariance * J.transpose() * turn.transpose();
  out.covariance = 0.5 * (out.covariance + out.covariance.transpose()).eval();
  return out;
}

std::vector<TagAnchor> TagFinder::find(const StereoFrame& frame) {
  std::vector<TagAnchor> out;
  if (!frame.left()) return out;
  const std::vector<TagDetection> all = detector_.find(frame.left()->view());
  for (const TagDetection& seen : all) {
    const auto of_id = std::ranges::count(all, seen.id, &TagDetection::id);
    if (of_id > 1 || !survey_.T_AT.contains(seen.id)) continue;
    auto anchor = posed(seen, frame.left()->view());
    if (!anchor) continue;
    anchor->t = frame.t;
    if (impossible(*anchor).empty()) out.push_back(*anchor);
  }
  return out;
}

MapUpdate TagMapper::process(const Keyframe& keyframe) {
  const std::vector<TagAnchor> tags = finder_.find(keyframe.images);
  if (tags.empty()) return mapper_.process(keyframe);
  Keyframe with_tags = keyframe;
  with_tags.anchors.insert(with_tags.anchors.end(), tags.begin(), tags.end());
  return mapper_.process(with_tags);
}

}  // namespace fbvins
