// SPDX-License-Identifier: Apache-2.0
#include "fbvins/core/text.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace fbvins {
namespace text_test {

TEST(Split, HasOnePartMoreThanSeparators) {
  EXPECT_EQ(split("a:bc:d", ':'), (std::vector<std::string>{"a", "bc", "d"}));
  EXPECT_EQ(split("", ':'), std::vector<std::string>{""});
  EXPECT_EQ(split(":a::", ':'), (std::vector<std::string>{"", "a", "", ""}));
}

TEST(NumberIn, IsTheWholeTextOrNone) {
  EXPECT_EQ(number_in<int>("-12"), -12);
  EXPECT_EQ(number_in<double>("1e-3"), 1e-3);
  for (const char* text : {"", "12x", " 12", "12 ", "+12", "0x10", "1,5"}) EXPECT_FALSE(number_in<double>(text)) << text;
  EXPECT_FALSE(number_in<std::uint16_t>("65536")) << "it does not fit";
  EXPECT_FALSE(number_in<std::uint16_t>("-1"));
  EXPECT_FALSE(number_in<int>("1.5"));
}

}  // namespace text_test
}  // namespace fbvins
