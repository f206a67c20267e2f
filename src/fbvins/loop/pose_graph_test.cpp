// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/pose_graph.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "fbvins/core/rng.hpp"
#include "fbvins/loop/place_map.hpp"

namespace fbvins {
namespace pose_graph_test {

struct Flight {
  std::vector<Pose<M, B>> truth;
  std::vector<Pose<M, B>> odometry;  // drifts in position and yaw
  std::vector<PoseGraphEdge> edges;
};

Mat6 information(double sigma_m, double sigma_rad) {
  Mat6 m = Mat6::Zero();
  m.diagonal().head<3>().setConstant(1 / (sigma_m * sigma_m));
  m.diagonal().tail<3>().setConstant(1 / (sigma_rad * sigma_rad));
  return m;
}

Vec3 noise(Rng& rng, double sigma) { return sigma * Vec3(rng.normal(), rng.normal(), rng.normal()); }

/// Rounds in a room, with `loops` true loops and false ones that make up `false_share` of all.
Flight flight(int n, int loops, double false_share, std::uint64_t seed) {
  constexpr double kStep_m = 0.01, kStep_rad = 0.002, kLoop_m = 0.01, kLoop_rad = 0.004;
  Rng rng(seed);
  Flight f;
  for (int i = 0; i < n; ++i) {
    const double a = 0.12 * i;
    f.truth.push_back({Quat(Eigen::AngleAxisd(a, Vec3::UnitZ())) * so3_exp(Vec3(0.1 * std::sin(a), 0.05, 0)),
                       Vec3(3 * std::cos(a), 2 * std::sin(a), 1 + 0.3 * std::sin(0.31 * i))});
  }
  f.odometry.push_back(f.truth[0]);
  for (int i = 1; i < n; ++i) {
    const auto& a = f.truth[static_cast<std::size_t>(i) - 1];
    const auto& b = f.truth[static_cast<std::size_t>(i)];
    const Pose<B, B> step = a.inverse() * b;
    // The drift turns about the vertical only, which the odometry cannot observe.
    const Quat turned = so3_exp(b.q.conjugate() * Vec3(0, 0, kStep_rad * rng.normal()));
    const Pose<B, B> measured((step.q * turned).normalized(), Vec3(step.p + noise(rng, kStep_m)));
    f.edges.push_back({i - 1, i, measured, information(kStep_m, kStep_rad), false, 1});
    f.odometry.push_back(f.odometry.back() * measured);
  }
  const int wrong = static_cast<int>(std::lround(loops * false_share / (1 - false_share)));
  for (int k = 0; k < loops + wrong; ++k) {
    const int j = 60 + static_cast<int>(rng.below(static_cast<std::uint32_t>(n - 60)));
    const int i = static_cast<int>(rng.below(static_cast<std::uint32_t>(j - 45)));
    Pose<B, B> T = f.truth[static_cast<std::size_t>(i)].inverse() * f.truth[static_cast<std::size_t>(j)];
    T = T.boxplus(noise(rng, kLoop_m), noise(rng, kLoop_rad));
    if (k >= loops) T = Pose<B, B>(so3_exp(Vec3(0, 0, rng.uniform(-2, 2))), noise(rng, 1.5));
    f.edges.push_back({i, j, T, information(kLoop_m, kLoop_rad), true, 1});
  }
  return f;
}

double error_after(const Flight& f, const PoseGraphOptions& options, PoseGraphReport* report = nullptr) {
  PoseGraph graph;
  for (std::size_t i = 0; i < f.odometry.size(); ++i)
    graph.add_node(f.odometry[i], f.odometry[i].q.conjugate() * Vec3::UnitZ(), i == 0);
  for (const PoseGraphEdge& e : f.edges) graph.add_edge(e);
  const PoseGraphReport r = graph.optimise(options);
  if (report != nullptr) *report = r;
  double sum = 0;
  for (std::size_t i = 0; i < f.truth.size(); ++i) sum += (graph.poses()[i].p - f.truth[i].p).squaredNorm();
  return std::sqrt(sum / static_cast<double>(f.truth.size()));
}

double odometry_error(const Flight& f) {
  double sum = 0;
  for (std::size_t i = 0; i < f.truth.size(); ++i) sum += (f.odometry[i].p - f.truth[i].p).squaredNorm();
  return std::sqrt(sum / static_cast<double>(f.truth.size()));
}

class PoseGraphDof : public testing::TestWithParam<int> {};

TEST_P(PoseGraphDof, LoopsTakeOutTheDrift) {
  const Flight f = flight(400, 120, 0, 3);
  const double after = error_after(f, {.degrees_of_freedom = GetParam()});
  EXPECT_GT(odometry_error(f), 0.1);
  EXPECT_LT(after, 0.25 * odometry_error(f));
}

TEST_P(PoseGraphDof, TenPercentFalseLoopsStayWithinTenPercentOfClean) {
  for (const std::uint64_t seed : {3, 4, 5}) {
    const Flight clean = flight(400, 120, 0, seed), dirty = flight(400, 120, 0.1, seed);
    PoseGraphReport report;
    const double with_false = error_after(dirty, {.degrees_of_freedom = GetParam()}, &report);
    EXPECT_LT(with_false, 1.1 * error_after(clean, {.degrees_of_freedom = GetParam()}) + 1e-3) << "seed " << seed;
    EXPECT_GE(report.rejected, 12);
    EXPECT_LE(report.rejected, 20);
  }
}

TEST_P(PoseGraphDof, SameInputSameBits) {
  const Flight f = flight(150, 40, 0.1, 9);
  EXPECT_EQ(error_after(f, {.degrees_of_freedom = GetParam()}), error_after(f, {.degrees_of_freedom = GetParam()}));
}

INSTANTIATE_TEST_SUITE_P(Dof, PoseGraphDof, testing::Values(4, 6));

TEST(PoseGraph, FourDegreesOfFreedomKeepRollAndPitch) {
  const Flight f = flight(200, 60, 0, 5);
  PoseGraph graph;
  for (std::size_t i = 0; i < f.odometry.size(); ++i)
    graph.add_node(f.odometry[i], f.odometry[i].q.conjugate() * Vec3::UnitZ(), i == 0);
  for (const PoseGraphEdge& e : f.edges) graph.add_edge(e);
  graph.optimise({});
  for (std::size_t i = 0; i < f.odometry.size(); ++i)
    EXPECT_NEAR((graph.poses()[i].q.conjugate() * Vec3::UnitZ() - f.odometry[i].q.conjugate() * Vec3::UnitZ()).norm(), 0, 1e-9);
}

/// The truth moved to the frame of a building, of which every fifth node has a position; `wrong_share` of them are elsewhere.
double anchored_error(const Flight& f, double wrong_share, int dof, PoseGraphReport& report) {
  const Pose<A, M> T_AM(Quat(Eigen::AngleAxisd(0.4, Vec3::UnitZ())), Vec3(1, 2, -0.5));
  Rng rng(11);
  PoseGraph graph;
  for (const Pose<M, B>& T : f.odometry) graph.add_node(T, T.q.conjugate() * Vec3::UnitZ());
  for (const PoseGraphEdge& e : f.edges) graph.add_edge(e);
  for (std::size_t i = 0; i < f.truth.size(); i += 5) {
    PositionAnchor a{.p_A = T_AM * f.truth[i].p + noise(rng, 0.05), .covariance = 0.0025 * Mat3::Identity()};
    if (rng.uniform() < wrong_share) a.p_A += noise(rng, 2);
    graph.add_anchor({static_cast<int>(i), measurement_of(a)});
  }
  report = graph.optimise({.degrees_of_freedom = dof});
  double sum = 0;
  for (std::size_t i = 0; i < f.truth.size(); ++i) sum += (graph.poses()[i].p - T_AM * f.truth[i].p).squaredNorm();
  return std::sqrt(sum / static_cast<double>(f.truth.size()));
}

TEST_P(PoseGraphDof, AnchorsMoveEverythingAndWrongOnesCountForNothing) {
  const Flight f = flight(300, 60, 0, 3);
  PoseGraphReport clean, dirty;
  const double right = anchored_error(f, 0, GetParam(), clean), with_wrong = anchored_error(f, 0.2, GetParam(), dirty);
  EXPECT_LT(right, 0.03);
  EXPECT_LT(with_wrong, 0.04);
  EXPECT_EQ(clean.anchors, 60);
  EXPECT_EQ(clean.anchors_rejected, 0);
  EXPECT_GT(dirty.anchors_rejected, 6);
  EXPECT_EQ(dirty.anchors + dirty.anchors_rejected, 60);
}

TEST(ComposeCovariance, AgreesWithSampling) {
  const Pose<B, B> A(so3_exp(Vec3(0.3, -0.5, 0.8)), Vec3(1, 2, -0.5)), C(so3_exp(Vec3(-0.2, 0.1, 0.4)), Vec3(0.4, -1, 0.3));
  const Mat6 cov_a = information(1 / 0.02, 1 / 0.01).inverse().inverse(),
             cov_c = information(1 / 0.01, 1 / 0.03).inverse().inverse();
  Rng rng(4);
  Mat6 sampled = Mat6::Zero();
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    const auto perturb = [&](const Pose<B, B>& T, const Mat6& cov) {
      Vec6 d;
      for (int k = 0; k < 6; ++k) d[k] = std::sqrt(cov(k, k)) * rng.normal();
      return T.boxplus(d.head<3>(), d.tail<3>());
    };
    const Pose<B, B> T = perturb(A, cov_a) * perturb(C, cov_c), mean = A * C;
    Vec6 e;
    e << T.p - mean.p, so3_log(mean.q.conjugate() * T.q);
    sampled += e * e.transpose() / kSamples;
  }
  const Mat6 formula = compose_covariance(A, cov_a, C, cov_c);
  EXPECT_LT((formula - sampled).norm(), 0.05 * formula.norm());
}

TEST(PlaceMap, ThinningKeepsTheGraphTogether) {
  const Flight f = flight(120, 40, 0, 6);
  PlaceMap map;
  for (std::size_t i = 0; i < f.odometry.size(); ++i) {
    MapKeyframe k;
    k.t = Time{static_cast<std::int64_t>(i) * 100'000'000};
    k.T_GB = {f.odometry[i].q, f.odometry[i].p};  // M begins as W
    k.T_MB = f.odometry[i];
    map.add(std::move(k));
  }
  for (const PoseGraphEdge& e : f.edges)
    map.edges.push_back(
        {KeyframeId{e.a}, KeyframeId{e.b}, e.T_ab, e.information, e.loop ? MapEdge::Kind::loop : MapEdge::Kind::odometry});
  for (int i = 119; i > 0; i -= 2) map.remove(KeyframeId{i});
  ASSERT_EQ(map.size(), 60u);
  map.optimise({});
  double sum = 0, before = 0;
  for (const MapKeyframe& k : map.keyframes()) {
    const auto i = static_cast<std::size_t>(k.id.value);
    sum += (k.T_MB.p - f.truth[i].p).squaredNorm();
    before += (f.odometry[i].p - f.truth[i].p).squaredNorm();
  }
  EXPECT_LT(std::sqrt(sum), 0.4 * std::sqrt(before));
}

/// Two flights along the same way, each of its own scale, which know one another's places.
struct TwoScales {
  PoseGraph graph;
  std::vector<Pose<M, B>> truth;
  std::size_t first = 0, second = 0;

