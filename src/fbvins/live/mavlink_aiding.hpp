// SPDX-License-Identifier: Apache-2.0
// A flight controller's rangefinder, optical flow and barometer as readings of aiding sensors. No threads, ports or clocks of its
// own: time is an argument.
//
//   MavlinkAiding aiding(options, mounting);
//   if (auto reading = aiding.read(frame.message, clock_offset, now)) use(*reading);      // on this machine's clock
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/mavlink/aiding_options.hpp"
#include "fbvins/mavlink/messages.hpp"
#include "fbvins/mavlink/mounting_options.hpp"
#include "fbvins/mavlink/wire.hpp"
#include "fbvins/types/aiding.hpp"

namespace fbvins {

class MavlinkAiding {
 public:
  MavlinkAiding(const MavlinkAidingOptions& options, const MountingOptions& mounting);

  /// Of the sensors that the options name. `offset`: the flight controller's clock less this machine's CLOCK_MONOTONIC, on which
  /// the reading is stamped. The sensors are taken to sit where the flight controller does.
  std::optional<AidingSample> read(const MavlinkMessage& message, Duration offset, Time now);
  /// Requests for messages that are wanted and have not come lately.
  std::vector<CommandMessage> requests(const MavlinkAddress& to, Time now);

 private:
  struct Wanted {
    std::uint32_t message = 0;
    bool wanted = false;
    Time newest{}, next_request{};
  };
  std::optional<AidingSample> as_reading(const MavlinkMessage& message, Time now_theirs) const;

  MavlinkAidingOptions options_;
  Pose<B, B> T_BF_;  ///< takes the vehicle's axes, forward-right-down, to B
  std::array<Wanted, 3> wanted_;
};

}  // namespace fbvins
