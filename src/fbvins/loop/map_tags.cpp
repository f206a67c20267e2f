// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_tags.hpp"

#include <algorithm>

#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

/// On the way of one session: less is one pass before the tag.
constexpr double kOnePass_m = 3;
constexpr std::ptrdiff_t kMostOfATag = 12;
/// No view of a tag is more certain: size and lens err by as much. And views from near one another err alike.
constexpr double kFloor_m = 0.003, kFloor_rad = 0.003, kInflation = 2;

Pose<B, B> as_body(const Pose<B, Tag>& T) { return {T.q, T.p}; }

/// Of (dp in the left frame, dtheta in the right one), as everywhere.
Mat6 of_inverse(const Pose<B, B>& T, const Mat6& covariance) {
  Mat6 J = Mat6::Zero();
  J.topLeftCorner<3, 3>() = -T.R().transpose();
  J.topRightCorner<3, 3>() = hat(T.inverse().p);
  J.bottomRightCorner<3, 3>() = -T.R();
  return J * covariance * J.transpose();
}

Mat6 floored(Mat6 covariance) {
  covariance.diagonal().head<3>().array() += kFloor_m * kFloor_m;
  covariance.diagonal().tail<3>().array() += kFloor_rad * kFloor_rad;
  return kInflation * covariance;
}

bool one_pass(const PlaceMap& map, const MapTag& a, const MapTag& b) {
  const MapKeyframe &k = *map.find(a.keyframe), &l = *map.find(b.keyframe);
  return a.id == b.id && k.session == l.session && std::abs(k.path_m - l.path_m) < kOnePass_m;
}

double uncertainty(const MapTag& tag) { return tag.covariance.topLeftCorner<3, 3>().trace(); }

}  // namespace

MapTag carried(MapTag tag, KeyframeId other, const Pose<B, B>& T_other_this, const Mat6& covariance) {
  tag.covariance = compose_covariance(T_other_this, covariance, as_body(tag.T_BT), tag.covariance);
  tag.covariance = 0.5 * (tag.covariance + tag.covariance.transpose()).eval();
  tag.T_BT = T_other_this * tag.T_BT;
  tag.keyframe = other;
  return tag;
}

MapEdge tag_edge(const MapTag& before, const MapTag& now) {
  const Pose<B, B> T_aT = as_body(before.T_BT), T_bT = as_body(now.T_BT);
  const Mat6 covariance =
      compose_covariance(T_aT, floored(before.covariance), T_bT.inverse(), of_inverse(T_bT, floored(now.covariance)));
  const Mat6 information = inverted(covariance);
  return {before.keyframe,     now.keyframe, T_aT * T_bT.inverse(), 0.5 * (information + information.transpose()),
          MapEdge::Kind::loop, nullptr};
}

std::vector<const MapTag*> tags_before(const PlaceMap& map, const MapTag& now) {
  std::vector<const MapTag*> out;
  for (auto tag = map.tags.rbegin(); tag != map.tags.rend(); ++tag)
    if (tag->id == now.id && map.find(tag->keyframe)->placed && !one_pass(map, *tag, now)) out.push_back(&*tag);
  return out;
}

void remember_tag(PlaceMap& map, MapTag now) {
  const auto pass = std::ranges::find_if(map.tags, [&](const MapTag& tag) { return one_pass(map, tag, now); });
  if (pass != map.tags.end()) {
    if (uncertainty(now) < uncertainty(*pass)) *pass = std::move(now);
    return;
  }
  const int id = now.id;
  map.tags.push_back(std::move(now));
  if (std::ranges::count(map.tags, id, &MapTag::id) > kMostOfATag) map.tags.erase(std::ranges::find(map.tags, id, &MapTag::id));
}

}  // namespace fbvins
