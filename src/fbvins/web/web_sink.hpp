// SPDX-License-Identifier: Apache-2.0
// Shows a live flight in a browser: one page, served by this program, and a stream of messages to every viewer (docs/web.md).
// Also shows a finished flight, whose events it is given one by one.
//
//   auto sink = WebSink::create({.address = {"127.0.0.1", 8080}}, page_files(), flight, actions);
//   live.add_sink(*std::move(sink));
//
// Each event is encoded once for all viewers; images only while there is a viewer, five a second.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "fbvins/live/flight_command.hpp"
#include "fbvins/live/sink.hpp"
#include "fbvins/web/flight_history.hpp"
#include "fbvins/web/grey_jpeg.hpp"
#include "fbvins/web/web_messages.hpp"
#include "fbvins/web/web_server.hpp"

namespace fbvins {

/// A viewer's commands, called on the server's thread; none may block.
struct WebActions {
  std::function<void(std::string)> mark = [](std::string) {};
  std::vector<FlightCommand> commands = {};                                  ///< their answers are shown to all viewers
  std::function<void(const WebCommand&)> replay = [](const WebCommand&) {};  ///< seek, play, pause
};

class WebSink final : public Sink {
 public:
  /// Serves at once.
  static Result<std::unique_ptr<WebSink>> create(const WebOptions& options, PageFiles files, WebFlight flight,
                                                 WebActions actions);
  /// Serves from begin() on, which is called before the first event: until then no action is called, as what they act on may not
  /// be complete.
  static std::unique_ptr<WebSink> prepare(const WebOptions& options, WebFlight flight, WebActions actions);
  Result<void> begin(PageFiles files);

  std::string_view name() const override { return "web"; }
  bool wants_views() const override { return true; }
  Result<void> take(const LiveEvent& event) override;
  Result<void> finish() override;
  /// That the page's address is in use.
  std::string problem() const override { return server_ ? server_->problem() : ""; }

  /// Sends a sentence to all viewers. From any thread.
  void tell(const std::string& sentence, bool bad);
  // For replays, from the thread that calls take().
  void show_replay(double t_s, bool playing);
  /// Discards the history. Events until end_replay() are not sent one by one, but as history then.
  void begin_replay();
  void end_replay();
  /// Zero of the times on the page; without it the first event with a stamp.
  void set_start(Time start);

  int viewers() const { return server_ ? server_->viewers() : 0; }
  std::uint16_t port() const { return server_->port(); }
  /// Address for a browser, with the token.
  std::string url() const;

 private:
  WebSink(const WebOptions& options, WebFlight flight, WebActions actions);
  std::vector<SharedMessage> greeting();
  std::vector<SharedMessage> flight_so_far() const;
  void send(SharedMessage message);
  void on_command(std::string_view text);
  void ask_flight(const std::string& name);

  void show(const StereoFrame& frame);
  void show(const Odometry& odometry);
  void show(const MapUpdate& update);
  void show(const LiveStatus& status);
  void show(const LiveMark& mark);
  void send_pictures(double t_s);
  double since_start_s(Time t);

  WebOptions options_;
  WebActions actions_;
  std::mutex mutex_;  ///< guards the data of a greeting
  WebFlight flight_;
  FlightHistory history_;
  std::optional<Time> start_;
  bool silent_ = false;
  std::optional<Odometry> unsent_;  ///< the newest since begin_replay()
  SharedMessage last_state_, last_status_, last_map_, last_points_, last_replay_;
  std::map<int, SharedMessage> last_images_;  ///< by camera

  // Used by the thread that calls take().
  struct Picture {
    int camera;
    Time t;
    std::string jpeg;
    int width_px = 0, height_px = 0;
  };
  GreyJpeg encoder_;
  std::vector<Picture> pictures_;  ///< of one instant; they wait for the features of their images
  std::optional<LiveView> view_;   ///< waits for its odometry
  LivePose newest_;
  std::chrono::steady_clock::time_point picture_due_{}, points_due_{}, state_due_{};
  int loops_ = 0;

  std::unique_ptr<WebServer> server_;  ///< last: its thread uses the members above
};

}  // namespace fbvins
