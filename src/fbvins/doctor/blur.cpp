// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/blur.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

using Energies = GradientEnergies;
constexpr int kDirections = Energies::kDirections;

/// Half of the time over which the angular rate is averaged; image velocity from which an image counts; most and fewest images.
constexpr Duration kHalf{7'500'000};
constexpr double kSlowest_pxps = 50;
constexpr std::size_t kMostImages = 400;
constexpr int kFewestImages = 40;
/// Blur of sharp edges at the two scales, px of the image: lens, pixels, pyramid and the gradient's own filter.
constexpr double kFineEdge_px = 1.1, kCoarseEdge_px = 3.6;
/// A direction counts if it has this share of its cell's mean energy; a cell, if its mean coarse energy is this large.
constexpr double kCoarseShare = 0.15, kFineShare = 0.01, kLeastEnergy = 4;
/// Exposures tried, each a quarter longer than the one before.
constexpr double kShortest_s = 1e-3, kStep = 1.24;
constexpr std::size_t kExposures = 21, kParts = 8;
constexpr double kCap = 1;  // of a residual, logarithm of a ratio
/// Edges of real scenes are not all sharp: known exposures are measured within this share.
constexpr double kModelError = 0.25;
constexpr double kMostBlur_px = 12, kSignificant = 3;

using ByDirection = std::array<double, kDirections>;

/// One cell of one image.
struct Sample {
  std::size_t part = 0;
  std::array<bool, kDirections> used{};
  ByDirection sharpness{};   ///< logarithm of fine over coarse energy, less its mean
  ByDirection speed_pxps{};  ///< of the image across edges of that direction
};

/// Energy of a sharp edge's gradients after a box blur of so many edge widths, as a share of what it was.
double kept_energy(double widths) {
  if (widths < 1e-3) return 1;
  const double along =
      widths * std::erf(0.5 * widths) - 2 / std::sqrt(std::numbers::pi) * (1 - std::exp(-0.25 * widths * widths));
  return 2 * std::sqrt(std::numbers::pi) / (widths * widths) * along;
}

double lost_sharpness(double blur_px) {
  return std::log(kept_energy(blur_px / kFineEdge_px) / kept_energy(blur_px / kCoarseEdge_px));
}

/// The same from a table.
class LostSharpness {
 public:
  LostSharpness() {
    for (std::size_t i = 0; i < table_.size(); ++i) table_[i] = lost_sharpness(kGrid_px * static_cast<double>(i));
  }
  double operator()(double blur_px) const {
    const double at = std::min(blur_px / kGrid_px, static_cast<double>(table_.size()) - 1.001);
    const auto i = static_cast<std::size_t>(at);
    return table_[i] + (at - static_cast<double>(i)) * (table_[i + 1] - table_[i]);
  }

 private:
  static constexpr double kGrid_px = 0.25;
  std::array<double, 600> table_{};
};

void subtract_mean(const std::array<bool, kDirections>& used, ByDirection& values) {
  double sum = 0, count = 0;
  for (std::size_t d = 0; d < kDirections; ++d)
    if (used[d]) sum += values[d], count += 1;
  for (double& value : values) value -= sum / std::max(count, 1.0);
}

/// Derivative of the image velocity at the cells' centres by the camera's angular rate, px/s per rad/s.
using Flow = Eigen::Matrix<double, 2, 3>;
std::vector<std::optional<Flow>> flows(const Camera& camera) {
  constexpr double kSmall = 1e-4;
  std::vector<std::optional<Flow>> all;
  for (int cell = 0; cell < Energies::kCells; ++cell) {
    const Vec2 px((cell % Energies::kColumns + 0.5) * camera.width() / Energies::kColumns,
                  (cell / Energies::kColumns + 0.5) * camera.height() / Energies::kRows);
    all.emplace_back();
    const auto ray = camera.undistort(px);
    if (!ray) continue;
    const Vec3 X = ray->homogeneous();
    Flow flow;
    for (int i = 0; i < 3; ++i)
      flow.col(i) = (camera.distort(Vec3(X - kSmall * Vec3::Unit(i).cross(X)).hnormalized()) - px) / kSmall;
    all.back() = flow;
  }
  return all;
}

std::optional<Sample> sample_of(const Energies& energies, int cell, const Vec2& velocity_pxps) {
  Sample sample;
  double fine = 0, coarse = 0;
  for (int d = 0; d < kDirections; ++d) {
    fine += energies.fine[Energies::index(cell, d)] / kDirections;
    coarse += energies.coarse[Energies::index(cell, d)] / kDirections;
  }
  if (coarse < kLeastEnergy || fine <= 0) return std::nullopt;
  int count = 0;
  for (int d = 0; d < kDirections; ++d) {
    const auto i = static_cast<std::size_t>(d);
    const double here_fine = energies.fine[Energies::index(cell, d)], here_coarse = energies.coarse[Energies::index(cell, d)];
    const double angle = std::numbers::pi * d / kDirections;
    sample.speed_pxps[i] = std::abs(velocity_pxps.dot(Vec2(std::cos(angle), std::sin(angle))));
    if (here_coarse < kCoarseShare * coarse || here_fine < kFineShare * fine) continue;
    sample.used[i] = true, ++count;
    sample.sharpness[i] = std::log(here_fine / here_coarse);
  }
  if (count < 2) return std::nullopt;
  subtract_mean(sample.used, sample.sharpness);
  return sample;
}

struct Samples {
  std::vector<Sample> all;
  std::vector<double> speeds_pxps;  ///< of the images
};

