// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_views.hpp"

#include <gtest/gtest.h>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace window_views_test {

FrameList turning(const Vec3& rate_B, int frames, Duration apart) {
  FrameList out;
  Quat q = so3_exp(Vec3(0.3, -0.2, 1));
  for (int i = 0; i < frames; ++i) {
    Frame frame{};
    frame.id = FrameId{i};
    frame.t = Time{apart.ns * i};
    frame.state.T_FB.q = q;
    out.add(frame);
    q = q * so3_exp(apart.seconds() * rate_B);
  }
  return out;
}

TEST(MeanRate, IsThatOfATurnOfMoreThanARevolution) {
  const Vec3 rate_B(0.4, -0.3, 1.1);
  EXPECT_NEAR((mean_rate_B(turning(rate_B, 12, Duration{800'000'000})) - rate_B).norm(), 0, 1e-12);
}

TEST(MeanRate, OfOneFrameIsZero) {
  EXPECT_EQ(mean_rate_B(turning(Vec3(0, 0, 1), 1, Duration{1})), Vec3::Zero());
  EXPECT_EQ(mean_rate_B(FrameList{}), Vec3::Zero());
}

}  // namespace window_views_test
}  // namespace fbvins
