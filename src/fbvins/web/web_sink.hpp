// SPDX-License-Identifier: Apache-2.0
// A live flight in a browser: one page, served by this program, and a stream of what happens to every page that looks
// (docs/web.md). Also shows a finished flight, whose events are given to it one by one.
//
//   auto sink = WebSink::create({.address = {"127.0.0.1", 8080}}, page_files(), flight, actions);
//   live.add_sink(*std::move(sink));
//
// Each event is encoded once, whoever looks; images only while somebody does, five a second.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "fbvins/live/sink.hpp"
#include "fbvins/web/flight_history.hpp"
#include "fbvins/web/grey_jpeg.hpp"
#include "fbvins/web/web_messages.hpp"
#include "fbvins/web/web_server.hpp"

namespace fbvins {

/// What a viewer may ask for, called on the server's thread; none may wait for anything.
struct WebActions {
  std::function<void(std::string)> mark = [](std::string) {};
  std::function<void()> save_map = [] {};
  std::function<void(const WebCommand&)> replay = [](const WebCommand&) {};  ///< seek, play, pause
};

class WebSink final : public Sink {
 public:
  static Result<std::unique_ptr<WebSink>> create(const WebOptions& options, PageFiles files, WebFlight flight,
                                                 WebActions actions);

  std::string_view name() const override { return "web"; }
  bool wants_views() const override { return true; }
  Result<void> take(const LiveEvent& event) override;
  Result<void> finish() override;

  /// From any thread: a sentence for everybody who looks.
  void tell(const std::string& sentence, bool bad);
  // Of a replay, from the thread that gives events.
  void show_replay(double t_s, bool playing);
  /// All is void; what comes until caught_up() is told at once then.
  void begin_again();
  void caught_up();
  /// Times on the page begin here; without it at the first image.
  void set_start(Time start);

  int viewers() const { return server_->viewers(); }
  std::uint16_t port() const { return server_->port(); }
  /// What to type into a browser.
  std::string url() const;

 private:
  WebSink(const WebOptions& options, WebFlight flight, WebActions actions);
  std::vector<SharedMessage> greeting();
  std::vector<SharedMessage> flight_so_far() const;
  void send(SharedMessage message);
  void on_command(std::string_view text);

  void show(const StereoFrame& frame);
  void show(const Odometry& odometry);
  void show(const MapUpdate& update);
  void show(const LiveStatus& status);
  void show(const LiveMark& mark);
  void send_picture(double t_s);
  double since_start_s(Time t);

  WebOptions options_;
  WebActions actions_;
  std::mutex mutex_;  ///< of what a greeting is made of
  WebFlight flight_;
  FlightHistory history_;
  std::optional<Time> start_;
  bool silent_ = false;
  std::optional<Odometry> untold_;  ///< the newest since begin_again()
  SharedMessage last_state_, last_status_, last_map_, last_points_, last_image_, last_replay_;

  // Of the thread that gives events.
  struct Picture {
    Time t;
    std::string jpeg;
    int width_px = 0, height_px = 0;
  };
  GreyJpeg encoder_;
  std::optional<Picture> picture_;  ///< waits for the features of its image
  std::optional<LiveView> view_;    ///< waits for its odometry
  LivePose newest_;
  std::chrono::steady_clock::time_point picture_due_{}, points_due_{}, state_due_{};
  int loops_ = 0;

  std::unique_ptr<WebServer> server_;  ///< last: its thread uses what is above
};

}  // namespace fbvins