  TwoScales(double log_first, double sigma_first, double log_second, double sigma_second) {
    Rng rng(7);
    constexpr int kEach = 60;
    const Flight f = flight(kEach, 0, 0, 7);
    const Mat6 step = information(0.01, 0.002), loop = information(0.006, 0.002);
    const auto unit = [&](double sigma) { return sigma > 0 ? std::optional(graph.add_scale({0, sigma, false})) : std::nullopt; };
    const std::array<std::optional<std::size_t>, 2> scales{unit(sigma_first), unit(sigma_second)};
    const auto scaled = [](Pose<B, B> T, double log) { return Pose<B, B>(T.q, Vec3(std::exp(-log) * T.p)); };
    for (const double log : {log_first, log_second}) {
      const bool later = !truth.empty();
      for (int i = 0; i < kEach; ++i) {
        const auto& T = f.truth[static_cast<std::size_t>(i)];
        graph.add_node({T.q, Vec3(std::exp(-log) * T.p)}, T.q.conjugate() * Vec3::UnitZ(), !later && i == 0);
        truth.push_back(T);
        const int n = static_cast<int>(truth.size()) - 1;
        if (i == 0) continue;
        const Pose<B, B> T_ab = (truth[truth.size() - 2].inverse() * T).boxplus(noise(rng, 0.002), noise(rng, 0.0005));
        graph.add_edge({n - 1, n, scaled(T_ab, log), step, false, 1, scales[later], scales[later]});
      }
    }
    for (int i = 0; i < kEach; i += 2) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(kEach + (i + 3) % kEach);
      const Pose<B, B> T_ab = (truth[a].inverse() * truth[b]).boxplus(noise(rng, 0.003), noise(rng, 0.001));
      graph.add_edge({static_cast<int>(a), static_cast<int>(b), scaled(T_ab, 0.5 * (log_first + log_second)), loop, true, 1,
                      scales[0], scales[1]});
    }
    if (scales[0]) first = *scales[0];
    if (scales[1]) second = *scales[1];
  }

