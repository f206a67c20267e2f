// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/record_messages.hpp"

#include <cmath>
#include <cstdlib>
#include <utility>

#include "fbvins/core/text.hpp"
#include "fbvins/io/cdr.hpp"

namespace fbvins {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

std::optional<Time> get_stamp(CdrReader& cdr) {
  const auto seconds = cdr.get<std::int32_t>();
  const auto nanoseconds = cdr.get<std::uint32_t>();
  if (!cdr.ok() || seconds < 0 || nanoseconds >= kSecond_ns) return std::nullopt;
  return Time{seconds * kSecond_ns + nanoseconds};
}

std::optional<Time> get_header(CdrReader& cdr) {
  const std::optional<Time> t = get_stamp(cdr);
  cdr.text();  // frame
  return t;
}

Vec3 get_vector(CdrReader& cdr) {
  const double x = cdr.get<double>(), y = cdr.get<double>(), z = cdr.get<double>();
  return {x, y, z};
}

Mat6 get_covariance(CdrReader& cdr) {
  Mat6 out;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) out(row, column) = cdr.get<double>();
  return out;
}

std::string_view text_at(const RosDiagnostic& diagnostic, std::string_view key) {
  for (const auto& [name, value] : diagnostic.values)
    if (name == key) return value;
  return {};
}
double number_at(const RosDiagnostic& diagnostic, std::string_view key) {
  return std::strtod(std::string(text_at(diagnostic, key)).c_str(), nullptr);
}
template <class Number>
void take_number(const RosDiagnostic& diagnostic, std::string_view key, Number& number) {
  number = static_cast<Number>(number_at(diagnostic, key));
}

Health health_of(const RosDiagnostic& diagnostic) {
  return {enumerator_in(text_at(diagnostic, "state"), HealthState::lost).value_or(HealthState::initialising),
          enumerator_in(text_at(diagnostic, "reason"), kLastHealthReason).value_or(HealthReason::none)};
}

/// "p50 1.2, p99 3.4, max 5.6 of 7".
LatencySummary latency_at(const RosDiagnostic& diagnostic, std::string_view key) {
  LatencySummary s;
  long long count = 0;
  const std::string text(text_at(diagnostic, key));
  if (std::sscanf(text.c_str(), "p50 %lf, p99 %lf, max %lf of %lld", &s.p50_ms, &s.p99_ms, &s.max_ms, &count) == 4)
    s.count = count;
  return s;
}

}  // namespace

std::optional<Odometry> read_record_odometry(std::string_view bytes) {
  CdrReader cdr(bytes);
  const std::optional<Time> t = get_header(cdr);
  cdr.text();  // the body's frame
  if (!t) return std::nullopt;
  Odometry o;
  o.t = *t;
  o.T_WB.p = get_vector(cdr);
  const Vec3 xyz = get_vector(cdr);
  o.T_WB.q = Quat(cdr.get<double>(), xyz.x(), xyz.y(), xyz.z());
  const Mat3 R_WB = o.T_WB.R();
  Mat6 to_B = Mat6::Identity();  // ROS's angles are about the axes of W
  to_B.bottomRightCorner<3, 3>() = R_WB.transpose();
  o.pose_covariance = to_B * get_covariance(cdr) * to_B.transpose();
  o.v_WB = R_WB * get_vector(cdr);
  o.w_WB_B = get_vector(cdr);
  if (!cdr.ok()) return std::nullopt;
  return o;
}

bool take_record_health(const RosDiagnostic& diagnostic, Odometry& o) {
  if (diagnostic.name != "odometry") return false;
  o.health = health_of(diagnostic);
  take_number(diagnostic, "reset_counter", o.reset_counter);
  take_number(diagnostic, "frame", o.id.value);
  take_number(diagnostic, "tilt_sigma_rad", o.tilt_sigma_rad);
  take_number(diagnostic, "scale_sigma", o.scale_sigma);
  o.level = text_at(diagnostic, "level") == "yes";
  EstimatorStats& s = o.stats;
  s.keyframe = text_at(diagnostic, "keyframe") == "yes";
  s.standstill = text_at(diagnostic, "standstill") == "yes";
  take_number(diagnostic, "frames_in_window", s.frames_in_window);
  take_number(diagnostic, "landmarks", s.landmarks);
  take_number(diagnostic, "known_landmarks", s.known_landmarks);
  take_number(diagnostic, "observations", s.observations);
  take_number(diagnostic, "outliers", s.outliers);
  take_number(diagnostic, "iterations", s.iterations);
  take_number(diagnostic, "estimator_ms", s.solve_ms);
  return true;
}

