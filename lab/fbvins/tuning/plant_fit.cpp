// SPDX-License-Identifier: Apache-2.0
#include "fbvins/tuning/plant_fit.hpp"
#include "fbvins/core/angle.hpp"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace fbvins {
namespace {

constexpr double kCoherent = 0.7;
/// Above the excitation's frequencies, noise in the closed loop shows the inverse of the controller instead of the vehicle.
constexpr double kFastest_hz = 6;
/// Below this a window of four seconds has too few periods.
constexpr double kSlowestFitted_hz = 0.7;
constexpr std::size_t kFewest = 6;
std::vector<FrequencyPoint> coherent(std::vector<FrequencyPoint> points) {
  std::erase_if(points, [](const FrequencyPoint& p) { return p.coherence < kCoherent; });
  return points;
}

double radps(const FrequencyPoint& p) { return 2 * std::numbers::pi * p.hz; }

/// Fits the gain of a model `shape` to measured points. The cost is of complex logarithms: a relative error of gain and an angle
/// of the same size count the same.
struct Match {
  double gain = 1, cost = 0, misfit_db = 0, misfit_deg = 0;
};
Match match(const std::vector<FrequencyPoint>& points, const std::function<Complex(double)>& shape) {
  double weight = 0, mean = 0, squares = 0, turns = 0;
  for (const FrequencyPoint& p : points) {
    const Complex ratio = p.H / shape(radps(p));
    const double w = p.coherence / (1.02 - p.coherence), l = std::log(std::abs(ratio)), a = std::arg(ratio);
    weight += w, mean += w * l, squares += w * l * l, turns += w * a * a;
  }
  mean /= weight;
  const double spread = std::max(0.0, squares / weight - mean * mean);
  return {std::exp(mean), spread + turns / weight, std::sqrt(spread) * 20 / std::numbers::ln10,
          std::sqrt(turns / weight) * kDegreesPerRad};
}

/// Grid search with refinement around the best plant.
template <class Plant, class Fit>
void refine(const std::function<Match(const Plant&)>& judge, const std::function<std::vector<Plant>(const Plant&, int)>& around,
            Fit& fit) {
  Plant best;
  Match found = judge(best);
  for (int level = 0; level < 4; ++level)
    for (const Plant& p : around(best, level)) {
      const Match m = judge(p);
      if (m.cost < found.cost) found = m, best = p;
    }
  fit.plant = best;
  fit.plant.gain = found.gain;
  fit.misfit_db = found.misfit_db, fit.misfit_deg = found.misfit_deg;
}

std::vector<double> column(const std::vector<Vec3>& all, int axis) {
  std::vector<double> x;
  x.reserve(all.size());
  for (const Vec3& v : all) x.push_back(v[axis]);
  return x;
}

Error unseen(const std::string& what) {
  return {ErrorCode::invalid_argument,
          fmt::format("{}: not enough excitation about or along this axis to identify its response", what)};
}

}  // namespace

Result<RateFit> fit_rate(const std::vector<double>& torque, const std::vector<double>& rate, const LoopFilters& filters,
                         bool yaw) {
  RateFit fit;
  fit.points = coherent(frequency_response(torque, rate, filters.rate_hz, frequencies(0.6, kFastest_hz, 28)));
  if (fit.points.size() < kFewest) return unseen("rate");
  // The log has the rate after the controller's filter.
  const auto judge = [&](const RatePlant& p) {
    return match(fit.points, [&](double w) { return plant_of(p, w) * butterworth(w, filters.rate_hz, filters.gyro_cutoff_hz); });
  };
  const std::function<std::vector<RatePlant>(const RatePlant&, int)> around = [&](const RatePlant& c, int level) {
    std::vector<RatePlant> all;
    const int n = level == 0 ? 12 : 4;
    const double lag = level == 0 ? 0.01 : 0.0025 / std::pow(4, level - 1), delay = 0.6 * lag, lead = 4 * lag;
    for (int i = level == 0 ? 0 : -n; i <= n; ++i)
      for (int k = level == 0 ? 0 : -n; k <= n; ++k)
        for (int l = yaw ? (level == 0 ? 0 : -n) : 0; l <= (yaw ? n : 0); ++l) {
          const RatePlant origin = level == 0 ? RatePlant{} : c;
          RatePlant p{1, origin.lag_s + i * lag, origin.delay_s + k * delay, origin.lead_s + l * lead};
          if (p.lag_s >= 0 && p.delay_s >= 0 && p.lead_s >= 0) all.push_back(p);
        }
    return all;
  };
  refine<RatePlant>(judge, around, fit);
  return fit;
}

