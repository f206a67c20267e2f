// SPDX-License-Identifier: Apache-2.0
// Finds the pose of a flight in M after a restart or in a loaded map: one recognised place may be a look-alike, so two keyframes
// must agree, or one must be beyond doubt (docs/derivations/loop.md, Where W lies now). One thread at a time.
//
//   Relocaliser relocaliser;
//   if (auto T_MG = relocaliser.consider(query, q_LG, T_MB, verified)) frame.reset(*T_MG, ...);
#pragma once

#include <optional>
#include <vector>

#include "fbvins/loop/place_map.hpp"
#include "fbvins/loop/place_verifier.hpp"

namespace fbvins {

class Relocaliser {
 public:
  /// A recognised place, or a tag by its number, puts the body of `query` at T_MB. Returns the pose of its gauge, level by
  /// `q_LG`, once that is certain. One tag alone never is: somebody may have hung it elsewhere.
  std::optional<Pose<M, G>> consider(const MapKeyframe& query, const Quat& q_LG, const Pose<M, B>& T_MB,
                                     const VerifiedPose& verified, int tag = kNoTag);
  void forget() { guesses_.clear(); }

 private:
  static constexpr int kNoTag = -1;
  struct Guess {
    Time t;
    int tag;
    Pose<M, G> T_MG;
  };
  std::vector<Guess> guesses_;
};

}  // namespace fbvins
