// SPDX-License-Identifier: Apache-2.0
// Readings that are missing, and what drivers put in their place.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>

#include "tests/support/setup_fault_lists.hpp"

namespace fbvins::setup_fault {
namespace {

/// Time since the first reading, s.
struct SinceFirst {
  std::shared_ptr<std::optional<Time>> first = std::make_shared<std::optional<Time>>();
  double operator()(Time t) const {
    if (!*first) *first = t;
    return (t - **first).seconds();
  }
};

/// Readings are lost for the first `gap_s` of every `every_s`, but for the first of these.
SetupFault gaps(std::string name, double gap_s, double every_s) {
  return {std::move(name), FindingKind::imu_gaps, 0, 0, {}, {}, {}, [=, since = SinceFirst()](const ImuSample& s) {
            const double t = since(s.t);
            return t > every_s && std::fmod(t, every_s) < gap_s;
          }};
}

/// The same, filled with the last reading or with zeros.
SetupFault filled(std::string name, double gap_s, double every_s, bool zeros) {
  auto last = std::make_shared<ImuSample>();
  return {std::move(name), FindingKind::imu_gaps, 0, 0, {}, [=, since = SinceFirst()](ImuSample& s) {
            const double t = since(s.t);
            if (!(t > every_s && std::fmod(t, every_s) < gap_s)) *last = s;
            else
              s.gyro_radps = zeros ? Vec3(Vec3::Zero()) : last->gyro_radps,
              s.accel_mps2 = zeros ? Vec3(Vec3::Zero()) : last->accel_mps2;
          }};
}

/// Readings lost once, after which stamps are counted on.
SetupFault closed_up(double at_s, double gap_s) {
  const SinceFirst since;
  return {fmt::format("{:.0f} ms of readings lost, and stamps counted on", 1e3 * gap_s),
          FindingKind::clocks_drift,
          -1e3 * gap_s,
          kTenth * 1e3 * gap_s,
          {},
          [=](ImuSample& s) {
            if (since(s.t) > at_s) s.t = s.t - Duration::from_seconds(gap_s);
          },
          {},
          [=](const ImuSample& s) { return since(s.t) >= at_s && since(s.t) < at_s + gap_s; }};
}

SetupFault in_blocks(int size) {
  auto state = std::make_shared<std::pair<int, Time>>();
  return {fmt::format("readings stamped in blocks of {}", size), FindingKind::imu_stamps, 0, 0, {}, [=](ImuSample& s) {
            if (state->first % size == 0) state->second = s.t;
            s.t = state->second + Duration{20'000 * (state->first++ % size)};
          }};
}

}  // namespace

std::vector<SetupFault> of_gaps() {
  auto count = std::make_shared<int>(0);
  return {
      {"one reading in ten lost",
       FindingKind::imu_gaps,
       0,
       0,
       {},
       {},
       {},
       [count](const ImuSample&) { return ++*count % 10 == 0; }},
      gaps("30 ms of readings lost every second", 0.03, 1),
      gaps("200 ms of readings lost every 5 s", 0.2, 5),
      {"readings begin 1 s late",
       FindingKind::imu_gaps,
       0,
       0,
       {},
       {},
       {},
       [since = SinceFirst()](const ImuSample& s) { return since(s.t) < 1; }},
      filled("the last reading in place of lost ones, 100 ms every 3 s", 0.1, 3, false),
      filled("zeros in place of lost readings, 100 ms every 3 s", 0.1, 3, true),
      closed_up(5, 0.1),
      in_blocks(10),
  };
}

}  // namespace fbvins::setup_fault
