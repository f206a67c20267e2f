// SPDX-License-Identifier: Apache-2.0
// What ROS 2 may ask of a flight: commands as services of std_srvs/Trigger, the options as parameters, and the state of a managed
// node (lifecycle), which follows the pose: active where there is one, otherwise inactive, finalized at the end.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "fbvins/io/ros_services.hpp"
#include "fbvins/live/flight_command.hpp"
#include "fbvins/live/sink.hpp"
#include "fbvins/ros2/ros2_services.hpp"

namespace fbvins {

class Ros2Control final : public Sink {
 public:
  /// A command "reset" becomes the service <node>/reset.
  static Result<std::unique_ptr<Ros2Control>> create(const std::shared_ptr<Ros2Node>& node, std::vector<FlightCommand> commands,
                                                     std::vector<RosParameter> parameters, const Ros2Services::Say& say);

  std::string_view name() const override { return "ROS 2 services"; }
  Result<void> take(const LiveEvent& event) override;
  Result<void> finish() override;

 private:
  explicit Ros2Control(Ros2Publisher transitions) : transitions_(std::move(transitions)) {}
  Result<void> become(RosLifecycle state);
  std::vector<Ros2Services::Service> lifecycle(const Ros2Node& node) const;

  Ros2Publisher transitions_;
  std::atomic<RosLifecycle> state_{RosLifecycle::inactive};
  std::unique_ptr<Ros2Services> services_;  // last: its thread uses the others
};

}  // namespace fbvins
