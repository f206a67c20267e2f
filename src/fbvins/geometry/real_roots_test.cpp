// SPDX-License-Identifier: Apache-2.0
#include "fbvins/geometry/real_roots.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace real_roots_test {

/// Coefficients, lowest first, of the product of (x - root) and of (x^2 + 1) `pairs` times.
std::vector<double> polynomial(const std::vector<double>& roots, int pairs = 0) {
  std::vector<double> c{1};
  const auto times = [&](const std::vector<double>& factor) {
    std::vector<double> product(c.size() + factor.size() - 1, 0.0);
    for (std::size_t i = 0; i < c.size(); ++i)
      for (std::size_t j = 0; j < factor.size(); ++j) product[i + j] += c[i] * factor[j];
    c = product;
  };
  for (const double r : roots) times({-r, 1});
  for (int i = 0; i < pairs; ++i) times({1, 0, 1});
  return c;
}

std::vector<double> sorted_roots(const std::vector<double>& coefficients) {
  const RealRoots found = real_roots(coefficients);
  std::vector<double> roots(found.begin(), found.end());
  std::sort(roots.begin(), roots.end());
  return roots;
}

TEST(RealRoots, RandomPolynomialsOfEveryDegreeGiveTheirRootsBack) {
  Rng rng(1);
  for (int trial = 0; trial < 300; ++trial) {
    const int real = 1 + trial % 6, pairs = trial % 3;
    std::vector<double> roots;
    while (static_cast<int>(roots.size()) < real) {
      const double r = rng.uniform(-3, 3);
      if (std::none_of(roots.begin(), roots.end(), [&](double other) { return std::abs(other - r) < 0.2; })) roots.push_back(r);
    }
    std::sort(roots.begin(), roots.end());
    const std::vector<double> found = sorted_roots(polynomial(roots, pairs));
    ASSERT_EQ(found.size(), roots.size()) << "trial " << trial;
    for (std::size_t i = 0; i < roots.size(); ++i)
      EXPECT_NEAR(found[i], roots[i], 1e-8 * (1 + std::abs(roots[i]))) << "trial " << trial;
  }
}

TEST(RealRoots, LargeSmallAndZeroRootsAreFoundToTheLastBits) {
  const std::vector<double> roots{-4e6, -1, 0, 2e-7, 1, 3e3};
  const std::vector<double> found = sorted_roots(polynomial(roots));
  ASSERT_EQ(found.size(), roots.size());
  for (std::size_t i = 0; i < roots.size(); ++i) EXPECT_NEAR(found[i], roots[i], 1e-12 * std::abs(roots[i]) + 1e-20);
}

TEST(RealRoots, LeadingZerosLowerTheDegree) {
  EXPECT_EQ(sorted_roots({-2, 1, 0, 0}), (std::vector<double>{2}));
  EXPECT_TRUE(sorted_roots({5}).empty());
  EXPECT_TRUE(sorted_roots({0, 0, 0}).empty());
}

TEST(RealRoots, NoneWhereThereIsNone) {
  EXPECT_TRUE(sorted_roots(polynomial({}, 5)).empty());
  EXPECT_TRUE(sorted_roots({1, std::numeric_limits<double>::quiet_NaN(), 1}).empty());
  EXPECT_TRUE(sorted_roots({1, std::numeric_limits<double>::infinity(), 1}).empty());
}

}  // namespace real_roots_test
}  // namespace fbvins
