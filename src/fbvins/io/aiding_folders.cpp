// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/aiding_folders.hpp"

#include <fmt/format.h>

#include <array>
#include <map>
#include <utility>

#include "fbvins/geometry/so3.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/csv.hpp"
#include "fbvins/io/euroc_rows.hpp"
#include "fbvins/io/stamped_numbers.hpp"

namespace fbvins {
namespace {

constexpr double kLargestRange_m = 1e4, kLargestVelocity_mps = 1e3, kLargestPressure_pa = 2e5;

double number(YamlReader& yaml, const char* key, double least, double most, double otherwise) {
  return yaml.has(yaml.root(), key) ? yaml.number_between(yaml.root(), key, least, most, otherwise) : otherwise;
}

/// From the sensor's axes to the IMU's.
Result<Pose<B, B>> mounting(AidingFiles& files) {
  if (!files.sensor.ok()) return files.sensor.error();
  const Result<Pose<B, B>> T_BS = parse_euroc_mounting(std::move(files.sensor));
  return T_BS ? Result<Pose<B, B>>(files.T_BI.inverse() * *T_BS) : T_BS.error();
}

/// `make(row)`: a reading of each row.
template <class Make>
Result<std::vector<AidingSample>> rows_of(const AidingFiles& files, NumbersRowParser parser, std::vector<std::string>& warnings,
                                          const Make& make) {
  const Result<StampedRows<StampedNumbers>> rows = read_stamped_rows<StampedNumbers>(files.csv, files.file, std::move(parser));
  if (!rows) return rows.error();
  for (std::string& warning : row_warnings(rows->counts, files.file)) warnings.push_back(std::move(warning));
  std::vector<AidingSample> out;
  int refused = 0;
  for (const StampedNumbers& row : rows->rows) {
    AidingSample reading = make(row);
    if (impossible(reading).empty()) out.push_back(std::move(reading));
    else ++refused;
  }
  if (refused > 0) warnings.push_back(fmt::format("{}: {} readings that cannot be are left out", files.file, refused));
  return out;
}

Result<std::vector<AidingSample>> parse_ranges(AidingFiles files, std::vector<std::string>& warnings) {
  RangeSample beam;
  beam.sigma_m = number(files.sensor, "noise_m", 1e-4, 10, beam.sigma_m);
  beam.nearest_m = number(files.sensor, "nearest_m", 0, 1000, beam.nearest_m);
  beam.farthest_m = number(files.sensor, "farthest_m", beam.nearest_m, 1000, beam.farthest_m);
  const Result<Pose<B, B>> T_IS = mounting(files);
  if (!T_IS) return T_IS.error();
  beam.p_B = T_IS->p;
  beam.direction_B = T_IS->q * Vec3::UnitX();
  return rows_of(files, NumbersRowParser({1}, kLargestRange_m, true), warnings, [&](const StampedNumbers& row) {
    beam.t = row.t, beam.distance_m = row.values[0];
    return beam;
  });
}

Result<std::vector<AidingSample>> parse_velocities(AidingFiles files, std::vector<std::string>& warnings) {
  VelocitySample sensor;
  if (files.sensor.has(files.sensor.root(), "noise_mps")) {
    const std::vector<double> noise = files.sensor.numbers(files.sensor.root(), "noise_mps", 3);
    if (files.sensor.ok()) sensor.sigma_mps = Vec3(noise.data());
    if (!(sensor.sigma_mps.minCoeff() > 0))
      return Error{ErrorCode::malformed, fmt::format("{}: noise_mps of sensor.yaml is not positive", files.file)};
  }
  const Result<Pose<B, B>> T_IS = mounting(files);
  if (!T_IS) return T_IS.error();
  sensor.p_B = T_IS->p, sensor.q_BS = T_IS->q;
  return rows_of(files, NumbersRowParser({3, 6}, kLargestVelocity_mps, false), warnings, [&](const StampedNumbers& row) {
    VelocitySample reading = sensor;
    reading.t = row.t, reading.v_mps = Vec3(row.values.data());
    if (row.count == 6) reading.sigma_mps = Vec3(row.values.data() + 3);
    return reading;
  });
}

Result<std::vector<AidingSample>> parse_pressures(AidingFiles files, std::vector<std::string>& warnings) {
  PressureSample sensor;
  sensor.sigma_pa = number(files.sensor, "noise_pa", 1e-3, 1000, sensor.sigma_pa);
  if (!files.sensor.ok()) return files.sensor.error();
  return rows_of(files, NumbersRowParser({1}, kLargestPressure_pa, false), warnings, [&](const StampedNumbers& row) {
    sensor.t = row.t, sensor.pressure_pa = row.values[0];
    return sensor;
  });
}

constexpr std::array kFolders = {AidingFolder{"range", parse_ranges}, AidingFolder{"velocity", parse_velocities},
                                 AidingFolder{"baro", parse_pressures}};

std::string yaml_of(const char* type, const std::string& origin, const Quat& q, const Vec3& p, const std::string& figures) {
  const Mat3 R = q.toRotationMatrix();
  std::string text = fmt::format("sensor_type: {}\ncomment: {}\n\nT_BS:\n  cols: 4\n  rows: 4\n  data: [", type, origin);
  for (int r = 0; r < 3; ++r) text += fmt::format("{}, {}, {}, {},\n         ", R(r, 0), R(r, 1), R(r, 2), p[r]);
  return text + "0.0, 0.0, 0.0, 1.0]\n" + figures;
}

/// What a reading's sensor is written as, and its row.
struct Written {
  std::string_view folder;
  std::string yaml, header, row;
};

Written written(const RangeSample& r, const std::string& origin) {
  return {"range",
          yaml_of("range", origin + ", along x", so3_between(Vec3::UnitX(), r.direction_B), r.p_B,
                  fmt::format("noise_m: {}\nnearest_m: {}\nfarthest_m: {}\n", r.sigma_m, r.nearest_m, r.farthest_m)),
          "#timestamp [ns],distance [m]\n", fmt::format("{},{}\n", r.t.ns, r.distance_m)};
}
Written written(const VelocitySample& r, const std::string& origin) {
  const Vec3 &v = r.v_mps, s = r.sigma_mps.cwiseMin(kUnmeasured_mps);
  return {"velocity", yaml_of("velocity", origin, r.q_BS, r.p_B, ""),
          "#timestamp [ns],v_x [m/s],v_y [m/s],v_z [m/s],sigma_x [m/s],sigma_y [m/s],sigma_z [m/s]\n",
          fmt::format("{},{},{},{},{},{},{}\n", r.t.ns, v.x(), v.y(), v.z(), s.x(), s.y(), s.z())};
}
Written written(const PressureSample& r, const std::string& origin) {
  return {"baro", fmt::format("sensor_type: barometer\ncomment: {}\nnoise_pa: {}\n", origin, r.sigma_pa),
          "#timestamp [ns],pressure [Pa]\n", fmt::format("{},{}\n", r.t.ns, r.pressure_pa)};
}

}  // namespace

std::span<const AidingFolder> aiding_folders() { return kFolders; }

std::vector<AidingText> aiding_texts(const std::vector<AidingSample>& readings, const std::string& origin) {
  std::vector<AidingText> out;
  std::map<std::string, std::size_t> by_sensor;
  std::map<std::string_view, int> numbers;
  for (const AidingSample& reading : readings) {
    const Written w = std::visit([&](const auto& r) { return written(r, origin); }, reading);
    const auto [at, is_new] = by_sensor.try_emplace(w.yaml, out.size());
    if (is_new) out.push_back({fmt::format("{}{}", w.folder, numbers[w.folder]++), w.yaml, w.header});
    out[at->second].csv += w.row;
  }
  return out;
}

}  // namespace fbvins
