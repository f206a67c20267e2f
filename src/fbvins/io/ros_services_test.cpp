// SPDX-License-Identifier: Apache-2.0
// Against rosbags' bytes: tests/ros2_peer.py.
#include "fbvins/io/ros_services.hpp"

#include <gtest/gtest.h>

#include "fbvins/io/cdr.hpp"

namespace fbvins {
namespace ros_services_test {

/// A literal with zeros in it.
template <std::size_t kSize>
std::string bytes(const char (&text)[kSize]) {
  return {text, kSize - 1};
}

TEST(RosServices, ATriggersReply) {
  std::string out;
  append_trigger_reply(out, true, "ok");
  EXPECT_EQ(out, bytes("\0\1\0\0\1\0\0\0\3\0\0\0ok\0"));
}

TEST(RosServices, AnEmptyRequestHasOneByte) {
  EXPECT_TRUE(is_empty_request(bytes("\0\1\0\0\0")));
  EXPECT_TRUE(is_empty_request(bytes("\0\1\0\0\0\0\0\0"))) << "filled up";
  EXPECT_FALSE(is_empty_request(bytes("\0\1\0\0")));
  EXPECT_FALSE(is_empty_request(""));
}

TEST(RosServices, NamesAreRead) {
  const auto names = read_names(bytes("\0\1\0\0\2\0\0\0\2\0\0\0a\0\0\0\3\0\0\0bc\0"));
  ASSERT_TRUE(names);
  EXPECT_EQ(*names, (std::vector<std::string>{"a", "bc"}));
  EXPECT_FALSE(read_names(bytes("\0\1\0\0\377\377\377\377\2\0\0\0a\0"))) << "more than there are";
  EXPECT_FALSE(read_names(bytes("\0\1\0\0")));
}

TEST(RosServices, ARequestOfVeryManyNamesIsRefused) {
  std::string out;
  CdrWriter cdr(out);
  constexpr int kNames = 10'001;
  cdr.count(kNames);
  for (int i = 0; i < kNames; ++i) cdr.text("");
  EXPECT_FALSE(read_names(out));
  out[4] = '\0', out[5] = '\1';  // 256 of them
  EXPECT_TRUE(read_names(out));
}

TEST(RosServices, AListRequestHasPrefixesAndADepth) {
  const auto request = read_list_request(bytes("\0\1\0\0\1\0\0\0\2\0\0\0a\0\0\0\0\0\0\0\7\0\0\0\0\0\0\0"));
  ASSERT_TRUE(request);
  EXPECT_EQ(request->prefixes, std::vector<std::string>{"a"});
  EXPECT_EQ(request->depth, 7u);
  EXPECT_FALSE(read_list_request(bytes("\0\1\0\0\1\0\0\0\2\0\0\0a\0")));
}

/// Values of any type are passed over, to the next name.
TEST(RosServices, NamesToSetAreReadWithAnyValues) {
  std::string out;
  CdrWriter cdr(out);
  cdr.count(2);
  for (const char* name : {"first", "second"}) {
    cdr.text(name);
    cdr.put(std::uint8_t{9});
    cdr.put(std::uint8_t{1});
    cdr.put(std::int64_t{5});
    cdr.put(2.5);
    cdr.text("text");
    cdr.count(3), cdr.raw("abc", 3);
    cdr.count(1), cdr.raw("\1", 1);
    cdr.count(2), cdr.put(std::int64_t{1}), cdr.put(std::int64_t{2});
    cdr.count(1), cdr.put(0.5);
    cdr.count(1), cdr.text("x");
  }
  const auto names = read_names_to_set(out);
  ASSERT_TRUE(names);
  EXPECT_EQ(*names, (std::vector<std::string>{"first", "second"}));
  for (std::size_t size = 0; size + 2 < out.size(); ++size) EXPECT_FALSE(read_names_to_set(out.substr(0, size))) << size;
}

TEST(RosServices, ADescriptionHasARangeOfItsType) {
  const std::vector<RosParameter> parameters = {{"whole", std::int64_t{3}, "", "", 1, 10}, {"none", {}, "", "", 1, 10}};
  std::string out;
  append_parameter_descriptions(out, parameters);
  CdrReader cdr(out);
  EXPECT_EQ(cdr.get<std::uint32_t>(), 2u);
  EXPECT_EQ(cdr.text(), "whole");
  EXPECT_EQ(cdr.get<std::uint8_t>(), 2) << "PARAMETER_INTEGER";
  cdr.text(), cdr.text();
  EXPECT_EQ(cdr.get<std::uint8_t>(), 1) << "read only";
  EXPECT_EQ(cdr.get<std::uint8_t>(), 0);
  EXPECT_EQ(cdr.get<std::uint32_t>(), 0u) << "no range of floating point";
  EXPECT_EQ(cdr.get<std::uint32_t>(), 1u);
  EXPECT_EQ(cdr.get<std::int64_t>(), 1);
  EXPECT_EQ(cdr.get<std::int64_t>(), 10);
  EXPECT_EQ(cdr.get<std::uint64_t>(), 1u);
  EXPECT_EQ(cdr.text(), "none");
  EXPECT_EQ(cdr.get<std::uint8_t>(), 0) << "not set";
}

TEST(RosServices, ATransitionNamesBothStates) {
  std::string out;
  append_transition(out, 5, RosLifecycle::inactive, RosLifecycle::active);
  CdrReader cdr(out);
  EXPECT_EQ(cdr.get<std::uint64_t>(), 5u);
  EXPECT_EQ(cdr.get<std::uint8_t>(), 3);
  EXPECT_EQ(cdr.text(), "activate");
  EXPECT_EQ(cdr.get<std::uint8_t>(), 2);
  EXPECT_EQ(cdr.text(), "inactive");
  EXPECT_EQ(cdr.get<std::uint8_t>(), 3);
  EXPECT_EQ(cdr.text(), "active");
  EXPECT_TRUE(cdr.ok());
}

}  // namespace ros_services_test
}  // namespace fbvins
