// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/renderer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <set>

#include "fbvins/sim/flight_recorder.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {
namespace renderer_test {

/// A wall 3 m in front of the camera (along +x of the world) whose texture is dark left of its middle, light right of it.
World split_wall() {
  World world;
  world.plan.rooms = {{-5, -5, 5, 5}};
  Canvas canvas;
  for (int y = 0; y < kTextureSize; ++y)
    for (int x = 0; x < kTextureSize; ++x) canvas.at(x, y) = x < kTextureSize / 2 ? 0.2f : 0.8f;
  world.atlas.add(canvas);
  Canvas grey;
  world.detail_texture = world.atlas.add(grey);
  Facet wall;
  wall.corner = Vec3(3, -8, 8);
  wall.u = Vec3(0, 16, 0);
  wall.v = Vec3(0, 0, -16);
  wall.detail = 0;
  world.facets = {wall};
  return world;
}

Quat looking_along_x() {
  Mat3 R;  // columns: the camera's right, down, forward
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return Quat(R);
}

std::vector<float> rendered(const World& world, const Camera& camera, const Instant& instant,
                            std::vector<float>* depth = nullptr) {
  const LightBake bake = bake_light(world, 1.0);
  MixedLight light;
  mix_light(bake, world, world.facets, {}, 1.0, light);
  Renderer renderer(camera, world);
  renderer.begin();
  renderer.add(instant, world.facets, light, 1.0f);
  std::vector<float> image;
  renderer.radiance(image);
  if (depth) renderer.depth(*depth);
  return image;
}

/// Column, with fraction, where a row passes from one half to the other.
double edge_column(const std::vector<float>& image, int width, int y) {
  const float* row = image.data() + static_cast<std::ptrdiff_t>(y) * width;
  const float middle = 0.5f * (row[20] + row[width - 20]);
  for (int x = 20; x + 20 < width; ++x)
    if ((row[x] < middle) != (row[x + 1] < middle)) return x + (middle - row[x]) / (row[x + 1] - row[x]);
  return -1;
}

TEST(Renderer, EdgesAreWhereTheDistortedCameraSeesThem) {
  const World world = split_wall();
  const Camera camera = euroc_rig().left();
  Instant instant;
  instant.q_WC = looking_along_x();
  instant.p_WC = Vec3(0, 0.4, 0.1);
  const std::vector<float> image = rendered(world, camera, instant);
  int checked = 0;
  for (double z = -1.2; z <= 1.2; z += 0.1) {
    const auto px = camera.project(instant.q_WC.conjugate() * (Vec3(3, 0, z) - instant.p_WC));
    if (!px || !camera.inside(*px, 2)) continue;
    const int row = static_cast<int>(std::lround(px->y()));
    // The edge's column where it crosses this very row.
    Vec2 exact = *px;
    for (double dz = -0.02; dz <= 0.02; dz += 0.0005)
      if (const auto p = camera.project(instant.q_WC.conjugate() * (Vec3(3, 0, z + dz) - instant.p_WC));
          p && std::abs(p->y() - row) < std::abs(exact.y() - row))
        exact = *p;
    EXPECT_NEAR(edge_column(image, camera.width(), row), exact.x(), 0.15) << "z = " << z;
    ++checked;
  }
  EXPECT_GT(checked, 10);
}

TEST(Renderer, TexturesAreNotMirrored) {
  const World world = split_wall();
  const Camera camera = euroc_rig().left();
  Instant instant;
  instant.q_WC = looking_along_x();
  const std::vector<float> image = rendered(world, camera, instant);
  const float* row = image.data() + 240 * camera.width();
  EXPECT_LT(row[100], row[650]);  // the texture's left half is dark
}

TEST(Renderer, DepthIsExact) {
  const World world = split_wall();
  const Camera camera = euroc_rig().left();
  Instant instant;
  instant.q_WC = (looking_along_x() * so3_exp(Vec3(0, 0.2, 0))).normalized();
  std::vector<float> depth;
  rendered(world, camera, instant, &depth);
  for (int y = 10; y < 470; y += 57)
    for (int x = 10; x < 740; x += 61) {
      const Vec2 n = *camera.undistort(Vec2(x, y));
      const Vec3 d = instant.q_WC * Vec3(n.x(), n.y(), 1);
      EXPECT_NEAR(depth[static_cast<std::size_t>(y * 752 + x)], 3 / d.x(), 1e-3 * 3 / d.x());
    }
}

TEST(Renderer, NearerThingsHideFartherOnes) {
  World world = split_wall();
  Facet sheet = world.facets[0];
  sheet.corner = Vec3(1.5, -0.2, 0.2);
  sheet.u = Vec3(0, 0.4, 0);
  sheet.v = Vec3(0, 0, -0.4);
  world.facets.push_back(sheet);
  Instant instant;
  instant.q_WC = looking_along_x();
  std::vector<float> depth;
  rendered(world, euroc_rig().left(), instant, &depth);
  EXPECT_NEAR(depth[248 * 752 + 367], 1.5, 1e-3);
  EXPECT_GT(depth[20 * 752 + 367], 2.9);
}

TEST(Renderer, LinesReadLaterShowALaterMoment) {
  const World world = split_wall();
  const Camera camera = euroc_rig().left();
  Instant still, turning;
  still.q_WC = turning.q_WC = looking_along_x();
  turning.w_WC_C = Vec3(0, 1.0, 0);  // to the right: the scene moves left
  turning.line_s = 50e-6;
  const std::vector<float> a = rendered(world, camera, still), b = rendered(world, camera, turning);
  EXPECT_NEAR(edge_column(b, 752, 4) - edge_column(a, 752, 4), 0, 0.4);
  // 476 lines of 50 us at 1 rad/s turn the camera by 23.8 mrad.
  Mat2 J_pixel_normalised;
  camera.distort(*camera.undistort(Vec2(camera.width() / 2, 476)), &J_pixel_normalised);
  EXPECT_NEAR(edge_column(a, 752, 476) - edge_column(b, 752, 476), 0.0238 * J_pixel_normalised(0, 0), 0.4);
}

/// The stamp is that of the middle line, whatever the number of lines.
TEST(FlightRecorder, ARollingShutterBeginsHalfAnImageBeforeTheStamp) {
  for (const int height : {48, 480}) {
    StereoRig rig;
    rig.cameras.assign(2, {Camera(PinholeRadtan{40, 40, 32, 0.5 * height, 0, 0, 0, 0}, 64, height), {}});
    SimulationOptions options;
    options.camera.line_delay_us = 30;
    options.camera.time_samples = 1;
    std::mutex mutex;
    std::set<double> asked_s;
    const auto standing = [&](double t_s) {
      const std::lock_guard lock(mutex);
      asked_s.insert(t_s);
      return MotionState{};
    };
    FlightRecorder recorder(options, rig, standing, Vec3::Zero(), std::make_shared<const World>(split_wall()));
    (void)recorder.render(2, 0, false);
    ASSERT_EQ(asked_s.size(), 1u);
    EXPECT_NEAR(*asked_s.begin(), 2 - 15e-6 * height, 1e-12);
  }
}

}  // namespace renderer_test
}  // namespace fbvins
