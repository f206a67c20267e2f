// SPDX-License-Identifier: Apache-2.0
// For tests and bench: a rig held by hand before a board, its motion a sum of sines with exact derivatives, and what cameras and
// IMU see of it. Everything that can be wrong with a recording can be put in.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "fbvins/calibration/imu_camera.hpp"
#include "fbvins/core/rng.hpp"

namespace fbvins::test {

struct HandHeldOptions {
  double duration_s = 30, image_rate_hz = 20, imu_rate_hz = 200;
  int cameras = 2;
  double corner_sigma_px = 0.2;
  ImuNoise noise{.gyro_noise_density_radps_rthz = 1.7e-4,
                 .accel_noise_density_mps2_rthz = 2e-3,
                 .gyro_random_walk_radps2_rthz = 2e-5,
                 .accel_random_walk_mps3_rthz = 3e-3};
  double time_offset_s = 0.0123, line_delay_s = 0;
  double later_s = 0;           ///< of each camera after the one before it, with the same stamp
  Vec3 turning = Vec3::Ones();  ///< factor on the turns about each axis of B
  double moving = 1;            ///< factor on the translation
  ImuTriads axes;
  double outlier_share = 0;                   ///< corners elsewhere
  double blur_share = 0;                      ///< images with ten times the noise
  double dropped_share = 0;                   ///< readings missing, in bursts of ten
  double spike_share = 0;                     ///< readings that are nonsense
  double hidden_from_s = 0, hidden_to_s = 0;  ///< board out of view
  double stamp_jitter_s = 0;                  ///< of the images
  double tremor = 1;                          ///< factor on the trembling of the hand, 5 to 10 Hz
};

/// A sum of sines of one variable.
class Wave {
 public:
  Wave() = default;
  Wave(double amplitude, double tremor, Rng& rng) {
    for (std::size_t i = 0; i < kParts; ++i) {
      const bool trembles = i + 2 >= kParts;
      hz_[i] = trembles ? rng.uniform(5, 10) : rng.uniform(0.15, 1.1);
      size_[i] = trembles ? tremor : amplitude * rng.uniform(0.3, 0.6) / std::max(1.0, 2 * hz_[i]);
      phase_[i] = rng.uniform(0, 2 * std::numbers::pi);
    }
  }
  /// Value, first and second derivative.
  std::array<double, 3> at(double t) const {
    std::array<double, 3> out = {};
    for (std::size_t i = 0; i < kParts; ++i) {
      const double w = 2 * std::numbers::pi * hz_[i], x = w * t + phase_[i];
      out[0] += size_[i] * std::sin(x), out[1] += w * size_[i] * std::cos(x), out[2] -= w * w * size_[i] * std::sin(x);
    }
    return out;
  }

 private:
  static constexpr std::size_t kParts = 7;
  std::array<double, kParts> hz_ = {}, size_ = {}, phase_ = {};
};

struct BodyMotion {
  Pose<T, B> T_TB;
  Vec3 a_TB, w_TB_B;
};

class HandHeldMotion {
 public:
  HandHeldMotion(const HandHeldOptions& o, const Pose<T, B>& middle, Rng& rng) : middle_(middle) {
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      position_[k] = Wave(0.18 * o.moving, 3e-4 * o.tremor * o.moving, rng);
      angle_[k] = Wave(0.5 * o.turning(i), 1e-3 * o.tremor * o.turning(i), rng);
    }
  }
  BodyMotion at(double t) const {
    std::array<double, 3> p[3], a[3];
    for (std::size_t i = 0; i < 3; ++i) p[i] = position_[i].at(t), a[i] = angle_[i].at(t);
    const Quat qx = so3_exp(a[0][0] * Vec3::UnitX()), qy = so3_exp(a[1][0] * Vec3::UnitY()),
               qz = so3_exp(a[2][0] * Vec3::UnitZ());
    BodyMotion m;
    m.T_TB = {(middle_.q * qz * qy * qx).normalized(), Vec3(middle_.p + Vec3(p[0][0], p[1][0], p[2][0]))};
    m.a_TB = {p[0][2], p[1][2], p[2][2]};
    m.w_TB_B = a[0][1] * Vec3::UnitX() + qx.conjugate() * (a[1][1] * Vec3::UnitY() + qy.conjugate() * Vec3(0, 0, a[2][1]));
    return m;
  }

