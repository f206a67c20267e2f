// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/misreading.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace fbvins {
namespace misreading_test {

Trajectory<W> flight() {
  Trajectory<W> out;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 * i;
    out.push_back({Time{static_cast<std::int64_t>(50'000'000) * i},
                   {so3_exp(Vec3(0.9 * std::sin(t), 0.7 * std::cos(1.3 * t), 0.4 * t)), Vec3(std::sin(t), t, std::cos(2 * t))}});
  }
  return out;
}

/// The flight in another world, each pose changed by `change`.
template <class Change>
Misreading found(Change change) {
  const Pose<W, W> T(so3_exp(Vec3(0, 0, 1)), Vec3(3, 2, 1));
  Trajectory<W> estimate = flight();
  for (auto& pose : estimate) pose.T = T * pose.T, change(pose);
  return find_misreading(flight(), estimate, {});
}

TEST(Misreading, NothingIsFoundWhereNothingIsWrong) {
  EXPECT_EQ(found([](auto&) {}).said, "");
  EXPECT_EQ(found([](auto& pose) { pose.T.q = pose.T.q * so3_exp(Vec3(0.02, 0.3 * std::sin(pose.t.seconds()), 0)); }).said, "")
      << "a bad estimate";
  EXPECT_EQ(found([](auto& pose) { pose.T.p *= 0.5; }).said, "") << "a scale that nobody knows";
}

TEST(Misreading, OrderAndConjugationAreFound) {
  const auto as_last = [](auto& pose) {
    const Quat q = pose.T.q;
    pose.T.q = Quat(q.x(), q.y(), q.z(), q.w());
  };
  const Misreading order = found(as_last);
  EXPECT_EQ(order.said, "quaternions are x y z w");
  EXPECT_LT(order.estimate.poses[100].T.q.angularDistance(so3_exp(Vec3(0, 0, 1)) * flight()[100].T.q), 1e-9);
  EXPECT_EQ(found([](auto& pose) {
              const Quat q = pose.T.q;
              pose.T.q = Quat(q.z(), q.w(), q.x(), q.y());
            }).said,
            "quaternions are w x y z");
  EXPECT_EQ(found([](auto& pose) { pose.T.q = pose.T.q.conjugate(); }).said, "quaternions are conjugated (world to body)");
}

TEST(Misreading, MillimetresAreFound) {
  const Misreading mm = found([](auto& pose) { pose.T.p *= 1000; });
  EXPECT_EQ(mm.said, "positions are in millimetres");
  EXPECT_LT(mm.estimate.poses[7].T.p.norm(), 10);
}

}  // namespace misreading_test
}  // namespace fbvins
