// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/status_sink.hpp"

#include <poll.h>

#include <nlohmann/json.hpp>

#include "fbvins/types/quality.hpp"

namespace fbvins {
namespace {

nlohmann::ordered_json to_json(const LatencySummary& s) {
  return {{"p50", s.p50_ms}, {"p99", s.p99_ms}, {"max", s.max_ms}, {"count", s.count}};
}

nlohmann::ordered_json to_json(const OutputFigures& output) {
  nlohmann::ordered_json json{{"output", output.output}};
  for (const OutputFigure& figure : output.figures)
    std::visit([&](const auto& value) { json[figure.name] = value; }, figure.value);
  return json;
}

}  // namespace

std::string to_json_line(const LiveStatus& status, const LivePose& newest) {
  nlohmann::ordered_json json{{"t_ns", status.t.ns}, {"host_ns", status.host_t.ns}};
  json["health"] = to_string(status.health.state);
  json["reason"] = to_string(status.health.reason);
  if (status.health.without_cameras != 0) json["without_cameras"] = cameras_in(status.health.without_cameras);
  json["reset_counter"] = status.reset_counter;
  if (newest.health.has_pose()) {
    const Vec3& p = newest.T_WB.p;
    const Quat& q = newest.T_WB.q;
    json["position_m"] = {p.x(), p.y(), p.z()};
    json["orientation_wxyz"] = {q.w(), q.x(), q.y(), q.z()};
    json["velocity_mps"] = {newest.v_WB.x(), newest.v_WB.y(), newest.v_WB.z()};
    json["tilt_sigma_rad"] = newest.tilt_sigma_rad;
    json["level"] = newest.level;
    if (newest.scale_sigma > 0) json["scale_sigma"] = newest.scale_sigma;
    json["protection_m"] = protection_level_m(newest.health, newest.pose_covariance);
    json["quality_percent"] = quality_percent(newest.health, newest.pose_covariance);
  }
  status.counts.visit([&](const char* name, std::int64_t count) { json["counts"][name] = count; });
  json["shutter_to_pose_ms"] = to_json(status.shutter_to_pose);
  json["pose_age_ms"] = to_json(status.pose_age);
  for (const OutputFigures& output : status.outputs) json["outputs"].push_back(to_json(output));
  if (!status.problem.empty()) json["problem"] = status.problem;
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

Result<void> StatusSink::take(const LiveEvent& event) {
  if (const auto* pose = std::get_if<LivePose>(&event)) newest_ = *pose;
  const auto* status = std::get_if<LiveStatus>(&event);
  if (status == nullptr) return {};
  // A line is shorter than PIPE_BUF: a pipe that is writable takes all of it.
  pollfd stream{fileno(file_), POLLOUT, 0};
  if (poll(&stream, 1, 0) == 0) return {};
  const std::string line = to_json_line(*status, newest_) + "\n";
  const bool written = std::fwrite(line.data(), 1, line.size(), file_) == line.size() && std::fflush(file_) == 0;
  if (!written) return Error{ErrorCode::unwritable, "the status cannot be written"};
  return {};
}

}  // namespace fbvins
