// SPDX-License-Identifier: Apache-2.0
#include "apps/live_outputs.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "apps/imu_state.hpp"
#include "apps/live_files.hpp"
#include "apps/terminal.hpp"
#include "apps/web_page.hpp"
#include "fbvins/config/config_file.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/live/mavlink_sink.hpp"
#include "fbvins/live/service_sink.hpp"
#include "fbvins/live/status_sink.hpp"
#include "fbvins/mavlink/vehicle_frames.hpp"

namespace fbvins::app {
namespace {

void go_on_without(const char* name, const Error& error, LiveSystem& live, Troubles& troubles) {
  troubles.add(error);
  live.add_sink(std::make_unique<MissingOutput>(name, error.message));
}

void add_record(const OutputArguments& arguments, LiveFlight& flight, LiveSystem& live, Troubles& troubles) {
  const FlightRecordOptions options{
      .program = "fbvins " FBVINS_VERSION, .configuration = to_yaml(flight.config), .images = arguments.record_images};
  const RecordSpace space{.keep_free_bytes = static_cast<std::uint64_t>(arguments.record_keep_free_mb * 1e6)};
  auto record = std::make_unique<RecordSwitch>(
      [=, path = arguments.record, rig = flight.source.rig()] { return RecordSink::create_next(path, rig, options, space); });
  flight.record = record.get();
  if (!arguments.record_on_request) {
    const Result<std::string> begun = record->start();
    if (!begun) troubles.add(begun.error());  // the status says it, too
    else if (*begun != arguments.record)
      note(fmt::format("{} exists already; this flight's record is {}", arguments.record, *begun));
  }
  live.add_sink(std::move(record));
}

/// It also wants to see the frontend's frames.
void add_files(const OutputArguments& arguments, const LiveFlight& flight, LiveSystem& live, Troubles& troubles) {
  if (Result<void> made = make_folders(arguments.out); !made) return go_on_without("files", made.error(), live, troubles);
  auto files = LiveFiles::create(arguments.out, flight.map.wanted(), flight.map.load.empty());
  if (!files) return go_on_without("files", files.error(), live, troubles);
  live.on_tracked_frame([to = files->get()](const TrackedFrame& frame) { to->add(frame); });
  live.add_sink(std::move(*files));
}

/// How the IMU sits on the vehicle, where the configuration says so.
std::optional<Quat> vehicle_axes(const MountingOptions& options) {
  const MountingOptions usual;
  const bool told = options.imu_axes != usual.imu_axes || options.roll_rad != 0 || options.pitch_rad != 0 || options.yaw_rad != 0;
  return told ? std::optional(mounting(options).q.conjugate()) : std::nullopt;
}

}  // namespace

void OutputArguments::add_to(CLI::App& command) {
  command.add_option("--out", out, "folder for the results; without it no files are written");
  command
      .add_option("--mavlink", mavlink,
                  "a flight controller to send poses to, udp:HOST:PORT[:OWN_PORT] or serial:DEVICE:BAUD; may be repeated")
      ->take_all()
      ->allow_extra_args(false);
  command
      .add_option("--reset-counter", reset_counter,
                  "file that keeps the reset counter from process to process, so that a flight controller notices the new frame")
      ->take_last();
  command.add_option("--web", web, kWebHelp);
  command.add_option("--record", record,
                     "MCAP file for the flight record, or the next number where it exists; it is a recording for fbvins run");
  command
      .add_option("--record-keep-free", record_keep_free_mb,
                  "MB of its disk that the record leaves free for maps; it ends before")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      .add_flag("--record-on-request", record_on_request,
                "do not begin the record with the flight, but when start_record is called (docs/ros2.md)")
      ->needs("--record");
  command.add_flag("!--record-no-images", record_images, "leave images out of the record, which cannot be run again then");
  command.add_flag("--quiet", quiet, "print nothing but errors and warnings");
}

void Troubles::add(const Error& error) {
  (void)fail(error.message);
  any_ = true;
}

Result<void> add_outputs(const OutputArguments& arguments, LiveFlight& flight, LiveSystem& live, LiveTotals& totals,
                         Troubles& troubles) {
  live.add_sink(totals.make_sink(flight.source.rig().time_offset_s));
  if (!arguments.record.empty()) add_record(arguments, flight, live, troubles);
  if (const char* address = std::getenv("NOTIFY_SOCKET")) {
    auto sink = ServiceSink::create(address, stderr);
    if (sink) live.add_sink(*std::move(sink));
    else troubles.add(sink.error());
  } else if (!arguments.quiet) {
    live.add_sink(std::make_unique<StatusSink>(stdout));
  }
  if (!arguments.mavlink.empty() && flight.config.live.mavlink.mounting.local_frame == LocalOrigin::map && !flight.map.wanted())
    return Error{ErrorCode::invalid_argument, "live.mavlink.mounting.local_frame=map needs a map: --map FILE, or --loop"};
  for (const std::string& address : arguments.mavlink) {
    auto sink = MavlinkSink::create(address, flight.config.live.mavlink);
    if (!sink) return sink.error();
    if (flight.config.live.mavlink.sensors.any())
      (*sink)->on_reading([&live](const AidingSample& reading) { live.push_of_host(reading); });
    live.add_sink(*std::move(sink));
  }
  if (!arguments.out.empty()) add_files(arguments, flight, live, troubles);
  return {};
}

Result<void> add_page(const std::string& where, const LiveFlight& flight, LiveSystem& live) {
  if (where.empty()) return {};
  auto page = open_live_page({.where = where,
                              .source = flight.source_name,
                              .frontend = flight.config.frontend.kind,
                              .q_B_vehicle = vehicle_axes(flight.config.live.mavlink.mounting),
                              .mark = [&live](std::string text) { live.mark(std::move(text)); },
                              .commands = flight_commands(flight, live)});
  if (!page) return page.error();
  live.add_sink(std::move(page->sink));
  return page->begin();
}

std::optional<ImuState> imu_state_for_flight(const std::string& file, const ImuNoise& imu) {
  const auto state = load_imu_state(file, imu);
  if (state) return *state;
  const Result<std::string> aside = set_aside(file);
  warn(fmt::format("{}; {}", state.error().message,
                   aside ? fmt::format("it is kept as {}, and the flight begins without", *aside) : aside.error().message));
  return std::nullopt;
}

}  // namespace fbvins::app
