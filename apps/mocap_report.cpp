// SPDX-License-Identifier: Apache-2.0
#include "apps/mocap_report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iterator>

#include "apps/terminal.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/mocap/motion_capture.hpp"

namespace fbvins::app {
namespace {

std::string numbers(const Vec3& v, double scale, int digits) {
  return fmt::format("{:.{}f} {:.{}f} {:.{}f}", scale * v.x(), digits, scale * v.y(), digits, scale * v.z(), digits);
}

Vec3 sigmas(const HandEye& found, int at) { return found.covariance.diagonal().segment<3>(at).cwiseSqrt(); }

std::string row(const char* name, const Vec3& v) {
  return fmt::format("{:<24}{:>10.4f}{:>10.4f}{:>10.4f}\n", name, v.x(), v.y(), v.z());
}

}  // namespace

Result<Markers> read_markers(const std::string& path, const std::string& name) {
  auto file = read_motion_capture(path);
  if (!file) return file.error();
  if (file->counts.bad() > 0) warn(fmt::format("{} rows left out, the first: {}", file->counts.bad(), file->counts.first_bad));
  const std::string format = file->format;
  const auto body = choose_body(*std::move(file), name, path);
  if (!body) return body.error();
  Markers markers{format, body->name, body->track.size(), body->unseen, body->track.front().t, inspect(body->track), {}};
  markers.clean = markers.inspection.kept(body->track);
  return markers;
}

Result<Trajectory<W>> read_estimate(const std::string& path) {
  const bool folder = std::filesystem::is_directory(path);
  auto file = read_trajectory(folder ? path + "/trajectory.csv" : path);
  if (!file) return file.error();
  if (file->counts.bad() > 0) warn(fmt::format("{} rows left out, the first: {}", file->counts.bad(), file->counts.first_bad));
  return file->poses();
}

Trajectory<W> within(const Trajectory<W>& truth, const Trajectory<W>& estimate) {
  Trajectory<W> out;
  for (const StampedPose<W>& pose : truth)
    if (pose.t >= estimate.front().t && pose.t <= estimate.back().t) out.push_back(pose);
  return out;
}

std::string describe(const Markers& markers) {
  std::string out =
      fmt::format("{}{}{}: {} poses at {:.2f} Hz (jitter {:.2f} ms), {:.1f} % of the time in gaps\n", markers.format,
                  markers.body.empty() ? "" : ", body ", markers.body, markers.poses, markers.inspection.rate_hz,
                  1e3 * markers.inspection.jitter_s, 100 * markers.inspection.unseen_share);
  for (const MarkerFault& fault : markers.inspection.faults) out += "  " + to_string(fault, markers.start) + "\n";
  return out;
}

std::string describe(const HandEye& found, Time start) {
  const MarkerCalibration& c = found.calibration;
  std::string out;
  for (const MarkerFault& fault : found.faults) out += "  " + to_string(fault, start) + ", left out\n";
  const Quat &q = c.T_BK.q, &w = c.T_VW.q;
  auto to = std::back_inserter(out);
  fmt::format_to(to, "{} poses of the estimate used, {} that did not fit left out\n", found.pairs, found.outliers);
  fmt::format_to(to, "markers on the IMU, m      {}   sigma {} mm\n", numbers(c.T_BK.p, 1, 4), numbers(sigmas(found, 0), 1e3, 2));
  fmt::format_to(to, "rotation, qx qy qz qw      {:.6f} {:.6f} {:.6f} {:.6f}   sigma {} deg\n", q.x(), q.y(), q.z(), q.w(),
                 numbers(sigmas(found, 3), kDegreesPerRad, 3));
  fmt::format_to(to, "origin of W in the volume  {}\n", numbers(c.T_VW.p, 1, 4));
  fmt::format_to(to, "rotation, qx qy qz qw      {:.6f} {:.6f} {:.6f} {:.6f}   sigma {} deg\n", w.x(), w.y(), w.z(), w.w(),
                 numbers(sigmas(found, 9), kDegreesPerRad, 3));
  fmt::format_to(to, "estimate's clock           {:+.6f} s to the motion capture's   sigma {:.3f} ms\n", c.offset.seconds(),
                 1e3 * std::sqrt(found.covariance(12, 12)));
  if (found.covariance(13, 13) > 0)
    fmt::format_to(to, "its drift                  {:+.2f} us/s   sigma {:.2f}\n", 1e6 * c.drift,
                   1e6 * std::sqrt(found.covariance(13, 13)));
  fmt::format_to(to, "scale of the estimate      {:.5f}   sigma {:.5f}\n", found.scale, std::sqrt(found.covariance(14, 14)));
  return out;
}

std::string to_table(const AxisErrors& e, Time start) {
  const auto span = [&](const HoverSpan& s) {
    return fmt::format("{:.1f}-{:.1f} s", (s.from - start).seconds(), (s.to - start).seconds());
  };
  std::string out = fmt::format("from the hover at {} to the one at {}, m in W\n{:<24}{:>10}{:>10}{:>10}\n", span(e.start),
                                span(e.end), "", "x", "y", "z");
  out += row("true start", e.truth_start) + row("true end", e.truth_end) + row("true difference", e.truth_difference());
  out += row("estimated difference", e.estimate_difference()) + row("expected", e.expected) + row("axial error", e.axial_error());
  return out;
}

}  // namespace fbvins::app
