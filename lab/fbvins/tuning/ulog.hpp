// SPDX-License-Identifier: Apache-2.0
// Reads from PX4's logs (.ulg) what tuning needs: numeric fields of topics by name, and parameters. Everything else is skipped,
// and a truncated log is read up to its end. Values; one thread. Format:
// https://docs.px4.io/main/en/dev_log/ulog_file_format.html
//
//   Result<Ulog> log = Ulog::read("flight.ulg");
//   std::vector<double> t = log->seconds("vehicle_torque_setpoint"), x = log->numbers("vehicle_torque_setpoint", "xyz[0]");
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins {

class Ulog {
 public:
  static Result<Ulog> read(const std::string& path);
  /// `source` names the bytes in messages.
  static Result<Ulog> parse(std::string_view bytes, const std::string& source);

  /// Stamps of a topic's first instance, seconds since boot; empty if it was not logged.
  std::vector<double> seconds(const std::string& topic) const;
  /// Values of a field; for arrays with the index in brackets ("xyz[0]"). Empty if there is no such field.
  std::vector<double> numbers(const std::string& topic, const std::string& field) const;
  /// Value at the beginning of the log.
  std::optional<double> parameter(const std::string& name) const;

 private:
  /// Offset and type of a number in a message.
  struct Field {
    std::size_t offset = 0;
    char kind = 'f';
    std::size_t size = 4;
  };
  struct Format {
    std::map<std::string, Field> fields;
    std::size_t size = 0;
  };
  struct Topic {
    std::string format;
    std::vector<std::string> messages;
  };

  Result<void> take(char type, std::string_view body);
  Result<void> take_format(std::string_view text);
  void take_parameter(std::string_view body);

  std::map<std::string, Format> formats_;
  std::map<int, std::string> subscriptions_;  ///< message number to topic, of first instances
  std::map<std::string, Topic> topics_;
  std::map<std::string, double> parameters_;
};

}  // namespace fbvins
