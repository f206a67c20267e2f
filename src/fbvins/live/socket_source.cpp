// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/socket_source.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <mutex>

namespace fbvins {
namespace {

using namespace std::chrono_literals;

constexpr auto kStatusEvery = 1s;
/// Pause after a connection could not be accepted for lack of descriptors or memory.
constexpr auto kAcceptAgain = 1s;

/// A connection is closed this long after its goodbye: closed at once, a sender that is about to send would get an error first.
constexpr auto kGoodbyeIsRead = 1s;

std::uint32_t health_number(HealthState state) {
  switch (state) {
    case HealthState::initialising: return FBVINS_SOCKET_INITIALISING;
    case HealthState::good: return FBVINS_SOCKET_GOOD;
    case HealthState::degraded: return FBVINS_SOCKET_DEGRADED;
    case HealthState::lost: return FBVINS_SOCKET_LOST;
  }
  return FBVINS_SOCKET_UNKNOWN;
}

template <class To, class From>
void write_pose(const Pose<To, From>& T, double (&p)[3], double (&q)[4]) {
  Eigen::Map<Vec3>{p} = T.p;
  q[0] = T.q.w(), q[1] = T.q.x(), q[2] = T.q.y(), q[3] = T.q.z();
}

FbvinsSocketMap map_message(const MapUpdate& update, const Pose<M, M>& T_MM0, std::uint32_t moves) {
  FbvinsSocketMap map{};
  map.t_ns = update.t.ns;
  map.reset_counter = update.reset_counter;
  if (update.anchored) map.flags |= FBVINS_SOCKET_ANCHORED;
  if (update.localised) {
    map.flags |= FBVINS_SOCKET_LOCALISED;
    write_pose(update.T_MW, map.p_MW, map.q_MW);
    write_pose(update.T_MW_smooth, map.p_smooth, map.q_smooth);
  }
  write_pose(T_MM0, map.p_MM0, map.q_MM0);
  map.moves = moves;
  return map;
}

}  // namespace

/// The estimator's state, from the status sink's thread to the source's.
struct SocketSource::Report {
  std::mutex mutex;
  std::uint32_t health = FBVINS_SOCKET_UNKNOWN;
  std::uint32_t reset_counter = 0;
  bool fresh = false;
  Pose<M, M> T_MM0;
  std::uint32_t moves = 0;
  std::optional<FbvinsSocketMap> map;
  bool map_sent = false;
};

class SocketSource::StatusSink final : public Sink {
 public:
  StatusSink(std::shared_ptr<Report> report, std::shared_ptr<const WakeEvent> wake)
      : report_(std::move(report)), wake_(std::move(wake)) {}
  std::string_view name() const override { return "status to the sender"; }
  Result<void> take(const LiveEvent& event) override {
    if (const auto* status = std::get_if<LiveStatus>(&event)) {
      const std::lock_guard lock(report_->mutex);
      const std::uint32_t health = health_number(status->health.state);
      report_->fresh = report_->fresh || health != report_->health || status->reset_counter != report_->reset_counter;
      report_->health = health;
      report_->reset_counter = status->reset_counter;
      if (report_->fresh) wake_->signal();
    } else if (const auto* update = std::get_if<MapUpdate>(&event)) {
      const std::lock_guard lock(report_->mutex);
      if (update->M_moved) report_->T_MM0 = *update->M_moved * report_->T_MM0, ++report_->moves;
      report_->map = map_message(*update, report_->T_MM0, report_->moves);
      report_->map_sent = false;
      wake_->signal();
    }
    return {};
  }

 private:
  std::shared_ptr<Report> report_;
  std::shared_ptr<const WakeEvent> wake_;
};

SocketSource::SocketSource(SocketFile file, SocketOptions options)
    : file_(std::move(file)), options_(std::move(options)), report_(std::make_shared<Report>()) {
  if (!options_.rig) return;
  rig_ = *options_.rig;
  rig_known_ = true;
}

Result<std::unique_ptr<SocketSource>> SocketSource::open(const std::string& path, SocketOptions options) {
  Result<SocketFile> file = SocketFile::listen(path, options.group);
  if (!file) return file.error();
  std::unique_ptr<SocketSource> source(new SocketSource(*std::move(file), std::move(options)));
  if (Result<void> known = source->wait_for_rig(); !known) return known.error();
  return source;
}

Result<void> SocketSource::wait_for_rig() {
  if (!rig_known_) say("waiting for a sender that has the calibration");
  while (!rig_known_) {
    if (options_.give_up()) return Error{ErrorCode::not_found, file_.path() + ": no sender came"};
    step(100ms, nullptr);
  }
  return {};
}

Result<void> SocketSource::run(SensorInput& input) {
  if (session_ && session_->greeted()) session_->welcome();
  while (!stopped_) step(kStatusEvery, &input);
  if (session_) session_->refuse(FBVINS_SOCKET_DONE, "the estimator ends");
  session_.reset();
  return {};
}

void SocketSource::stop() {
  stopped_ = true;
  wake_->signal();
}

std::unique_ptr<Sink> SocketSource::status_sink() { return std::make_unique<StatusSink>(report_, wake_); }

/// Waits for an event, `longest` at most, and handles it. Without an input a sender is checked, but not welcomed yet.
void SocketSource::step(Clock::duration longest, SensorInput* input) {
  const auto now = Clock::now();
  const auto until = session_ ? std::clamp(next_, now, now + longest) : now + longest;
  const auto to_sender = static_cast<short>(backlog_ ? POLLOUT : 0);
  std::array<pollfd, 3> watched = {pollfd{wake_->fd(), POLLIN, 0}, pollfd{now < accept_after_ ? -1 : file_.fd(), POLLIN, 0},
                                   pollfd{session_ ? session_->fd() : -1, static_cast<short>(POLLIN | to_sender), 0}};
  ::poll(watched.data(), watched.size(), static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(until - now).count()));
  if (watched[0].revents != 0) wake_->clear();
  if (Clock::now() > leaving_until_) leaving_.reset();
  if (session_) {
    if (!session_->greeted()) greet(input != nullptr);
    else if (input != nullptr) serve(*input);
  }
  // Not while the old connection still holds messages: a sender that reconnects would be refused as a second one.
  if (watched[1].revents != 0 && watched[2].revents == 0) accept();
}

