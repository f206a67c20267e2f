// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/px4_process.hpp"

#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <filesystem>
#include <vector>

#include "fbvins/flight/loopback_port.hpp"

namespace fbvins {
namespace {

// PX4's ports for instance 0; add the instance's number.
constexpr int kSimulatorPort = 4560, kCompanionPort = 14580, kInstances = 9;
constexpr MavlinkAddress kSimulator{1, 51};
constexpr int kConnect_ms = 30'000;
/// In wall time: while its modules start PX4 does not answer, later it always does.
constexpr int kStarting_ms = 5, kAnswer_ms = 5'000;

/// The first instance with free ports, and the listening socket of its simulator.
std::pair<int, FileDescriptor> free_instance() {
  for (int instance = 0; instance < kInstances; ++instance) {
    FileDescriptor listener = bound_to_loopback(SOCK_STREAM, kSimulatorPort + instance);
    if (!listener || !bound_to_loopback(SOCK_DGRAM, kCompanionPort + instance) || ::listen(listener.number(), 1) != 0) continue;
    return {instance, std::move(listener)};
  }
  return {-1, FileDescriptor()};
}

std::vector<std::string> environment(const Px4Parameters& parameters) {
  std::vector<std::string> all = environment_without("PX4_");
  all.insert(all.end(), {"PX4_SIM_MODEL=none_iris", "HEADLESS=1"});
  for (const auto& [name, value] : parameters) all.push_back(fmt::format("PX4_PARAM_{}={}", name, value));
  return all;
}

}  // namespace

Result<std::unique_ptr<Px4Process>> Px4Process::start(const std::string& binary, const std::string& folder,
                                                      const Px4Parameters& parameters) {
  std::error_code missing;
  const std::string program = std::filesystem::canonical(binary, missing).string();
  if (missing || access(program.c_str(), X_OK) != 0)
    return Error{ErrorCode::invalid_argument, fmt::format("{}: there is no PX4 executable", binary)};
  auto [instance, listener] = free_instance();
  if (instance < 0) return Error{ErrorCode::invalid_argument, "all ports of PX4's simulator (4560 to 4568) are in use"};
  std::unique_ptr<Px4Process> px4(new Px4Process(instance, std::filesystem::absolute(folder).string()));
  if (Result<void> done = px4->launch(program, parameters); !done) return done.error();
  if (Result<void> done = px4->accept_simulator(listener); !done) return done.error();
  return px4;
}

Result<void> Px4Process::launch(const std::string& binary, const Px4Parameters& parameters) {
  const std::string etc = (std::filesystem::path(binary).parent_path().parent_path() / "etc").string();
  return child_.start({{binary, "-d", "-i", std::to_string(instance_), "-w", folder_, etc},
                       environment(parameters),
                       folder_,
                       folder_ + "/px4.log"});
}

Result<void> Px4Process::accept_simulator(const FileDescriptor& listener) {
  if (!readable(listener.number(), kConnect_ms)) return ended();
  simulator_ = FileDescriptor(accept4(listener.number(), nullptr, nullptr, SOCK_CLOEXEC));
  if (!simulator_) return ended();
  const int yes = 1;
  setsockopt(simulator_.number(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  return {};
}

Error Px4Process::ended() const {
  return {ErrorCode::unreadable, fmt::format("PX4 does not answer any more; its output is in {}/px4.log", folder_)};
}

std::uint16_t Px4Process::companion_port() const { return static_cast<std::uint16_t>(kCompanionPort + instance_); }

Result<void> Px4Process::step(const HilSensorMessage& reading) {
  const std::vector<std::uint8_t> frame = encode_mavlink(reading, kSimulator, sequence_++);
  if (send(simulator_.number(), frame.data(), frame.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(frame.size())) return ended();
  bool answered = false;
  while (!answered && readable(simulator_.number(), awake_ ? kAnswer_ms : kStarting_ms)) {
    std::array<std::uint8_t, 4096> bytes{};
    const ssize_t size = recv(simulator_.number(), bytes.data(), bytes.size(), 0);
    if (size <= 0) return ended();
    for (const MavlinkFrame& got : decoder_.push(std::span(bytes).first(static_cast<std::size_t>(size)))) {
      if (const auto* controls = std::get_if<HilActuatorControlsMessage>(&got.message)) {
        controls_ = controls->controls;
        answered = controls->time_usec >= reading.time_usec;
        awake_ = true;
      }
    }
  }
  if (awake_ && !answered) return ended();
  return {};
}

}  // namespace fbvins
