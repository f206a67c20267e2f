// SPDX-License-Identifier: Apache-2.0
// Uses only the installed core: synthetic images and readings go in, poses come out, once with a frontend of the library
// and once with the user's own frontend.
#include <cmath>
#include <cstdio>
#include <fbvins/pipeline/system.hpp>

#include "dot_frontend.hpp"

#if __has_include(<fbvins/core/eigen_as_on_x86_64.hpp>) && !defined(EIGEN_VECTORIZE_SSE2)
#error "the library's Eigen code is not this program's"
#endif

/// Error of the last pose's distance from the start, m; NaN without a pose.
double fly(fbvins::SystemParts parts, const char* name) {
  auto system = fbvins::System::create({}, wall::rig(), fbvins::RunMode::threaded, std::move(parts));
  if (!system) {
    std::puts(system.error().message.c_str());
    return NAN;
  }
  int poses = 0;
  double error_m = NAN;
  system->on_odometry([&](const fbvins::Odometry& o) {
    if (!o.health.has_pose()) return;
    ++poses;
    error_m = std::abs(o.T_WB.p.norm() - wall::sway_m(o.t.seconds()));
  });
  for (fbvins::SensorEvent& event : wall::flight(44))
    if (!system->push(std::move(event))) break;
  if (const auto end = system->finish(); !end) {
    std::puts(end.error().message.c_str());
    return NAN;
  }
  std::printf("%s: %d poses, the last %.1f mm off\n", name, poses, 1e3 * error_m);
  return poses > 20 ? error_m : NAN;
}

int main() {
  const double shipped_m = fly({}, "klt");
  const double own_m = fly({.frontend = std::make_unique<DotFrontend>(wall::rig())}, "dots");
  return shipped_m < 0.03 && own_m < 0.03 ? 0 : 1;
}