 private:
  Pose<T, B> middle_;
  std::array<Wave, 3> position_, angle_;
};

struct HandHeldTruth {
  std::vector<Pose<B, Cn>> T_BC;
  double time_offset_s = 0, line_delay_s = 0;
  Vec3 gravity_T;
  ImuTriads axes;
  std::vector<ImuBias> biases;  ///< at every time of a reading, also of those dropped
  Time first_reading;
  double imu_rate_hz = 200;

  const ImuBias& bias_at(Time t) const {
    return biases[static_cast<std::size_t>(std::lround((t - first_reading).seconds() * imu_rate_hz))];
  }
};

struct HandHeldRecording {
  ImuCameraInput input;
  HandHeldTruth truth;
};

inline Vec3 random_vector(Rng& rng, double sigma) {
  return Vec3{sigma * rng.normal(), sigma * rng.normal(), sigma * rng.normal()};
}

inline Camera wide_camera() {
  return Camera(PinholeRadtan{458.654, 457.296, 367.215, 248.375, -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}, 752, 480);
}

class HandHeld {
 public:
  HandHeld(const HandHeldOptions& options, std::uint64_t seed) : o_(options), rng_(seed) {
    ImuCameraInput& input = out_.input;
    const Quat nominal(Mat3{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}});
    for (int c = 0; c < o_.cameras; ++c) {
      input.cameras.push_back(wide_camera());
      const Vec3 place(-0.021, -0.065 + 0.11 * c, 0.01);
      out_.truth.T_BC.push_back(
          {(nominal * so3_exp(random_vector(rng_, 0.03))).normalized(), Vec3(place + random_vector(rng_, 0.01))});
    }
    for (const Pose<B, Cn>& T_BC : out_.truth.T_BC)
      input.T_CnC0.push_back((T_BC.inverse() * out_.truth.T_BC[0]).cast_frames<Cn, C0>());
    out_.truth.time_offset_s = o_.time_offset_s, out_.truth.line_delay_s = o_.line_delay_s, out_.truth.axes = o_.axes;
    // Gravity downwards on a board that hangs, about: its y axis points up.
    out_.truth.gravity_T = 9.81 * (so3_exp(random_vector(rng_, 0.1)) * -Vec3::UnitY());
    input.noise = o_.noise;
    input.noise.rate_hz = o_.imu_rate_hz;
  }

  HandHeldRecording record() {
    const Board& board = out_.input.board;
    const Vec3 centre = 0.5 * board.corner(board.corner_count() - 2);
    const Pose<T, Cn> looking(Quat(0, 1, 0, 0), Vec3(centre.x(), centre.y(), 0.75));
    const HandHeldMotion motion(o_, looking * out_.truth.T_BC[0].inverse(), rng_);
    readings(motion);
    for (int i = 0; i < static_cast<int>(o_.duration_s * o_.image_rate_hz); ++i) images(motion, i / o_.image_rate_hz + 0.003);
    return std::move(out_);
  }

 private:
  static Time at(double s) { return Time{1'400'000'000'000'000'000} + Duration::from_seconds(s); }

  void readings(const HandHeldMotion& motion) {
    const double dt = 1 / o_.imu_rate_hz;
    const double sg = o_.noise.gyro_noise_density_radps_rthz / std::sqrt(dt),
                 sa = o_.noise.accel_noise_density_mps2_rthz / std::sqrt(dt);
    const double wg = o_.noise.gyro_random_walk_radps2_rthz * std::sqrt(dt),
                 wa = o_.noise.accel_random_walk_mps3_rthz * std::sqrt(dt);
    ImuBias bias{random_vector(rng_, 0.02), random_vector(rng_, 0.1)};
    out_.truth.first_reading = at(-0.5), out_.truth.imu_rate_hz = o_.imu_rate_hz;
    int dropping = 0;
    const int count = static_cast<int>((o_.duration_s + 1) * o_.imu_rate_hz);
    for (int i = 0; i < count; ++i) {
      const double t = -0.5 + i * dt;
      const BodyMotion m = motion.at(t);
      ImuSample s{
          at(t), o_.axes.gyro * m.w_TB_B + bias.gyro_radps + random_vector(rng_, sg),
          o_.axes.accel * (m.T_TB.q.conjugate() * (m.a_TB - out_.truth.gravity_T)) + bias.accel_mps2 + random_vector(rng_, sa)};
      out_.truth.biases.push_back(bias);
      bias.gyro_radps += random_vector(rng_, wg), bias.accel_mps2 += random_vector(rng_, wa);
      if (rng_.uniform() < o_.dropped_share / 10) dropping = 10;
      if (rng_.uniform() < o_.spike_share) s.gyro_radps += random_vector(rng_, 3), s.accel_mps2 += random_vector(rng_, 30);
      if (dropping-- <= 0) out_.input.imu.push_back(s);
    }
  }

  void images(const HandHeldMotion& motion, double t) {
    const bool hidden = t >= o_.hidden_from_s && t < o_.hidden_to_s;
    const double blur = rng_.uniform() < o_.blur_share ? 10 : 1;
    const double late_s = o_.stamp_jitter_s > 0 ? o_.stamp_jitter_s * rng_.normal() : 0;
    for (int c = 0; c < o_.cameras && !hidden; ++c) {
      BoardView view{at(t - o_.time_offset_s + late_s), c, {}};
      for (int i = 0; i < out_.input.board.corner_count(); ++i)
        if (const auto pixel = seen(motion, t + c * o_.later_s, c, i)) {
          Vec2 px = *pixel;
          px += Vec2{blur * o_.corner_sigma_px * rng_.normal(), blur * o_.corner_sigma_px * rng_.normal()};
          if (rng_.uniform() < o_.outlier_share) px += Vec2{20 * rng_.normal(), 20 * rng_.normal()};
          view.corners.push_back({i, px});
        }
      if (!view.corners.empty()) out_.input.views.push_back(std::move(view));
    }
  }

  std::optional<Vec2> seen(const HandHeldMotion& motion, double t, int camera, int corner) const {
    const Camera& lens = out_.input.cameras[static_cast<std::size_t>(camera)];
    const Vec3 p_T = out_.input.board.corner(corner);
    std::optional<Vec2> pixel;
    double row = 0;
    for (int round = 0; round < (o_.line_delay_s != 0 ? 4 : 1); ++round) {
      const Pose<T, B> T_TB = motion.at(t + o_.line_delay_s * row).T_TB;
      const Vec3 p_C = (T_TB * out_.truth.T_BC[static_cast<std::size_t>(camera)]).inverse() * p_T;
      if (p_C.z() < 0.1) return std::nullopt;
      pixel = lens.project(p_C);
      if (!pixel || !lens.inside(*pixel, -100)) return std::nullopt;
      row = pixel->y() - 0.5 * lens.height();
    }
    if (!lens.inside(*pixel, 4)) return std::nullopt;
    return pixel;
  }

  HandHeldOptions o_;
  Rng rng_;
  HandHeldRecording out_;
};

inline HandHeldRecording hand_held(const HandHeldOptions& options, std::uint64_t seed) {
  return HandHeld(options, seed).record();
}

/// Error over its covariance: the mean over many is the number of dimensions.
inline double squared_sigmas(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  return error.dot(covariance.ldlt().solve(error));
}

}  // namespace fbvins::test