std::optional<LiveStatus> status_of(const RosDiagnostic& diagnostic) {
  if (diagnostic.name != "live") return std::nullopt;
  LiveStatus s;
  s.health = health_of(diagnostic);
  take_number(diagnostic, "reset_counter", s.reset_counter);
  s.shutter_to_pose = latency_at(diagnostic, "shutter_to_pose_ms");
  s.pose_age = latency_at(diagnostic, "pose_age_ms");
  LiveCounts& c = s.counts;
  for (auto [key, count] : {std::pair{"imu", &c.imu},
                            {"images", &c.images},
                            {"images_estimated", &c.images_estimated},
                            {"images_dropped", &c.images_dropped},
                            {"images_incomplete", &c.images_incomplete},
                            {"imu_late", &c.imu_late},
                            {"imu_reordered", &c.imu_reordered},
                            {"clock_leaps", &c.clock_leaps},
                            {"clock_set_back", &c.clock_set_back},
                            {"resets", &c.resets},
                            {"events_lost", &c.events_lost}})
    take_number(diagnostic, key, *count);
  return s;
}

std::optional<std::vector<RosDiagnostic>> read_diagnostics(std::string_view bytes) {
  CdrReader cdr(bytes);
  if (!get_header(cdr)) return std::nullopt;
  std::vector<RosDiagnostic> out;
  for (auto left = cdr.get<std::uint32_t>(); left > 0 && cdr.ok(); --left) {
    RosDiagnostic& diagnostic = out.emplace_back();
    diagnostic.level = cdr.get<std::uint8_t>();
    diagnostic.name = cdr.text();
    diagnostic.message = cdr.text();
    cdr.text();  // hardware
    for (auto values = cdr.get<std::uint32_t>(); values > 0 && cdr.ok(); --values) {
      std::string key(cdr.text());
      diagnostic.values.emplace_back(std::move(key), cdr.text());
    }
  }
  if (!cdr.ok()) return std::nullopt;
  return out;
}

std::optional<LiveView> read_view(std::string_view bytes) {
  constexpr std::string_view kFields[] = {"x", "y", "z", "track", "u", "v", "age", "depth"};  // as append_landmarks() writes them
  CdrReader cdr(bytes);
  const std::optional<Time> t = get_header(cdr);
  cdr.get<std::uint32_t>();
  const auto count = cdr.get<std::uint32_t>();
  if (!t || cdr.get<std::uint32_t>() != std::size(kFields)) return std::nullopt;
  for (const std::string_view field : kFields) {
    if (cdr.text() != field) return std::nullopt;
    cdr.get<std::uint32_t>();
    cdr.get<std::uint8_t>();
    cdr.get<std::uint32_t>();
  }
  cdr.get<std::uint8_t>();
  cdr.get<std::uint32_t>();
  cdr.get<std::uint32_t>();
  ByteCursor points(cdr.bytes());
  LiveView view;
  view.t = *t;
  view.shutter_to_pose_ms = -1;  // not recorded for each image
  for (std::uint32_t i = 0; i < count && points.ok(); ++i) {
    const float x = points.get<float>(), y = points.get<float>(), z = points.get<float>();
    const TrackId track{points.get<std::uint32_t>()};
    const float u = points.get<float>(), v = points.get<float>(), age = points.get<float>(), depth = points.get<float>();
    if (std::isfinite(u)) view.features.push_back({track, Vec2(u, v), std::isfinite(age) ? static_cast<int>(age) : 0, depth});
    if (std::isfinite(x)) view.landmarks.push_back({track, Vec3(x, y, z)});
  }
  if (!cdr.ok() || !points.ok()) return std::nullopt;
  return view;
}

std::optional<LiveMark> read_mark(std::string_view bytes) {
  CdrReader cdr(bytes);
  const std::optional<Time> t = get_stamp(cdr);
  cdr.get<std::uint8_t>();
  cdr.text();
  const std::string_view text = cdr.text();
  if (!t || !cdr.ok()) return std::nullopt;
  return LiveMark{*t, std::string(text)};
}

}  // namespace fbvins
