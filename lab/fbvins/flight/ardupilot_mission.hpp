// SPDX-License-Identifier: Apache-2.0
// A mission that an ArduCopter flies: it is told where its origin is (it has no GPS), put into GUIDED, armed and sent a take-off;
// once it is in the air it follows the mission's setpoints, and at the end it gets NAV_LAND. When there are no poses any more it
// is told to use its second set of sources and to land. See companion_mission.hpp.
#pragma once

#include "fbvins/flight/companion_mission.hpp"

namespace fbvins {

class ArduPilotMission final : public CompanionMission {
 public:
  /// `ahead_s`: ArduPilot's clock minus `now_s`.
  ArduPilotMission(const Mission& mission, double rate_hz, int system_id, double ahead_s)
      : CompanionMission(mission, rate_hz, system_id, "ArduPilot"), ahead_s_(ahead_s) {}

 private:
  void hear(const MavlinkFrame& frame, double now_s) override;
  void prepare(double now_s) override;
  void use_poses(bool use, double now_s) override;
  bool follows(std::uint32_t mode) const override;
  bool lands(std::uint32_t mode) const override;
  std::string mode_name(std::uint32_t mode) const override;
  bool streams_early() const override { return false; }

  void hear_position(const LocalPositionMessage& position, double now_s);
  void ask_for_estimate(double now_s);
  void leave_the_ground(double now_s);

  double ahead_s_;
  std::optional<AttitudeQuaternionMessage> attitude_;
  std::optional<LocalPositionMessage> position_;
  double next_origin_s_ = 0, next_take_off_s_ = 0;
  std::optional<double> standing_z_m_;  ///< z of N
};

}  // namespace fbvins
