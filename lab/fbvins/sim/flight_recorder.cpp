// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/flight_recorder.hpp"

#include <algorithm>
#include <cmath>
#include <future>

#include "fbvins/camera/virtual_pinholes.hpp"
#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace {

/// Halton sequence (bases 2 and 3): sample positions that fill the pixel evenly, whatever their number. Their mean is its middle,
/// or the image would be shifted against the lens.
Vec2 place_in_pixel(int i, int samples) {
  const auto radical = [](int n, int base) {
    double value = 0, share = 1.0 / base;
    for (; n > 0; n /= base, share /= base) value += share * (n % base);
    return value;
  };
  const auto place = [&](int n) { return Vec2(radical(n + 1, 2), radical(n + 1, 3)); };
  Vec2 mean = Vec2::Zero();
  for (int n = 0; n < samples; ++n) mean += place(n) / samples;
  return place(i) - mean;
}

}  // namespace

FlightRecorder::FlightRecorder(const SimulationOptions& options, const StereoRig& rig, BodyMotion motion,
                               const Vec3& world_from_flight, std::shared_ptr<const World> world)
    : options_(options),
      intervals_(options),
      motion_(std::move(motion)),
      world_from_flight_(world_from_flight),
      world_(std::move(world)),
      bake_(bake_light(*world_, options.world.ambient)) {
  for (int i = 0; i < rig.camera_count(); ++i) {
    const double gain = i == 1 ? options.camera.right_gain : 1.0;
    const auto seed = static_cast<std::uint64_t>(options.seed) * 2 + (i < 2 ? 0 : 1'000'000) + static_cast<std::uint64_t>(i);
    eyes_.push_back(make_eye(rig.mounted(i), gain, seed));
    const int width = rig.camera(i).width(), height = rig.camera(i).height();
    if (options.camera.legs > 0) eyes_.back().legs.emplace(width, height, options.camera.legs, i);
    if (options.camera.dirt > 0 && i == 0)
      eyes_.back().dirt.emplace(width, height, options.camera.dirt, static_cast<std::uint64_t>(options.seed));
    if (options.camera.propellers > 0) eyes_.back().propellers.emplace(width, height, options.camera.propellers, i);
  }
  if (rig.depth) depth_.emplace(options.depth, rig.depth_camera(), static_cast<std::uint64_t>(options.seed));
  if (rig.depth && rig.depth->own) depth_eye_ = make_eye(*rig.depth->own, 1, 0);
}

FlightRecorder::Eye FlightRecorder::make_eye(const MountedCamera& mounted, double gain, std::uint64_t seed) const {
  const auto& [camera, T_BC] = mounted;
  Eye eye{{}, ImageSensor(options_.camera, camera, gain, seed), {}, {}, camera.height()};
  if (camera.sees_backwards())
    for (const auto& [face, T_BF] : faces_of(mounted))
      eye.faces.push_back({Renderer(face, *world_, face.mask().get()), T_BF, face.mask()});
  else eye.faces.push_back({Renderer(camera, *world_), T_BC, nullptr});
  return eye;
}

/// Sums the radiance over an exposure that is centred at t.
void FlightRecorder::collect(Eye& eye, double t_s, double exposure_s, int samples) {
  for (Face& face : eye.faces) face.renderer.begin();
  for (int i = 0; i < samples; ++i) {
    const double t = t_s + exposure_s * ((i + 0.5) / samples - 0.5);
    add_instant(eye, t, i, samples);
  }
  eye.faces.front().renderer.radiance(eye.radiance);
  if (eye.faces.front().shown != nullptr) join_faces(eye);
  if (eye.legs) eye.legs->draw(eye.radiance);
  if (eye.propellers) eye.propellers->draw(eye.radiance, t_s, exposure_s, options_.camera.line_delay_us * 1e-6);
  if (eye.dirt && t_s >= options_.camera.dirt_from_s && t_s < options_.camera.dirt_until_s) eye.dirt->draw(eye.radiance);
}

/// Each pixel from a face that shows it; black where none does.
void FlightRecorder::join_faces(Eye& eye) {
  std::vector<float> of_face;
  std::fill(eye.radiance.begin(), eye.radiance.end(), 0.0f);
  for (const Face& face : eye.faces) {
    face.renderer.radiance(of_face);
    const int width = face.shown->width();
    for (std::size_t i = 0; i < of_face.size(); ++i) {
      const auto at = static_cast<int>(i);
      if (!face.shown->hides(Vec2(at % width, at / width))) eye.radiance[i] = of_face[i];
    }
  }
}

/// A readout of 30 ms in the hands of a person is too long for a constant velocity.
std::vector<Instant::Strip> FlightRecorder::strips_of(const Eye& eye, const Face& face, double first_line_s) const {
  std::vector<Instant::Strip> strips;
  for (int row = 0; row * Renderer::kTile < eye.height_px; ++row) {
    const MotionState m = motion_(first_line_s + (row * Renderer::kTile + 3.5) * options_.camera.line_delay_us * 1e-6);
    const auto T_WC = m.T_WB * face.T_BC;
    strips.push_back({T_WC.q, T_WC.p + world_from_flight_, face.T_BC.q.conjugate() * m.w_WB_B});
  }
  return strips;
}

