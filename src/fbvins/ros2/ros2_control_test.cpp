// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_control.hpp"

#include <dds/dds.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "fbvins/io/cdr.hpp"
#include "fbvins/ros2/cdr_type.hpp"
#include "fbvins/ros2/dds_wire.hpp"
#include "fbvins/ros2/ros2_parameters.hpp"
#include "fbvins/ros2/ros2_test_graph.hpp"

namespace fbvins {
namespace ros2_control_test {

using test::Heard;
using test::node;

const std::string kEmpty("\0\1\0\0\0", 5);

/// Asks as rmw_cyclonedds_cpp does; with another `id` as somebody else.
class Client {
 public:
  Client(const std::string& service, const std::string& type, const std::string& id = "clientid=1.2.3;") {
    auto request = make_wire_topic(node()->participant(), "rq" + service + "Request", type + "_Request");
    auto reply = make_wire_topic(node()->participant(), "rr" + service + "Reply", type + "_Response");
    request_topic_ = std::move(request->entity), reply_topic_ = std::move(reply->entity);
    request_type_ = request->type;
    const Ros2Quality quality;
    writer_ = DdsEntity(dds_create_writer(node()->participant(), request_topic_.handle(),
                                          make_qos(quality, type + "_Request", id).get(), nullptr));
    reader_ = DdsEntity(dds_create_reader(node()->participant(), reply_topic_.handle(),
                                          make_qos(quality, type + "_Response", id).get(), nullptr));
  }

