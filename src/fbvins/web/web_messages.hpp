// SPDX-License-Identifier: Apache-2.0
// Private: messages to the pages, encoded once for all viewers (docs/web.md). Pure functions, any thread.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fbvins/live/live_event.hpp"
#include "fbvins/web/flight_history.hpp"
#include "fbvins/web/viewer_queue.hpp"

namespace fbvins {

/// Description of the flight, sent to a page first.
struct WebFlight {
  std::string program = "fbvins";  ///< with its version
  std::string source = {}, frontend = {};
  bool replay = false;    ///< a finished flight, in which a viewer may seek
  double duration_s = 0;  ///< of a replay
  bool can_mark = false;
  /// What viewers may ask of the flight: the command's name, and why this flight cannot do it (empty: it can).
  std::vector<std::pair<std::string, std::string>> commands = {};
  std::vector<PathPoint> whole_path{};  ///< of a replay
  std::optional<Quat> q_B_vehicle{};  ///< takes the vehicle's axes (forward, right, down) to the IMU's; none: they are not known
};

SharedMessage hello_message(const WebFlight& flight, Time start);
SharedMessage history_message(const FlightHistory& history);
SharedMessage state_message(double t_s, const Odometry& odometry, const LiveView* view, const FlightHistory& history);
SharedMessage status_message(double t_s, const LiveStatus& status, const LivePose& newest);
SharedMessage map_message(double t_s, const MapUpdate& update, int loops);
SharedMessage mark_message(const FlightMark& mark);
/// A sentence for people, such as the result of a command.
SharedMessage note_message(const std::string& text, bool bad);
/// A replay's time, and whether it is playing.
SharedMessage replay_message(double t_s, bool playing);
/// A replay has jumped: all that was sent of the flight is void, and follows again.
SharedMessage rewound_message();
SharedMessage end_message();

/// JPEG with the features of the same image; the size is that of the image before it was scaled down.
SharedMessage image_message(double t_s, std::string_view jpeg, int width_px, int height_px,
                            const std::vector<LiveView::Feature>& features, int camera = 0);
/// Replaces the window's landmarks, or (`cloud`) adds to those seen before.
SharedMessage points_message(double t_s, const std::vector<LiveView::Landmark>& points, bool cloud);

struct WebCommand {
  enum class Kind { mark, flight, seek, play, pause };
  Kind kind;
  std::string text = {};  ///< of a mark; name of a command to the flight
  double t_s = 0;         ///< of a seek
};
/// Nullopt for anything that is not a command.
std::optional<WebCommand> parse_command(std::string_view text);

}  // namespace fbvins
