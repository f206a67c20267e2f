// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/serial_noise.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace serial_noise_test {

SerialRows simulated(const SerialNoise& noise, int count, std::uint64_t seed) {
  Rng rng(seed);
  SerialRows out;
  out.rows.resize(count, 3);
  double wander = noise.wander * rng.normal(), t = 0;
  for (int i = 0; i < count; ++i) {
    const double dt = i == 0 ? 0 : rng.uniform(0.03, 0.08), left = std::exp(-dt / noise.memory_s);
    t += dt;
    wander = left * wander + std::sqrt(1 - left * left) * noise.wander * rng.normal();
    out.t_s.push_back(t);
    out.rows.row(i) << 1, std::sin(t), wander + noise.white * rng.normal();
  }
  return out;
}

TEST(SerialNoise, WhiteningIsMultiplicationByTheInverseCovariance) {
  const SerialNoise noise{0.3, 0.7, 0.4};
  const SerialRows rows = simulated(noise, 60, 1);
  Eigen::MatrixXd V(60, 60);
  for (int i = 0; i < 60; ++i)
    for (int k = 0; k < 60; ++k)
      V(i, k) = 0.49 * std::exp(-std::abs(rows.t_s[static_cast<std::size_t>(i)] - rows.t_s[static_cast<std::size_t>(k)]) / 0.4) +
                (i == k ? 0.09 : 0);
  const Eigen::MatrixXd inverse = V.inverse(), J = rows.rows.leftCols(2);
  const Eigen::VectorXd r = rows.rows.col(2);
  const NormalSums sums = whitened_sums(noise, rows);
  EXPECT_LT((sums.A - J.transpose() * inverse * J).norm(), 1e-9 * sums.A.norm());
  EXPECT_LT((sums.b - J.transpose() * inverse * r).norm(), 1e-9 * sums.A.norm());
  EXPECT_NEAR(sums.c, r.dot(inverse * r), 1e-9 * sums.c);
  EXPECT_NEAR(sums.log_det_V, std::log(V.determinant()), 1e-9);
}

TEST(SerialNoise, SmoothingIsTheConditionalMean) {
  const SerialNoise noise{0.3, 0.7, 0.4};
  const SerialRows rows = simulated(noise, 40, 2);
  Eigen::MatrixXd C(40, 40);
  for (int i = 0; i < 40; ++i)
    for (int k = 0; k < 40; ++k)
      C(i, k) = 0.49 * std::exp(-std::abs(rows.t_s[static_cast<std::size_t>(i)] - rows.t_s[static_cast<std::size_t>(k)]) / 0.4);
  const Eigen::VectorXd y = rows.rows.col(2), mean = C * (C + 0.09 * Eigen::MatrixXd::Identity(40, 40)).inverse() * y;
  const std::vector<double> smoothed = wandering_part(noise, rows.t_s, y);
  for (int i = 0; i < 40; ++i) EXPECT_NEAR(smoothed[static_cast<std::size_t>(i)], mean(i), 1e-9);
}

TEST(SerialNoise, IsFoundFromResiduals) {
  const SerialNoise truth{0.002, 0.01, 3};
  double white = 0, wander = 0, memory = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const SerialRows rows = simulated(truth, 2000, seed);
    NormalSums others;
    others.A = 1e-6 * Eigen::MatrixXd::Identity(2, 2);
    others.b = Eigen::VectorXd::Zero(2);
    const SerialNoise found = fit_serial_noise({0.01, 0.002, 20}, {&rows}, others, 200);
    white += std::log(found.white / truth.white) / 8;
    wander += std::log(found.wander / truth.wander) / 8;
    memory += std::log(found.memory_s / truth.memory_s) / 8;
  }
  EXPECT_NEAR(white, 0, 0.05);
  EXPECT_NEAR(wander, 0, 0.25);
  EXPECT_NEAR(memory, 0, 0.5);
}

}  // namespace serial_noise_test
}  // namespace fbvins
