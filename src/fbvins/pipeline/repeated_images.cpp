// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/repeated_images.hpp"

#include <algorithm>
#include <cstring>

#include "fbvins/imu/propagation.hpp"

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

/// Of every eighth row: multiply and fold, eight bytes at a time.
std::uint64_t fingerprint_of(ImageView image) {
  std::uint64_t hash =
      0x9e3779b97f4a7c15ULL ^ (static_cast<std::uint64_t>(image.width) << 32) ^ static_cast<std::uint64_t>(image.height);
  const auto mix = [&](std::uint64_t word) {
    hash = (hash ^ word) * 0xd6e8feb86659fd93ULL;
    hash ^= hash >> 32;
  };
  for (int y = 0; y < image.height; y += 8) {
    const std::uint8_t* row = image.row(y);
    int x = 0;
    for (; x + 8 <= image.width; x += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, row + x, 8);
      mix(word);
    }
    for (; x < image.width; ++x) mix(row[x]);
  }
  return hash;
}

}  // namespace

const ImageHistory::Seen* ImageHistory::find(std::uint64_t fingerprint) const {
  const auto same = std::find_if(seen_.rbegin(), seen_.rend(), [&](const Seen& s) { return s.fingerprint == fingerprint; });
  return same == seen_.rend() ? nullptr : &*same;
}

void ImageHistory::add(const Seen& seen) {
  if (seen_.size() == kMostSeen) seen_.pop_front();
  seen_.push_back(seen);
}

bool ImageHistory::is_repeated(const std::shared_ptr<const Image>& image) {
  if (image == nullptr) return false;
  const std::uint64_t fingerprint = fingerprint_of(image->view());
  if (find(fingerprint)) return true;
  add({fingerprint});
  return false;
}

bool RepeatedImageFilter::is_repeated(OfCamera& camera, const Image& image, const Quat& R_B0B, Time t) {
  const std::uint64_t fingerprint = fingerprint_of(image.view());
  const ImageHistory::Seen* same = camera.seen.find(fingerprint);
  if (same != nullptr && !is_of_one_grey(image.view())) {
    const bool turned = same->R_B0B.angularDistance(R_B0B) > kTurn_rad + kBias_radps * (t - same->t).seconds();
    if (turned || (camera.repeats && camera.seen.is_newest(same))) return camera.repeats = true;
  }
  camera.seen.add({fingerprint, R_B0B, t});
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
