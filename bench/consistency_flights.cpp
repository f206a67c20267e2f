// SPDX-License-Identifier: Apache-2.0
// Flies the estimator alone, on made-up tracks (made_up_tracks.hpp) along real or simulated trajectories with real or simulated
// IMU readings: how far off it is, and whether it knows.
//
//   consistency_flights --trajectory V1_02/groundtruth.csv --imu V1_02/imu0.csv --start 10 --seconds 60 --recognise
//   consistency_flights normal --seed 4 --movers 8
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "bench/made_up_tracks.hpp"
#include "fbvins/estimator/estimator.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/eval/nees.hpp"

namespace fbvins::bench {
namespace {

struct Wanted {
  std::string preset = "normal", out;
  SimulationOptions simulation;
  TrackOptions tracks;
  bool known = true;
  double perturb = 0;
};

const TrueState& truth_at(const Simulation& s, Time t) {
  const auto it =
      std::lower_bound(s.imu.truth.begin(), s.imu.truth.end() - 1, t, [](const TrueState& x, Time y) { return x.t < y; });
  return *it;
}

double squared(const Vec3& e, const Mat3& P) { return e.dot(P.ldlt().solve(e)); }

int fly(const Wanted& wanted) {
  Result<Simulation> made = prepare_simulation(wanted.simulation);
  if (!made) {
    fmt::print(stderr, "{}\n", made.error().message);
    return 1;
  }
  Simulation& flight = *made;
  if (wanted.perturb > 0) {
    Rng rng(wanted.tracks.seed, 99);
    for (ImuSample& s : flight.imu.samples)
      for (int k = 0; k < 3; ++k) s.accel_mps2(k) *= 1 + wanted.perturb * rng.normal();
  }
  MadeUpTracks tracks(flight, wanted.tracks);
  EstimatorOptions options;
  options.known_landmarks.enabled = wanted.known;
  Estimator estimator(flight.rig, options);
  Trajectory<W> truth, estimate;
  std::vector<Mat6> covariances;
  StatePrior before, prior;
  double bias_g = 0, bias_a = 0;
  int known = 0, resets = 0;
  double ms = 0;
  FILE* file = wanted.out.empty() ? nullptr : std::fopen(wanted.out.c_str(), "w");
  for (std::size_t k = 0; k < flight.frames.size(); ++k) {
    const TrackedFrame frame = tracks.frame(k, before);
    const Estimate e = estimator.process(frame);
    before = prior;  // two images late, as in a System
    prior = estimator.prior();
    tracks.locate(e.landmarks);
    const Odometry& o = e.odometry;
    known += o.stats.known_landmarks;
    ms += o.stats.total_ms();
    resets = static_cast<int>(o.reset_counter);
    if (!o.health.has_pose()) continue;
    const double t_s = (o.t - flight.start).seconds();
    truth.push_back({o.t, flight.flight.pose(t_s)});
    estimate.push_back({o.t, o.T_WB});
    covariances.push_back(o.pose_covariance);
    const ImuBias& b = truth_at(flight, o.t).bias;
    bias_g += squared(o.bias.gyro_radps - b.gyro_radps, o.gyro_bias_covariance);
    bias_a += squared(o.bias.accel_mps2 - b.accel_mps2, o.accel_bias_covariance);
    if (file) {
      const Vec3 p = flight.flight.pose(t_s).p;
      fmt::print(file, "{:.3f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{}\n", t_s, o.T_WB.p.x(), o.T_WB.p.y(), o.T_WB.p.z(),
                 p.x(), p.y(), p.z(), o.stats.known_landmarks);
    }
  }
  if (file) std::fclose(file);
  const std::vector<PosePair> pairs = associate(truth, estimate, {});
  const auto se3 = align(pairs, Alignment::se3);
  if (!se3) return 1;
  const auto errors = statistics_of(absolute_errors_m(apply(*se3, pairs)));
  const LevelledStart start = *align_start_levelled(pairs);
  const NeesSummary honest = nees(pairs, covariances, start.to_truth);
  const auto n = static_cast<double>(pairs.size());
  fmt::print("rmse {:.4f} max {:.4f} nees {:.1f} {:.1f} bias {:.1f} {:.1f} known {:.1f} ms {:.2f} resets {}\n", errors.rmse,
             errors.max, honest.mean.position, honest.mean.orientation, bias_g / n, bias_a / n, known / n, ms / n, resets);
  return 0;
}

int run(int argc, char** argv) {
  CLI::App app("fly the estimator on made-up tracks");
  Wanted w;
  double seconds = 30, start = 0;
  int seed = 1;
  std::string trajectory, imu;
  app.add_option("preset", w.preset, "of fbvins simulate");
  app.add_option("--trajectory", trajectory, "a real flight instead");
  app.add_option("--imu", imu, "and its readings");
  app.add_option("--start", start, "[s]");
  app.add_option("--seconds", seconds, "length");
  app.add_option("--seed", seed, "of everything made up");
  app.add_option("--movers", w.tracks.movers, "boxes that move");
  app.add_option("--bad-start", w.tracks.bad_start_s, "so long [s] tracks are bad");
  app.add_option("--perturb", w.perturb, "relative noise on the accelerometer");
  app.add_flag("--recognise", w.tracks.recognise, "corners are known again");
  app.add_flag("!--forget", w.known, "no landmark is remembered");
  app.add_option("--out", w.out, "CSV of positions");
  CLI11_PARSE(app, argc, argv);
  const auto preset = simulation_preset(w.preset);
  if (!preset) {
    fmt::print(stderr, "{}\n", preset.error().message);
    return 2;
  }
  w.simulation = *preset;
  w.simulation.seed = seed;
  w.simulation.flight.duration_s = seconds;
  w.simulation.recorded.trajectory = trajectory;
  w.simulation.recorded.imu = imu;
  w.simulation.recorded.start_s = start;
  w.tracks.seed = static_cast<std::uint64_t>(seed);
  return fly(w);
}

}  // namespace
}  // namespace fbvins::bench

int main(int argc, char** argv) { return fbvins::bench::run(argc, argv); }
