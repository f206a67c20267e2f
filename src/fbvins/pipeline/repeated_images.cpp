// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/repeated_images.hpp"

#include <algorithm>

#include "fbvins/imu/propagation.hpp"
#include "fbvins/pipeline/frozen_camera.hpp"

namespace fbvins {
namespace {

/// A driver's buffers may come in turns.
constexpr std::size_t kMostSeen = 32;
/// One pixel of a wide lens, and the largest bias of a gyroscope: less may be no turn.
constexpr double kTurn_rad = 0.005, kBias_radps = 0.05;

bool is_of_one_grey(const ImageView& image) {
  for (int y = 0; y < image.height; y += 8) {
    const std::uint8_t* row = image.row(y);
    if (!std::all_of(row, row + image.width, [&](std::uint8_t grey) { return grey == image.data[0]; })) return false;
  }
  return true;
}

}  // namespace

bool RepeatedImageFilter::is_repeated(OfCamera& camera, const Image& image, const Quat& R_B0B, Time t) {
  const std::uint64_t now = image_fingerprint(image.view());
  const auto same = std::find_if(camera.seen.rbegin(), camera.seen.rend(), [&](const Seen& s) { return s.fingerprint == now; });
  if (same != camera.seen.rend() && !is_of_one_grey(image.view())) {
    const bool turned = same->R_B0B.angularDistance(R_B0B) > kTurn_rad + kBias_radps * (t - same->t).seconds();
    if (turned || (camera.repeats && same == camera.seen.rbegin())) return camera.repeats = true;
  }
  if (camera.seen.size() == kMostSeen) camera.seen.pop_front();
  camera.seen.push_back({now, R_B0B, t});
  return false;
}

bool RepeatedImageFilter::take_out(StereoFrame& frame, const ImuSegment& since) {
  if (since.empty())
    for (OfCamera& camera : cameras_) camera.seen.clear();  // nobody knows by how much it has turned
  const Quat R_B0B = since.empty() ? R_B0B_ : Quat(R_B0B_ * integrate_gyro(since, Vec3::Zero()));
  cameras_.resize(std::max(cameras_.size(), frame.images.size()));
  const bool had_images = !frame.without_images();
  for (std::size_t i = 0; i < frame.images.size(); ++i) {
    if (!frame.images[i] || !is_repeated(cameras_[i], *frame.images[i], R_B0B, frame.t)) continue;
    frame.images[i] = nullptr;
    ++count_;
  }
  if (had_images && frame.without_images() && !frame.after_clock_step) return false;
  R_B0B_ = R_B0B.normalized();
  return true;
}

}  // namespace fbvins
