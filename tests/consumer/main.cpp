// SPDX-License-Identifier: Apache-2.0
// Uses the installed library as a user would, from values to a figure.
#include <fbvins/eval/evaluation.hpp>

#include <cmath>
#include <cstdio>

int main() {
  fbvins::Trajectory truth, estimate;
  for (int i = 0; i < 100; ++i) {
    const fbvins::Time t{50'000'000LL * i};
    const fbvins::Vec3 p(std::sin(0.1 * i), std::cos(0.1 * i), 0.01 * i);
    truth.push_back({t, {fbvins::Quat::Identity(), p}});
    estimate.push_back({t, {fbvins::Quat::Identity(), fbvins::Vec3(p + fbvins::Vec3(1, 2, 3))}});
  }
  const auto evaluation = fbvins::evaluate(truth, estimate, {});
  if (!evaluation) {
    std::puts(evaluation.error().message.c_str());
    return 1;
  }
  std::printf("rmse %.3e m over %d poses\n", evaluation->absolute_m.rmse, evaluation->pairs);
  return evaluation->absolute_m.rmse < 1e-9 ? 0 : 1;
}
