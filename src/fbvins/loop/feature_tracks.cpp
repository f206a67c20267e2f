// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/feature_tracks.hpp"

#include <algorithm>
#include <numeric>

namespace fbvins {
namespace {

/// Pairs of keyframes (earlier, later) worth matching, in order and once each.
std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const PlaceMap& map, int neighbours) {
  const std::vector<MapKeyframe>& k = map.keyframes();
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < k.size(); ++i)
    for (std::size_t j = i + 1; j < k.size() && j <= i + static_cast<std::size_t>(neighbours); ++j)
      if (k[i].session == k[j].session) pairs.emplace_back(i, j);
  for (const MapEdge& e : map.edges)
    pairs.push_back(
        std::minmax(static_cast<std::size_t>(map.find(e.from) - k.data()), static_cast<std::size_t>(map.find(e.to) - k.data())));
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  std::erase_if(pairs, [&](const auto& p) { return !k[p.first].placed || !k[p.second].placed; });
  return pairs;
}

/// Sets of features that matches have joined; a union that would give a keyframe two features of a set is refused.
class Chains {
 public:
  explicit Chains(const PlaceMap& map) {
    for (std::size_t i = 0; i < map.size(); ++i) {
      first_.push_back(views_.size());
      for (std::size_t f = 0; f < map.keyframes()[i].place.size(); ++f) views_.push_back({{i, f}});
    }
    parent_.resize(views_.size());
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }

  void join(FeatureView a, FeatureView b) {
    std::size_t ra = root(first_[a.keyframe] + a.feature), rb = root(first_[b.keyframe] + b.feature);
    if (ra == rb || share_a_keyframe(views_[ra], views_[rb])) return;
    if (views_[ra].size() < views_[rb].size()) std::swap(ra, rb);
    FeatureTrack both;
    std::merge(views_[ra].begin(), views_[ra].end(), views_[rb].begin(), views_[rb].end(), std::back_inserter(both), earlier);
    views_[ra] = std::move(both);
    views_[rb] = {};
    parent_[rb] = ra;
  }

  std::vector<FeatureTrack> take() {
    std::erase_if(views_, [](const FeatureTrack& t) { return t.size() < 2; });
    return std::move(views_);
  }

 private:
  static bool earlier(const FeatureView& a, const FeatureView& b) { return a.keyframe < b.keyframe; }

  static bool share_a_keyframe(const FeatureTrack& a, const FeatureTrack& b) {
    for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
      if (i->keyframe == j->keyframe) return true;
      if (i->keyframe < j->keyframe) ++i;
      else ++j;
    }
    return false;
  }

  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  std::vector<std::size_t> first_, parent_;
  std::vector<FeatureTrack> views_;
};

}  // namespace

std::vector<FeatureTrack> feature_tracks(const PlaceMap& map, const PlaceVerifierOptions& matching, int neighbours,
                                         double radius_px) {
  Chains chains(map);
  PlaceVerifier verifier(matching);
  const MapKeyframe* query = nullptr;
  auto pairs = pairs_of(map, neighbours);
  // By the later keyframe, so that its features are sorted into cells once.
  std::stable_sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  for (const auto& [earlier, later] : pairs) {
    const MapKeyframe &a = map.keyframes()[earlier], &b = map.keyframes()[later];
    if (query != &b) query = &b, verifier.set_query(b.place);
    const CameraFromCamera T_ba = map.T_MC(b).inverse() * map.T_MC(a);
    const auto found = verifier.verify(a.place, {T_ba, radius_px});
    if (!found) continue;
    for (const DescriptorMatch& m : found->pose.inliers)
      chains.join({earlier, static_cast<std::size_t>(m.b)}, {later, static_cast<std::size_t>(m.a)});
  }
  return chains.take();
}

}  // namespace fbvins
