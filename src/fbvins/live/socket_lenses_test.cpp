// SPDX-License-Identifier: Apache-2.0
// Lenses of more than four coefficients, and the IMU's scale and axes, over the socket.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string>
#include <variant>

#include "fbvins/live/socket_message.hpp"
#include "tests/support/socket_test_sender.hpp"

namespace fbvins {
namespace socket_lenses_test {

using test::bytes_of;
using test::hello_message;

std::string refusal(const FbvinsSocketHello& hello) {
  const auto message = parse_socket_message(bytes_of(hello, hello.header.size_bytes));
  return message ? "" : message.error().message;
}

TEST(SocketLenses, EveryModelComesAsItWas) {
  const LensModel models[] = {
      PinholeRadtan{40, 41, 31.5, 23.5, -0.25, 0.0625, 0.001, -0.002},
      KannalaBrandt{40, 41, 31.5, 23.5, -0.025, 0.0625, 0.001, -0.002},
      DoubleSphere{40, 41, 31.5, 23.5, -0.25, 0.5},
      ExtendedUnified{40, 41, 31.5, 23.5, 0.5, 1.25},
      UnifiedRadtan{40, 41, 31.5, 23.5, 0.75, -0.25, 0.0625, 0.001, -0.002},
      PinholeRadtan5{40, 41, 31.5, 23.5, -0.25, 0.0625, 0.001, -0.002, 0.015625},
      PinholeRational{40, 41, 31.5, 23.5, 0.25, -0.0625, 0.001, -0.002, 0.03125, 0.125, -0.0625, 0.0078125}};
  static_assert(std::size(models) == std::variant_size_v<LensModel>);
  for (const LensModel& model : models) {
    StereoRig rig = test::socket_test_rig();
    rig.cameras[1].camera = Camera(model, test::kWidth, test::kHeight);
    const FbvinsSocketHello hello = hello_message(&rig);
    const auto message = parse_socket_message(bytes_of(hello));
    ASSERT_TRUE(message) << message.error().message;
    const SocketRig& sent = *std::get<SocketHello>(*message).rig;
    EXPECT_EQ(sent.lenses.has_value(), rig.right().distortion().size() > 4) << rig.right().model_name();
    const auto back = parse_socket_rig(sent, test::kWidth, test::kHeight);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->right().model_name(), rig.right().model_name());
    EXPECT_EQ(back->right().intrinsics(), rig.right().intrinsics());
    EXPECT_EQ(back->right().distortion(), rig.right().distortion());
    EXPECT_EQ(back->left().distortion(), rig.left().distortion());
    EXPECT_TRUE(same(sent, socket_rig(*back)));
  }
}

TEST(SocketLenses, WhatIsMissingIsRefused) {
  StereoRig rig = test::socket_test_rig();
  rig.cameras[0].camera =
      Camera(PinholeRadtan5{40, 41, 31.5, 23.5, -0.25, 0.0625, 0.001, -0.002, 0.015625}, test::kWidth, test::kHeight);
  FbvinsSocketHello hello = hello_message(&rig);
  hello.flags &= ~std::uint32_t{FBVINS_SOCKET_HAS_LENSES};
  EXPECT_EQ(
      refusal(hello),
      "calibration: the left camera's model pinhole-radtan5 has 5 coefficients, which come in more_distortion, since version 1.8");
  hello = hello_message(&rig);
  hello.more_distortion[0][0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal(hello), "calibration: the left camera's intrinsics are not finite, with positive focal lengths");
  hello = hello_message(&rig);
  hello.header.size_bytes = offsetof(FbvinsSocketHello, more_distortion);
  EXPECT_EQ(refusal(hello), "hello of 1856 bytes where 2144 are needed");
}

TEST(SocketLenses, ScaleAndAxesOfTheImu) {
  StereoRig rig = test::socket_test_rig();
  EXPECT_FALSE(socket_rig(rig).axes);
  ImuIntrinsics& axes = rig.imu_noise.axes;
  axes.gyro(0, 1) = 0.015625, axes.accel(2, 2) = 1.03125, axes.accel(0, 2) = -0.0078125, axes.gyro_by_force(1, 0) = 0.0009765625;
  axes.bias = {.gyro_radps = Vec3(0.01, 0.02, 0.03), .accel_mps2 = Vec3(0.1, 0.2, 0.3)};
  FbvinsSocketHello hello = hello_message(&rig);
  const auto message = parse_socket_message(bytes_of(hello));
  ASSERT_TRUE(message) << message.error().message;
  const auto back = parse_socket_rig(*std::get<SocketHello>(*message).rig, test::kWidth, test::kHeight);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_TRUE(back->imu_noise.axes == axes);
  EXPECT_FALSE(same(*std::get<SocketHello>(*message).rig, socket_rig(test::socket_test_rig())));
  hello.imu_axes.accel[4] = 9.81;  // readings in g
  EXPECT_NE(refusal(hello), "");
}

}  // namespace socket_lenses_test
}  // namespace fbvins
