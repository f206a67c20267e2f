// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_control.hpp"

#include <chrono>
#include <utility>

#include "fbvins/ros2/ros2_parameters.hpp"

namespace fbvins {
namespace {

Ros2Services::Service trigger(const Ros2Node& node, FlightCommand command) {
  return {node.own_topic(command.name), "std_srvs/srv/Trigger",
          [act = std::move(command.act)](std::string_view request, const Ros2Services::Reply& reply) {
            if (!is_empty_request(request)) return false;
            act([reply](const Result<std::string>& done) {
              std::string message;
              append_trigger_reply(message, done.ok(), done ? *done : done.error().message);
              reply(std::move(message));
            });
            return true;
          }};
}

/// A service whose reply depends on nothing in the request.
template <class IsRequest, class Append>
Ros2Services::Service answering(std::string name, std::string type, IsRequest is_request, Append append) {
  return {std::move(name), std::move(type), [=](std::string_view request, const Ros2Services::Reply& reply) {
            if (!is_request(request)) return false;
            std::string message;
            append(message);
            reply(std::move(message));
            return true;
          }};
}

}  // namespace

Result<std::unique_ptr<Ros2Control>> Ros2Control::create(const std::shared_ptr<Ros2Node>& node,
                                                         std::vector<FlightCommand> commands,
                                                         std::vector<RosParameter> parameters, const Ros2Services::Say& say) {
  auto transitions = Ros2Publisher::create(node, node->own_topic("transition_event"), "lifecycle_msgs/msg/TransitionEvent");
  if (!transitions) return transitions.error();
  std::unique_ptr<Ros2Control> control(new Ros2Control(std::move(*transitions)));
  std::vector<Ros2Services::Service> all = Ros2Parameters(std::move(parameters)).services(*node);
  for (FlightCommand& command : commands) all.push_back(trigger(*node, std::move(command)));
  for (Ros2Services::Service& service : control->lifecycle(*node)) all.push_back(std::move(service));
  auto services = Ros2Services::create(node, std::move(all), say);
  if (!services) return services.error();
  control->services_ = std::move(*services);
  return control;
}

std::vector<Ros2Services::Service> Ros2Control::lifecycle(const Ros2Node& node) const {
  const std::string srv = "lifecycle_msgs/srv/";
  return {answering(node.own_topic("get_state"), srv + "GetState", is_empty_request,
                    [this](std::string& out) { append_lifecycle_state(out, state_); }),
          answering(node.own_topic("change_state"), srv + "ChangeState", is_change_request, append_no_change),
          answering(node.own_topic("get_available_transitions"), srv + "GetAvailableTransitions", is_empty_request,
                    append_no_transitions)};
}

Result<void> Ros2Control::take(const LiveEvent& event) {
  const auto* status = std::get_if<LiveStatus>(&event);
  if (status == nullptr) return {};
  return become(status->health.has_pose() ? RosLifecycle::active : RosLifecycle::inactive);
}

Result<void> Ros2Control::finish() {
  services_.reset();
  return become(RosLifecycle::finalized);
}

Result<void> Ros2Control::become(RosLifecycle state) {
  const RosLifecycle before = state_.exchange(state);
  if (before == state) return {};
  const auto now = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch());
  std::string message;
  append_transition(message, static_cast<std::uint64_t>(now.count()), before, state);
  return transitions_.publish(std::move(message));
}

}  // namespace fbvins
