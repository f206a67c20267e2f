// SPDX-License-Identifier: Apache-2.0
// A flight without end: a lap whose end is its beginning, flown again and again, and the readings of an IMU on it. Noise and
// biases are not those of a lap but go on; the biases wander within bounds, as those of a real IMU do.
//
//   const SplineTrajectory lap = make_lap({.length_s = 120});
//   EndlessFlight flight(lap, 120, 0, rig.imu_noise, start, 1);
//   ImuSample sample = flight.next_reading();      // the truth at its stamp: flight.pose(sample.t)
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/simulation.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins::bench {

struct LapOptions {
  double length_s = 120;
  bool still = false;                      ///< a vehicle that stands
  Quat R_vehicle_body = Quat::Identity();  ///< vehicle: x forwards, z up
  double size_x_m = 1.5, size_y_m = 1.2;   ///< half of the lap's extent
};

inline SplineTrajectory make_lap(const LapOptions& o) {
  constexpr double kKnots_s = 0.25;
  const auto knots = static_cast<std::size_t>(std::lround(o.length_s / kKnots_s));
  std::vector<Vec3> p;
  std::vector<Quat> q;
  // Five more than knots: the spline's end has the control points of its beginning.
  for (std::size_t k = 0; k < knots + 5; ++k) {
    const double a = o.still ? 0.3 : 2 * std::numbers::pi * static_cast<double>(k % knots) / static_cast<double>(knots);
    const double rounds = std::max(1.0, std::round(o.length_s / 20));
    p.emplace_back(o.size_x_m * std::cos(rounds * a), o.size_y_m * std::sin(rounds * a) + 0.3 * std::sin(3 * a),
                   1.4 + 0.3 * std::sin(2 * rounds * a));
    const Quat heading(Eigen::AngleAxisd(rounds * a + 0.4 * std::sin(2 * a), Vec3::UnitZ()));
    q.push_back(heading * so3_exp(Vec3(0.08 * std::sin(3 * rounds * a), 0.06 * std::cos(2 * rounds * a), 0)) * o.R_vehicle_body);
  }
  return {static_cast<double>(o.length_s) / static_cast<double>(knots), std::move(p), std::move(q)};
}

struct RenderedLaps {
  SplineTrajectory flight;          ///< three laps; the second is the one that is rendered
  std::vector<StereoFrame> images;  ///< of a lap, the first at its beginning
};

/// The simulator flies along recorded poses by a spline through them, which is periodic in the middle one of three laps.
inline Result<RenderedLaps> render_laps(const SplineTrajectory& lap, double lap_s, double rate_hz) {
  const std::string file = (std::filesystem::temp_directory_path() / fmt::format("fbvins_laps_{}.txt", ::getpid())).string();
  {
    std::ofstream poses(file);
    for (double t = 0; t < 3 * lap_s; t += 0.01) {
      const Pose<W, B> T = lap.pose(std::fmod(t, lap_s));
      poses << fmt::format("{:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", 1000 + t, T.p.x(), T.p.y(), T.p.z(),
                           T.q.x(), T.q.y(), T.q.z(), T.q.w());
    }
  }
  SimulationOptions options = *simulation_preset("normal");
  options.recorded.trajectory = file;
  options.flight.duration_s = 3 * lap_s;
  options.image_rate_hz = rate_hz;
  auto simulation = prepare_simulation(options);
  std::filesystem::remove(file);
  if (!simulation) return simulation.error();
  RenderedLaps out{simulation->flight, {}};
  const auto each = static_cast<std::size_t>(std::lround(lap_s * rate_hz));
  const Time begin = simulation->start + Duration::from_seconds(lap_s - 0.5 / rate_hz);
  for (std::size_t k = 0; k < simulation->frames.size() && out.images.size() < each; ++k) {
    StereoFrame frame = render_frame(*simulation, k).frame;
    if (simulation->frames[k] > begin) out.images.push_back(std::move(frame));
  }
  return out;
}

class EndlessFlight {
 public:
  /// The lap is the part of the trajectory that is `lap_s` long and begins at `from_s`.
  EndlessFlight(const SplineTrajectory& lap, double lap_s, double from_s, const ImuNoise& noise, Time start, std::uint64_t seed)
      : lap_(lap), lap_s_(lap_s), from_s_(from_s), noise_(noise), start_(start), rng_(seed, 5) {}

  Pose<W, B> pose(Time t) const { return lap_.pose(within_lap(t)); }

  ImuSample next_reading() {
    const double dt_s = 1 / noise_.rate_hz, root_hz = std::sqrt(noise_.rate_hz);
    const Time t = start_ + Duration::from_seconds(static_cast<double>(count_++) * dt_s);
    const MotionState m = lap_.at(within_lap(t));
    wander(gyro_bias_, noise_.gyro_random_walk_radps2_rthz, dt_s);
    wander(accel_bias_, noise_.accel_random_walk_mps3_rthz, dt_s);
    return {t, m.w_WB_B + gyro_bias_ + root_hz * noise_.gyro_noise_density_radps_rthz * normal(),
            m.specific_force() + accel_bias_ + root_hz * noise_.accel_noise_density_mps2_rthz * normal()};
  }

 private:
  static constexpr double kBiasMemory_s = 300;

  double within_lap(Time t) const { return from_s_ + std::fmod((t - start_).seconds(), lap_s_); }
  Vec3 normal() { return {rng_.normal(), rng_.normal(), rng_.normal()}; }
  void wander(Vec3& bias, double walk, double dt_s) {
    bias = Vec3((1 - dt_s / kBiasMemory_s) * bias + walk * std::sqrt(dt_s) * normal());
  }

  const SplineTrajectory& lap_;
  double lap_s_, from_s_;
  ImuNoise noise_;
  Time start_;
  Rng rng_;
  std::int64_t count_ = 0;
  Vec3 gyro_bias_ = Vec3(0.01, -0.02, 0.015), accel_bias_ = Vec3(0.1, -0.05, 0.08);
};

}  // namespace fbvins::bench