/// The middle line is read at t. The faces of a lens are in one place.
void FlightRecorder::add_instant(Eye& eye, double t_s, int sample, int samples) {
  const double line_s = options_.camera.line_delay_us * 1e-6, first_line = t_s - 0.5 * line_s * eye.height_px;
  const MotionState m = motion_(line_s > 0 ? first_line : t_s);
  const Vec3& p_BC = eye.faces.front().T_BC.p;
  Instant instant;
  instant.p_WC = m.T_WB * p_BC + world_from_flight_;
  instant.v_WC = m.v_WB + m.T_WB.q * m.w_WB_B.cross(p_BC);
  instant.line_s = line_s;
  instant.shift_px = place_in_pixel(sample, samples);
  const LightState lamps = light_at(options_.light, *world_, t_s, static_cast<std::uint64_t>(options_.seed));
  eye.facets = world_->facets;
  for (Facet& f : eye.facets)
    if (f.lamp_group >= 0) f.emission *= static_cast<float>(lamps.group[static_cast<std::size_t>(f.lamp_group)]);
  append_movers(*world_, t_s, instant.p_WC, eye.facets);
  mix_light(bake_, *world_, eye.facets, lamps, options_.world.ambient, eye.light);
  for (Face& face : eye.faces) {
    instant.q_WC = (m.T_WB * face.T_BC).q;
    instant.w_WC_C = face.T_BC.q.conjugate() * m.w_WB_B;
    if (line_s > 0 && options_.sensors != "none") instant.strips = strips_of(eye, face, first_line);
    face.renderer.add(instant, eye.facets, eye.light, 1.0f / static_cast<float>(samples));
  }
}

Image FlightRecorder::render_eye(Eye& eye, double t_s, std::int64_t frame) {
  eye.sensor.allow_longer(intervals_.longer(t_s));
  if (!eye.settled) {
    collect(eye, t_s, 0, 1);
    eye.sensor.settle(eye.radiance);
    eye.settled = true;
  }
  collect(eye, t_s, eye.sensor.exposure_s(), options_.camera.time_samples);
  return eye.sensor.expose(eye.radiance, frame);
}

RenderedFrame FlightRecorder::render(double t_s, std::int64_t frame, bool with_depth) {
  RenderedFrame rendered;
  rendered.exposure_s = eyes_.front().sensor.exposure_s();
  std::vector<std::future<Image>> others;
  for (std::size_t i = 1; i < eyes_.size(); ++i)
    others.push_back(
        std::async(std::launch::async, [this, i, t_s, frame] { return render_eye(eyes_[i], exposed_s(i, t_s), frame); }));
  rendered.frame.set_image(0, std::make_shared<const Image>(render_eye(eyes_.front(), t_s, frame)));
  if (with_depth) eyes_.front().faces.front().renderer.depth(rendered.depth_left_m);
  if (depth_) {
    std::vector<float> exact_m;
    Eye& eye = depth_eye_ ? *depth_eye_ : eyes_.front();
    collect(eye, t_s, 0, 1);
    eye.faces.front().renderer.depth(exact_m);
    rendered.frame.depth = std::make_shared<const DepthImage>(depth_->measure(exact_m, frame));
  }
  for (std::size_t i = 1; i < eyes_.size(); ++i)
    if (const Duration d = offset(i, t_s); d.ns != 0) rendered.frame.offsets.set(static_cast<int>(i), d);
  for (auto& other : others) rendered.frame.images.push_back(std::make_shared<const Image>(other.get()));
  return rendered;
}

/// Of a camera without a common trigger, less than an interval before the first one.
Duration FlightRecorder::offset(std::size_t camera, double t_s) const {
  const double before_s = 1e-3 * options_.camera.untriggered_ms + 1e-6 * options_.camera.untriggered_drift_us_per_s * t_s;
  const double offset_s = -std::fmod(static_cast<double>(camera) * before_s, 1 / options_.image_rate_hz);
  return Duration::from_seconds(std::max(offset_s, -t_s));
}

/// When it takes its image of the frame at t.
double FlightRecorder::exposed_s(std::size_t camera, double t_s) const {
  return t_s + offset(camera, t_s).seconds() + 1e-3 * static_cast<double>(camera) * options_.camera.later_ms;
}

Duration FlightRecorder::right_jitter(std::int64_t frame) const {
  Rng rng(static_cast<std::uint64_t>(options_.seed), 1000 + static_cast<std::uint64_t>(frame));
  return Duration::from_seconds(1e-6 * options_.camera.stamp_jitter_us * rng.normal());
}

}  // namespace fbvins
