// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "fbvins/core/rng.hpp"
#include "tests/support/setup_fault_lists.hpp"

namespace fbvins::setup_fault {
namespace {

/// Each `nth` image is the one before.
SetupFault frozen(std::string name, int nth, bool left, bool right) {
  struct State {
    StereoFrame before;
    int count = 0;
  };
  auto state = std::make_shared<State>();
  return {std::move(name), FindingKind::frozen_images, 0, 0, {}, {}, [=](StereoFrame& frame) {
            if (++state->count % nth == 0) {
              if (left) frame.set_image(0, state->before.left());
              if (right) frame.set_image(1, state->before.right());
            }
            state->before = frame;
          }};
}

SetupFault right_one_frame_late(double period_s) {
  auto before = std::make_shared<std::shared_ptr<const Image>>();
  return {"right images one frame old",
          FindingKind::stereo_sync,
          -1e3 * period_s,
          std::max(kTenth * 1e3 * period_s, kTimeTolerance_ms),
          {},
          {},
          [before](StereoFrame& frame) {
            if (!*before) *before = frame.right();
            frame.set_image(1, std::exchange(*before, frame.right()));
          }};
}

std::shared_ptr<const Image> with(const std::shared_ptr<const Image>& image, const std::function<void(Image&)>& change) {
  if (!image) return image;
  auto copy = std::make_shared<Image>(image->width(), image->height());
  for (int y = 0; y < image->height(); ++y) std::copy(image->row(y), image->row(y) + image->width(), copy->row(y));
  change(*copy);
  return copy;
}

void add_dot(Image& image, double x, double y, double brightness) {
  for (int py = static_cast<int>(y) - 3; py <= static_cast<int>(y) + 4; ++py)
    for (int px = static_cast<int>(x) - 3; px <= static_cast<int>(x) + 4; ++px) {
      if (px < 0 || py < 0 || px >= image.width() || py >= image.height()) continue;
      const double light = brightness * std::exp(-0.5 * ((px - x) * (px - x) + (py - y) * (py - y)));
      image.at(px, py) = static_cast<std::uint8_t>(std::min(255.0, image.at(px, py) + light));
    }
}

/// A projector beside the cameras: a pattern that moves with them.
SetupFault dots(const StereoRig& rig) {
  std::vector<Vec2> places;
  Rng rng(5);
  for (int y = 8; y < rig.left().height() - 8; y += 18)
    for (int x = 8; x < rig.left().width() - 8; x += 18) {
      const double dx = rng.uniform(), dy = rng.uniform();
      places.emplace_back(x + 8 * dx, y + 8 * dy);
    }
  return {"projector of dots on", FindingKind::projector_dots, 0, 0, {}, {}, [places](StereoFrame& frame) {
            frame.set_image(0, with(frame.left(), [&](Image& image) {
                              for (const Vec2& p : places) add_dot(image, p.x(), p.y(), 110);
                            }));
            frame.set_image(1, with(frame.right(), [&](Image& image) {
                              for (const Vec2& p : places) add_dot(image, p.x() - 9, p.y(), 110);
                            }));
          }};
}

/// A part of the vehicle in the lower third of both images.
SetupFault vehicle_in_view() {
  return {"vehicle in view", FindingKind::fixed_in_view, 0, 0, {}, {}, [](StereoFrame& frame) {
            const auto paint = [](Image& image) {
              Rng rng(9);
              for (int y = 2 * image.height() / 3; y < image.height(); y += 12)
                for (int x = 0; x < image.width(); x += 12) {
                  const auto grey = static_cast<std::uint8_t>(40 + 150 * rng.uniform());
                  for (int v = y; v < std::min(y + 12, image.height()); ++v)
                    for (int u = x; u < std::min(x + 12, image.width()); ++u) image.at(u, v) = grey;
                }
            };
            frame.set_image(0, with(frame.left(), paint));
            frame.set_image(1, with(frame.right(), paint));
          }};
}

/// Derivative of the image velocity by the angular rate, on a grid of kFlowGrid_px, px/s per rad/s.
constexpr int kFlowGrid_px = 16;
std::vector<Eigen::Matrix<double, 2, 3>> flow_of(const Camera& camera) {
  std::vector<Eigen::Matrix<double, 2, 3>> flow;
  for (int y = kFlowGrid_px / 2; y < camera.height() + kFlowGrid_px; y += kFlowGrid_px)
    for (int x = kFlowGrid_px / 2; x < camera.width() + kFlowGrid_px; x += kFlowGrid_px) {
      flow.emplace_back(Eigen::Matrix<double, 2, 3>::Zero());
      const auto ray = camera.undistort(Vec2(x, y));
      if (!ray) continue;
      for (int i = 0; i < 3; ++i) {
        const Vec3 turned = ray->homogeneous() - 1e-4 * Vec3::Unit(i).cross(ray->homogeneous());
        flow.back().col(i) = 1e4 * (camera.distort(turned.hnormalized()) - Vec2(x, y));
      }
    }
  return flow;
}

/// Motion blur: each pixel becomes the mean along its path under the camera's rotation `turn_C`, rad, during the exposure.
void smear(Image& image, const std::vector<Eigen::Matrix<double, 2, 3>>& flow, const Vec3& turn_C) {
  const Image sharp = image;
  const int columns = (image.width() + kFlowGrid_px + kFlowGrid_px / 2 - 1) / kFlowGrid_px;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const Vec2 way = flow[static_cast<std::size_t>(y / kFlowGrid_px * columns + x / kFlowGrid_px)] * turn_C;
      const int steps = std::clamp(static_cast<int>(std::ceil(way.norm())), 1, 60);
      int sum = 0;
      for (int i = 0; i <= steps; ++i) {
        const Vec2 at = Vec2(x, y) + (static_cast<double>(i) / steps - 0.5) * way;
        sum += sharp.at(std::clamp(static_cast<int>(std::lround(at.x())), 0, image.width() - 1),
                        std::clamp(static_cast<int>(std::lround(at.y())), 0, image.height() - 1));
      }
      image.at(x, y) = static_cast<std::uint8_t>(sum / (steps + 1));
    }
}

/// Blur by the rate of the newest reading before an image.
SetupFault exposed_longer(const StereoRig& rig, double ms) {
  auto rate_B = std::make_shared<Vec3>(Vec3::Zero());
  return {
      fmt::format("exposed for {:.0f} ms longer", ms),
      FindingKind::blur,
      0,
      0,
      {},
      [rate_B](ImuSample& sample) { *rate_B = sample.gyro_radps; },
      [=, left = flow_of(rig.left()), right = flow_of(rig.right())](StereoFrame& frame) {
        const Vec3 turn_B = 1e-3 * ms * *rate_B;
        frame.set_image(0, with(frame.left(), [&](Image& image) { smear(image, left, rig.T_BC0().R().transpose() * turn_B); }));
        frame.set_image(1, with(frame.right(), [&](Image& image) { smear(image, right, rig.T_BC1().R().transpose() * turn_B); }));
      }};
}

SetupFault turned_images() {
  const auto half_turn = [](Image& image) {
    for (int y = 0; y < image.height() / 2; ++y)
      std::swap_ranges(image.row(y), image.row(y) + image.width(), image.row(image.height() - 1 - y));
    for (int y = 0; y < image.height(); ++y) std::reverse(image.row(y), image.row(y) + image.width());
  };
  return {"images upside down", FindingKind::images_turned, 0, 0, {}, {}, [half_turn](StereoFrame& frame) {
            frame.set_image(0, with(frame.left(), half_turn));
            frame.set_image(1, with(frame.right(), half_turn));
          }};
}

SetupFault mirrored_images() {
  const auto mirror = [](Image& image) {
    for (int y = 0; y < image.height(); ++y) std::reverse(image.row(y), image.row(y) + image.width());
  };
  return {"images mirrored", FindingKind::images_mirrored, 0, 0, {}, {}, [mirror](StereoFrame& frame) {
            frame.set_image(0, with(frame.left(), mirror));
            frame.set_image(1, with(frame.right(), mirror));
          }};
}

}  // namespace

std::vector<SetupFault> of_the_images(const StereoRig& rig) {
  std::vector<SetupFault> all;
  all.push_back(
      {"left and right exchanged", FindingKind::swapped_images, 0, 0, {}, {}, [](StereoFrame& f) { f.swap_left_right(); }});
  all.push_back(
      {"one camera as both", FindingKind::same_image_twice, 0, 0, {}, {}, [](StereoFrame& f) { f.set_image(1, f.left()); }});
  all.push_back(frozen("one right image in ten frozen", 10, false, true));
  all.push_back(frozen("every image twice", 2, true, true));
  all.push_back(right_one_frame_late(1 / rig.image_rate_hz));
  all.push_back(
      {"images stamped on arrival", FindingKind::image_stamps, 0, 0, {}, {}, [rng = std::make_shared<Rng>(3)](StereoFrame& f) {
         f.t = f.t + Duration::from_seconds(0.02 * rng->uniform());
       }});
  all.push_back(dots(rig));
  all.push_back(vehicle_in_view());
  all.push_back(exposed_longer(rig, 30));
  all.push_back(turned_images());
  all.push_back(mirrored_images());
  return all;
}

}  // namespace fbvins::setup_fault
