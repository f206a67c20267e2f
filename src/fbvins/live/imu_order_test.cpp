// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/imu_order.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace fbvins {
namespace imu_order_test {

Time ms(std::int64_t value) { return Time{value * 1'000'000}; }

struct Ordered {
  ImuOrder order{Duration::from_seconds(0.01)};
  std::vector<std::int64_t> out;
  ImuOrder::Release release = [this](const ImuSample& s) { out.push_back(s.t.ns / 1'000'000); };
  void push(std::int64_t t_ms, std::int64_t host_ms) { order.push({ms(t_ms), Vec3::Zero(), Vec3::Zero()}, ms(host_ms), release); }
};

std::vector<std::int64_t> every_five(std::int64_t count) {
  std::vector<std::int64_t> all;
  for (std::int64_t k = 0; k < count; ++k) all.push_back(5 * k);
  return all;
}

TEST(ImuOrder, RegularReadingsGoOnAtOnce) {
  Ordered o;
  for (const std::int64_t t : every_five(20)) {
    o.push(t, t);
    ASSERT_EQ(o.out.back(), t);
  }
  EXPECT_EQ(o.order.reordered(), 0);
}

TEST(ImuOrder, SwappedReadingsArePutInOrder) {
  Ordered o;
  for (std::int64_t k = 0; k < 20; k += 2) {  // from the fifth on in pairs, the later one first
    if (k < 10) o.push(5 * k, 5 * k), o.push(5 * k + 5, 5 * k + 5);
    else o.push(5 * k + 5, 5 * k + 5), o.push(5 * k, 5 * k + 6);
  }
  EXPECT_EQ(o.out, every_five(20));
  EXPECT_EQ(o.order.reordered(), 5);
  EXPECT_EQ(o.order.late(), 0);
}

TEST(ImuOrder, AHoleIsWaitedForButNotForEver) {
  Ordered o;
  for (const std::int64_t t : every_five(10)) o.push(t, t);
  o.push(55, 55);  // 50 is missing
  EXPECT_EQ(o.out.back(), 45);
  o.order.tick(ms(60), o.release);
  EXPECT_EQ(o.out.back(), 45);
  o.order.tick(ms(66), o.release);
  EXPECT_EQ(o.out.back(), 55);
  o.push(50, 67);
  EXPECT_EQ(o.out.back(), 55);
  EXPECT_EQ(o.order.late(), 1);
}

TEST(ImuOrder, DoubledReadingsCountAsLate) {
  Ordered o;
  for (const std::int64_t t : every_five(10)) o.push(t, t), o.push(t, t);
  EXPECT_EQ(o.out, every_five(10));
  EXPECT_EQ(o.order.late(), 10);
}

TEST(ImuOrder, FlushLetsEverythingGo) {
  Ordered o;
  for (const std::int64_t t : every_five(10)) o.push(t, t);
  o.push(70, 70), o.push(60, 70);
  o.order.flush(o.release);
  EXPECT_EQ(std::vector<std::int64_t>(o.out.end() - 2, o.out.end()), (std::vector<std::int64_t>{60, 70}));
}

}  // namespace imu_order_test
}  // namespace fbvins
