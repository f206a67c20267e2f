// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/web_messages.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "fbvins/live/status_sink.hpp"

namespace fbvins {
namespace {

static_assert(std::endian::native == std::endian::little, "the page reads little-endian numbers");

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostMark_characters = 120, kMostName_characters = 32;
constexpr std::size_t kMostKeyframes = 2000;
constexpr std::uint8_t kImage = 1, kWindowPoints = 2, kCloudPoints = 3;

SharedMessage text(const Json& json) {
  return std::make_shared<const WebMessage>(WebMessage{json.dump(-1, ' ', false, Json::error_handler_t::replace), false, false});
}

/// Few digits keep messages short; 1e-4 of the unit is less than a pixel.
double rounded(double x) { return std::round(x * 1e4) / 1e4; }
Json rounded(const Vec3& v) { return {rounded(v.x()), rounded(v.y()), rounded(v.z())}; }
Json known(double x) { return x < 0 ? Json() : Json(rounded(x)); }

Json path_json(const std::vector<PathPoint>& path) {
  Json out = Json::array();
  for (const PathPoint& point : path)
    out.push_back(
        {rounded(point.t_s), rounded(point.p_W.x()), rounded(point.p_W.y()), rounded(point.p_W.z()), point.reset_counter});
  return out;
}

/// Header of every binary message, 24 bytes (docs/web.md).
struct BinaryHead {
  std::uint8_t kind;
  std::uint8_t version = 1;
  std::uint16_t camera = 0;  ///< of an image
  std::uint32_t count;
  double t_s;
  std::uint32_t width_px = 0, height_px = 0;
};
static_assert(sizeof(BinaryHead) == 24);

template <class Value>
void append(std::string& out, const Value& value) {
  static_assert(std::is_trivially_copyable_v<Value>);
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  out.append(bytes, sizeof value);
}
void append_number(std::string& out, double number) { append(out, static_cast<float>(number)); }

}  // namespace

SharedMessage hello_message(const WebFlight& flight, Time start) {
  Json json{{"type", "hello"}, {"program", flight.program}, {"source", flight.source}, {"frontend", flight.frontend}};
  json["replay"] = flight.replay;
  json["start_ns"] = std::to_string(start.ns);  // a JavaScript number would lose the last digits
  if (flight.replay) json["duration_s"] = rounded(flight.duration_s);
  json["can_mark"] = flight.can_mark;
  json["commands"] = Json::object();
  for (const auto& [name, never] : flight.commands) json["commands"][name] = never;
  if (const auto& q = flight.q_B_vehicle) json["vehicle_to_imu_wxyz"] = {q->w(), q->x(), q->y(), q->z()};
  if (flight.replay) json["whole_path"] = path_json(flight.whole_path);
  return text(json);
}

SharedMessage history_message(const FlightHistory& history) {
  Json json{{"type", "history"}, {"path", path_json(history.path())}, {"distance_m", rounded(history.distance_m())}};
  Json& health = json["health"] = Json::array();
  for (const HealthChange& change : history.health())
    health.push_back({rounded(change.t_s), to_string(change.health.state), to_string(change.health.reason)});
  Json& series = json["series"] = Json::array();
  for (const SeriesPoint& s : history.series())
    series.push_back({rounded(s.t_s), known(s.latency_ms), s.dropped, s.features, s.landmarks, known(s.sigma_m)});
  Json& marks = json["marks"] = Json::array();
  for (const FlightMark& mark : history.marks()) marks.push_back({rounded(mark.t_s), mark.text});
  return text(json);
}

SharedMessage state_message(double t_s, const Odometry& o, const LiveView* view, const FlightHistory& history) {
  Json json{{"type", "state"}, {"t_s", rounded(t_s)}, {"image", o.id.value}, {"health", to_string(o.health.state)}};
  json["reason"] = to_string(o.health.reason);
  if (o.health.without_cameras != 0) json["without_cameras"] = cameras_in(o.health.without_cameras);
  json["reset_counter"] = o.reset_counter;
  if (o.health.has_pose()) {
    const Mat6& C = o.pose_covariance;
    json["position_m"] = rounded(o.T_WB.p);
    json["orientation_wxyz"] = {rounded(o.T_WB.q.w()), rounded(o.T_WB.q.x()), rounded(o.T_WB.q.y()), rounded(o.T_WB.q.z())};
    json["velocity_mps"] = rounded(o.v_WB);
    json["position_covariance_m2"] = {C(0, 0), C(0, 1), C(0, 2), C(1, 1), C(1, 2), C(2, 2)};
    json["sigma_m"] = position_sigma_m(C);
    json["tilt_sigma_rad"] = o.tilt_sigma_rad;
    json["level"] = o.level;
    if (o.scale_sigma > 0) json["scale_sigma"] = o.scale_sigma;
    json["distance_m"] = rounded(history.distance_m());
  }
  json["frames_in_window"] = o.stats.frames_in_window;
  json["landmarks"] = o.stats.landmarks;
  json["known_landmarks"] = o.stats.known_landmarks;
  json["outliers"] = o.stats.outliers;
  json["estimator_ms"] = rounded(o.stats.total_ms());
  json["dropped"] = history.newest().dropped;
  if (view == nullptr) return text(json);
  json["features"] = view->features.size();
  json["latency_ms"] = known(view->shutter_to_pose_ms);
  Json& keyframes = json["keyframes_m"] = Json::array();
  for (const Vec3& p : view->keyframes_W) keyframes.push_back(rounded(p));
  return text(json);
}

SharedMessage status_message(double t_s, const LiveStatus& status, const LivePose& newest) {
  return text({{"type", "status"}, {"t_s", rounded(t_s)}, {"status", Json::parse(to_json_line(status, newest))}});
}

SharedMessage map_message(double t_s, const MapUpdate& update, int loops) {
  Json json{{"type", "map"}, {"t_s", rounded(t_s)}, {"keyframes", update.stats.keyframes}, {"loops", loops}};
  json["localised"] = update.localised;
  json["found"] = update.found;
  if (update.localised) json["position_of_odometry_m"] = rounded(update.T_MW.p);
  if (!update.localised || update.corrected.empty()) return text(json);
  // The page shows W: the map's keyframes are transformed into it.
  const Pose<W, M> T_WM = update.T_MW.inverse();
  const std::size_t stride = update.corrected.size() / kMostKeyframes + 1;
  Json& corrected = json["corrected_m"] = Json::array();
  for (std::size_t i = 0; i < update.corrected.size(); i += stride)
    corrected.push_back(rounded(T_WM * update.corrected[i].T_MB.p));
  return text(json);
}

SharedMessage mark_message(const FlightMark& mark) {
  return text({{"type", "mark"}, {"t_s", rounded(mark.t_s)}, {"text", mark.text}});
}
SharedMessage note_message(const std::string& sentence, bool bad) {
  return text({{"type", "note"}, {"text", sentence}, {"bad", bad}});
}
SharedMessage replay_message(double t_s, bool playing) {
  return text({{"type", "replay"}, {"t_s", rounded(t_s)}, {"playing", playing}});
}
SharedMessage rewound_message() { return text({{"type", "rewound"}}); }
SharedMessage end_message() { return text({{"type", "end"}}); }

SharedMessage image_message(double t_s, std::string_view jpeg, int width_px, int height_px,
                            const std::vector<LiveView::Feature>& features, int camera) {
  WebMessage message{{}, true, true, camera};
  message.bytes.reserve(sizeof(BinaryHead) + features.size() * 16 + jpeg.size());
  append(message.bytes, BinaryHead{.kind = kImage,
                                   .camera = static_cast<std::uint16_t>(camera),
                                   .count = static_cast<std::uint32_t>(features.size()),
                                   .t_s = t_s,
                                   .width_px = static_cast<std::uint32_t>(width_px),
                                   .height_px = static_cast<std::uint32_t>(height_px)});
  for (const LiveView::Feature& feature : features)
    for (const double number : {feature.pixel.x(), feature.pixel.y(), static_cast<double>(feature.age_frames), feature.depth_m})
      append_number(message.bytes, number);
  message.bytes += jpeg;
  return std::make_shared<const WebMessage>(std::move(message));
}

SharedMessage points_message(double t_s, const std::vector<LiveView::Landmark>& points, bool cloud) {
  WebMessage message{{}, true, false};
  message.bytes.reserve(sizeof(BinaryHead) + points.size() * 16);
  append(
      message.bytes,
      BinaryHead{.kind = cloud ? kCloudPoints : kWindowPoints, .count = static_cast<std::uint32_t>(points.size()), .t_s = t_s});
  for (const LiveView::Landmark& point : points) {
    append(message.bytes, static_cast<std::uint32_t>(point.track.value));
    for (int i = 0; i < 3; ++i) append_number(message.bytes, point.p_W[i]);
  }
  return std::make_shared<const WebMessage>(std::move(message));
}

std::optional<WebCommand> parse_command(std::string_view bytes) {
  const Json json = Json::parse(bytes, nullptr, false);
  if (!json.is_object() || !json.contains("do") || !json["do"].is_string()) return std::nullopt;
  const std::string what = json["do"];
  using Kind = WebCommand::Kind;
  if (what == "play") return WebCommand{Kind::play, {}};
  if (what == "pause") return WebCommand{Kind::pause, {}};
  if (what == "mark") {
    const auto words = json.find("text");
    if (words == json.end() || !words->is_string()) return WebCommand{Kind::mark, {}};
    return WebCommand{Kind::mark, words->get<std::string>().substr(0, kMostMark_characters)};
  }
  if (what == "seek")
    return json.contains("t_s") && json["t_s"].is_number() ? std::optional(WebCommand{Kind::seek, {}, json["t_s"]})
                                                           : std::nullopt;
  if (what.size() > kMostName_characters) return std::nullopt;
  return WebCommand{Kind::flight, what};
}

}  // namespace fbvins
