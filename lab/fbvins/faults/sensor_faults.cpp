// SPDX-License-Identifier: Apache-2.0
#include "fbvins/faults/sensor_faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/text.hpp"

namespace fbvins {
namespace {

using Kind = SensorFault::Kind;

using Reading = ReadingFault;
using Img = ImageFault;

constexpr FaultName kNames[] = {
    {"camera_off", Kind::camera_off},
    {"left_off", Kind::camera_off, "", 0, 0, 0, false, {}, {}, 0},
    {"right_off", Kind::camera_off, "", 0, 0, 0, false, {}, {}, 1},
    {"imu_off", Kind::imu_off},
    {"unplugged", Kind::unplugged},
    {"lose_images", Kind::lose_images, "of 1", 0.1, 0.9, 1},
    {"lose_readings", Kind::lose_readings, "of 1", 0.1, 0.9, 1},
    {"burst", Kind::burst, "s", 0.05, 0.5, 10},
    {"leap", Kind::leap, "s", 0.03, 5, 1e6, true},
    {"imu_leap", Kind::imu_leap, "s", 0.01, 0.3, 1e6, true},
    {"image_leap", Kind::image_leap, "s", 0.01, 0.3, 1e6, true},
    {"imu_jitter", Kind::imu_jitter, "s", 0.0005, 0.01, 1},
    {"imu_frozen", Kind::reading, "", 0, 0, 0, false, Reading::frozen},
    {"imu_every_fourth", Kind::reading, "", 0, 0, 0, false, Reading::every_fourth},
    {"imu_zero", Kind::reading, "", 0, 0, 0, false, Reading::zero},
    {"imu_nan", Kind::reading, "", 0, 0, 0, false, Reading::nan},
    {"imu_noise", Kind::reading, "m/s^2", 0.5, 10, 1e3, false, Reading::noise},
    {"vibration", Kind::reading, "m/s^2", 0.5, 15, 1e3, false, Reading::vibration},
    {"imu_spikes", Kind::reading, "m/s^2", 5, 150, 1e6, false, Reading::spikes},
    {"gyro_clipped", Kind::reading, "rad/s", 0.1, 1, 1e3, false, Reading::gyro_clipped},
    {"accel_clipped", Kind::reading, "m/s^2", 5, 12, 1e3, false, Reading::accel_clipped},
    {"gyro_bias", Kind::reading, "rad/s", 0.01, 0.5, 1e3, true, Reading::gyro_bias},
    {"accel_bias", Kind::reading, "m/s^2", 0.1, 5, 1e3, true, Reading::accel_bias},
    {"gyro_drift", Kind::reading, "rad/s^2", 0.005, 0.2, 1e3, true, Reading::gyro_drift},
    {"gyro_scale", Kind::reading, "%", 2, 100, 1e4, true, Reading::gyro_scale},
    {"accel_scale", Kind::reading, "%", 1, 50, 1e4, true, Reading::accel_scale},
    {"gyro_axis_dead", Kind::reading, "", 0, 0, 0, false, Reading::gyro_axis_dead},
    {"accel_axis_dead", Kind::reading, "", 0, 0, 0, false, Reading::accel_axis_dead},
    {"gyro_flipped", Kind::reading, "", 0, 0, 0, false, Reading::gyro_flipped},
    {"imu_axes_exchanged", Kind::reading, "", 0, 0, 0, false, Reading::axes_exchanged},
    {"imu_loose", Kind::reading, "degrees", 2, 60, 180, true, Reading::loose},
    {"left_frozen", Kind::image, "", 0, 0, 0, false, {}, Img::frozen, 0},
    {"right_frozen", Kind::image, "", 0, 0, 0, false, {}, Img::frozen, 1},
    {"cycle", Kind::image, "frames", 2, 8, 32, false, {}, Img::cycle},
    {"each_twice", Kind::image, "", 0, 0, 0, false, {}, Img::each_twice},
    {"left_late", Kind::image, "", 0, 0, 0, false, {}, Img::late, 0},
    {"right_late", Kind::image, "", 0, 0, 0, false, {}, Img::late, 1},
    {"exchanged", Kind::image, "", 0, 0, 0, false, {}, Img::exchanged},
    {"same_twice", Kind::image, "", 0, 0, 0, false, {}, Img::same_twice},
    {"black", Kind::image, "", 0, 0, 0, false, {}, Img::black},
    {"white", Kind::image, "", 0, 0, 0, false, {}, Img::white},
    {"left_black", Kind::image, "", 0, 0, 0, false, {}, Img::black, 0},
    {"blank", Kind::image, "", 0, 0, 0, false, {}, Img::blank},
    {"dark", Kind::image, "of 1", 0.005, 0.2, 1, false, {}, Img::dark},
    {"image_noise", Kind::image, "grey levels", 5, 60, 1e3, false, {}, Img::noise},
    {"blur", Kind::image, "px", 3, 41, 1e3, false, {}, Img::blur},
    {"covered", Kind::image, "of 1", 0.3, 0.9, 1, false, {}, Img::covered},
    {"right_covered", Kind::image, "of 1", 0.3, 1, 1, false, {}, Img::covered, 1},
    {"flicker", Kind::image, "of 1", 0.05, 0.7, 1, false, {}, Img::flicker},
    {"right_darker", Kind::image, "of 1", 0.05, 0.7, 1, false, {}, Img::dark, 1},
    {"torn", Kind::image, "", 0, 0, 0, false, {}, Img::torn},
    {"broken_blocks", Kind::image, "of 1", 0.02, 0.7, 1, false, {}, Img::broken_blocks},
    {"scroll", Kind::image, "px", 0.5, 12, 1e3, true, {}, Img::scroll},
    {"right_shifted", Kind::image, "px", 1, 20, 1e3, true, {}, Img::shifted, 1},
    {"right_turned", Kind::image, "degrees", 0.3, 5, 180, true, {}, Img::turned, 1},
    {"both_turned", Kind::image, "degrees", 0.5, 20, 180, true, {}, Img::turned},
    {"mirrored", Kind::image, "", 0, 0, 0, false, {}, Img::mirrored},
};

/// Of one camera, beside those of kNames that are of all.
constexpr FaultName kOfOneCamera[] = {
    {"off", Kind::camera_off},
    {"frozen", Kind::image, "", 0, 0, 0, false, {}, Img::frozen},
    {"late", Kind::image, "", 0, 0, 0, false, {}, Img::late},
    {"shifted", Kind::image, "px", 1, 20, 1e3, true, {}, Img::shifted},
    {"turned", Kind::image, "degrees", 0.3, 5, 180, true, {}, Img::turned},
};

/// What may happen to one camera alone, under its name without the camera.
std::vector<FaultName> names_of_one_camera() {
  std::vector<FaultName> out(std::begin(kOfOneCamera), std::end(kOfOneCamera));
  for (const FaultName& name : kNames)
    if (name.kind == Kind::image && name.camera == kAllCameras && name.image != Img::exchanged && name.image != Img::same_twice &&
        name.image != Img::turned)
      out.push_back(name);
  return out;
}

/// "camera3_off": what "off" is, of camera 3. None where it is no such name.
std::optional<FaultName> of_one_camera(std::string_view kind) {
  constexpr std::string_view kBegin = "camera";
  if (!kind.starts_with(kBegin) || kind.size() < kBegin.size() + 2 || kind[kBegin.size() + 1] != '_') return std::nullopt;
  const int camera = kind[kBegin.size()] - '0';
  if (camera < 0 || camera >= kMostCameras) return std::nullopt;
  for (FaultName name : names_of_one_camera())
    if (name.name == kind.substr(kBegin.size() + 2)) return name.camera = camera, name;
  return std::nullopt;
}

std::optional<FaultName> name_of(std::string_view kind) {
  for (const FaultName& name : kNames)
    if (name.name == kind) return name;
  return of_one_camera(kind);
}

std::string known_names() {
  std::string out;
  for (const FaultName& name : kNames) out += fmt::format("{}{}", out.empty() ? "" : ", ", name.name);
  out += "; and of one camera, by its number";
  for (const FaultName& name : names_of_one_camera()) out += fmt::format(", camera2_{}", name.name);
  return out;
}

}  // namespace

std::span<const FaultName> fault_names() { return kNames; }

Result<SensorFault> parse_fault(const std::string& text) {
  const auto refuse = [&](const std::string& why) {
    return Error{ErrorCode::invalid_argument, fmt::format("fault '{}': {}; it is KIND:START:LENGTH[:AMOUNT]", text, why)};
  };
  const std::vector<std::string> parts = split(text, ':');
  const std::optional<FaultName> name = name_of(parts[0]);
  if (!name) return refuse(fmt::format("there are {}", known_names()));
  const bool has_amount = !name->unit.empty();
  if (parts.size() != (has_amount ? 4u : 3u))
    return refuse(has_amount ? fmt::format("{} has an AMOUNT ({})", parts[0], name->unit)
                             : fmt::format("{} has no AMOUNT", parts[0]));
  const std::optional<double> start = number_in<double>(parts[1]), length = number_in<double>(parts[2]);
  const std::optional<double> amount = has_amount ? number_in<double>(parts[3]) : 0.0;
  if (!start || !length || !amount || *start < 0 || *length <= 0) return refuse("times are numbers, START >= 0, LENGTH > 0");
  if (std::abs(*amount) > name->most) return refuse(fmt::format("AMOUNT is at most {}", name->most));
  if (has_amount && !name->both_signs && *amount <= 0) return refuse("AMOUNT is more than 0");
  return SensorFault{name->kind, *start, *length, *amount, name->reading, name->image, name->camera};
}

FaultyInput::FaultyInput(SensorInput& input, std::vector<SensorFault> faults, std::uint64_t seed) : input_(input), rng_(seed) {
  for (const SensorFault& f : faults)
    injected_.push_back(
        {f, ReadingFaultInjector(f.reading, f.amount, seed), ImageFaultInjector(f.image, f.camera, f.amount, seed)});
}

bool FaultyInput::active(const SensorFault& fault, Time t) const {
  const double since_s = (t - *first_).seconds();
  return since_s >= fault.start_s && since_s < fault.start_s + fault.length_s;
}

const SensorFault* FaultyInput::active(Kind kind, Time t) const {
  for (const Injected& i : injected_)
    if (i.fault.kind == kind && active(i.fault, t)) return &i.fault;
  return nullptr;
}

bool FaultyInput::camera_is_off(int camera, Time t) const {
  return std::ranges::any_of(injected_, [&](const Injected& i) {
    return i.fault.kind == Kind::camera_off && i.fault.camera == camera && active(i.fault, t);
  });
}

void FaultyInput::push(const ImuSample& sample) {
  if (!first_) first_ = sample.t;
  const Time t = sample.t;
  if (active(Kind::imu_off, t) || active(Kind::unplugged, t)) return;
  if (const SensorFault* lost = active(Kind::lose_readings, t))
    if (rng_.uniform() < lost->amount) return;
  ImuSample altered = sample;
  for (Injected& i : injected_) {
    if (i.fault.kind != Kind::reading) continue;
    if (active(i.fault, t)) i.reading.alter(altered);
  }
  altered.t = t + leap(Kind::imu_leap, t);
  if (const SensorFault* jitter = active(Kind::imu_jitter, t))
    altered.t = altered.t + Duration::from_seconds(jitter->amount * rng_.normal());
  pass(altered, t);
}

void FaultyInput::push(StereoFrame frame) {
  if (!first_) first_ = frame.t;
  const Time t = frame.t;
  if (camera_is_off(kAllCameras, t) || active(Kind::unplugged, t)) return;
  if (const SensorFault* lost = active(Kind::lose_images, t))
    if (rng_.uniform() < lost->amount) return;
  for (Injected& i : injected_) {
    if (i.fault.kind != Kind::image) continue;
    i.image.see(frame);
    if (active(i.fault, t)) i.image.alter(frame);
  }
  for (int i = 0; i < kMostCameras; ++i)
    if (std::shared_ptr<const Image>* image = image_in(frame, i); image != nullptr && camera_is_off(i, t)) image->reset();
  frame.t = t + leap(Kind::image_leap, t);
  pass(std::move(frame), t);
}

/// How much later a stamp is, by a leap of all clocks and of that of its own kind.
Duration FaultyInput::leap(Kind own, Time t) const {
  const SensorFault *all = active(Kind::leap, t), *one = active(own, t);
  return Duration::from_seconds((all ? all->amount : 0) + (one ? one->amount : 0));
}

void FaultyInput::pass(SensorEvent event, Time t) {
  if (held_until_ && t >= *held_until_) deliver_held();
  if (const SensorFault* burst = active(Kind::burst, t); burst && !held_until_)
    held_until_ = t + Duration::from_seconds(burst->amount);
  held_.push_back(std::move(event));
  if (!held_until_) deliver_held();
}

void FaultyInput::deliver_held() {
  held_until_.reset();
  for (SensorEvent& event : std::exchange(held_, {})) push_event(input_, std::move(event));
}

}  // namespace fbvins
