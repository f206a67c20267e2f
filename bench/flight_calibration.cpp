// SPDX-License-Identifier: Apache-2.0
// Calibrations refined from flights, flown (docs/experiments/calibration.md): the error of each recording's trajectory with its
// calibration as given and as its own flight refines it; or with one that is spoilt in a known way, and as refined from there.
// Recordings with a truth.
//
// usage: flight_calibration [OPTION...] RECORDING...             calibrations as they are
//        flight_calibration [OPTION...] --spoilt RECORDING...    each spoilt in every way
//        flight_calibration [OPTION...] --together RECORDING...  refined from all flights, each flown
//        flight_calibration [OPTION...] --held-out RECORDING...  spoilt in every way, refined from the first and from all but
//                                                                the last, which alone is flown with the result
// options: --camera left: one of a pair; --only WORD: ways of spoiling that have the word in their name
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <optional>
#include <string_view>

#include "fbvins/calibration/flight_calibration.hpp"
#include "fbvins/config/config.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/pipeline/system.hpp"

namespace {

using namespace fbvins;

struct Flown {
  StereoRig rig;
  FlightTracks tracks;
  double ate_m = std::numeric_limits<double>::infinity();
};

/// The cameras that are used (DatasetOptions).
std::string cameras_used = "all";
/// In the names of the ways of spoiling that are tried.
std::string only;

/// `rig`: instead of the recording's own.
Result<Flown> fly(const std::string& path, const std::optional<StereoRig>& rig) {
  DatasetOptions options;
  options.camera = cameras_used;
  options.rig = rig;
  const Result<std::unique_ptr<Dataset>> data = open_dataset(path, options);
  if (!data) return data.error();
  Config config;
  config.frontend.kind = "klt";
  config.estimator.align_time_offset = false;  // as the command flies
  Result<System> system = System::create(config, (*data)->rig(), RunMode::threaded);
  if (!system) return system.error();
  FlightCollector collector;
  Trajectory<W> estimate, truth;
  system->on_tracked_frame([&](const TrackedFrame& f) { collector.add(f); });
  system->on_keyframe([&](const Keyframe& k) { collector.add(k); });
  system->on_odometry([&](const Odometry& o) {
    if (o.health.has_pose()) estimate.push_back({o.t, o.T_WB});
  });
  while (auto event = (*data)->next())
    if (Result<void> taken = system->push(std::move(*event)); !taken) return taken.error();
  if (Result<void> done = system->finish(); !done) return done.error();
  for (const TrajectoryPoint& p : (*data)->ground_truth()) truth.push_back({p.t, p.T_WB});
  Flown out{(*data)->rig(), collector.take()};
  if (const auto e = evaluate(truth, estimate, {})) out.ate_m = e->absolute_m.rmse;
  return out;
}

std::string name_of(const std::string& path) { return path.substr(path.find_last_of('/') + 1); }
std::string mm(double error_m) { return std::isfinite(error_m) ? fmt::format("{:.2f}", 1e3 * error_m) : "no pose"; }

std::string changes(const FlightCalibration& found) {
  std::string out;
  for (const RefinedParameter& p : found.parameters)
    if (p.finding == FlightFinding::refined) out += fmt::format(" {} {:+.3g} +- {:.2g},", p.name, p.change, p.sigma);
  for (const HeldOutPart& part : found.held_out) out += fmt::format(" {}: {:+.1f};", part.name, part.gain);
  return out + fmt::format(" spread {:.1f}, {:.2f} px", found.spread, found.sigma_px);
}

struct Ratios {
  double sum = 0, largest = 0;
  int count = 0, refined = 0;
  void add(double ratio, bool better) { sum += ratio, largest = std::max(largest, ratio), ++count, refined += better; }
};

int as_given(const std::vector<std::string>& paths) {
  fmt::print("| flight | ATE given, mm | refined, mm | ratio | |\n|---|---|---|---|---|\n");
  Ratios ratios;
  for (const std::string& path : paths) {
    const Result<Flown> given = fly(path, {});
    if (!given) return fmt::print(stderr, "{}\n", given.error().message), 2;
    const Result<FlightCalibration> found = calibrate_from_flights({given->tracks}, {name_of(path)}, given->rig, {});
    if (!found) {
      fmt::print("| {} | {} | | | {} |\n", name_of(path), mm(given->ate_m), found.error().message);
      continue;
    }
    const double ate_m = found->better ? (*fly(path, found->rig)).ate_m : given->ate_m;
    ratios.add(ate_m / given->ate_m, found->better);
    fmt::print("| {} | {} | {} | {:.3f} | {} |\n  {}\n", name_of(path), mm(given->ate_m), mm(ate_m), ate_m / given->ate_m,
               found->verdict, changes(*found));
    std::fflush(stdout);
  }
  fmt::print("{} flights, {} refined: ratio {:.3f} in the mean, {:.3f} at most\n", ratios.count, ratios.refined,
             ratios.sum / std::max(1, ratios.count), ratios.largest);
  return 0;
}

int together(const std::vector<std::string>& paths) {
  std::vector<FlightTracks> tracks;
  std::vector<double> before_m;
  std::optional<StereoRig> rig;
  std::vector<std::string> names;
  for (const std::string& path : paths) {
    Result<Flown> given = fly(path, {});
    if (!given) return fmt::print(stderr, "{}\n", given.error().message), 2;
    rig = given->rig;
    tracks.push_back(std::move(given->tracks)), before_m.push_back(given->ate_m), names.push_back(name_of(path));
  }
  const Result<FlightCalibration> found = calibrate_from_flights(tracks, names, *rig, {});
  if (!found) return fmt::print(stderr, "{}\n", found.error().message), 1;
  fmt::print("{}: {}\n| flight | ATE given, mm | refined, mm | ratio |\n|---|---|---|---|\n", found->verdict, changes(*found));
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const double ate_m = found->better ? (*fly(paths[i], found->rig)).ate_m : before_m[i];
    fmt::print("| {} | {} | {} | {:.3f} |\n", names[i], mm(before_m[i]), mm(ate_m), ate_m / before_m[i]);
    std::fflush(stdout);
  }
  return 0;
}

