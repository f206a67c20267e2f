// SPDX-License-Identifier: Apache-2.0
// Sensors of another process, over a Unix socket (docs/socket.md). One sender at a time; one that crashes, sends garbage or
// has another version is disconnected with a sentence, and the next one may connect.
//
//   auto source = SocketSource::open("/run/fbvins/sensors.sock", {.rig = *rig, .say = warn});
//   live.add_sink((*source)->status_sink());          // senders get the estimator's health, and M
//   Result<void> end = (*source)->run(live.input());  // until stop()
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "fbvins/live/socket_file.hpp"
#include "fbvins/live/socket_session.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins {

struct SocketOptions {
  /// Without one open() waits for the first sender, whose calibration it takes; later senders must then have the same, or none.
  std::optional<StereoRig> rig = std::nullopt;
  /// Gets one sentence whenever a sender comes or goes; on the thread of open() and run().
  std::function<void(const std::string&)> say = [](const std::string&) {};
  /// Asked about ten times a second while open() waits: true ends it with an error.
  std::function<bool()> give_up = [] { return false; };
  /// Time in which a connected sender must send its hello.
  double hello_s = 2;
  std::string group = "";  ///< whose members may connect; empty: this program's user alone
};

class SocketSource final : public Source {
 public:
  static Result<std::unique_ptr<SocketSource>> open(const std::string& path, SocketOptions options);

  const StereoRig& rig() const override { return rig_; }
  Result<void> run(SensorInput& input) override;
  void stop() override;
  std::unique_ptr<Sink> status_sink() override;
  std::vector<SensorFinding> device_findings() const override {
    return device_ ? fbvins::device_findings(*device_, rig_) : std::vector<SensorFinding>{};
  }

 private:
  using Clock = std::chrono::steady_clock;
  struct Report;
  class StatusSink;
  SocketSource(SocketFile file, SocketOptions options);
  Result<void> wait_for_rig();
  void step(Clock::duration longest, SensorInput* input);
  void accept();
  void greet(bool begin);
  void check_hello();
  void serve(SensorInput& input);
  void send_status();
  void let_go();
  void linger(std::unique_ptr<SocketSession> refused);
  void say(const std::string& what) { options_.say(file_.path() + ": " + what); }

  SocketFile file_;
  SocketOptions options_;
  StereoRig rig_;
  bool rig_known_ = false;
  std::optional<SocketRig> senders_rig_;  ///< where rig_ was taken from a sender
  std::shared_ptr<const WakeEvent> wake_ = std::make_shared<const WakeEvent>();
  std::shared_ptr<Report> report_;
  std::unique_ptr<SocketSession> session_;
  std::optional<DeviceFacts> device_;       ///< as a sender has last said
  std::unique_ptr<SocketSession> leaving_;  ///< the last session that ended, kept open until its goodbye has been read
  Clock::time_point leaving_until_;
  bool backlog_ = false;            ///< a message waits because the sender does not read
  Clock::time_point accept_after_;  ///< no connection is accepted before
  Clock::time_point next_;          ///< the session's deadline for its hello, then the time of its next status
  std::atomic<bool> stopped_ = false;
};

}  // namespace fbvins