Samples collect(const Evidence& evidence, const ImuSeries& imu, const StereoRig& rig) {
  Samples out;
  const auto flow = flows(rig.left());
  const std::size_t n = evidence.frames.size(), step = n / kMostImages + 1;
  for (std::size_t k = 0; k < n; k += step) {
    const Time t = evidence.frames[k].t + Duration::from_seconds(rig.time_offset_s);
    if (!imu.covers(t - kHalf, t + kHalf)) continue;
    const Vec3 rate_C = rig.T_BC0().R().transpose() * imu.turned(t - kHalf, t + kHalf) / (kHalf + kHalf).seconds();
    std::vector<double> speeds;
    for (int cell = 0; cell < Energies::kCells; ++cell) {
      if (!flow[static_cast<std::size_t>(cell)]) continue;
      const Vec2 velocity = *flow[static_cast<std::size_t>(cell)] * rate_C;
      speeds.push_back(velocity.norm());
      auto sample = sample_of(evidence.frames[k].gradients, cell, velocity);
      if (!sample) continue;
      sample->part = k * kParts / n;
      out.all.push_back(*sample);
    }
    out.speeds_pxps.push_back(median(speeds));
  }
  return out;
}

/// Squared residuals of an exposure, by part of the recording. What a direction has in all images is the scene's, and is removed.
std::array<double, kParts> misfit(const std::vector<Sample>& samples, double exposure_s, const LostSharpness& lost) {
  std::vector<ByDirection> rest;
  std::array<std::vector<double>, kDirections> of_direction;
  for (const Sample& sample : samples) {
    ByDirection expected;
    for (std::size_t d = 0; d < kDirections; ++d) expected[d] = lost(exposure_s * sample.speed_pxps[d]);
    subtract_mean(sample.used, expected);
    rest.emplace_back();
    for (std::size_t d = 0; d < kDirections; ++d) {
      rest.back()[d] = sample.sharpness[d] - expected[d];
      if (sample.used[d]) of_direction[d].push_back(rest.back()[d]);
    }
  }
  ByDirection common{};
  for (std::size_t d = 0; d < kDirections; ++d) common[d] = median(of_direction[d]);
  std::array<double, kParts> sums{};
  for (std::size_t i = 0; i < samples.size(); ++i)
    for (std::size_t d = 0; d < kDirections; ++d)
      if (samples[i].used[d]) sums[samples[i].part] += std::pow(std::min(std::abs(rest[i][d] - common[d]), kCap), 2);
  return sums;
}

/// The exposures that are tried; the first is 0.
double exposure_at(double index) { return index < 0.5 ? 0 : kShortest_s * std::pow(kStep, index - 1); }

/// The exposure with the smallest misfit, leaving out one part (jackknife); kParts: none.
double best_exposure(const std::array<std::array<double, kParts>, kExposures + 1>& misfits, std::size_t without) {
  std::array<double, kExposures + 1> sums{};
  for (std::size_t i = 0; i < sums.size(); ++i)
    for (std::size_t part = 0; part < kParts; ++part)
      if (part != without) sums[i] += misfits[i][part];
  const auto best = static_cast<std::size_t>(std::min_element(sums.begin(), sums.end()) - sums.begin());
  if (best < 2 || best == kExposures) return exposure_at(static_cast<double>(best));
  const double l = sums[best - 1], m = sums[best], r = sums[best + 1];
  return exposure_at(static_cast<double>(best) + 0.5 * (l - r) / std::max(l + r - 2 * m, 1e-12));
}

}  // namespace

Blur measure_blur(const Evidence& evidence, const ImuSeries& imu, const StereoRig& rig) {
  Blur blur;
  if (imu.empty() || evidence.frames.empty()) return blur;
  Samples samples = collect(evidence, imu, rig);
  std::sort(samples.speeds_pxps.begin(), samples.speeds_pxps.end());
  blur.images = static_cast<int>(samples.speeds_pxps.end() -
                                 std::lower_bound(samples.speeds_pxps.begin(), samples.speeds_pxps.end(), kSlowest_pxps));
  if (blur.images < kFewestImages) return blur;
  blur.speed_pxps = samples.speeds_pxps[samples.speeds_pxps.size() * 9 / 10];
  const LostSharpness lost;
  std::array<std::array<double, kParts>, kExposures + 1> misfits{};
  for (std::size_t i = 0; i < misfits.size(); ++i) misfits[i] = misfit(samples.all, exposure_at(static_cast<double>(i)), lost);
  blur.exposure_s = best_exposure(misfits, kParts);
  double mean = 0, square = 0;
  for (std::size_t part = 0; part < kParts; ++part) mean += best_exposure(misfits, part) / kParts;
  for (std::size_t part = 0; part < kParts; ++part) square += std::pow(best_exposure(misfits, part) - mean, 2);
  blur.sigma_s = std::hypot(std::sqrt((kParts - 1.0) / kParts * square), kModelError * blur.exposure_s, kShortest_s);
  return blur;
}

std::optional<Finding> check_blur(const Blur& blur) {
  if (blur.length_px() < kMostBlur_px || blur.exposure_s < kSignificant * blur.sigma_s) return std::nullopt;
  Finding finding;
  finding.kind = FindingKind::blur;
  finding.size = 1e3 * blur.exposure_s, finding.sigma = 1e3 * blur.sigma_s, finding.unit = "ms";
  finding.measured = fmt::format(
      "edges across the motion are as blurred as by an exposure of {:.0f} +- {:.0f} ms: {:.0f} px in the fastest tenth of the images",
      finding.size, finding.sigma, blur.length_px());
  finding.expected = fmt::format("less than {:.0f} px", kMostBlur_px);
  finding.advice = fmt::format("limit the exposure to {:.0f} ms and let the gain go up, or give more light",
                               std::max(1e3 * 0.5 * kMostBlur_px / blur.speed_pxps, 1.0));
  return finding;
}

}  // namespace fbvins