using Cameras = std::vector<MountedCamera>;

struct Spoilt {
  const char* name;
  std::function<void(Cameras&)> spoil;
  double late_s = 0;
  std::size_t fewest_cameras = 1;
};

/// Of all cameras together.
void turn_mounting(Cameras& cameras, const Vec3& turn) {
  const Pose<B, C0> before = cameras.front().T_BC;
  Pose<B, C0> after = before;
  after.q = (before.q * so3_exp(turn)).normalized();
  for (MountedCamera& camera : cameras) camera.T_BC = after * (before.inverse() * camera.T_BC);
}

std::function<void(Cameras&)> turned_camera(std::size_t k) {
  return [k](Cameras& cameras) { cameras[k].T_BC.q = (cameras[k].T_BC.q * so3_exp(Vec3(0.2, 0.2, 0.1) * kDegree)).normalized(); };
}

std::vector<Spoilt> all_spoilt() {
  return {{"baseline's direction, 0.3 degrees", turned_camera(1), 0, 2},
          {"third camera, 0.3 degrees", turned_camera(2), 0, 3},
          {"camera-IMU rotation, 0.5 degrees",
           [](Cameras& cameras) { turn_mounting(cameras, 0.5 * kDegree * Vec3(0.6, -0.64, 0.48)); }},
          {"time offset, 3 ms", [](Cameras&) {}, 3e-3},
          {"focal lengths, 1 %",
           [](Cameras& cameras) {
             for (MountedCamera& camera : cameras) {
               LensModel lens = camera.camera.model();
               std::visit([](auto& m) { m.fx *= 1.01, m.fy *= 1.01; }, lens);
               camera.camera = camera.camera.with_lens(lens);
             }
           }},
          {"lever arm, 2 cm", [](Cameras& cameras) {
             for (MountedCamera& camera : cameras) camera.T_BC.p += Vec3(0.012, -0.012, 0.0106);
           }}};
}

/// None where the rig has too few cameras for it, or it is not to be tried.
std::optional<StereoRig> spoilt_by(const Spoilt& way, const StereoRig& good) {
  Cameras cameras;
  for (int k = 0; k < good.camera_count(); ++k) cameras.push_back(good.mounted(k));
  if (cameras.size() < way.fewest_cameras || std::string_view(way.name).find(only) == std::string_view::npos) return std::nullopt;
  way.spoil(cameras);
  StereoRig rig = with_cameras(good, cameras);
  rig.time_offset_s += way.late_s;
  return rig;
}

/// Part of what was spoilt that is undone: of the spoilt parameters, as one vector in units of their priors.
double undone(const StereoRig& good, const StereoRig& spoilt, const StereoRig& refined) {
  const FlightRig truth = flight_rig(good);
  const Eigen::VectorXd before = step_between(truth, flight_rig(spoilt)), after = step_between(truth, flight_rig(refined));
  const std::vector<FlightParameter> parameters = flight_parameters(truth);
  double sum_before = 0, sum_after = 0;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double sigma = parameters[i].prior_sigma;
    if (std::abs(before[k]) < 1e-3 * sigma) continue;
    sum_before += std::pow(before[k] / sigma, 2), sum_after += std::pow(after[k] / sigma, 2);
  }
  return 1 - std::sqrt(sum_after / sum_before);
}

