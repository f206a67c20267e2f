// SPDX-License-Identifier: Apache-2.0
// A mission that a PX4 flies: it is sent setpoints where it stands, asked for OFFBOARD and armed; at the end it gets NAV_LAND.
// When poses stop its own failsafe lands. See companion_mission.hpp.
#pragma once

#include "fbvins/flight/companion_mission.hpp"

namespace fbvins {

class Px4Mission final : public CompanionMission {
 public:
  /// `ahead_s`: PX4's clock minus `now_s`.
  Px4Mission(const Mission& mission, double rate_hz, int system_id, double ahead_s)
      : CompanionMission(mission, rate_hz, system_id, "PX4"), ahead_s_(ahead_s) {}

 private:
  void hear(const MavlinkFrame& frame, double now_s) override;
  void prepare(double now_s) override;
  bool follows(std::uint32_t mode) const override;
  bool lands(std::uint32_t mode) const override;
  std::string mode_name(std::uint32_t mode) const override;
  bool streams_early() const override { return true; }

  double ahead_s_;
  std::optional<std::uint8_t> ekf_resets_;
};

}  // namespace fbvins
