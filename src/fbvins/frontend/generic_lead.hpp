// SPDX-License-Identifier: Apache-2.0
// A frontend of any kind as one that can lead a pair (track_transfer.hpp): it gives no tracks to another and takes none, but
// begins anew. Synchronous; one instance is used by one thread at a time.
//
//   GenericLead lead(rig, [](const StereoRig& r) { return std::make_unique<MyFrontend>(r); });
#pragma once

#include "fbvins/frontend/any_rig.hpp"
#include "fbvins/frontend/track_transfer.hpp"

namespace fbvins {

class GenericLead final : public LeadingFrontend {
 public:
  GenericLead(const StereoRig& rig, FrontendOfPair make);

  TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) override;
  void locate(const LandmarkUpdate& update) override;
  void follow_at_most(int features) override;

  void stand_by(const SensorPacket&, const StatePrior&) override {}
  bool reaches(Time t) const override;
  void begin_ids_at(std::int64_t id) override;
  std::int64_t next_id() const override { return next_id_; }
  TrackTransfer hand_over() override;
  void take_over(TrackTransfer handover) override;

 private:
  /// From a track number of the frontend on.
  struct Numbering {
    std::int64_t own, outside;
  };

  void begin_anew();
  TrackId outside(TrackId own) const;
  std::optional<TrackId> own(TrackId outside) const;
  bool is_usable_feature(const TrackedFeature& feature) const;

  StereoRig rig_;
  FrontendOfPair make_;
  std::unique_ptr<Frontend> frontend_;
  int most_ = 0;                       ///< features; 0: as made
  Time newest_;                        ///< image that it was given
  std::vector<Numbering> numberings_;  ///< in order
  std::int64_t next_own_ = 0, next_id_ = 0;
};

}  // namespace fbvins
