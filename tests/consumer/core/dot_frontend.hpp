// SPDX-License-Identifier: Apache-2.0
// A complete frontend as a user may write one: tracks round dots, each of which has its own grey value.
#pragma once

#include <array>
#include <fbvins/frontend/frontend.hpp>
#include <optional>

#include "../wall.hpp"

class DotFrontend final : public fbvins::Frontend {
 public:
  explicit DotFrontend(const fbvins::StereoRig& rig) : rig_(rig) {}

  fbvins::TrackedFrame process(const fbvins::SensorPacket& packet, const fbvins::StatePrior&) override {
    fbvins::TrackedFrame out;
    out.cameras = {packet.frame.left() != nullptr, packet.frame.right() != nullptr};
    if (!out.has(0) || !out.has(1)) return out;
    const auto left = dots_in(*packet.frame.left(), rig_.left()), right = dots_in(*packet.frame.right(), rig_.right());
    for (int dot = 0; dot < wall::kDots; ++dot) {
      const auto k = static_cast<std::size_t>(dot);
      if (!left[k]) continue;
      fbvins::TrackedFeature feature{fbvins::TrackId{dot}, packet.id.value > 0};
      feature.see(0, left[k]);
      feature.see(1, right[k]);
      out.features.push_back(feature);
      out.stats.stereo += right[k].has_value();
    }
    return out;
  }

 private:
  using Dots = std::array<std::optional<fbvins::Observation>, wall::kDots>;

  /// The centre of each dot that lies completely inside the image.
  static Dots dots_in(const fbvins::Image& image, const fbvins::Camera& camera) {
    constexpr double kWhole_px2 = 100, kSigma_px = 0.1;
    std::array<fbvins::Vec3, wall::kDots> sums;
    sums.fill(fbvins::Vec3::Zero());
    for (int v = 0; v < image.height(); ++v)
      for (int u = 0; u < image.width(); ++u)
        if (const int dot = image.at(u, v) - wall::kFirstDot; dot >= 0 && dot < wall::kDots)
          sums[static_cast<std::size_t>(dot)] += fbvins::Vec3(u, v, 1);
    Dots dots;
    for (std::size_t k = 0; k < dots.size(); ++k) {
      if (sums[k].z() < kWhole_px2) continue;
      fbvins::Observation observation;
      observation.pixel = sums[k].head<2>() / sums[k].z();
      observation.normalised = camera.undistort(observation.pixel).value();
      fbvins::Mat2 J_pixel_normalised;
      camera.distort(observation.normalised, &J_pixel_normalised);
      observation.sqrt_information = J_pixel_normalised / kSigma_px;
      dots[k] = observation;
    }
    return dots;
  }

  fbvins::StereoRig rig_;
};
