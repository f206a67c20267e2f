// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/socket_message.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/socket_test_sender.hpp"

namespace fbvins {
namespace socket_message_test {

using test::bytes_of;
using test::hello_message;

std::string refusal(std::span<const std::byte> bytes) {
  const auto message = parse_socket_message(bytes);
  return message ? "taken" : message.error().message;
}

TEST(SocketMessage, HelloWithItsCalibrationAsSent) {
  const StereoRig rig = test::socket_test_rig();
  const auto message = parse_socket_message(bytes_of(hello_message(&rig)));
  ASSERT_TRUE(message) << message.error().message;
  const auto& hello = std::get<SocketHello>(*message);
  EXPECT_EQ(hello.name, "tester");
  EXPECT_EQ(hello.layout.slots, test::kSlots);
  EXPECT_EQ(hello.layout.offset_bytes[1], test::kSlotBytes / 2);
  const auto sent = parse_socket_rig(*hello.rig, test::kWidth, test::kHeight);
  ASSERT_TRUE(sent);
  EXPECT_EQ(sent->T_BC0().R(), rig.T_BC0().R());
  EXPECT_EQ(sent->T_BC1().p, rig.T_BC1().p);
  EXPECT_EQ(sent->time_offset_s, rig.time_offset_s);
  EXPECT_EQ(sent->imu_noise.accel_random_walk_mps3_rthz, rig.imu_noise.accel_random_walk_mps3_rthz);
  EXPECT_EQ(std::get<PinholeRadtan>(sent->right().model()).k1, -0.125);
  EXPECT_EQ(sent->right().width(), test::kWidth);
}

TEST(SocketMessage, HelloOfALaterMinorVersionMayBeLonger) {
  struct Longer {
    FbvinsSocketHello hello;
    double more = 0;
  } longer{hello_message(nullptr)};
  longer.hello.header.size_bytes = sizeof(longer);
  longer.hello.minor = FBVINS_SOCKET_MINOR + 1;
  const auto message = parse_socket_message(bytes_of(longer));
  ASSERT_TRUE(message);
  EXPECT_EQ(std::get<SocketHello>(*message).minor, FBVINS_SOCKET_MINOR + 1);
}

TEST(SocketMessage, AnotherMajorVersionIsToldBeforeAnythingElse) {
  FbvinsSocketHello hello = hello_message(nullptr);
  hello.major = 7;
  hello.slots = 0;
  hello.header.size_bytes = 20;  // whatever follows the version may be different there
  const auto message = parse_socket_message(bytes_of(hello, 20));
  ASSERT_FALSE(message);
  EXPECT_EQ(message.error().code, ErrorCode::unsupported);
  EXPECT_EQ(message.error().message, fmt::format("the sender speaks version 7.{} of the protocol, this program {}.{}",
                                                 FBVINS_SOCKET_MINOR, FBVINS_SOCKET_MAJOR, FBVINS_SOCKET_MINOR));
}

TEST(SocketMessage, LayoutsThatDoNotFitAreRefused) {
  const auto with = [](auto change) {
    FbvinsSocketHello hello = hello_message(nullptr);
    change(hello);
    return refusal(bytes_of(hello));
  };
  EXPECT_EQ(with([](auto& h) { h.magic[0] = 'x'; }), "hello: not an FB-VINS sender");
  EXPECT_EQ(with([](auto& h) { h.width_px = 0; }), "hello: images of 0 x 48 pixels");
  EXPECT_EQ(with([](auto& h) { h.height_px = 0xffffffffu; }), "hello: images of 64 x 4294967295 pixels");
  EXPECT_EQ(with([](auto& h) { h.slots = 1; }), "hello: 1 slots, not 2 to 64");
  EXPECT_EQ(with([](auto& h) { h.slots = 65; }), "hello: 65 slots, not 2 to 64");
  EXPECT_EQ(with([](auto& h) { h.right_offset_bytes = 3071; }),
            "hello: 2 images of 3072 bytes, that of camera 1 at 3071, do not fit into a slot of 8192 bytes");
  EXPECT_EQ(with([](auto& h) { h.right_offset_bytes = 0xfffff000u; }),
            "hello: 2 images of 3072 bytes, that of camera 1 at 4294963200, do not fit into a slot of 8192 bytes");
  EXPECT_EQ(with([](auto& h) { h.slots = 64, h.slot_bytes = 0x7fffffffu; }), "hello: 137438953408 bytes of images, over 1 GiB");
  EXPECT_EQ(with([](auto& h) { h.header.size_bytes = 12; }), "a message of 2408 bytes says that it has 12");
  EXPECT_EQ(with([](auto& h) { std::memset(h.name, 0x1b, sizeof(h.name)); }), "taken");
}

TEST(SocketMessage, NamesArePrintable) {
  FbvinsSocketHello hello = hello_message(nullptr);
  std::memcpy(hello.name, "a\n\x1b[31m\xff", 9);
  const auto message = parse_socket_message(bytes_of(hello));
  ASSERT_TRUE(message);
  EXPECT_EQ(std::get<SocketHello>(*message).name, "a??[31m?");
}

TEST(SocketMessage, CalibrationsThatCannotBeAreRefused) {
  const auto with = [](auto change) {
    SocketRig rig = socket_rig(test::socket_test_rig());
    change(rig.pair);
    const auto parsed = parse_socket_rig(rig, test::kWidth, test::kHeight);
    return parsed ? "taken" : parsed.error().message;
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(with([](auto&) {}), "taken");
  EXPECT_EQ(with([](auto& r) { r.left.model = 9; }), "calibration: the left camera has no model 9");
  EXPECT_EQ(with([](auto& r) { r.right.focal_px[1] = -1; }),
            "calibration: the right camera's intrinsics are not finite, with positive focal lengths");
  EXPECT_EQ(with([](auto& r) { r.left.distortion[3] = kNan; }),
            "calibration: the left camera's intrinsics are not finite, with positive focal lengths");
  EXPECT_EQ(with([](auto& r) { r.right.T_BC[0] = 2; }),
            "calibration: the right camera's T_BC is not a rotation and a translation");
  EXPECT_EQ(with([](auto& r) { r.right.T_BC[3] = kNan; }),
            "calibration: the right camera's T_BC is not a rotation and a translation");
  EXPECT_EQ(with([](auto& r) { r.right = r.left; }), "calibration: the two cameras are 0 m apart, not between 1 mm and 10 m");
  EXPECT_EQ(with([](auto& r) { r.imu_rate_hz = 0; }), "calibration: a noise density or a rate is not positive");
  EXPECT_EQ(with([](auto& r) { r.time_offset_s = kNan; }), "calibration: the time offset is more than 10 s");
}

TEST(SocketMessage, TagsWithAndWithoutAPlace) {
  FbvinsSocketTag tag{};
  tag.header = {FBVINS_SOCKET_TAG, sizeof(tag)};
  tag.t_ns = 77, tag.id = 5;
  tag.p_BT[0] = 2, tag.q_BT[0] = 1;
  for (int i = 0, n = 0; i < 6; n += 6 - i++) tag.covariance_BT[n] = 0.01 * (i + 1);
  tag.covariance_BT[1] = 0.002;
  const auto anchor_of = [&] {
    const auto message = parse_socket_message(bytes_of(tag));
    EXPECT_TRUE(message);
    return std::get<SocketPosition>(*message).anchor;
  };
  const auto landmark = std::get<TagAnchor>(*anchor_of());
  EXPECT_EQ(landmark.t, Time{77});
  EXPECT_EQ(landmark.id, 5);
  EXPECT_FALSE(landmark.has_place());
  EXPECT_EQ(landmark.T_BT.p, Vec3(2, 0, 0));
  EXPECT_EQ(landmark.covariance(1, 0), 0.002);
  EXPECT_EQ(landmark.covariance(5, 5), 0.06);
  tag.has_place = 1;
  EXPECT_FALSE(anchor_of()) << "a place without an orientation";
  tag.p_AT[1] = 3, tag.q_AT[0] = 1;
  EXPECT_EQ(std::get<TagAnchor>(*anchor_of()).T_AT.p, Vec3(0, 3, 0));
  for (double& p : tag.p_AT) p = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(anchor_of()) << "no landmark by accident";
  tag.has_place = 0, tag.covariance_BT[0] = -1;
  EXPECT_FALSE(anchor_of());
  tag.t_ns = -1;
  EXPECT_EQ(refusal(bytes_of(tag)), "tag: stamp -1 ns");
}

TEST(SocketMessage, PositionsAndHeights) {
  FbvinsSocketPosition position{};
  position.header = {FBVINS_SOCKET_POSITION, sizeof(position)};
  position.t_ns = 77;
  const double p_A[] = {1, 2, 3}, covariance[] = {0.04, 0.01, 0, 0.09, 0, 0.25}, p_B[] = {0.1, 0, -0.2};
  std::copy_n(p_A, 3, position.p_A), std::copy_n(covariance, 6, position.covariance_m2), std::copy_n(p_B, 3, position.p_B);
  const auto anchor_of = [&] {
    const auto message = parse_socket_message(bytes_of(position));
    EXPECT_TRUE(message);
    return std::get<SocketPosition>(*message).anchor;
  };
  const auto where = std::get<PositionAnchor>(*anchor_of());
  EXPECT_EQ(where.t, Time{77});
  EXPECT_EQ(where.p_A, Vec3(1, 2, 3));
  EXPECT_EQ(where.p_B, Vec3(0.1, 0, -0.2));
  EXPECT_EQ(where.covariance(1, 0), 0.01);
  EXPECT_EQ(where.covariance(1, 1), 0.09);
  position.measured = FBVINS_SOCKET_HEIGHT;
  const auto height = std::get<HeightAnchor>(*anchor_of());
  EXPECT_EQ(height.z_A_m, 3);
  EXPECT_EQ(height.sigma_m, 0.5);
  position.covariance_m2[5] = -1;
  EXPECT_FALSE(anchor_of()) << "left out, and the connection stays";
  position.measured = 2;
  EXPECT_EQ(refusal(bytes_of(position)), "position: measured is 2, not 0 or 1");
  position.t_ns = -1;
  EXPECT_EQ(refusal(bytes_of(position)), "position: stamp -1 ns");
  EXPECT_EQ(refusal(bytes_of(position, 40)), "a message of 40 bytes says that it has 120");
}

TEST(SocketMessage, ReadingsOfAidingSensors) {
  RangeSample range{
      .t = Time{77}, .distance_m = 1.5, .sigma_m = 0.01, .p_B = Vec3(0.1, 0, 0.2), .direction_B = Vec3(0.6, 0, -0.8)};
  VelocitySample velocity{.t = Time{78}, .v_mps = Vec3(1, 2, 3), .sigma_mps = Vec3(0.1, 0.2, kUnmeasured_mps)};
  velocity.p_B = Vec3(-0.1, 0, 0), velocity.q_BS = so3_exp(Vec3(0, 0.3, 1));
  const auto back = [](const AidingSample& reading) {
    const auto message = parse_socket_message(bytes_of(socket_aiding(reading)));
    EXPECT_TRUE(message);
    return std::get<SocketAiding>(*message).reading;
  };
  const auto r = std::get<RangeSample>(*back(range));
  EXPECT_EQ(r.t, range.t);
  EXPECT_EQ(r.distance_m, 1.5);
  EXPECT_EQ(r.p_B, range.p_B);
  EXPECT_LT((r.direction_B - range.direction_B).norm(), 1e-12);
  EXPECT_EQ(r.farthest_m, range.farthest_m);
  const auto v = std::get<VelocitySample>(*back(velocity));
  EXPECT_EQ(v.v_mps, velocity.v_mps);
  EXPECT_EQ(v.sigma_mps, velocity.sigma_mps);
  EXPECT_EQ(v.q_BS.coeffs(), velocity.q_BS.coeffs());
  EXPECT_EQ(std::get<PressureSample>(*back(PressureSample{Time{79}, 99'000, 3})).pressure_pa, 99'000);
  EXPECT_FALSE(back(PressureSample{Time{79}, -1, 3})) << "left out, and the connection stays";
  FbvinsSocketAiding message = socket_aiding(range);
  message.sensor = 3;
  EXPECT_EQ(refusal(bytes_of(message)), "aiding: sensor is 3, not 0 to 2");
  message.sensor = 0, message.t_ns = -1;
  EXPECT_EQ(refusal(bytes_of(message)), "aiding: stamp -1 ns");
  EXPECT_EQ(refusal(bytes_of(message, 40)), "a message of 40 bytes says that it has 144");
}

TEST(SocketMessage, ReadingsThatAreNotFiniteAreLeftOutAndCounted) {
  FbvinsSocketImu imu{};
  const auto size = static_cast<std::uint32_t>(offsetof(FbvinsSocketImu, readings) + 3 * sizeof(FbvinsSocketReading));
  imu.header = {FBVINS_SOCKET_IMU, size};
  imu.count = 3;
  for (int i = 0; i < 3; ++i) imu.readings[i] = {100 + i, {0.1, 0.2, 0.3}, {1, 2, 9.5}};
  imu.readings[1].accel_mps2[2] = std::numeric_limits<double>::infinity();
  const auto message = parse_socket_message(bytes_of(imu, size));
  ASSERT_TRUE(message);
  const auto& taken = std::get<SocketImu>(*message);
  ASSERT_EQ(taken.readings.size(), 2u);
  EXPECT_EQ(taken.refused, 1);
  EXPECT_EQ(taken.readings[1].t, Time{102});
  EXPECT_EQ(taken.readings[1].gyro_radps, Vec3(0.1, 0.2, 0.3));
  EXPECT_EQ(taken.readings[1].accel_mps2, Vec3(1, 2, 9.5));

  imu.count = 4;
  EXPECT_EQ(refusal(bytes_of(imu, size)), "imu: 4 readings in 184 bytes");
  imu.count = 0xffffffffu;
  EXPECT_EQ(refusal(bytes_of(imu, size)), "imu: 4294967295 readings in 184 bytes");
  imu.count = 3;
  imu.readings[0].t_ns = -5;
  EXPECT_EQ(refusal(bytes_of(imu, size)), "imu: stamp -5 ns");
}

TEST(SocketMessage, FramesNameASlotAStampAndAnImage) {
  const FbvinsSocketFrame good{{FBVINS_SOCKET_FRAME, sizeof(good)}, 42, 7, 3, FBVINS_SOCKET_RIGHT, {}};
  const auto message = parse_socket_message(bytes_of(good));
  ASSERT_TRUE(message);
  const auto& frame = std::get<SocketFrame>(*message);
  EXPECT_EQ(frame.t, Time{42});
  EXPECT_EQ(frame.sequence, 7u);
  EXPECT_EQ(frame.slot, 3);
  EXPECT_EQ(frame.images, 0b10u);
  EXPECT_TRUE(frame.offsets.all_zero());

  FbvinsSocketFrame wrong = good;
  wrong.slot = 64;
  EXPECT_EQ(refusal(bytes_of(wrong)), "frame: no slot 64");
  wrong = good;
  wrong.images = 0;
  EXPECT_EQ(refusal(bytes_of(wrong)), "frame: without an image");
  wrong = good;
  wrong.t_ns = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(refusal(bytes_of(wrong)), "frame: stamp 9223372036854775807 ns");
  wrong = good;
  wrong.header.size_bytes = 31;
  EXPECT_EQ(refusal(bytes_of(wrong, 31)), "frame of 31 bytes where 32 are needed");
}

TEST(SocketMessage, FramesOfFourCamerasWithoutACommonTrigger) {
  FbvinsSocketFrame sent{{FBVINS_SOCKET_FRAME, sizeof(sent)}, 42, 7, 3, 0b1101, {}};
  sent.offset_ns[3] = -5'000'000;
  const auto message = parse_socket_message(bytes_of(sent));
  ASSERT_TRUE(message);
  const auto& frame = std::get<SocketFrame>(*message);
  EXPECT_EQ(frame.images, 0b1101u);
  EXPECT_EQ(frame.offsets.of(3), Duration{-5'000'000});
  EXPECT_EQ(frame.offsets.of(2), Duration{0});
  sent.offset_ns[2] = std::numeric_limits<std::int64_t>::min();
  EXPECT_EQ(refusal(bytes_of(sent)), "frame: camera 2 took its image -9223372036854775808 ns from the stamp");
}

TEST(SocketMessage, MessagesOfVersionOneOneAreShorter) {
  const StereoRig rig = test::socket_test_rig();
  FbvinsSocketHello hello = hello_message(&rig);
  hello.minor = 1;
  hello.header.size_bytes = 472;
  const auto parsed = parse_socket_message(bytes_of(hello, 472));
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_EQ(std::get<SocketHello>(*parsed).layout.cameras, 2);
  hello.flags |= FBVINS_SOCKET_HAS_CAMERAS;
  EXPECT_EQ(refusal(bytes_of(hello, 472)), "hello of 472 bytes where 1512 are needed");
  FbvinsSocketFrame frame{{FBVINS_SOCKET_FRAME, 32}, 42, 7, 3, FBVINS_SOCKET_LEFT, {}};
  EXPECT_EQ(refusal(bytes_of(frame, 32)), "taken");
}

TEST(SocketMessage, HelloOfOneToEightCameras) {
  StereoRig rig = test::socket_test_rig();
  for (int i = 2; i < 8; ++i) {
    rig.cameras.push_back(rig.mounted(0));
    rig.cameras.back().T_BC.p.z() = 0.25 * i;
  }
  FbvinsSocketHello hello = hello_message(&rig);
  hello.slot_bytes = 8 * test::kImageBytes;
  for (std::uint32_t i = 0; i < 6; ++i) hello.more_offset_bytes[i] = (2 + i) * test::kImageBytes;
  hello.right_offset_bytes = test::kImageBytes;
  const auto message = parse_socket_message(bytes_of(hello));
  ASSERT_TRUE(message) << message.error().message;
  const auto& taken = std::get<SocketHello>(*message);
  EXPECT_EQ(taken.layout.cameras, 8);
  EXPECT_EQ(taken.layout.offset_bytes[7], 7 * test::kImageBytes);
  const auto back = parse_socket_rig(*taken.rig, test::kWidth, test::kHeight);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->camera_count(), 8);
  EXPECT_EQ(back->T_BC(6).p, rig.T_BC(6).p);

  hello.more_offset_bytes[5] = 8 * test::kImageBytes - 1;
  EXPECT_EQ(refusal(bytes_of(hello)),
            "hello: 8 images of 3072 bytes, that of camera 7 at 24575, do not fit into a slot of 24576 bytes");
  hello.cameras = 9;
  EXPECT_EQ(refusal(bytes_of(hello)), "hello: 9 cameras, not 1 to 8");
  hello = hello_message(&rig);
  hello.more[1].model = 9;
  hello.slot_bytes = 8 * test::kImageBytes, hello.right_offset_bytes = test::kImageBytes;
  for (std::uint32_t i = 0; i < 6; ++i) hello.more_offset_bytes[i] = (2 + i) * test::kImageBytes;
  EXPECT_EQ(refusal(bytes_of(hello)), "calibration: the number 3 camera has no model 9");

  const StereoRig one = with_one_camera(test::socket_test_rig());
  hello = hello_message(&one);
  hello.right_offset_bytes = 0;
  const auto alone = parse_socket_message(bytes_of(hello));
  ASSERT_TRUE(alone) << alone.error().message;
  EXPECT_EQ(std::get<SocketHello>(*alone).layout.cameras, 1);
}

TEST(SocketMessage, HelloOfACameraWithADepthSensor) {
  const StereoRig rig = with_depth(test::socket_test_rig(), {.noise_at_1m_m = 0.007, .farthest_m = 6});
  FbvinsSocketHello hello = hello_message(&rig);
  hello.slot_bytes = 3 * test::kImageBytes;
  hello.depth_offset_bytes = test::kImageBytes;
  const auto message = parse_socket_message(bytes_of(hello));
  ASSERT_TRUE(message) << message.error().message;
  const auto& taken = std::get<SocketHello>(*message);
  EXPECT_EQ(taken.layout.depth_offset_bytes, test::kImageBytes);
  const auto back = parse_socket_rig(*taken.rig, test::kWidth, test::kHeight);
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_TRUE(back->depth);
  EXPECT_EQ(back->depth->noise_at_1m_m, 0.007);
  EXPECT_EQ(back->depth->farthest_m, 6);
  EXPECT_FALSE(same(*taken.rig, socket_rig(with_one_camera(test::socket_test_rig()))));

  hello.depth_offset_bytes += 2;
  EXPECT_EQ(refusal(bytes_of(hello)), "hello: a depth image of 6144 bytes at 3074 does not fit into a slot of 9216 bytes");
  hello.depth_offset_bytes = test::kImageBytes;
  hello.depth.noise_at_1m_m = 0;
  EXPECT_EQ(refusal(bytes_of(hello)),
            "calibration: the depth sensor's noise, range or scale is not positive, or its range is empty");
  hello.cameras = 2, hello.right_offset_bytes = test::kImageBytes;
  EXPECT_EQ(refusal(bytes_of(hello)), "hello: a depth sensor goes with one camera, and there are 2");
  hello.header.size_bytes = 1512;
  EXPECT_EQ(refusal(bytes_of(hello, 1512)), "hello of 1512 bytes where 1552 are needed");
}

TEST(SocketMessage, ADepthSensorThatLiesElsewhereHasItsLensAndPoseSinceVersion16) {
  DepthSensor sensor;
  sensor.own = MountedCamera{Camera(KannalaBrandt{30, 31, 19.5, 14.5, 0.0625, -0.03125, 0, 0}, 40, 30),
                             {Quat(0.5, -0.5, 0.5, -0.5), Vec3(0.25, -0.0625, 0.125)}};
  const StereoRig rig = with_depth(test::socket_test_rig(), sensor);
  FbvinsSocketHello hello = hello_message(&rig);
  hello.depth_offset_bytes = test::kImageBytes;
  const auto message = parse_socket_message(bytes_of(hello));
  ASSERT_TRUE(message) << message.error().message;
  const auto& taken = std::get<SocketHello>(*message);
  EXPECT_EQ(taken.layout.depth_values(), 40u * 30u);
  const auto back = parse_socket_rig(*taken.rig, test::kWidth, test::kHeight);
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_TRUE(back->depth && back->depth->own);
  const MountedCamera& own = *back->depth->own;
  EXPECT_EQ(own.camera.width(), 40);
  EXPECT_EQ(own.camera.model_name(), "pinhole-equidistant");
  EXPECT_EQ(own.camera.distortion(), sensor.own->camera.distortion());
  EXPECT_EQ(own.T_BC.p, sensor.own->T_BC.p);
  EXPECT_FALSE(same(*taken.rig, socket_rig(with_depth(test::socket_test_rig(), {}))));

  const auto with = [&](auto change) {
    FbvinsSocketHello other = hello;
    change(other);
    return refusal(bytes_of(other));
  };
  EXPECT_EQ(with([](auto& h) { h.depth_height_px = 0; }), "hello: depth images of 40 x 0 pixels");
  EXPECT_EQ(with([](auto& h) { h.depth_height_px = 100; }),
            "hello: a depth image of 8000 bytes at 3072 does not fit into a slot of 8192 bytes");
  EXPECT_EQ(with([](auto& h) { h.depth_camera.focal_px[0] = -1; }),
            "calibration: the depth camera's intrinsics are not finite, with positive focal lengths");
  EXPECT_EQ(with([](auto& h) { h.depth_camera.T_BC[0] = 2; }),
            "calibration: the depth camera's T_BC is not a rotation and a translation");
  hello.header.size_bytes = offsetof(FbvinsSocketHello, depth_width_px);
  EXPECT_EQ(refusal(bytes_of(hello, hello.header.size_bytes)), "hello of 1680 bytes where 1856 are needed");
}

TEST(SocketMessage, WhatADeviceSaysOfItself) {
  FbvinsSocketDevice device{{FBVINS_SOCKET_DEVICE, sizeof(device)}, "firmware=5.13.0\nusb=2.1\nstalls=3"};
  const auto message = parse_socket_message(bytes_of(device));
  ASSERT_TRUE(message) << message.error().message;
  const DeviceFacts& facts = std::get<SocketDevice>(*message).facts;
  EXPECT_EQ(facts.firmware, "5.13.0");
  EXPECT_EQ(facts.usb, "2.1");
  EXPECT_EQ(facts.stalls, 3);
  std::strcpy(device.text, "usb=3\nstalls=many");
  EXPECT_EQ(refusal(bytes_of(device)), "device, line 2: stalls=many");
  EXPECT_EQ(refusal(bytes_of(device, 100)), "a message of 100 bytes says that it has 2048");
}

TEST(SocketMessage, NothingAndUnknownTypes) {
  EXPECT_EQ(refusal({}), "a message of 0 bytes where 8 are needed");
  const FbvinsSocketHeader unknown{999, sizeof(unknown)};
  const auto message = parse_socket_message(bytes_of(unknown));
  ASSERT_TRUE(message);
  EXPECT_EQ(std::get<SocketUnknown>(*message).type, 999u);
}

TEST(SocketMessage, CamerasHaveTimesOfTheirOwnSinceVersion14) {
  StereoRig rig = test::socket_test_rig();
  EXPECT_FALSE(socket_rig(rig).times) << "where all are alike nothing is said of each";
  rig.cameras[1].camera.set_own_times({0.00390625, 0.0000152587890625});
  FbvinsSocketHello hello = hello_message(&rig);
  const auto message = parse_socket_message(bytes_of(hello));
  ASSERT_TRUE(message) << message.error().message;
  const auto sent = parse_socket_rig(*std::get<SocketHello>(*message).rig, test::kWidth, test::kHeight);
  ASSERT_TRUE(sent) << sent.error().message;
  for (int i = 0; i < 2; ++i) EXPECT_EQ(sent->times(i), rig.times(i)) << i;
  hello.times[1].time_offset_s = 11;
  EXPECT_EQ(refusal(bytes_of(hello)), "calibration: camera 1's time offset is more than 10 s, or its line delay not finite");
  hello.header.size_bytes = offsetof(FbvinsSocketHello, times);
  EXPECT_EQ(refusal(bytes_of(hello, hello.header.size_bytes)), "hello of 1552 bytes where 1680 are needed");
}

}  // namespace socket_message_test
}  // namespace fbvins
