// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/aiding_messages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <variant>

#include "fbvins/core/overloaded.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/io/cdr.hpp"
#include "fbvins/io/little_endian.hpp"

namespace fbvins {
namespace {

constexpr std::string_view kRange = "sensor_msgs/Range", kTwist = "geometry_msgs/TwistWithCovarianceStamped",
                           kPressure = "sensor_msgs/FluidPressure";
constexpr std::int64_t kSecond_ns = 1'000'000'000;
/// Where a message says nothing: of zero, ROS's word for unknown.
constexpr double kUnknownTwist_mps = 0.1;

double sigma_of(double variance, double otherwise) {
  return variance > 0 && std::isfinite(variance) ? std::sqrt(variance) : otherwise;
}

/// Beyond its limits, or infinite where it sees nothing (REP 117).
RangeSample range_of(MessageFields& in, Encoding encoding) {
  RangeSample r;
  in.get<std::uint8_t>();  // sound or light
  in.get<float>();         // field of view
  r.nearest_m = in.get<float>(), r.farthest_m = in.get<float>();
  r.distance_m = in.get<float>();
  if (encoding == Encoding::cdr)
    if (MessageFields behind = in; true) {  // since ROS 2 Iron
      const double variance = behind.get<float>();
      if (behind.ok()) r.sigma_m = sigma_of(variance, r.sigma_m);
    }
  if (std::isnan(r.distance_m)) r.distance_m = std::numeric_limits<double>::infinity();
  return r;
}

VelocitySample velocity_of(MessageFields& in) {
  VelocitySample r;
  r.v_mps = in.vector();
  in.skip_doubles(3);  // angular
  for (int row = 0; row < 3; ++row) {
    in.skip_doubles(row == 0 ? 0 : 6);
    const double variance = in.get<double>();
    r.sigma_mps(row) = std::min(sigma_of(variance, kUnknownTwist_mps), kUnmeasured_mps);
  }
  in.skip_doubles(36 - 15);
  return r;
}

/// Puts numbers one behind the other, as ROS 1 has them.
class PackedWriter {
 public:
  explicit PackedWriter(std::string& out) : out_(out) {}
  template <class Number>
  void put(Number value) {
    append_le(out_, value);
  }
  void header(Time t, std::string_view frame) {
    put(std::uint32_t{0});  // sequence
    put(static_cast<std::uint32_t>(t.ns / kSecond_ns));
    put(static_cast<std::uint32_t>(t.ns % kSecond_ns));
    put(static_cast<std::uint32_t>(frame.size()));
    out_.append(frame);
  }

 private:
  std::string& out_;
};

class AlignedWriter {
 public:
  explicit AlignedWriter(std::string& out) : cdr_(out) {}
  template <class Number>
  void put(Number value) {
    cdr_.put(value);
  }
  void header(Time t, std::string_view frame) {
    put(static_cast<std::int32_t>(t.ns / kSecond_ns));
    put(static_cast<std::uint32_t>(t.ns % kSecond_ns));
    cdr_.text(frame);
  }

