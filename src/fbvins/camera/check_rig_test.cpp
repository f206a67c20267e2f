// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/check_rig.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace fbvins {
namespace check_rig_test {

StereoRig good_rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{.fx = 450, .fy = 450, .cx = 376, .cy = 240}, 752, 480), {}});
  rig.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
  return rig;
}

struct Broken {
  std::function<void(StereoRig&)> breaks;
  const char* sentence;
};

TEST(CheckRig, TakesARigThatCanFly) { EXPECT_TRUE(check_rig(good_rig(), "rig").ok()); }

TEST(CheckRig, OneCameraIsEnough) {
  EXPECT_TRUE(check_rig(with_one_camera(good_rig()), "rig").ok());
  EXPECT_FALSE(with_one_camera(good_rig()).has_right());
  EXPECT_EQ(with_one_camera(good_rig(), true).T_BC0().p, good_rig().T_BC1().p);
}

TEST(CheckRig, ADepthSensorGoesWithOneCamera) {
  const StereoRig rig = with_depth(good_rig(), {});
  EXPECT_TRUE(check_rig(rig, "rig").ok());
  EXPECT_EQ(rig.camera_count(), 1);
  EXPECT_FALSE(with_cameras(rig, {rig.mounted(0), good_rig().mounted(1)}).depth);
}

TEST(CheckRig, TakesALensOfMoreThan180Degrees) {
  StereoRig rig = good_rig();
  rig.cameras[0].camera = Camera(KannalaBrandt{150, 150, 256, 256, 0, 0, 0, 0}, 512, 512);
  EXPECT_TRUE(check_rig(rig, "drone.yaml").ok());
}

TEST(CheckRig, RefusesWithASentence) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Broken> all = {
      {[](StereoRig& r) { r.cameras[0].camera = Camera(); }, "the left camera has 0 x 0 pixels"},
      {[](StereoRig& r) { r.cameras[1].camera = Camera(PinholeRadtan{.fx = 0, .fy = 450, .cx = 376, .cy = 240}, 752, 480); },
       "focal lengths"},
      {[&](StereoRig& r) { r.cameras[1].camera = Camera(PinholeRadtan{.fx = 450, .fy = 450, .cx = nan, .cy = 240}, 752, 480); },
       "not finite"},
      {[](StereoRig& r) { r.cameras[0].camera = Camera(PinholeRadtan{.fx = 900, .fy = 900, .cx = 752, .cy = 480}, 752, 480); },
       "the left camera's principal point (752, 480) is outside the middle third of its image of 752 x 480 pixels"},
      {[](StereoRig& r) { r.cameras[0].camera = Camera(PinholeRadtan{.fx = 450, .fy = 450, .cx = 188, .cy = 120}, 752, 480); },
       "of an image of another size?"},
      {[](StereoRig& r) {
         r.cameras[0].camera = Camera(PinholeRadtan{.fx = 450, .fy = 450, .cx = 376, .cy = 240, .k1 = 26}, 752, 480);
       },
       "the left camera's distortion is impossible: half way to the edge of the image it bends rays as no lens does"},
      {[](StereoRig& r) {
         r.cameras[1].camera = Camera(PinholeRadtan{.fx = 450, .fy = 450, .cx = 376, .cy = 240, .k1 = -26}, 752, 480);
       },
       "the right camera's distortion is impossible: half way to the edge of the image it has no rays any more"},
      {[](StereoRig& r) { r.cameras[1].T_BC = {}; }, "0 m apart"},
      {[](StereoRig& r) { r.cameras[1].T_BC.p.x() = 11; }, "11 m apart"},
      {[&](StereoRig& r) { r.cameras[0].T_BC.p.x() = nan; }, "pose in the body"},
      {[](StereoRig& r) { r.cameras[0].T_BC.q = Quat(2, 0, 0, 0); }, "no rotation"},
      {[&](StereoRig& r) { r.time_offset_s = nan; }, "time offset"},
      {[&](StereoRig& r) { r.line_delay_s = nan; }, "line delay"},
      {[&](StereoRig& r) { r.line_delay_s = 40; }, "line delay"},
      {[](StereoRig& r) { r.image_rate_hz = 0; }, "images' rate"},
      {[](StereoRig& r) { r.imu_noise.gyro_noise_density_radps_rthz = 0; }, "gyroscope's noise density is 0, not positive"},
      {[](StereoRig& r) { r.imu_noise.accel_noise_density_mps2_rthz = -1; }, "accelerometer's noise density is -1, not positive"},
      {[](StereoRig& r) { r.imu_noise.gyro_random_walk_radps2_rthz = 0; }, "gyroscope's random walk"},
      {[&](StereoRig& r) { r.imu_noise.accel_random_walk_mps3_rthz = nan; }, "accelerometer's random walk"},
      {[](StereoRig& r) { r.imu_noise.rate_hz = 0; }, "IMU's rate"},
      {[](StereoRig& r) { r.depth = DepthSensor{}; }, "a depth sensor goes with one camera"},
      {[](StereoRig& r) { r = with_depth(r, {.noise_at_1m_m = 0}); }, "depth sensor's noise"},
      {[&](StereoRig& r) { r = with_depth(r, {.farthest_m = nan}); }, "depth sensor's noise"},
      {[](StereoRig& r) { r = with_depth(r, {.nearest_m = 2, .farthest_m = 1}); }, "its range is empty"},
      {[](StereoRig& r) { r = with_depth(r, {.own = MountedCamera{}}); }, "the depth camera has 0 x 0 pixels"},
      {[](StereoRig& r) {
         r = with_depth(r, {.own = MountedCamera{r.left(), {Quat::Identity(), Vec3(3, 0, 0)}}});
       },
       "m from the camera, more than 1 m"},
  };
  for (const Broken& broken : all) {
    StereoRig rig = good_rig();
    broken.breaks(rig);
    const Result<void> checked = check_rig(rig, "drone.yaml");
    ASSERT_FALSE(checked.ok()) << broken.sentence;
    EXPECT_NE(checked.error().message.find(broken.sentence), std::string::npos) << checked.error().message;
    EXPECT_EQ(checked.error().message.rfind("drone.yaml: ", 0), 0u) << checked.error().message;
  }
}

}  // namespace check_rig_test
}  // namespace fbvins
