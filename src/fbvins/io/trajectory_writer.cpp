// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <iterator>

#include "fbvins/io/numbers.hpp"
#include "fbvins/io/trajectory.hpp"

namespace fbvins {
namespace {

std::string odometry_header() {
  std::string header =
      "#timestamp [ns],p_WB_x [m],p_WB_y [m],p_WB_z [m],q_WB_w [],q_WB_x [],q_WB_y [],q_WB_z [],"
      "v_WB_x [m s^-1],v_WB_y [m s^-1],v_WB_z [m s^-1],b_gyro_x [rad s^-1],b_gyro_y [rad s^-1],b_gyro_z [rad s^-1],"
      "b_accel_x [m s^-2],b_accel_y [m s^-2],b_accel_z [m s^-2]";
  // Covariance of (dp in W [m], dtheta in B [rad]).
  constexpr const char* kNames[] = {"px", "py", "pz", "tx", "ty", "tz"};
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) fmt::format_to(std::back_inserter(header), ",cov_{}_{}", kNames[i], kNames[j]);
  return header + ",health,health_reason,reset_counter\n";
}

void append(std::string& row, const Vec3& v) {
  fmt::format_to(std::back_inserter(row), ",{:.9f},{:.9f},{:.9f}", v.x(), v.y(), v.z());
}

void append_health(std::string& row, const Odometry& o) {
  fmt::format_to(std::back_inserter(row), ",{},{},{}\n", to_string(o.health.state), to_string(o.health.reason), o.reset_counter);
}

}  // namespace

Result<TumWriter> TumWriter::create(const std::string& path) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  file->write("# timestamp [s] tx ty tz [m] qx qy qz qw\n");
  return TumWriter(*std::move(file));
}

void TumWriter::write(Time t, const Quat& q, const Vec3& p) {
  file_.write(fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", format_seconds(t), p.x(), p.y(), p.z(), q.x(),
                          q.y(), q.z(), q.w()));
}

Result<OdometryCsvWriter> OdometryCsvWriter::create(const std::string& path) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  file->write(odometry_header());
  return OdometryCsvWriter(*std::move(file));
}

void OdometryCsvWriter::write(const Odometry& o) {
  std::string row = fmt::format("{}", o.t.ns);
  constexpr int kNumbers = 16 + 21;
  if (!o.health.has_pose()) {
    for (int i = 0; i < kNumbers; ++i) row += ",nan";
    append_health(row, o);
    file_.write(row);
    return;
  }
  append(row, o.T_WB.p);
  const Quat& q = o.T_WB.q;
  fmt::format_to(std::back_inserter(row), ",{:.9f},{:.9f},{:.9f},{:.9f}", q.w(), q.x(), q.y(), q.z());
  append(row, o.v_WB);
  append(row, o.bias.gyro_radps);
  append(row, o.bias.accel_mps2);
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) fmt::format_to(std::back_inserter(row), ",{:.9e}", o.pose_covariance(i, j));
  append_health(row, o);
  file_.write(row);
}

}  // namespace fbvins
