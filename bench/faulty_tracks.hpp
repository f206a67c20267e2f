// SPDX-License-Identifier: Apache-2.0
// Synthetic tracks of flights whose cameras fail. An image is a few bytes: the moment at which it was taken, and by which
// camera; the frontend reads them and gives the tracks that this camera would have seen then. So an image that comes late, twice,
// from the other camera or not at all is one to the tracks as well; images turned, shifted or covered are tracks turned,
// shifted or covered.
//
//   faulty_frame(t)                                       in place of a StereoFrame of t
//   FaultyTracks frontend(simulation, options, fault);    reads them
#pragma once

#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>

#include "bench/synthetic_tracks.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/faults/sensor_faults.hpp"
#include "fbvins/frontend/frontend.hpp"

namespace fbvins::bench {

struct TakenImage {
  std::int64_t magic = kMagic;
  Time t;
  std::int64_t right = 0;
  static constexpr std::int64_t kMagic = 0x46425641;
};

inline std::shared_ptr<const Image> faulty_image(Time t, bool right) {
  auto image = std::make_shared<Image>(static_cast<int>(sizeof(TakenImage)), 1);
  const TakenImage taken{TakenImage::kMagic, t, right};
  std::memcpy(image->row(0), &taken, sizeof taken);
  return image;
}

inline StereoFrame faulty_frame(Time t) { return {t, {faulty_image(t, false), faulty_image(t, true)}}; }

/// None of a black, white or blank image.
inline std::optional<TakenImage> taken(const std::shared_ptr<const Image>& image) {
  TakenImage out;
  if (image == nullptr) return std::nullopt;
  std::memcpy(static_cast<void*>(&out), image->row(0), sizeof out);
  return out.magic == TakenImage::kMagic ? std::optional(out) : std::nullopt;
}

/// Faults of images that are made on tracks; those that only an image can show are `not_on_tracks`.
enum class OnTracks { by_image, by_track, not_on_tracks };
inline OnTracks on_tracks(const SensorFault& fault) {
  if (fault.kind != SensorFault::Kind::image) return OnTracks::by_image;
  switch (fault.image) {
    case ImageFault::dark:
    case ImageFault::noise:
    case ImageFault::blur:
    case ImageFault::flicker:
    case ImageFault::torn:
    case ImageFault::broken_blocks:
    case ImageFault::mirrored: return OnTracks::not_on_tracks;
    case ImageFault::covered:
    case ImageFault::scroll:
    case ImageFault::shifted:
    case ImageFault::turned: return OnTracks::by_track;
    default: return OnTracks::by_image;
  }
}

class FaultyTracks final : public Frontend {
 public:
  /// `fault`: one that is made on tracks; its times are since `begin`.
  FaultyTracks(const Simulation& flight, const TrackOptions& options, std::optional<SensorFault> fault, Time begin)
      : flight_(flight), sigma_px_(options.sigma_px), tracks_(flight, options), fault_(std::move(fault)), begin_(begin) {}

  TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) override {
    std::optional<TakenImage> left = taken(packet.frame.left()), right = taken(packet.frame.right());
    TrackedFrame out;
    if (left || right) out = tracks_.frame_at(packet.id, (left ? left : right)->t, prior, (right ? right : left)->t);
    else tracks_.lose_all();
    out.id = packet.id, out.t = packet.frame.t;
    out.cameras = {packet.frame.left() != nullptr, packet.frame.right() != nullptr};
    for (TrackedFeature& f : out.features) {
      const TrackedFeature seen = f;
      f.seen.clear();
      const auto see = [&](int camera, bool as_right) {
        if (const Observation* o = seen.by(as_right)) f.see(camera, *o);
      };
      if (left) see(0, left->right);
      if (right) see(1, right->right);
      if (fault_ && active(out.t)) spoil(f);
    }
    std::erase_if(out.features, [](const TrackedFeature& f) { return f.seen.empty(); });
    out.stats.stereo = 0;
    for (const TrackedFeature& f : out.features) out.stats.stereo += f.by_several();
    return out;
  }
  void locate(const LandmarkUpdate& update) override { tracks_.locate(update); }

 private:
  bool active(Time t) {
    const double since_s = (t - begin_).seconds() - fault_->start_s;
    const bool now = since_s >= 0 && since_s < fault_->length_s;
    if (now && last_ != t) ++count_, last_ = t;
    return now;
  }

  void spoil(TrackedFeature& f) const {
    const double w = flight_.rig.left().width(), h = flight_.rig.left().height(), amount = fault_->amount;
    const auto turn = [&](Vec2 px) {
      const double c = std::cos(amount * kDegree), s = std::sin(amount * kDegree);
      px -= Vec2(w / 2, h / 2);
      return Vec2(w / 2 + c * px.x() - s * px.y(), h / 2 + s * px.x() + c * px.y());
    };
    const auto scrolled = [&](const Vec2& px) { return Vec2(std::fmod(px.x() + w - std::fmod(amount * count_, w), w), px.y()); };
    const auto lower = [&](const Vec2& px) { return Vec2(px.x(), px.y() + amount); };
    for (const int camera : {0, 1}) {
      if (fault_->camera != kAllCameras && fault_->camera != camera) continue;
      Observation* o = f.by(camera);
      if (!o) continue;
      const Camera& lens = flight_.rig.camera(camera);
      bool is_seen = true;
      switch (fault_->image) {
        case ImageFault::covered: is_seen = o->pixel.x() >= fault_->amount * w; break;
        case ImageFault::scroll: is_seen = move(*o, lens, scrolled); break;
        case ImageFault::shifted: is_seen = move(*o, lens, lower); break;
        case ImageFault::turned: is_seen = move(*o, lens, turn); break;
        default: break;
      }
      if (!is_seen) f.forget(camera);
    }
  }

  /// Whether it is still in the image.
  template <class To>
  bool move(Observation& o, const Camera& camera, To&& to) const {
    o.pixel = to(o.pixel);
    const auto ray = camera.inside(o.pixel, 16) ? camera.undistort(o.pixel) : std::nullopt;
    if (!ray) return false;
    o.normalised = *ray;
    Mat2 J;
    (void)camera.distort(o.normalised, &J);
    o.sqrt_information = J / sigma_px_;
    return true;
  }

  const Simulation& flight_;
  double sigma_px_;
  SyntheticTracks tracks_;
  std::optional<SensorFault> fault_;
  Time begin_, last_;
  int count_ = 0;  ///< images of the fault
};

}  // namespace fbvins::bench
