// SPDX-License-Identifier: Apache-2.0
// What one frontend gives another that goes on with the other camera: the tracks that both cameras saw in the newest image, as
// the other camera saw them, and that camera's image, from which they are followed on.
//
//   right.take_over(left.hand_over());          // the left camera's images do not come: the right one leads
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/features/hamming.hpp"
#include "fbvins/features/pyramid.hpp"
#include "fbvins/frontend/frontend.hpp"
#include "fbvins/frontend/track_table.hpp"

namespace fbvins {

/// A track in the camera that leads from now on.
struct TransferredTrack {
  TrackId id;
  Vec2 px = Vec2::Zero(), normalised = Vec2::Zero();
  double inverse_depth = 0;  ///< 1/m along that camera's z
  // of the orb frontend:
  int age_frames = 0;
  Descriptor descriptor = {}, raw = {};
  int level = 0;
  std::optional<Vec3> seen_from_G, p_G;
};

struct TrackTransfer {
  Time t;         ///< of the image
  Pyramid image;  ///< of the camera that leads from now on; empty if it had none, and there are no tracks then
  std::vector<TransferredTrack> tracks;
  std::int64_t next_id = 0;  ///< of the next new track
};

/// A frontend that follows the first camera of its rig, whichever that is, and measures depth with the second.
class LeadingFrontend : public Frontend {
 public:
  /// Another one follows this image.
  virtual void stand_by(const SensorPacket& packet, const StatePrior& prior) = 0;
  /// Whether its tracks can be followed to an image at this time.
  virtual bool reaches(Time t) const = 0;
  /// Ids below this are another's.
  virtual void begin_ids_at(std::int64_t id) = 0;
  virtual std::int64_t next_id() const = 0;
  /// Ends the use of the second camera's newest image, which moves out.
  virtual TrackTransfer hand_over() = 0;
  /// Instead of its own tracks.
  virtual void take_over(TrackTransfer handover) = 0;
};

/// The track as the second camera sees it; nothing where it does not, or the depth is unknown.
inline std::optional<TransferredTrack> seen_by_second(const TrackState& track, const Pose<C1, C0>& T_C1C0) {
  if (!track.observed || track.status != TrackStatus::active || !track.right || !track.inverse_depth) return std::nullopt;
  const double rho = *track.inverse_depth;
  const double scaled_depth = (T_C1C0.q * track.normalised.homogeneous() + rho * T_C1C0.p).z();
  if (!(scaled_depth > 0)) return std::nullopt;
  TransferredTrack handed;
  handed.id = track.id;
  handed.px = track.right->pixel;
  handed.normalised = track.right->normalised;
  handed.inverse_depth = rho / scaled_depth;
  handed.age_frames = track.age_frames;
  return handed;
}

}  // namespace fbvins
