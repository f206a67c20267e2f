// SPDX-License-Identifier: Apache-2.0
// Reports the flight's state to the service manager by systemd's notification protocol (sd_notify(3): one datagram a message, to
// the socket that NOTIFY_SOCKET names): readiness, a line for `systemctl status`, and the watchdog's keep-alive. A hung estimator
// gives no keep-alive, so that the manager restarts the program; silent sensors are no reason to.
// The journal gets a line when health or problem changes, at most one a second, with its level as a prefix (sd-daemon(3)).
#pragma once

#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/live/sink.hpp"

namespace fbvins {

class ServiceSink final : public Sink {
 public:
  /// `address`: NOTIFY_SOCKET's value, a path, or @ and a name of Linux' abstract namespace. `journal` stays the caller's.
  static Result<std::unique_ptr<ServiceSink>> create(const std::string& address, std::FILE* journal);

  std::string_view name() const override { return "service manager"; }
  Result<void> take(const LiveEvent& event) override;
  Result<void> finish() override;

 private:
  ServiceSink(FileDescriptor socket, std::string address, std::FILE* journal)
      : socket_(std::move(socket)), address_(std::move(address)), journal_(journal) {}
  bool estimator_lives(const LiveStatus& status);
  Result<void> send(const std::string& message) const;
  void log(const LiveStatus& status, const std::string& sentence);

  FileDescriptor socket_;
  std::string address_;
  std::FILE* journal_;
  std::string logged_;
  Time logged_at_;  // CLOCK_MONOTONIC
  bool ready_ = false;
  std::int64_t images_ = 0, answers_ = 0;  // images and answers when the estimator was last known to run
  std::optional<Time> waits_since_;        // CLOCK_MONOTONIC
};

}  // namespace fbvins
