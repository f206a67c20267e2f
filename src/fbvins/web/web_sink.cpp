// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/web_sink.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace fbvins {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kPicturePeriod = 190ms, kPointsPeriod = 190ms;
/// Faster cameras are thinned out.
constexpr auto kStatePeriod = 30ms;
/// Time for viewers to receive the last messages.
constexpr auto kFarewell = 3s;

/// Whether `when` has come; then it is set a period ahead.
bool due(Clock::time_point& when, Clock::duration period) {
  const auto now = Clock::now();
  if (now < when) return false;
  when = now + period;
  return true;
}

}  // namespace

Result<std::unique_ptr<WebSink>> WebSink::create(const WebOptions& options, PageFiles files, WebFlight flight,
                                                 WebActions actions) {
  auto sink = prepare(options, std::move(flight), std::move(actions));
  if (Result<void> begun = sink->begin(std::move(files)); !begun) return begun.error();
  return sink;
}

std::unique_ptr<WebSink> WebSink::prepare(const WebOptions& options, WebFlight flight, WebActions actions) {
  return std::unique_ptr<WebSink>(new WebSink(options, std::move(flight), std::move(actions)));
}

Result<void> WebSink::begin(PageFiles files) {
  auto server =
      WebServer::start(options_, std::move(files),
                       {.greet = [this] { return greeting(); }, .command = [this](std::string_view text) { on_command(text); }});
  if (!server) return server.error();
  server_ = *std::move(server);
  return {};
}

WebSink::WebSink(const WebOptions& options, WebFlight flight, WebActions actions)
    : options_(options), actions_(std::move(actions)), flight_(std::move(flight)) {
  for (const FlightCommand& command : actions_.commands) flight_.commands.emplace_back(command.name, command.never);
}

std::string WebSink::url() const { return page_url(options_.address, port(), options_.token); }

double WebSink::since_start_s(Time t) {
  const std::lock_guard lock(mutex_);
  if (!start_) start_ = t;
  return (t - *start_).seconds();
}

void WebSink::set_start(Time start) {
  const std::lock_guard lock(mutex_);
  start_ = start;
}

std::vector<SharedMessage> WebSink::greeting() {
  const std::lock_guard lock(mutex_);
  std::vector<SharedMessage> messages{hello_message(flight_, start_.value_or(Time{}))};
  for (SharedMessage& message : flight_so_far()) messages.push_back(std::move(message));
  return messages;
}

std::vector<SharedMessage> WebSink::flight_so_far() const {
  std::vector<SharedMessage> messages{history_message(history_), points_message(0, history_.cloud().points(), true)};
  for (const SharedMessage& last : {last_status_, last_map_, last_points_})
    if (last) messages.push_back(last);
  for (const auto& [camera, last] : last_images_) messages.push_back(last);
  for (const SharedMessage& last : {last_state_, last_replay_})
    if (last) messages.push_back(last);
  return messages;
}

/// With the mutex held.
void WebSink::send(SharedMessage message) {
  if (!silent_ && server_) server_->send(std::move(message));
}

void WebSink::on_command(std::string_view text) {
  const std::optional<WebCommand> command = parse_command(text);
  if (!command) return;
  using Kind = WebCommand::Kind;
  const bool plays = command->kind == Kind::play || command->kind == Kind::pause || command->kind == Kind::seek;
  if (command->kind == Kind::mark && flight_.can_mark) actions_.mark(command->text);
  else if (command->kind == Kind::flight) ask_flight(command->text);
  else if (flight_.replay && plays) actions_.replay(*command);
}

void WebSink::ask_flight(const std::string& name) {
  for (const FlightCommand& command : actions_.commands)
    if (command.name == name && command.never.empty())
      command.act([this](const Result<std::string>& done) { tell(done ? *done : done.error().message, !done.ok()); });
}

Result<void> WebSink::take(const LiveEvent& event) {
  if (const auto* frame = std::get_if<StereoFrame>(&event)) show(*frame);
  else if (const auto* view = std::get_if<LiveView>(&event)) view_ = *view;
  else if (const auto* odometry = std::get_if<Odometry>(&event)) show(*odometry);
  else if (const auto* pose = std::get_if<LivePose>(&event)) newest_ = *pose;
  else if (const auto* update = std::get_if<MapUpdate>(&event)) show(*update);
  else if (const auto* status = std::get_if<LiveStatus>(&event)) show(*status);
  else if (const auto* mark = std::get_if<LiveMark>(&event)) show(*mark);
  return {};
}

