// SPDX-License-Identifier: Apache-2.0
// Where a live system's results go: a file, a flight controller, a page. One class a destination:
//
//   struct Printer final : Sink {
//     std::string_view name() const override { return "printer"; }
//     Result<void> take(const LiveEvent& event) override {
//       if (const auto* pose = std::get_if<LivePose>(&event)) fmt::print("{}\n", pose->T_WB.p.transpose());
//       return {};
//     }
//   };
//
// Threads: each sink is called on a thread of its own, for which the estimator never waits. A sink that is slower than the
// events loses the oldest of those that wait for it (Hub).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/live/live_event.hpp"

namespace fbvins {

class Sink {
 public:
  virtual ~Sink() = default;
  /// For messages: "mavlink udp:127.0.0.1:14540".
  virtual std::string_view name() const = 0;
  /// The first error is reported in the status, and is the result of LiveSystem::finish(); later events still come.
  virtual Result<void> take(const LiveEvent& event) = 0;
  /// Asked with every image, on the estimator's thread: whether it wants a LiveView of it. Each costs that thread some ten
  /// microseconds.
  virtual bool wants_views() const { return false; }
  /// A problem that may pass, such as an unplugged cable, in one sentence for the status. Empty: none. From any thread, the
  /// estimator's among them, and without waiting for a disk or a network, whatever take() is doing.
  virtual std::string problem() const { return {}; }
  /// For displays, asked once a second and when health changes. As problem().
  virtual std::vector<OutputFigure> figures() const { return {}; }
  /// The last call: close what is open.
  virtual Result<void> finish() { return {}; }
};

}  // namespace fbvins
