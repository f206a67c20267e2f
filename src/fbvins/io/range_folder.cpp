// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/range_folder.hpp"

#include <fmt/format.h>

#include <utility>

#include "fbvins/io/calibration.hpp"
#include "fbvins/io/csv.hpp"
#include "fbvins/io/euroc_rows.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

constexpr double kLargest_m = 1e4;

/// A reading without what its sensor says: that it sees nothing may be written as inf.
class RangeRowParser {
 public:
  RowVerdict operator()(std::string_view line, RangeSample& reading, std::string& problem) {
    split_at_commas(line, fields_);
    if (fields_.size() != 2) {
      problem = fmt::format("{} columns where 2 are needed", fields_.size());
      return RowVerdict::malformed;
    }
    const auto stamp = parse_nanoseconds(fields_[0]);
    if (!stamp) {
      problem = fmt::format("'{}' is not a stamp in nanoseconds", fields_[0].substr(0, 40));
      return RowVerdict::malformed;
    }
    reading.t = *stamp;
    if (fields_[1] == "inf") return reading.distance_m = kLargest_m, RowVerdict::good;
    const RowVerdict verdict = parse_doubles(fields_, 1, 1, kLargest_m, &reading.distance_m);
    if (verdict != RowVerdict::good) problem = "a value is not a usable number";
    return verdict;
  }

 private:
  std::vector<std::string_view> fields_;
};

}  // namespace

Result<std::vector<RangeSample>> parse_ranges(YamlReader yaml, const std::string& csv, const std::string& file,
                                              const Pose<B, B>& T_BI, std::vector<std::string>& warnings) {
  RangeSample beam;
  const auto number = [&](const char* key, double least, double most, double otherwise) {
    return yaml.has(yaml.root(), key) ? yaml.number_between(yaml.root(), key, least, most, otherwise) : otherwise;
  };
  beam.sigma_m = number("noise_m", 1e-4, 10, beam.sigma_m);
  beam.nearest_m = number("nearest_m", 0, 1000, beam.nearest_m);
  beam.farthest_m = number("farthest_m", beam.nearest_m, 1000, beam.farthest_m);
  if (!yaml.ok()) return yaml.error();
  const Result<Pose<B, B>> mounting = parse_euroc_mounting(std::move(yaml));
  if (!mounting) return mounting.error();
  const Pose<B, B> T_IS = T_BI.inverse() * *mounting;
  beam.p_B = T_IS.p;
  beam.direction_B = T_IS.q * Vec3::UnitX();
  Result<StampedRows<RangeSample>> rows = read_stamped_rows<RangeSample>(csv, file, RangeRowParser{});
  if (!rows) return rows.error();
  for (std::string& warning : row_warnings(rows->counts, file)) warnings.push_back(std::move(warning));
  for (RangeSample& reading : rows->rows) {
    const RangeSample read = std::exchange(reading, beam);
    reading.t = read.t, reading.distance_m = read.distance_m;
  }
  return std::move(rows->rows);
}

std::string range_yaml(const RangeSample& beam, const std::string& origin) {
  const Mat3 R = Quat::FromTwoVectors(Vec3::UnitX(), beam.direction_B).toRotationMatrix();
  std::string text = fmt::format("sensor_type: range\ncomment: {}, along x\n\nT_BS:\n  cols: 4\n  rows: 4\n  data: [", origin);
  for (int r = 0; r < 3; ++r) text += fmt::format("{}, {}, {}, {},\n         ", R(r, 0), R(r, 1), R(r, 2), beam.p_B[r]);
  return text + fmt::format("0.0, 0.0, 0.0, 1.0]\nnoise_m: {}\nnearest_m: {}\nfarthest_m: {}\n", beam.sigma_m, beam.nearest_m,
                            beam.farthest_m);
}

std::string range_csv(const std::vector<RangeSample>& readings) {
  std::string text = "#timestamp [ns],distance [m]\n";
  for (const RangeSample& r : readings) text += fmt::format("{},{}\n", r.t.ns, r.distance_m);
  return text;
}

}  // namespace fbvins
