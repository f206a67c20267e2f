// SPDX-License-Identifier: Apache-2.0
// A frontend that survives the loss of either camera. The left camera leads: features are followed in its images, and found again
// in the right ones. While its images do not come, the right one leads: the same frontend for the mirrored rig goes on with the
// tracks that both cameras saw. When both deliver again the left one takes the lead back, with its own tracks after a short gap,
// with the right one's after a longer one. Both use one numbering of tracks.
// Synchronous; one instance is used by one thread at a time.
//
//   EitherCamera frontend(rig, std::make_unique<KltFrontend>(rig, options), std::make_unique<KltFrontend>(mirrored(rig),
//   options));
#pragma once

#include <memory>

#include "fbvins/frontend/track_transfer.hpp"

namespace fbvins {

/// The rig with left and right exchanged.
StereoRig mirrored(const StereoRig& rig);

class EitherCamera final : public Frontend {
 public:
  /// `right`: for the mirrored rig.
  EitherCamera(const StereoRig& rig, std::unique_ptr<LeadingFrontend> left, std::unique_ptr<LeadingFrontend> right);

  TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) override;
  void locate(const LandmarkUpdate& update) override;
  void follow_at_most(int features) override { left_->follow_at_most(features), right_->follow_at_most(features); }

 private:
  void choose(const StereoFrame& frame);
  void lead_with(bool right);

  Camera left_camera_, right_camera_;
  std::unique_ptr<LeadingFrontend> left_, right_;
  bool right_leads_ = false;
};

}  // namespace fbvins
