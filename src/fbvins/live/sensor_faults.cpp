// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/sensor_faults.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <string_view>
#include <utility>

namespace fbvins {
namespace {

using Kind = SensorFault::Kind;

struct KindName {
  std::string_view name;
  Kind kind;
  bool has_amount;
  double largest_amount;
};

constexpr std::array<KindName, 10> kKinds{{{"camera_off", Kind::camera_off, false, 0},
                                           {"left_off", Kind::left_off, false, 0},
                                           {"right_off", Kind::right_off, false, 0},
                                           {"left_frozen", Kind::left_frozen, false, 0},
                                           {"right_frozen", Kind::right_frozen, false, 0},
                                           {"imu_off", Kind::imu_off, false, 0},
                                           {"unplugged", Kind::unplugged, false, 0},
                                           {"lose_images", Kind::lose_images, true, 1},
                                           {"burst", Kind::burst, true, 10},
                                           {"leap", Kind::leap, true, 1e6}}};

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text)
    if (c == ':') parts.emplace_back();
    else parts.back() += c;
  return parts;
}

std::optional<double> number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

Result<SensorFault> parse_fault(const std::string& text) {
  const auto refuse = [&](const std::string& why) {
    return Error{ErrorCode::invalid_argument, fmt::format("fault '{}': {}; it is KIND:START:LENGTH[:AMOUNT]", text, why)};
  };
  const std::vector<std::string> parts = split(text);
  std::string known;
  for (const KindName& kind : kKinds) {
    known += fmt::format("{}{}", known.empty() ? "" : ", ", kind.name);
    if (kind.name != parts[0]) continue;
    if (parts.size() != (kind.has_amount ? 4u : 3u))
      return refuse(fmt::format("{} has {}", kind.name, kind.has_amount ? "an AMOUNT" : "no AMOUNT"));
    const std::optional<double> start = number(parts[1]), length = number(parts[2]);
    const std::optional<double> amount = kind.has_amount ? number(parts[3]) : 0.0;
    if (!start || !length || !amount || *start < 0 || *length <= 0) return refuse("times are numbers, START >= 0, LENGTH > 0");
    if (std::abs(*amount) > kind.largest_amount) return refuse(fmt::format("AMOUNT is at most {}", kind.largest_amount));
    if (*amount <= 0 && kind.kind != Kind::leap && kind.has_amount) return refuse("AMOUNT is more than 0");
    return SensorFault{kind.kind, *start, *length, *amount};
  }
  return refuse(fmt::format("there are {}", known));
}

const SensorFault* FaultyInput::active(Kind kind, Time t) const {
  const double since_s = (t - *first_).seconds();
  for (const SensorFault& fault : faults_)
    if (fault.kind == kind && since_s >= fault.start_s && since_s < fault.start_s + fault.length_s) return &fault;
  return nullptr;
}

void FaultyInput::push(const ImuSample& sample) {
  if (!first_) first_ = sample.t;
  if (active(Kind::imu_off, sample.t) || active(Kind::unplugged, sample.t)) return;
  pass(sample, sample.t);
}

void FaultyInput::push(StereoFrame frame) {
  if (!first_) first_ = frame.t;
  const Time t = frame.t;
  if (active(Kind::camera_off, t) || active(Kind::unplugged, t)) return;
  if (const SensorFault* lost = active(Kind::lose_images, t))
    if (rng_.uniform() < lost->amount) return;
  if (active(Kind::left_off, t)) frame.left.reset();
  else if (active(Kind::left_frozen, t)) frame.left = left_;
  if (active(Kind::right_off, t)) frame.right.reset();
  else if (active(Kind::right_frozen, t)) frame.right = right_;
  left_ = frame.left, right_ = frame.right;
  pass(std::move(frame), t);
}

Time FaultyInput::leapt(Time t) const {
  const SensorFault* leap = active(Kind::leap, t);
  return leap ? t + Duration::from_seconds(leap->amount) : t;
}

void FaultyInput::pass(SensorEvent event, Time t) {
  std::visit([&](auto& e) { e.t = leapt(t); }, event);
  if (held_until_ && t >= *held_until_) deliver_held();
  if (const SensorFault* burst = active(Kind::burst, t); burst && !held_until_)
    held_until_ = t + Duration::from_seconds(burst->amount);
  held_.push_back(std::move(event));
  if (!held_until_) deliver_held();
}

void FaultyInput::deliver_held() {
  held_until_.reset();
  for (SensorEvent& event : std::exchange(held_, {})) std::visit([&](auto& e) { input_.push(std::move(e)); }, event);
}

}  // namespace fbvins
