// SPDX-License-Identifier: Apache-2.0
#include "fbvins/core/fixed_list.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace fbvins {
namespace fixed_list_test {

struct Value {
  int number = 7;
  bool operator==(const Value&) const = default;
};
using List = FixedList<Value, 4>;

List of(const std::vector<int>& numbers) {
  List out;
  for (const int n : numbers) out.push_back({n});
  return out;
}
std::vector<int> numbers(const List& list) {
  std::vector<int> out;
  for (const Value& v : list) out.push_back(v.number);
  return out;
}

TEST(FixedList, HoldsWhatIsPutIn) {
  EXPECT_TRUE(List().empty());
  List list = of({1, 2, 3});
  EXPECT_EQ(list.push_front({4}).number, 4);
  EXPECT_EQ(numbers(list), (std::vector{4, 1, 2, 3}));
  EXPECT_EQ(list.size(), List::capacity());
  EXPECT_EQ(list.front(), list[0]);
}

TEST(FixedList, ACopyIsAValueOfItsOwn) {
  const List list = of({1, 2, 3});
  List copy = list, assigned = of({5});
  assigned = list;
  copy.erase_if([](const Value& v) { return v.number == 2; });
  EXPECT_EQ(numbers(copy), (std::vector{1, 3}));
  EXPECT_EQ(numbers(list), (std::vector{1, 2, 3}));
  EXPECT_EQ(numbers(assigned), (std::vector{1, 2, 3}));
  assigned.clear();
  EXPECT_EQ(assigned.begin(), assigned.end());
}

TEST(FixedList, TheFirstOfItselfCanBePutInAgain) {
  List list = of({1, 2});
  list.push_front(list[1]);
  list.push_back(list.front());
  EXPECT_EQ(numbers(list), (std::vector{2, 1, 2, 2}));
}

}  // namespace fixed_list_test
}  // namespace fbvins