  void ask(const std::string& request, std::int64_t number) const {
    std::string bytes = request.substr(0, 4);
    append_le(bytes, kClient);
    append_le(bytes, number);
    bytes.append(request, 4);
    EXPECT_TRUE(write_bytes(writer_.handle(), *request_type_, bytes, "a request"));
  }
  /// Within that time, else empty. It has the number of its request.
  std::string reply(std::int64_t number, std::chrono::milliseconds within = std::chrono::seconds(60)) const {
    for (const auto end = std::chrono::steady_clock::now() + within; std::chrono::steady_clock::now() < end;) {
      ddsi_serdata* message = nullptr;
      dds_sample_info_t about{};
      if (dds_takecdr(reader_.handle(), &message, 1, &about, DDS_ANY_STATE) == 1) {
        std::string bytes(bytes_of(*message));
        ddsi_serdata_unref(message);
        if (!about.valid_data) continue;  // the service has ended
        ByteCursor header(std::string_view(bytes).substr(4));
        EXPECT_EQ(header.get<std::uint64_t>(), kClient);
        EXPECT_EQ(header.get<std::int64_t>(), number);
        return bytes.erase(4, 16);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return {};
  }
  std::string call(const std::string& request, std::int64_t number) const {
    ask(request, number);
    return reply(number);
  }

 private:
  static constexpr std::uint64_t kClient = 0x1122334455667788;
  DdsEntity request_topic_, reply_topic_, writer_, reader_;
  const ddsi_sertype* request_type_ = nullptr;
};

std::string reply_of(bool success, const std::string& message) {
  std::string out;
  append_trigger_reply(out, success, message);
  return out;
}

std::unique_ptr<Ros2Control> control_with(std::vector<FlightCommand> commands, std::vector<RosParameter> parameters = {},
                                          std::vector<std::string>* said = nullptr) {
  auto made = Ros2Control::create(node(), std::move(commands), std::move(parameters), [said](const std::string& sentence) {
    if (said != nullptr) said->push_back(sentence);
  });
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return made ? std::move(*made) : nullptr;
}

TEST(Ros2Control, CommandsAreServices) {
  int asked = 0;
  const auto control = control_with({{"reset", [&](const FlightCommand::Told& told) { told("done " + std::to_string(++asked)); }},
                                     {"save_map", [&](const FlightCommand::Told& told) {
                                        told(Error{ErrorCode::unwritable, "the disk is full"});
                                      }}});
  ASSERT_TRUE(control);
  const Client reset("/fbvins/reset", "std_srvs/srv/Trigger"), save("/fbvins/save_map", "std_srvs/srv/Trigger");
  EXPECT_EQ(reset.call(kEmpty, 1), reply_of(true, "done 1"));
  EXPECT_EQ(reset.call(kEmpty, 2), reply_of(true, "done 2"));
  EXPECT_EQ(save.call(kEmpty, 7), reply_of(false, "the disk is full"));
}

/// As with live.ros2.commands=false.
TEST(Ros2Control, WithoutCommandsStateAndParametersAreAnsweredAlone) {
  const auto control = control_with({}, {{"live.rate_hz", 5.0, "", "", {}, {}}});
  ASSERT_TRUE(control);
  const Client reset("/fbvins/reset", "std_srvs/srv/Trigger"), state("/fbvins/get_state", "lifecycle_msgs/srv/GetState");
  reset.ask(kEmpty, 1);
  EXPECT_NE(state.call(kEmpty, 1), "");
  EXPECT_EQ(reset.reply(1, std::chrono::milliseconds(300)), "");
}

/// What takes long holds up no other request; what is told when the services are gone is lost.
TEST(Ros2Control, ACommandMayTellLater) {
  FlightCommand::Told waiting;
  auto control = control_with({{"slow", [&](const FlightCommand::Told& told) { waiting = told; }}});
  ASSERT_TRUE(control);
  const Client slow("/fbvins/slow", "std_srvs/srv/Trigger"), state("/fbvins/get_state", "lifecycle_msgs/srv/GetState");
  slow.ask(kEmpty, 1);
  EXPECT_NE(state.call(kEmpty, 1), "");  // after it, as one thread serves both
  std::thread([&] { waiting(std::string("late")); }).join();
  EXPECT_EQ(slow.reply(1), reply_of(true, "late"));
  slow.ask(kEmpty, 2);
  EXPECT_NE(state.call(kEmpty, 2), "");
  ASSERT_TRUE(control->finish());
  waiting(std::string("too late"));
  EXPECT_EQ(slow.reply(2, std::chrono::milliseconds(50)), "");
}

TEST(Ros2Control, ClientsOfAnotherKindAreSaid) {
  std::vector<std::string> said;
  const auto control = control_with({{"reset", [](const FlightCommand::Told& told) { told(std::string("done")); }}}, {}, &said);
  ASSERT_TRUE(control);
  const Client other("/fbvins/reset", "std_srvs/srv/Trigger", ""), good("/fbvins/reset", "std_srvs/srv/Trigger");
  other.ask(kEmpty, 1);
  good.ask(kEmpty.substr(0, 4), 1);  // nothing behind the header
  EXPECT_EQ(good.call(kEmpty, 2), reply_of(true, "done"));
  ASSERT_EQ(said.size(), 2u);
  EXPECT_NE(said[0].find("RMW_IMPLEMENTATION=rmw_cyclonedds_cpp"), std::string::npos);
  EXPECT_EQ(said[1], "ROS 2 service /fbvins/reset: a request of another form was left out");
}

TEST(Ros2Control, TheStateFollowsThePose) {
  Heard transitions;
  const auto heard = Ros2Subscriber::create(node(), "/fbvins/transition_event", "lifecycle_msgs/msg/TransitionEvent", 10,
                                            transitions.function());
  ASSERT_TRUE(heard);
  const auto control = control_with({});
  ASSERT_TRUE(control);
  const Client state("/fbvins/get_state", "lifecycle_msgs/srv/GetState");
  const auto is = [&](std::int64_t number, RosLifecycle expected) {
    std::string out;
    append_lifecycle_state(out, expected);
    EXPECT_EQ(state.call(kEmpty, number), out);
  };
  is(1, RosLifecycle::inactive);
  LiveStatus status;
  status.health = {HealthState::good, HealthReason::none};
  ASSERT_TRUE(control->take(status));
  ASSERT_TRUE(control->take(status));
  is(2, RosLifecycle::active);
  status.health = {HealthState::lost, HealthReason::no_images};
  ASSERT_TRUE(control->take(status));
  is(3, RosLifecycle::inactive);
  ASSERT_TRUE(control->finish());
  ASSERT_TRUE(transitions.wait_for(3));
  EXPECT_NE(transitions.messages()[0].find("activate"), std::string::npos);
  EXPECT_NE(transitions.messages()[1].find("deactivate"), std::string::npos);
  EXPECT_NE(transitions.messages()[2].find("finalized"), std::string::npos);
}

const std::vector<RosParameter> kParameters = {{"live.ros2.clock", std::string("ros"), "whose clock", "sensors|ros"},
                                               {"live.smoothing_s", 0.1, "time constant", "", 0, 2},
                                               {"loop", true, "", ""}};

TEST(Ros2Parameters, AreListedByPrefixAndDepth) {
  const Ros2Parameters parameters(kParameters);
  using Names = std::vector<std::string>;
  EXPECT_EQ(parameters.listed({}).size(), 3u);
  EXPECT_EQ(parameters.listed({{}, 1}), Names{"loop"});
  EXPECT_EQ(parameters.listed({{"live"}, 1}), Names{"live.smoothing_s"});
  EXPECT_EQ(parameters.listed({{"live.ros2", "loop"}, 0}), (Names{"live.ros2.clock", "loop"}));
  EXPECT_EQ(parameters.listed({{"live.ros"}, 0}), Names{});
}

TEST(Ros2Parameters, AreReadAndNotSet) {
  const auto control = control_with({}, kParameters);
  ASSERT_TRUE(control);
  const std::string srv = "rcl_interfaces/srv/";
  std::string request, expected;
  CdrWriter cdr(request);
  cdr.count(2), cdr.text("live.smoothing_s"), cdr.text("nonsense");
  const Client get("/fbvins/get_parameters", srv + "GetParameters");
  const std::vector<RosParameter> chosen = {kParameters[1], RosParameter{"nonsense", {}, {}, {}}};
  append_parameter_values(expected, chosen);
  EXPECT_EQ(get.call(request, 1), expected);
  const Client describe("/fbvins/describe_parameters", srv + "DescribeParameters");
  expected.clear();
  append_parameter_descriptions(expected, chosen);
  EXPECT_EQ(describe.call(request, 1), expected);
  const std::vector<std::string> reasons = Ros2Parameters(kParameters).refusals({"loop", "nonsense"});
  EXPECT_NE(reasons.at(0).find("--set loop=VALUE"), std::string::npos);
  EXPECT_EQ(reasons.at(1), "'nonsense' is no option of this flight");
}

}  // namespace ros2_control_test
}  // namespace fbvins
