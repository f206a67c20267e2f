// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/no_overlap.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

/// Of stamps, as a ratio: a recording begins at one time.
constexpr double kSameTime = 0.1;
/// Zones of time are apart by whole quarters of an hour; recordings of one flight begin within so much of one another.
constexpr double kZone_s = 900, kSameBegin_s = 30;
/// Clocks that count from power-on show less than this, those that know the date more (September 2001).
constexpr double kSinceEpoch_s = 1e9, kSincePowerOn_s = 1e8;

/// In which unit stamps are that are so many times smaller than nanoseconds; null where in none.
const char* unit_of(double times) {
  constexpr std::pair<double, const char*> kUnits[] = {{1e3, "microseconds"}, {1e6, "milliseconds"}, {1e9, "seconds"}};
  for (const auto& [factor, unit] : kUnits)
    if (std::abs(times / factor - 1) < kSameTime) return unit;
  return nullptr;
}

std::string why_apart(Time reading, Time image, bool part) {
  const double readings_s = Duration{reading.ns}.seconds(), images_s = Duration{image.ns}.seconds();
  const double times = readings_s > 0 && images_s > 0 ? images_s / readings_s : 1;
  for (const bool of_readings : {true, false})
    if (const char* unit = unit_of(of_readings ? times : 1 / times))
      return fmt::format("they differ by a factor of {:.0f}: the {} stamps look like {}, where nanoseconds are read",
                         std::pow(10, std::round(std::log10(of_readings ? times : 1 / times))),
                         of_readings ? "readings'" : "images'", unit);
  for (const bool of_readings : {true, false})
    if ((of_readings ? readings_s : images_s) < kSincePowerOn_s && (of_readings ? images_s : readings_s) > kSinceEpoch_s)
      return fmt::format("the {} stamps count from a device's power-on: stamp both by one clock",
                         of_readings ? "readings'" : "images'");
  const double apart_s = readings_s - images_s, zones = std::round(apart_s / kZone_s);
  const std::string by = fmt::format("the clocks are {:.3f} s apart", std::abs(apart_s));
  if (zones != 0 && std::abs(apart_s - zones * kZone_s) < kSameBegin_s)
    return fmt::format("{}, about {:.2f} hours, as local time is of UTC: stamp both by one clock", by, std::abs(zones) / 4);
  return part ? "there are no readings in this part of the recording" : by + ": stamp both by one clock";
}

}  // namespace

Error no_overlap(const std::string& name, const StampRange& readings, const StampRange& images, bool part) {
  return {ErrorCode::malformed,
          fmt::format("{}: stamps {} to {} s do not overlap the images' {} to {} s: {}", name, format_seconds(readings.first),
                      format_seconds(readings.last), format_seconds(images.first), format_seconds(images.last),
                      why_apart(readings.first, images.first, part))};
}

std::string shared_stamps(int rows, int duplicates) {
  constexpr double kMany = 0.1;
  if (duplicates < kMany * rows) return "";
  return fmt::format(
      "{} rows have the stamp of another: what arrives in a block needs a stamp for each, by the sensor's own clock or "
      "its rate",
      duplicates);
}

}  // namespace fbvins
