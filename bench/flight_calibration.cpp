// SPDX-License-Identifier: Apache-2.0
// Calibrations refined from flights, flown (docs/experiments/calibration.md): the error of each recording's trajectory with its
// calibration as given and as its own flight refines it; or with one that is spoilt in a known way, and as refined from there.
// Recordings with a truth.
//
// usage: flight_calibration RECORDING...             calibrations as they are
//        flight_calibration --spoilt RECORDING...    each spoilt in every way
//        flight_calibration --together RECORDING...  refined from all flights, each flown
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
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

/// `rig`: instead of the recording's own.
Result<Flown> fly(const std::string& path, const std::optional<StereoRig>& rig) {
  DatasetOptions options;
  options.rig = rig;
  const Result<std::unique_ptr<Dataset>> data = open_dataset(path, options);
  if (!data) return data.error();
  Config config;
  config.frontend.kind = "klt";
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
    if (p.flown && p.finding == FlightFinding::refined) out += fmt::format(" {} {:+.3g} +- {:.2g},", p.name, p.change, p.sigma);
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

struct Spoilt {
  const char* name;
  std::function<void(StereoRig&)> spoil;
};

/// Of C0 and C1 together.
void turn_mounting(StereoRig& rig, const Vec3& turn) {
  const Pose<C1, C0> T_C1C0 = rig.T_C1C0();
  rig.T_BC0.q = (rig.T_BC0.q * so3_exp(turn)).normalized();
  rig.T_BC1 = rig.T_BC0 * T_C1C0.inverse();
}

std::vector<Spoilt> all_spoilt() {
  return {
      {"baseline's direction, 0.3 degrees",
       [](StereoRig& rig) {
         Pose<C0, C1> T_C0C1 = rig.T_BC0.inverse() * rig.T_BC1;
         T_C0C1.q = (T_C0C1.q * so3_exp(Vec3(0.2, 0.2, 0.1) * kDegree)).normalized();
         rig.T_BC1 = rig.T_BC0 * T_C0C1;
       }},
      {"camera-IMU rotation, 0.5 degrees", [](StereoRig& rig) { turn_mounting(rig, 0.5 * kDegree * Vec3(0.6, -0.64, 0.48)); }},
      {"time offset, 3 ms", [](StereoRig& rig) { rig.time_offset_s += 3e-3; }},
      {"focal lengths, 1 %",
       [](StereoRig& rig) {
         for (Camera* camera : {&rig.left, &rig.right}) {
           LensModel lens = camera->model();
           std::visit([](auto& m) { m.fx *= 1.01, m.fy *= 1.01; }, lens);
           *camera = camera->with_lens(lens);
         }
       }},
      {"lever arm, 2 cm", [](StereoRig& rig) {
         const Vec3 moved(0.012, -0.012, 0.0106);
         rig.T_BC0.p += moved, rig.T_BC1.p += moved;
       }}};
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
      StereoRig rig = good->rig;
      way.spoil(rig);
      const Result<Flown> flown = fly(path, rig);
      if (!flown) return fmt::print(stderr, "{}\n", flown.error().message), 2;
      const Result<FlightCalibration> found = calibrate_from_flights({flown->tracks}, {name_of(path)}, rig, {});
      if (!found) {
        fmt::print("| {} | {} | | {} | {} | | {} |\n", name_of(path), way.name, mm(good->ate_m), mm(flown->ate_m),
                   found.error().message);
        continue;
      }
      const double ate_m = found->better ? (*fly(path, found->rig)).ate_m : flown->ate_m;
      fmt::print("| {} | {} | {:.0f} % | {} | {} | {} | {} |\n  {}\n", name_of(path), way.name,
                 100 * undone(good->rig, rig, found->rig), mm(good->ate_m), mm(flown->ate_m), mm(ate_m), found->verdict,
                 changes(*found));
      std::fflush(stdout);
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view mode = argc > 1 && argv[1][0] == '-' ? argv[1] : "";
  const std::vector<std::string> paths(argv + (mode.empty() ? 1 : 2), argv + argc);
  if (argc < 2 || paths.empty()) return fmt::print(stderr, "usage: flight_calibration [--spoilt | --together] RECORDING...\n"), 2;
  return mode == "--spoilt" ? spoilt(paths) : mode == "--together" ? together(paths) : as_given(paths);
}