  double largest_error_m() const {
    double most = 0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      most = std::max(most, (graph.poses()[i].p - graph.poses()[0].p - (truth[i].p - truth[0].p)).norm());
    return most;
  }
};

TEST(PoseGraphScale, AFlightTakesTheScaleOfOneThatMeasuresLengths) {
  TwoScales s(0, 0, 0.04, 0.03);
  EXPECT_GT(s.largest_error_m(), 0.1);
  const PoseGraphReport report = s.graph.optimise({});
  EXPECT_NEAR(s.graph.scales()[s.second].log, 0.04, 0.006);
  EXPECT_LT(s.largest_error_m(), 0.02);
  EXPECT_EQ(report.rejected, 0);
}

TEST(PoseGraphScale, TheScaleOfTwoLiesBetweenThemByWhatTheyKnow) {
  TwoScales s(0.02, 0.02, -0.01, 0.01);
  s.graph.optimise({});
  const double first = s.graph.scales()[s.first].log, second = s.graph.scales()[s.second].log;
  EXPECT_NEAR(first - second, 0.03, 0.002) << "what one has of the other is measured";
  EXPECT_NEAR(first, 0.03 * 4 / 5, 0.002) << "of which the less certain takes the larger part, by the variances";
  EXPECT_NEAR(first / (0.02 * 0.02), -second / (0.01 * 0.01), 10) << "which cost the same then";
}

TEST(PoseGraphScale, AFixedScaleStays) {
  TwoScales s(0.02, 0.02, -0.01, 0.01);
  PoseGraph fixed;
  for (std::size_t i = 0; i < s.truth.size(); ++i)
    fixed.add_node(s.graph.poses()[i], s.truth[i].q.conjugate() * Vec3::UnitZ(), i < s.truth.size() / 2);
  fixed.add_scale({0, 0.02, true});
  fixed.add_scale({0, 0.01, false});
  for (const PoseGraphEdge& e : s.graph.edges()) fixed.add_edge(e);
  fixed.optimise({});
  EXPECT_EQ(fixed.scales()[0].log, 0);
  EXPECT_NEAR(fixed.scales()[1].log, -0.03, 0.003);
}

TEST(PoseGraphScale, ResidualsFitWithTheScales) {
  TwoScales s(0.02, 0.02, -0.01, 0.01);
  const auto worst = [&] {
    double most = 0;
    for (const PoseGraphEdge& e : s.graph.edges()) most = std::max(most, s.graph.chi2(e, {}));
    return most;
  };
  s.graph.optimise({});
  EXPECT_LT(worst(), 16);
}

}  // namespace pose_graph_test
}  // namespace fbvins