/// Encoded at once rather than kept, as its memory may be the sensor's. It waits for its odometry; until then no other is taken.
void WebSink::show(const StereoFrame& frame) {
  if (!frame.left() && frame.images.size() <= 2) return;
  if (!pictures_.empty() || viewers() == 0 || !due(picture_due_, kPicturePeriod)) return;
  for (int i = 0; i < static_cast<int>(frame.images.size()); ++i)
    if (const std::shared_ptr<const Image> image = frame.image(i))
      pictures_.push_back({i, frame.t, encoder_.encode(*image), image->width(), image->height()});
}

void WebSink::show(const Odometry& o) {
  const double t_s = since_start_s(o.t);
  const LiveView* view = view_ && view_->t == o.t ? &*view_ : nullptr;
  const bool looked_at = viewers() > 0 || flight_.replay;  // a paused replay needs the last state
  const bool send_state = looked_at && !silent_ && due(state_due_, kStatePeriod);
  {
    const std::lock_guard lock(mutex_);
    history_.add(t_s, o, view);
    if (silent_) unsent_ = o;
    else if (send_state) send(last_state_ = state_message(t_s, o, view, history_));
  }
  if (!pictures_.empty() && pictures_.front().t <= o.t) send_pictures(t_s);
  if (view && looked_at && !silent_ && due(points_due_, kPointsPeriod)) {
    const SharedMessage points = points_message(t_s, view->landmarks, false);
    const std::lock_guard lock(mutex_);
    send(last_points_ = points);
  }
}

/// Each with the features of the same image, or none.
void WebSink::send_pictures(double t_s) {
  for (const Picture& picture : std::exchange(pictures_, {})) {
    std::vector<LiveView::Feature> features;
    if (view_ && view_->t == picture.t)
      for (const auto* seen : {&view_->features, &view_->right_features})
        std::ranges::copy_if(*seen, std::back_inserter(features),
                             [&](const LiveView::Feature& f) { return f.camera == picture.camera; });
    const SharedMessage message = image_message(t_s, picture.jpeg, picture.width_px, picture.height_px, features, picture.camera);
    const std::lock_guard lock(mutex_);
    send(last_images_[picture.camera] = message);
  }
}

void WebSink::show(const MapUpdate& update) {
  loops_ += static_cast<int>(update.loops.size());
  const SharedMessage message = map_message(since_start_s(update.t), update, loops_);
  const std::lock_guard lock(mutex_);
  send(last_map_ = message);
}

void WebSink::show(const LiveStatus& status) {
  if (status.t.ns == 0) return;  // no sensor data yet
  const SharedMessage message = status_message(since_start_s(status.t), status, newest_);
  const std::lock_guard lock(mutex_);
  history_.dropped_images(status.counts.images_dropped);
  send(last_status_ = message);
}

void WebSink::show(const LiveMark& mark) {
  if (mark.t.ns == 0) return;
  const double t_s = since_start_s(mark.t);
  const std::lock_guard lock(mutex_);
  history_.add(t_s, mark);
  send(mark_message(history_.marks().back()));
}

void WebSink::tell(const std::string& sentence, bool bad) {
  if (server_) server_->send(note_message(sentence, bad));
}

void WebSink::show_replay(double t_s, bool playing) {
  const std::lock_guard lock(mutex_);
  send(last_replay_ = replay_message(t_s, playing));
}

void WebSink::begin_replay() {
  const std::lock_guard lock(mutex_);
  silent_ = true;
  history_.clear();
  last_state_ = last_status_ = last_map_ = last_points_ = last_replay_ = nullptr;
  last_images_.clear();
  pictures_.clear();
  view_.reset();
  loops_ = 0;
}

void WebSink::end_replay() {
  const std::lock_guard lock(mutex_);
  silent_ = false;
  state_due_ = points_due_ = picture_due_ = {};  // the next image is shown, however soon it comes
  const bool same = unsent_ && view_ && view_->t == unsent_->t;
  const LiveView* view = same ? &*view_ : nullptr;
  const double t_s = unsent_ ? (unsent_->t - *start_).seconds() : 0;
  if (unsent_) last_state_ = state_message(t_s, *unsent_, view, history_);
  if (view) last_points_ = points_message(t_s, view->landmarks, false);
  unsent_.reset();
  send(rewound_message());
  for (SharedMessage& message : flight_so_far()) send(std::move(message));
}

Result<void> WebSink::finish() {
  if (!server_) return {};
  server_->send(end_message());
  server_->drain(kFarewell);
  server_->stop();  // the targets of its actions may be destroyed next
  return {};
}

}  // namespace fbvins
