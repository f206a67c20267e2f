// SPDX-License-Identifier: Apache-2.0
// Poses to a flight controller over MAVLink 2 (docs/px4.md).
//
//   auto sink = MavlinkSink::create("udp:127.0.0.1:14580", MavlinkOptions{});
//   if (!sink) return report(sink.error().message);
//   live.add_sink(std::move(*sink));
//
// Threads: take() hands the event to the sink's own thread and returns. Unplugged cables, full queues and a silent flight
// controller block nobody.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "fbvins/live/mavlink_options.hpp"
#include "fbvins/live/sink.hpp"
#include "fbvins/types/aiding.hpp"

namespace fbvins {

/// State of the connection, and counts since the start.
struct MavlinkLinkState {
  bool connected = false;          ///< the port is open
  bool flight_controller = false;  ///< heard within the last three seconds
  bool clock_known = false;        ///< its clock is known, and was confirmed lately
  double clock_offset_s = 0;       ///< its clock less CLOCK_MONOTONIC
  double round_trip_ms = 0;        ///< of the requests that compare the clocks, median of the newest; 0: not known
  std::int64_t poses_sent = 0, frames_sent = 0, frames_dropped = 0, frames_received = 0;
  std::int64_t poses_withheld = 0;   ///< due while the flight controller's clock was not sure
  std::int64_t frames_refused = 0;   ///< not signed with the key
  std::int64_t packets_refused = 0;  ///< UDP packets of others than the flight controller
  int times_opened = 0;
  std::int64_t readings = 0;  ///< of its sensors that are used
  std::string problem;        ///< one sentence while the port is not open, no poses can be sent or strangers send packets
};

class MavlinkSink final : public Sink {
 public:
  /// `udp:HOST:PORT`, `udp:HOST:PORT:OWN_PORT` (HOST: an IPv4 address or localhost) or `serial:DEVICE:BAUD`. An error says
  /// what is wrong with the address, the options or the key; a device that is not there is waited for.
  static Result<std::unique_ptr<MavlinkSink>> create(const std::string& address, const MavlinkOptions& options);
  ~MavlinkSink() override;

  std::string_view name() const override;
  Result<void> take(const LiveEvent& event) override;
  std::string problem() const override;
  std::vector<OutputFigure> figures() const override;
  Result<void> finish() override;
  MavlinkLinkState state() const;
  /// Called on the sink's own thread with each reading of the sensors that the options name, stamped on CLOCK_MONOTONIC. From any
  /// thread, but not from the callback.
  void on_reading(std::function<void(const AidingSample&)> callback);

 private:
  struct Impl;
  explicit MavlinkSink(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fbvins