 private:
  CdrWriter cdr_;
};

template <class Writer>
void put(Writer& out, const RangeSample& r) {
  constexpr std::uint8_t kInfrared = 1;
  out.put(kInfrared);
  out.put(0.0f);
  for (const double number : {r.nearest_m, r.farthest_m, r.distance_m}) out.put(static_cast<float>(number));
  if constexpr (std::is_same_v<Writer, AlignedWriter>) out.put(static_cast<float>(r.sigma_m * r.sigma_m));
}
template <class Writer>
void put(Writer& out, const VelocitySample& r) {
  for (int k = 0; k < 6; ++k) out.put(k < 3 ? r.v_mps(k) : 0.0);
  for (int k = 0; k < 36; ++k) out.put(k % 7 == 0 && k < 21 ? r.sigma_mps(k / 7) * r.sigma_mps(k / 7) : 0.0);
}
template <class Writer>
void put(Writer& out, const PressureSample& r) {
  out.put(r.pressure_pa);
  out.put(r.sigma_pa * r.sigma_pa);
}

template <class Writer>
std::string written(const AidingSample& reading, std::string_view frame) {
  std::string bytes;
  Writer out(bytes);
  out.header(stamp_of(reading), frame);
  std::visit([&](const auto& r) { put(out, r); }, reading);
  return bytes;
}

}  // namespace

bool is_aiding_type(std::string_view type) { return type == kRange || type == kTwist || type == kPressure; }

std::optional<AidingMessage> aiding_of(std::string_view bytes, Encoding encoding, std::string_view type) {
  MessageFields in(bytes, encoding);
  const Time t = in.header();
  AidingMessage out{PressureSample{}, std::string(in.frame())};
  if (type == kRange) out.reading = range_of(in, encoding);
  else if (type == kTwist) out.reading = velocity_of(in);
  else {
    const double pressure_pa = in.get<double>(), variance = in.get<double>();
    out.reading = PressureSample{t, pressure_pa, sigma_of(variance, PressureSample{}.sigma_pa)};
  }
  stamp_of(out.reading) = t;
  if (!in.ok() || !impossible(out.reading).empty()) return std::nullopt;
  return out;
}

std::string aiding_message(const AidingSample& reading, std::string_view frame, Encoding encoding) {
  return encoding == Encoding::cdr ? written<AlignedWriter>(reading, frame) : written<PackedWriter>(reading, frame);
}

std::optional<Pose<B, B>> mounting_of(const AidingSample& reading) {
  using Place = std::optional<Pose<B, B>>;
  return std::visit(Overloaded{[](const RangeSample& r) -> Place {
                                 return Pose<B, B>{so3_between(Vec3::UnitX(), r.direction_B), r.p_B};
                               },
                               [](const VelocitySample& r) -> Place {
                                 return Pose<B, B>{r.q_BS, r.p_B};
                               },
                               [](const PressureSample&) -> Place { return std::nullopt; }},
                    reading);
}

AidingSample mounted(AidingSample reading, const Pose<B, B>& T_BS) {
  std::visit(Overloaded{[&](RangeSample& r) { r.p_B = T_BS.p, r.direction_B = T_BS.q * Vec3::UnitX(); },
                        [&](VelocitySample& r) { r.p_B = T_BS.p, r.q_BS = T_BS.q; }, [](PressureSample&) {}},
             reading);
  return reading;
}

std::string_view aiding_name(const AidingSample& reading) {
  constexpr std::array<std::string_view, 3> kNames = {"range", "velocity", "baro"};
  static_assert(kNames.size() == std::variant_size_v<AidingSample>);
  return kNames[reading.index()];
}

std::string_view aiding_type(const AidingSample& reading) {
  constexpr std::array<std::string_view, 3> kTypes = {kRange, kTwist, kPressure};
  static_assert(kTypes.size() == std::variant_size_v<AidingSample>);
  return kTypes[reading.index()];
}

bool is_own_aiding_topic(std::string_view topic) {
  for (const AidingSample& kind : {AidingSample(RangeSample{}), AidingSample(VelocitySample{}), AidingSample(PressureSample{})}) {
    const std::string begin = fmt::format("/{}", aiding_name(kind));
    if (topic.starts_with(begin) && topic.size() > begin.size() &&
        std::ranges::all_of(topic.substr(begin.size()), [](char c) { return c >= '0' && c <= '9'; }))
      return true;
  }
  return false;
}

AidingSensors::Sensor* AidingSensors::find(const AidingSample& reading) {
  const auto T_BS = mounting_of(reading);
  const auto same = [&](const Sensor& s) {
    return s.type == aiding_type(reading) && (!T_BS || (s.T_BS->p == T_BS->p && s.T_BS->q.coeffs() == T_BS->q.coeffs()));
  };
  const auto at = std::ranges::find_if(all_, same);
  return at == all_.end() ? nullptr : &*at;
}

AidingSensors::Sensor& AidingSensors::add(const AidingSample& reading, std::size_t topic) {
  const std::string_view type = aiding_type(reading);
  const auto number = std::ranges::count(all_, type, &Sensor::type);
  return all_.emplace_back(Sensor{fmt::format("{}{}", aiding_name(reading), number), mounting_of(reading), type, topic});
}

}  // namespace fbvins
