// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/service_sink.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <system_error>

#include "fbvins/io/flight_record.hpp"

namespace fbvins {
namespace {

// The longest processing of one image, a restart or a loop, takes a tenth of this on a small board.
constexpr Duration kHungAfter{3'000'000'000};
constexpr Duration kLogPeriod{1'000'000'000};

std::string error_text() { return std::generic_category().message(errno); }

}  // namespace

Result<std::unique_ptr<ServiceSink>> ServiceSink::create(const std::string& address, std::FILE* journal) {
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  const auto complaint = [&](const std::string& text) {
    return Error{ErrorCode::unwritable, fmt::format("NOTIFY_SOCKET={}: {}", address, text)};
  };
  if (address.size() < 2 || (address[0] != '/' && address[0] != '@')) return complaint("neither a path nor @ and a name");
  if (address.size() >= sizeof(to.sun_path)) return complaint("too long for a socket's name");
  std::memcpy(to.sun_path, address.data(), address.size());
  if (address[0] == '@') to.sun_path[0] = '\0';
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address.size());
  FileDescriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!socket || connect(socket.number(), reinterpret_cast<const sockaddr*>(&to), length) != 0) return complaint(error_text());
  return std::unique_ptr<ServiceSink>(new ServiceSink(std::move(socket), address, journal));
}

Result<void> ServiceSink::take(const LiveEvent& event) {
  const auto* status = std::get_if<LiveStatus>(&event);
  if (status == nullptr) return {};
  // A problem of one output does not hide the health.
  std::string sentence = to_sentence(status->health);
  if (!status->problem.empty()) sentence += "; " + status->problem;
  std::replace(sentence.begin(), sentence.end(), '\n', ' ');
  log(*status, sentence);
  std::string message = fmt::format("STATUS={}\n", sentence);
  if (!ready_) message += "READY=1\n";
  ready_ = true;
  if (estimator_lives(*status)) message += "WATCHDOG=1\n";
  return send(message);
}

/// False where complete images keep coming and none has been answered for kHungAfter.
bool ServiceSink::estimator_lives(const LiveStatus& status) {
  const std::int64_t whole_images = status.counts.images - status.counts.images_incomplete;
  if (status.counts.images_estimated != answers_ || !waits_since_ || whole_images == images_) {
    answers_ = status.counts.images_estimated;
    images_ = whole_images;
    waits_since_ = status.host_t;
  }
  return status.host_t - *waits_since_ < kHungAfter;
}

void ServiceSink::log(const LiveStatus& status, const std::string& sentence) {
  if (sentence == logged_ || (!logged_.empty() && status.host_t - logged_at_ < kLogPeriod)) return;
  constexpr int kError = 3, kWarning = 4, kInfo = 6;  // syslog(3)
  const HealthState state = status.health.state;
  const int level = state == HealthState::lost ? kError : state == HealthState::good && status.problem.empty() ? kInfo : kWarning;
  std::fputs(fmt::format("<{}>{}\n", level, sentence).c_str(), journal_);  // a full disk stops no watchdog
  std::fflush(journal_);
  logged_ = sentence;
  logged_at_ = status.host_t;
}

Result<void> ServiceSink::finish() { return send("STOPPING=1\n"); }

Result<void> ServiceSink::send(const std::string& message) const {
  if (::send(socket_.number(), message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT) >= 0 || errno == EAGAIN) return {};
  return Error{ErrorCode::unwritable, fmt::format("NOTIFY_SOCKET={}: {}", address_, error_text())};
}

}  // namespace fbvins