void SocketSource::accept() {
  FileDescriptor connection(::accept4(file_.fd(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!connection) {
    if (errno != EMFILE && errno != ENFILE && errno != ENOBUFS && errno != ENOMEM) return;
    say(fmt::format("a sender cannot be taken: {}", std::strerror(errno)));
    accept_after_ = Clock::now() + kAcceptAgain;
    return;
  }
  auto newcomer = std::make_unique<SocketSession>(std::move(connection), wake_);
  if (session_) {
    newcomer->refuse(FBVINS_SOCKET_BUSY, fmt::format("another sender is connected: {}", session_->name()));
    return linger(std::move(newcomer));
  }
  session_ = std::move(newcomer);
  next_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options_.hello_s));
}

void SocketSource::greet(bool begin) {
  session_->greet();
  if (session_->greeted()) check_hello();
  else if (session_->ended().empty() && Clock::now() >= next_) session_->refuse(FBVINS_SOCKET_TOO_SLOW, "no hello in time");
  if (!session_->ended().empty()) return let_go();
  if (!session_->greeted()) return;
  say(fmt::format("{} is connected", session_->name()));
  const std::lock_guard lock(report_->mutex);
  report_->map_sent = false;
  next_ = Clock::now();
  if (begin) session_->welcome();
}

/// Whether the sender's images and calibration are those that the estimator runs with.
void SocketSource::check_hello() {
  const SocketHello& hello = *session_->hello();
  const auto refuse = [&](const std::string& why) { session_->refuse(FBVINS_SOCKET_WRONG_RIG, why); };
  if (!rig_known_) {
    if (!hello.rig) return refuse("no calibration: neither here nor in the hello");
    rig_ = *parse_socket_rig(*hello.rig, hello.layout.width_px, hello.layout.height_px);
    senders_rig_ = hello.rig;
    rig_known_ = true;
  }
  if (hello.layout.cameras != rig_.camera_count())
    return refuse(fmt::format("images of {} cameras, the calibration has {}", hello.layout.cameras, rig_.camera_count()));
  for (int i = 0; i < rig_.camera_count(); ++i)
    if (const Camera& camera = rig_.camera(i);
        hello.layout.width_px != camera.width() || hello.layout.height_px != camera.height())
      return refuse(fmt::format("images of {} x {} pixels, the calibration is for {} x {}", hello.layout.width_px,
                                hello.layout.height_px, camera.width(), camera.height()));
  if ((hello.layout.depth_offset_bytes > 0) != rig_.depth.has_value())
    return refuse(rig_.depth ? "no depth images, the calibration has a depth sensor"
                             : "depth images, and the calibration that is given has no depth sensor: send it with the hello");
  if (senders_rig_ && hello.rig && !same(*senders_rig_, *hello.rig))
    refuse("another calibration than the first sender's, which the estimator runs with");
}

void SocketSource::serve(SensorInput& input) {
  session_->receive(input);
  if (session_->device()) device_ = session_->device();
  backlog_ = session_->send_released();
  if (session_->ended().empty()) send_status();
  if (!session_->ended().empty()) let_go();
}

void SocketSource::send_status() {
  const std::lock_guard lock(report_->mutex);
  if (report_->map && !report_->map_sent) report_->map_sent = session_->send_map(*report_->map);
  if (!report_->fresh && Clock::now() < next_) return;
  session_->send_status(report_->health, report_->reset_counter);
  report_->fresh = false;
  next_ = Clock::now() + kStatusEvery;
}

void SocketSource::let_go() {
  const SocketCounts& counts = session_->counts();
  std::string sentence = fmt::format("{}: {}", session_->name(), session_->ended());
  if (session_->greeted())
    sentence += fmt::format(" ({} frames, {} missed, {} readings, {} refused)", counts.frames, counts.frames_missed,
                            counts.readings, counts.readings_refused);
  say(sentence);
  linger(std::move(session_));
  backlog_ = false;
}

void SocketSource::linger(std::unique_ptr<SocketSession> refused) {
  leaving_ = std::move(refused);
  leaving_until_ = Clock::now() + kGoodbyeIsRead;
}

}  // namespace fbvins
