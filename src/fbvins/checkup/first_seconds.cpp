// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/first_seconds.hpp"

#include <utility>

#include "fbvins/checkup/noise_figures.hpp"
#include "fbvins/checkup/projector_dots.hpp"
#include "fbvins/checkup/reading_faults.hpp"
#include "fbvins/checkup/reading_units.hpp"
#include "fbvins/checkup/stamps.hpp"
#include "fbvins/checkup/stereo_order.hpp"
#include "fbvins/types/owned_images.hpp"

namespace fbvins {
namespace {

constexpr double kLook_s = 5;
/// Number of stereo frames that are examined.
constexpr std::size_t kKept = 3;

}  // namespace

void FirstSeconds::push(const SensorEvent& event) {
  if (is_over()) return;
  std::visit(
      Overloaded{[this](const ImuSample& sample) { samples_.push_back(sample); }, [](const AidingSample&) {},  // not examined
                 [this](const StereoFrame& frame) { keep(frame); }},
      event);
}

void FirstSeconds::keep(const StereoFrame& frame) {
  images_.push_back(frame.t);
  const double due_s = kLook_s * static_cast<double>(kept_.size()) / kKept;
  if (kept_.size() < kKept && (frame.t - images_.front()).seconds() >= due_s) kept_.push_back(owned(frame));
}

bool FirstSeconds::is_over() const { return !images_.empty() && (images_.back() - images_.front()).seconds() >= kLook_s; }

std::vector<Finding> FirstSeconds::findings() const {
  std::vector<Finding> findings = check_readings(samples_);
  for (Finding& finding : check_reading_units(samples_)) findings.push_back(std::move(finding));
  for (Finding& finding : check_stamps(samples_, images_, rig_, ends_)) findings.push_back(std::move(finding));
  if (auto finding = check_noise_figures(rig_.imu_noise)) findings.push_back(std::move(*finding));
  if (auto finding = check_dots(share_of_dots(rig_.left(), kept_))) findings.push_back(std::move(*finding));
  if (!rig_.has_right()) return findings;
  if (auto finding = check_stereo_order(stereo_order(rig_, kept_))) findings.push_back(std::move(*finding));
  return findings;
}

}  // namespace fbvins
