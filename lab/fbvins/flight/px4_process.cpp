// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/px4_process.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <thread>
#include <vector>

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX has no header that declares it

namespace fbvins {
namespace {

// PX4's ports for instance 0; add the instance's number.
constexpr int kSimulatorPort = 4560, kCompanionPort = 14580, kInstances = 9;
constexpr MavlinkAddress kSimulator{1, 51};
constexpr int kConnect_ms = 30'000;
/// In wall time: while its modules start PX4 does not answer, later it always does.
constexpr int kStarting_ms = 5, kAnswer_ms = 5'000;
constexpr std::chrono::milliseconds kStop{3'000}, kLook{10};

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

FileDescriptor bound(int type, int port) {
  FileDescriptor fd(socket(AF_INET, type | SOCK_CLOEXEC, 0));
  const int yes = 1;
  if (type == SOCK_STREAM) setsockopt(fd.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const sockaddr_in address = loopback(port);
  if (!fd || bind(fd.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return {};
  return fd;
}

/// The first instance with free ports, and the listening socket of its simulator.
std::pair<int, FileDescriptor> free_instance() {
  for (int instance = 0; instance < kInstances; ++instance) {
    FileDescriptor listener = bound(SOCK_STREAM, kSimulatorPort + instance);
    if (!listener || !bound(SOCK_DGRAM, kCompanionPort + instance) || ::listen(listener.number(), 1) != 0) continue;
    return {instance, std::move(listener)};
  }
  return {-1, FileDescriptor()};
}

std::vector<std::string> environment(const Px4Parameters& parameters) {
  std::vector<std::string> all{"PX4_SIM_MODEL=none_iris", "HEADLESS=1"};
  for (char** entry = environ; *entry != nullptr; ++entry)
    if (std::strncmp(*entry, "PX4_", 4) != 0) all.emplace_back(*entry);
  for (const auto& [name, value] : parameters) all.push_back(fmt::format("PX4_PARAM_{}={}", name, value));
  return all;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  for (std::string& text : texts) all.push_back(text.data());
  all.push_back(nullptr);
  return all;
}

bool readable(int fd, int timeout_ms) {
  pollfd state{fd, POLLIN, 0};
  return ::poll(&state, 1, timeout_ms) > 0;
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
  const std::string log = folder_ + "/px4.log";
  const FileDescriptor file(open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)),
      nothing(open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (!file) return Error{ErrorCode::unwritable, fmt::format("{}: {}", log, std::strerror(errno))};
  const std::string etc = (std::filesystem::path(binary).parent_path().parent_path() / "etc").string();
  std::vector<std::string> words{binary, "-d", "-i", std::to_string(instance_), "-w", folder_, etc},
      settings = environment(parameters);
  const std::vector<char*> arguments = pointers(words), variables = pointers(settings);
  pid_ = fork();
  if (pid_ == 0) {  // only calls that are safe between fork and exec
#ifdef __linux__
    prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
    dup2(nothing.number(), STDIN_FILENO);
    dup2(file.number(), STDOUT_FILENO);
    dup2(file.number(), STDERR_FILENO);
    execve(arguments[0], arguments.data(), variables.data());
    _exit(127);
  }
  if (pid_ < 0) return Error{ErrorCode::unreadable, fmt::format("{}: {}", binary, std::strerror(errno))};
  return {};
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

Px4Process::~Px4Process() {
  if (pid_ <= 0) return;
  kill(pid_, SIGTERM);
  const auto last = std::chrono::steady_clock::now() + kStop;
  while (waitpid(pid_, nullptr, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > last) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
      return;
    }
    std::this_thread::sleep_for(kLook);
  }
}

}  // namespace fbvins