int spoilt(const std::vector<std::string>& paths) {
  fmt::print("| flight | spoilt | undone | ATE unspoilt, mm | spoilt, mm | refined, mm | |\n|---|---|---|---|---|---|---|\n");
  for (const std::string& path : paths) {
    const Result<Flown> good = fly(path, {});
    if (!good) return fmt::print(stderr, "{}\n", good.error().message), 2;
    for (const Spoilt& way : all_spoilt()) {
      const std::optional<StereoRig> rig = spoilt_by(way, good->rig);
      if (!rig) continue;
      const Result<Flown> flown = fly(path, rig);
      if (!flown) return fmt::print(stderr, "{}\n", flown.error().message), 2;
      const Result<FlightCalibration> found = calibrate_from_flights({flown->tracks}, {name_of(path)}, *rig, {});
      if (!found) {
        fmt::print("| {} | {} | | {} | {} | | {} |\n", name_of(path), way.name, mm(good->ate_m), mm(flown->ate_m),
                   found.error().message);
        continue;
      }
      const double ate_m = found->better ? (*fly(path, found->rig)).ate_m : flown->ate_m;
      fmt::print("| {} | {} | {:.0f} % | {} | {} | {} | {} |\n  {}\n", name_of(path), way.name,
                 100 * undone(good->rig, *rig, found->rig), mm(good->ate_m), mm(flown->ate_m), mm(ate_m), found->verdict,
                 changes(*found));
      std::fflush(stdout);
    }
  }
  return 0;
}

/// One row of a way of spoiling: refined from these flights, the last recording flown.
int held_out_row(const Spoilt& way, const std::vector<FlightTracks>& flights, const std::vector<std::string>& names,
                 const Flown& good, const StereoRig& rig, double spoilt_m, const std::string& last) {
  const Result<FlightCalibration> found = calibrate_from_flights(flights, names, rig, {});
  if (!found) return fmt::print("| {} | {} | {} |\n", way.name, flights.size(), found.error().message), 0;
  const double ate_m = found->better ? (*fly(last, found->rig)).ate_m : spoilt_m;
  fmt::print("| {} | {} | {:.0f} % | {} | {} | {} | {} |\n  {}\n", way.name, flights.size(),
             100 * undone(good.rig, rig, found->rig), mm(good.ate_m), mm(spoilt_m), mm(ate_m), found->verdict, changes(*found));
  return std::fflush(stdout);
}

int held_out(std::vector<std::string> paths) {
  const std::string last = paths.back();
  paths.pop_back();
  const Result<Flown> good = fly(last, {});
  if (!good) return fmt::print(stderr, "{}\n", good.error().message), 2;
  fmt::print(
      "held out: {}\n| spoilt | flights | undone | ATE unspoilt, mm | spoilt, mm | refined, mm | |\n|---|---|---|---|---|---|---|\n",
      name_of(last));
  for (const Spoilt& way : all_spoilt()) {
    const std::optional<StereoRig> rig = spoilt_by(way, good->rig);
    if (!rig) continue;
    std::vector<FlightTracks> flights;
    std::vector<std::string> names;
    const double spoilt_m = (*fly(last, rig)).ate_m;
    for (const std::string& path : paths) {
      Result<Flown> flown = fly(path, rig);
      if (!flown) return fmt::print(stderr, "{}\n", flown.error().message), 2;
      flights.push_back(std::move(flown->tracks)), names.push_back(name_of(path));
      if (flights.size() == 1 || flights.size() == paths.size()) held_out_row(way, flights, names, *good, *rig, spoilt_m, last);
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> paths(argv + 1, argv + argc);
  while (paths.size() > 2 && (paths.front() == "--camera" || paths.front() == "--only")) {
    (paths.front() == "--camera" ? cameras_used : only) = paths[1];
    paths.erase(paths.begin(), paths.begin() + 2);
  }
  std::string mode;
  if (!paths.empty() && paths.front().starts_with('-')) mode = paths.front(), paths.erase(paths.begin());
  if (paths.size() < (mode == "--held-out" ? 2u : 1u))
    return fmt::print(
               stderr,
               "usage: flight_calibration [--camera left] [--only WORD] [--spoilt | --together | --held-out] RECORDING...\n"),
           2;
  return mode == "--spoilt"     ? spoilt(paths)
         : mode == "--together" ? together(paths)
         : mode == "--held-out" ? held_out(paths)
                                : as_given(paths);
}
