// SPDX-License-Identifier: Apache-2.0
// The component of ros2/ with stand-ins for ROS's headers: a simulated flight comes by its topics, and goes out as odometry.
#include <gtest/gtest.h>

#include <thread>

#include "fbvins/sim/simulation.hpp"
#include "ros2/src/fbvins_component.cpp"
#include "tests/support/kalibr_test_files.hpp"
#include "tests/support/rendered_recording.hpp"

namespace fbvins {
namespace component_test {

constexpr double kSeconds = 3;
const std::vector<std::string> kImages{"/left", "/right"};

/// Rendered once.
const test::RenderedRecording& recorded() {
  static const test::RenderedRecording recorded = [] {
    SimulationOptions options = *simulation_preset("normal");
    options.flight.duration_s = kSeconds;
    options.image_rate_hz = 10;
    return test::rendered(options);
  }();
  return recorded;
}

template <class M>
void publish(const std::string& topic, const M& message) {
  rclcpp::Publisher<M>{topic}.publish(message);
}

template <class M>
std::shared_ptr<std::vector<M>> heard(const std::string& topic) {
  auto all = std::make_shared<std::vector<M>>();
  rclcpp::StandInGraph::instance().listeners[topic].push_back(
      [all](const std::any& message) { all->push_back(*std::any_cast<std::shared_ptr<const M>>(message)); });
  return all;
}

sensor_msgs::msg::Image message_of(const Image& image, Time t, std::uint32_t padding) {
  sensor_msgs::msg::Image message;
  message.header.stamp = fbvins_ros2::stamp_of(t);
  message.encoding = "mono8";
  message.width = static_cast<std::uint32_t>(image.width()), message.height = static_cast<std::uint32_t>(image.height());
  message.step = message.width + padding;
  for (int y = 0; y < image.height(); ++y) {
    message.data.insert(message.data.end(), image.row(y), image.row(y) + image.width());
    message.data.insert(message.data.end(), padding, 0);
  }
  return message;
}

Time time_of(const SensorEvent& event) { return stamp_of(event); }

void publish(const SensorEvent& event) {
  if (const auto* reading = std::get_if<ImuSample>(&event)) {
    sensor_msgs::msg::Imu message;
    message.header.stamp = fbvins_ros2::stamp_of(reading->t);
    fbvins_ros2::put(message.angular_velocity, reading->gyro_radps);
    fbvins_ros2::put(message.linear_acceleration, reading->accel_mps2);
    return publish("/imu", message);
  }
  const auto& frame = std::get<StereoFrame>(event);
  publish(kImages[0], message_of(*frame.left(), frame.t, 0));
  publish(kImages[1], message_of(*frame.right(), frame.t + frame.offsets.of(1), 8));  // rows with a gap are copied
}

rclcpp::NodeOptions parameters(const KalibrFiles& files) {
  return {{{"images", kImages},
           {"imu", std::string("/imu")},
           {"calibration", files.camchain()},
           {"imu_calibration", files.imu()},
           {"set", std::vector<std::string>{"live.ros2.base_frame=", "frontend.kind=klt"}}}};
}

std::string refusal(rclcpp::NodeOptions options, const std::string& name, std::any value) {
  options.parameters[name] = std::move(value);
  try {
    const fbvins_ros2::FbvinsComponent component(options);
  } catch (const std::exception& e) {
    return e.what();
  }
  return "";
}

struct Ros2Component : ::testing::Test {
  Ros2Component() { rclcpp::StandInGraph::instance() = {}; }
};

TEST_F(Ros2Component, FliesByItsTopics) {
  const KalibrFiles files(recorded().rig);
  const auto odometry = heard<nav_msgs::msg::Odometry>("/fbvins/odometry");
  const auto moving = heard<tf2_msgs::msg::TFMessage>("/tf"), fixed = heard<tf2_msgs::msg::TFMessage>("/tf_static");
  const auto diagnostics = heard<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics");
  {
    const fbvins_ros2::FbvinsComponent component(parameters(files));
    const Time first = time_of(recorded().events.front());
    const auto began = std::chrono::steady_clock::now();
    for (const SensorEvent& event : recorded().events) {
      std::this_thread::sleep_until(began + std::chrono::nanoseconds((time_of(event) - first).ns));
      publish(event);
    }
  }
  ASSERT_EQ(fixed->size(), 1u);
  EXPECT_EQ(fixed->front().transforms.size(), 2u) << "two cameras on the IMU, and no vehicle";
  ASSERT_GT(odometry->size(), 100u) << "of " << recorded().events.size() << " readings and frames";
  const nav_msgs::msg::Odometry &start = odometry->front(), &end = odometry->back();
  EXPECT_EQ(end.header.frame_id, "odom");
  EXPECT_EQ(end.child_frame_id, "imu_link");
  const auto place = [](const nav_msgs::msg::Odometry& o) {
    return Vec3(o.pose.pose.position.x, o.pose.pose.position.y, o.pose.pose.position.z);
  };
  const auto truth = [](const nav_msgs::msg::Odometry& o) {
    const Time t = fbvins_ros2::time_of(o.header.stamp);
    const auto away = [&](const auto& point) { return std::abs((point.t - t).ns); };
    return std::ranges::min_element(recorded().truth, {}, away)->T.p;
  };
  EXPECT_NEAR((place(end) - place(start)).norm(), (truth(end) - truth(start)).norm(), 0.1) << "metres from where it started";
  EXPECT_GT(moving->size(), 20u);
  EXPECT_GT(diagnostics->size(), 1u);
  EXPECT_TRUE(rclcpp::StandInGraph::instance().warnings.empty());
}

TEST_F(Ros2Component, AnswersResetAndNamesImagesThatDoNotFit) {
  const KalibrFiles files(euroc_rig());
  const fbvins_ros2::FbvinsComponent component(parameters(files));
  rclcpp::StandInGraph& graph = rclcpp::StandInGraph::instance();
  using Reset = rclcpp::Service<std_srvs::srv::Trigger>::Call;
  const auto reply = std::make_shared<std_srvs::srv::Trigger::Response>();
  std::any_cast<Reset>(graph.services.at("/fbvins/reset"))(std::make_shared<std_srvs::srv::Trigger::Request>(), reply);
  EXPECT_TRUE(reply->success);
  sensor_msgs::msg::Image small = message_of(Image(64, 48), Time{}, 0), coloured = message_of(Image(752, 480), Time{}, 0);
  coloured.encoding = "rgb8";
  for (const auto& image : {small, coloured}) publish(kImages[0], image);
  EXPECT_EQ(graph.warnings.size(), 2u);
}

TEST_F(Ros2Component, RefusesParametersThatDoNotFit) {
  const KalibrFiles files(euroc_rig());
  EXPECT_EQ(refusal(parameters(files), "calibration", std::string()),
            "the parameter 'calibration' names no Kalibr camchain-imucam.yaml");
  const std::string one = refusal(parameters(files), "images", std::vector<std::string>{"/left"});
  EXPECT_EQ(one.find("'images' has 1 topics, and "), 0u) << one;
  EXPECT_NE(refusal(parameters(files), "set", std::vector<std::string>{"no.such=1"}).find("no.such"), std::string::npos);
  EXPECT_NE(refusal(parameters(files), "pair_tolerance_ms", -1.0).find("pair_tolerance_ms"), std::string::npos);
}

}  // namespace component_test
}  // namespace fbvins
