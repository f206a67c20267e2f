// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/ros_messages.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "fbvins/core/rng.hpp"
#include "fbvins/io/message_fields.hpp"
#include "fbvins/io/ros_definitions.hpp"

namespace fbvins {
namespace ros_messages_test {

Vec3 random_vector(Rng& rng) {
  const double x = rng.normal(), y = rng.normal(), z = rng.normal();
  return {x, y, z};
}

bool same_bits(const Vec3& a, const Vec3& b) { return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0; }

double double_at(const std::string& bytes, std::size_t at) {
  double value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

TEST(RosMessages, AReadingComesBackWithTheSameBits) {
  Rng rng(5);
  for (int i = 0; i < 200; ++i) {
    const ImuSample sample{Time{1'403'636'584'763'555'584 + i * 5'000'001LL}, random_vector(rng), 1e-300 * random_vector(rng)};
    std::string bytes = "something before";
    const std::size_t start = bytes.size();
    append_imu(bytes, sample, {});
    const auto back = read_imu(std::string_view(bytes).substr(start));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->t, sample.t);
    EXPECT_TRUE(same_bits(back->gyro_radps, sample.gyro_radps));
    EXPECT_TRUE(same_bits(back->accel_mps2, sample.accel_mps2));
  }
}

/// By hand: 4 bytes of kind, 8 of stamp, 4 + 5 of "body", filled up to the next multiple of 8 behind the kind.
TEST(RosMessages, NumbersLieWhereCdrHasThem) {
  std::string bytes;
  append_imu(bytes, {Time{2'000'000'003}, Vec3(7, 8, 9), Vec3(1, 2, 3)}, {});
  EXPECT_EQ(bytes.substr(0, 21), std::string("\0\1\0\0\2\0\0\0\3\0\0\0\5\0\0\0body\0", 21));
  const std::size_t orientation = 4 + 24;
  EXPECT_EQ(double_at(bytes, orientation + 24), 1.0) << "w comes last";
  EXPECT_EQ(double_at(bytes, orientation + 32), -1.0) << "no orientation";
  EXPECT_EQ(double_at(bytes, orientation + 32 + 72), 7.0);
  EXPECT_EQ(double_at(bytes, orientation + 32 + 72 + 24 + 72), 1.0);
  EXPECT_EQ(bytes.size(), orientation + (4 + 9 + 3 + 9 + 3 + 9) * sizeof(double));
}

TEST(RosMessages, AnImageComesBackWithItsPixels) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {752, 480}}) {
    Image image(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) image.at(x, y) = static_cast<std::uint8_t>(3 * x + 7 * y);
    std::string bytes;
    append_image(bytes, Time{123'456'789'012}, kLeftFrame, &image);
    const auto back = read_image(bytes);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->t.ns, 123'456'789'012);
    EXPECT_EQ(back->width, static_cast<std::uint32_t>(width));
    EXPECT_EQ(back->encoding, "mono8");
    ASSERT_EQ(back->pixels.size(), static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    EXPECT_EQ(std::memcmp(back->pixels.data(), image.view().data, back->pixels.size()), 0);
  }
  std::string nothing;
  append_image(nothing, Time{5}, kLeftFrame, nullptr);
  ASSERT_TRUE(read_image(nothing));
  EXPECT_TRUE(read_image(nothing)->empty());
}

TEST(MessageFields, AreReadInBothByteOrders) {
  // A text of length 3 with its zero, two bytes at 8, eight bytes at 16 behind the head.
  std::string little = {0, 1, 0, 0, 3, 0, 0, 0, 'a', 'b', 0, 0, 2, 1}, big = {0, 0, 0, 0, 0, 0, 0, 3, 'a', 'b', 0, 0, 1, 2};
  little += std::string(6 + 6, '\0') + "\xF8\x3F";
  big += std::string(6, '\0') + "\x3F\xF8" + std::string(6, '\0');
  for (const std::string& bytes : {little, big}) {
    MessageFields in(bytes, Encoding::cdr);
    EXPECT_EQ(in.text(), "ab");
    EXPECT_EQ(in.get<std::uint16_t>(), 0x0102);
    EXPECT_EQ(in.get<double>(), 1.5);
    EXPECT_TRUE(in.ok());
    in.get<std::uint8_t>();
    EXPECT_FALSE(in.ok());
  }
  EXPECT_FALSE(MessageFields(std::string("\0\2\0\0", 4), Encoding::cdr).ok());
}

TEST(RosMessages, AnythingShorterIsRefused) {
  Image image(6, 4);
  std::string imu, picture;
  append_imu(imu, {Time{5}}, {});
  append_image(picture, Time{5}, kLeftFrame, &image);
  for (std::size_t size = 0; size < imu.size(); ++size) EXPECT_FALSE(read_imu(std::string_view(imu).substr(0, size)));
  for (std::size_t size = 0; size < picture.size(); ++size) EXPECT_FALSE(read_image(std::string_view(picture).substr(0, size)));
  imu[1] = '\0';
  EXPECT_FALSE(read_imu(imu)) << "big-endian is not read as if it were little";
}

/// The body is turned by a quarter about z: its x axis is W's y axis.
TEST(RosMessages, VelocitiesAreInTheBodyAndAnglesAboutTheAxesOfTheWorld) {
  RosOdometry o{Time{5}, {Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ())), Vec3(1, 2, 3)}, Vec3(0, 4, 0), Vec3(5, 0, 0)};
  o.pose_covariance.diagonal() << 1, 2, 3, 10, 20, 30;
  o.pose_covariance(0, 3) = o.pose_covariance(3, 0) = 0.5;  // W's x with the body's x
  o.velocity_covariance.diagonal() << 7, 8, 9;
  o.rate_covariance.diagonal() << 11, 12, 13;
  std::string bytes;
  append_odometry(bytes, o);
  const std::size_t pose = 4 + 32;  // kind; stamp, "odom", "body", filled up
  EXPECT_EQ(double_at(bytes, pose), 1.0);
  const std::size_t covariance = pose + 7 * 8, twist = covariance + 36 * 8;
  const auto entry = [&](std::size_t from, int row, int column) {
    return double_at(bytes, from + 8 * static_cast<std::size_t>(6 * row + column));
  };
  const double expected[] = {1, 2, 3, 20, 10, 30};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(entry(covariance, i, i), expected[i], 1e-12) << i;
  EXPECT_NEAR(entry(covariance, 0, 4), 0.5, 1e-12) << "the body's x axis is W's y axis";
  EXPECT_NEAR(entry(covariance, 0, 3), 0, 1e-12);
  EXPECT_NEAR(double_at(bytes, twist), 4, 1e-12);
  EXPECT_NEAR(double_at(bytes, twist + 8), 0, 1e-12);
  EXPECT_EQ(double_at(bytes, twist + 24), 5.0);
  const double of_twist[] = {8, 7, 9, 11, 12, 13};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(entry(twist + 48, i, i), of_twist[i], 1e-12) << i;
}

TEST(RosDefinitions, EachTypeIsThereOnceWithAllItsParts) {
  EXPECT_EQ(ros_definition("std_msgs/msg/Header"), "builtin_interfaces/Time stamp\nstring frame_id\n" + std::string(80, '=') +
                                                       "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n");
  const std::string odometry = ros_definition("nav_msgs/msg/Odometry");
  for (const char* part : {"std_msgs/Header", "builtin_interfaces/Time", "geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose",
                           "geometry_msgs/Point", "geometry_msgs/Quaternion", "geometry_msgs/TwistWithCovariance",
                           "geometry_msgs/Twist", "geometry_msgs/Vector3"}) {
    const std::string line = std::string("MSG: ") + part + "\n";
    EXPECT_NE(odometry.find(line), std::string::npos) << part;
    EXPECT_EQ(odometry.find(line), odometry.rfind(line)) << part;
  }
}

}  // namespace ros_messages_test
}  // namespace fbvins
