// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/imu_file.hpp"

#include <fmt/format.h>

#include "fbvins/io/csv.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {

Result<std::vector<ImuSample>> read_imu_csv(const std::string& path) {
  constexpr std::uint64_t kLargest = 1ULL << 31;  // a day at 1 kHz
  Result<std::string> text = read_file(path, kLargest);
  if (!text) return text.error();
  Result<StampedRows<ImuSample>> rows = read_stamped_rows<ImuSample>(*text, path, ImuRowParser{});
  if (!rows) return rows.error();
  return std::move(rows->rows);
}

std::string imu_to_csv(const std::vector<ImuSample>& samples) {
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const ImuSample& s : samples)
    text += fmt::format("{},{},{},{},{},{},{}\n", s.t.ns, s.gyro_radps.x(), s.gyro_radps.y(), s.gyro_radps.z(), s.accel_mps2.x(),
                        s.accel_mps2.y(), s.accel_mps2.z());
  return text;
}

}  // namespace fbvins