Result<VelocityFit> fit_velocity(const std::vector<double>& asked, const std::vector<double>& velocity,
                                 const VelocityLoop& loop) {
  VelocityFit fit;
  fit.points = coherent(frequency_response(asked, velocity, loop.filters.rate_hz, frequencies(kSlowestFitted_hz, 3, 20)));
  if (fit.points.size() < kFewest) return unseen("velocity");
  VelocityLoop model = loop;
  const auto judge = [&](const VelocityPlant& p) {
    model.plant = p;
    return match(fit.points, [&](double w) { return velocity_plant(model, w); });
  };
  const std::function<std::vector<VelocityPlant>(const VelocityPlant&, int)> around = [](const VelocityPlant& c, int level) {
    std::vector<VelocityPlant> all;
    const double finer = std::pow(4, std::max(0, level - 1)), delay_s = level == 0 ? 0.01 : 0.002 / finer,
                 drag = level == 0 ? 0.1 : 0.02 / finer;
    const VelocityPlant origin = level == 0 ? VelocityPlant{} : c;
    for (int i = level == 0 ? 0 : -6; i <= (level == 0 ? 30 : 6); ++i)
      for (int k = level == 0 ? 0 : -6; k <= (level == 0 ? 15 : 6); ++k) {
        const VelocityPlant p{1, origin.delay_s + i * delay_s, origin.drag_per_s + k * drag};
        if (p.delay_s >= 0 && p.drag_per_s >= 0) all.push_back(p);
      }
    return all;
  };
  refine<VelocityPlant>(judge, around, fit);
  return fit;
}

LoopFilters filters_of(const LoopLog& log) {
  return {log.rate_hz, log.control.rate.IMU_GYRO_CUTOFF, log.control.rate.IMU_DGYRO_CUTOFF, log.control.position.MPC_VELD_LP};
}

RateGains rate_gains(const ControlOptions& c, int axis) {
  const RateControlOptions& r = c.rate;
  if (axis == 0) return {r.MC_ROLLRATE_P, r.MC_ROLLRATE_I, r.MC_ROLLRATE_D, c.attitude.MC_ROLL_P};
  if (axis == 1) return {r.MC_PITCHRATE_P, r.MC_PITCHRATE_I, r.MC_PITCHRATE_D, c.attitude.MC_PITCH_P};
  return {r.MC_YAWRATE_P, r.MC_YAWRATE_I, r.MC_YAWRATE_D, c.attitude.MC_YAW_P};
}

VelocityGains velocity_gains(const ControlOptions& c, int axis) {
  const PositionControlOptions& p = c.position;
  if (axis == 2) return {p.MPC_Z_VEL_P_ACC, p.MPC_Z_VEL_I_ACC, p.MPC_Z_VEL_D_ACC, p.MPC_Z_P};
  return {p.MPC_XY_VEL_P_ACC, p.MPC_XY_VEL_I_ACC, p.MPC_XY_VEL_D_ACC, p.MPC_XY_P};
}

Result<VehicleFit> fit_vehicle(const LoopLog& log) {
  constexpr const char *kRates[] = {"roll", "pitch", "yaw"}, *kAxes[] = {"x", "y", "z"};
  const LoopFilters filters = filters_of(log);
  VehicleFit vehicle;
  for (int axis = 0; axis < 3; ++axis) {
    Result<RateFit> fit = fit_rate(column(log.torque, axis), column(log.rate, axis), filters, axis == 2);
    if (!fit) return unseen(fmt::format("{}: {}", log.source, kRates[axis]));
    vehicle.rate[static_cast<std::size_t>(axis)] = *std::move(fit);
  }
  for (int axis = 0; axis < 3; ++axis) {
    // x is controlled by pitch, y by roll, z by thrust.
    const auto turning = static_cast<std::size_t>(axis == 0 ? 1 : 0);
    VelocityLoop loop{{}, vehicle.rate[turning].plant, rate_gains(log.control, axis == 0 ? 1 : 0), axis < 2, filters};
    Result<VelocityFit> fit = fit_velocity(column(log.acceleration_asked, axis), column(log.velocity, axis), loop);
    if (!fit) return unseen(fmt::format("{}: {}", log.source, kAxes[axis]));
    vehicle.velocity[static_cast<std::size_t>(axis)] = *std::move(fit);
  }
  return vehicle;
}

}  // namespace fbvins
