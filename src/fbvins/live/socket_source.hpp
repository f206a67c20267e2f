// SPDX-License-Identifier: Apache-2.0
// Sensors of another process, over a Unix socket (docs/socket.md). One sender at a time; one that crashes, sends garbage or
// speaks another version is cut off with a sentence, and the next one goes on where it was.
//
//   auto source = SocketSource::open("/run/fbvins.sock", {.rig = *rig, .say = warn});
//   live.add_sink((*source)->status_sink());          // senders hear of the estimator's health
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
  /// Told in one sentence who comes and goes, and why; on the thread of open() and run().
  std::function<void(const std::string&)> say = [](const std::string&) {};
  /// Asked about ten times a second while open() waits: true ends it with an error.
  std::function<bool()> give_up = [] { return false; };
  /// A sender that has connected says hello in this time.
  double hello_s = 2;
};

class SocketSource final : public Source {
 public:
  static Result<std::unique_ptr<SocketSource>> open(const std::string& path, SocketOptions options);

  const StereoRig& rig() const override { return rig_; }
  Result<void> run(SensorInput& input) override;
  void stop() override;
  std::unique_ptr<Sink> status_sink() override;

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
  std::optional<FbvinsSocketRig> senders_rig_;  ///< where rig_ is a sender's
  std::shared_ptr<const Bell> bell_ = std::make_shared<const Bell>();
  std::shared_ptr<Report> report_;
  std::unique_ptr<SocketSession> session_;
  std::unique_ptr<SocketSession> leaving_;  ///< the last one that is over, until its goodbye is read
  Clock::time_point leaving_until_;
  bool backlog_ = false;            ///< the session has more to tell than its sender takes
  Clock::time_point accept_after_;  ///< no connection is taken before
  Clock::time_point next_;          ///< of the session: its hello is overdue then, or its next status due
  std::atomic<bool> stopped_ = false;
};

}  // namespace fbvins
