// SPDX-License-Identifier: Apache-2.0
// Private: requests and replies of ROS 2's services in bytes: std_srvs/Trigger, a node's parameters (rcl_interfaces), its
// lifecycle (lifecycle_msgs). Pure functions, any thread.
//
//   if (auto names = read_names(request)) append_parameter_values(reply, chosen_by(*names));
//
// Each is a message of its own, with the header of CDR and without what a middleware puts before it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace fbvins {

void append_trigger_reply(std::string& out, bool success, std::string_view message);
/// A request without fields has one byte in ROS 2.
bool is_empty_request(std::string_view bytes);

/// An option as `ros2 param` shows it; nobody can set it.
struct RosParameter {
  std::string name;
  std::variant<std::monostate, bool, std::int64_t, double, std::string> value;  ///< monostate: there is no such parameter
  std::string description, constraints;                                         ///< in words
  double min = 0, max = 0;                                                      ///< of a number; equal: no range
};

/// ListParameters: all below one of the prefixes, or all; so many levels below it, 0: any.
struct RosListRequest {
  std::vector<std::string> prefixes;
  std::uint64_t depth = 0;
};
std::optional<RosListRequest> read_list_request(std::string_view bytes);
void append_parameter_list(std::string& out, std::span<const std::string> names, std::span<const std::string> prefixes);

/// GetParameters, GetParameterTypes, DescribeParameters.
std::optional<std::vector<std::string>> read_names(std::string_view bytes);
void append_parameter_values(std::string& out, std::span<const RosParameter> parameters);
void append_parameter_types(std::string& out, std::span<const RosParameter> parameters);
void append_parameter_descriptions(std::string& out, std::span<const RosParameter> parameters);

/// SetParameters and SetParametersAtomically: the names; the values are passed over.
std::optional<std::vector<std::string>> read_names_to_set(std::string_view bytes);
/// One refusal each.
void append_refusals(std::string& out, std::span<const std::string> reasons);
/// One refusal of all.
void append_refusal(std::string& out, std::string_view reason);

/// The states of a managed node that this program has, with ROS's numbers.
enum class RosLifecycle : std::uint8_t { inactive = 2, active = 3, finalized = 4 };
/// GetState.
void append_lifecycle_state(std::string& out, RosLifecycle state);
/// ChangeState: refused.
void append_no_change(std::string& out);
bool is_change_request(std::string_view bytes);
/// GetAvailableTransitions: none.
void append_no_transitions(std::string& out);
/// lifecycle_msgs/TransitionEvent; `t_ns` of whatever clock ROS has.
void append_transition(std::string& out, std::uint64_t t_ns, RosLifecycle from, RosLifecycle to);

}  // namespace fbvins
