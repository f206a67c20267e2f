// SPDX-License-Identifier: Apache-2.0
// Strong integer ids: a TrackId cannot be passed where a FrameId is wanted.
#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace fbvins {

template <class Tag>
struct StrongId {
  std::int64_t value = -1;

  constexpr bool valid() const { return value >= 0; }
  constexpr auto operator<=>(const StrongId&) const = default;
};

using FrameId = StrongId<struct FrameTag>;  ///< a stereo image, counted from 0 in order of arrival
/// A feature followed over frames by the frontend. Once in a frame (frame_contract.hpp); the same in all images of a group of
/// cameras; never given to another feature, also after a restart. It stays when the other camera of the pair leads, and a
/// landmark that is re-observed comes back under it; the estimator keeps what it knows of the landmark under it, too.
using TrackId = StrongId<struct TrackTag>;
using LandmarkId = StrongId<struct LandmarkTag>;  ///< a 3-D point of the estimator
using KeyframeId = StrongId<struct KeyframeTag>;  ///< a frame that was chosen as keyframe

}  // namespace fbvins

template <class Tag>
struct std::hash<fbvins::StrongId<Tag>> {
  std::size_t operator()(fbvins::StrongId<Tag> id) const noexcept { return std::hash<std::int64_t>{}(id.value); }
};
