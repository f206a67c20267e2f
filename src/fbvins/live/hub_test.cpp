// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/hub.hpp"

#include <gtest/gtest.h>

#include <latch>
#include <stdexcept>

#include "fbvins/core/overloaded.hpp"

namespace fbvins {
namespace hub_test {

struct Taken {
  std::vector<std::int64_t> stamps;
  bool finished = false;
};

class Notes final : public Sink {
 public:
  explicit Notes(Taken& taken) : taken_(taken) {}
  std::string_view name() const override { return "notes"; }
  Result<void> take(const LiveEvent& event) override {
    taken_.stamps.push_back(std::visit(
        Overloaded{[](const AidingSample& r) { return stamp_of(r).ns; }, [](const auto& e) { return e.t.ns; }}, event));
    return {};
  }
  Result<void> finish() override {
    taken_.finished = true;
    return {};
  }

 private:
  Taken& taken_;
};

/// Takes nothing before it is told to.
class Hanging final : public Sink {
 public:
  Hanging(Taken& taken, std::latch& go) : notes_(taken), go_(go) {}
  std::string_view name() const override { return "hanging"; }
  Result<void> take(const LiveEvent& event) override {
    go_.wait();
    return notes_.take(event);
  }

 private:
  Notes notes_;
  std::latch& go_;
};

class Failing final : public Sink {
 public:
  std::string_view name() const override { return "failing"; }
  Result<void> take(const LiveEvent& event) override {
    const std::int64_t t = std::get<ImuSample>(event).t.ns;
    if (t == 3) return Error{ErrorCode::unwritable, "the disk is full"};
    if (t == 5) throw std::runtime_error("later and worse");
    return {};
  }
};

class Unplugged final : public Sink {
 public:
  std::string_view name() const override { return "unplugged"; }
  Result<void> take(const LiveEvent&) override { return {}; }
  std::string problem() const override { return "no cable"; }
};

ImuSample reading(std::int64_t t) { return {Time{t}, Vec3::Zero(), Vec3::Zero()}; }

TEST(Hub, EverySinkGetsEverythingInOrder) {
  Taken a, b;
  Hub hub;
  hub.add(std::make_unique<Notes>(a));
  hub.add(std::make_unique<Notes>(b));
  std::vector<std::int64_t> expected;
  for (std::int64_t t = 0; t < 1000; ++t) hub.publish(reading(t)), expected.push_back(t);
  ASSERT_TRUE(hub.finish());
  EXPECT_EQ(a.stamps, expected);
  EXPECT_EQ(b.stamps, expected);
  EXPECT_TRUE(a.finished);
}

TEST(Hub, ASinkThatHangsHoldsUpNobodyAndLosesTheOldest) {
  Taken slow, quick;
  std::latch go(1);
  Hub hub({.events = 10, .images = 2});
  hub.add(std::make_unique<Hanging>(slow, go));
  hub.add(std::make_unique<Notes>(quick));
  for (std::int64_t t = 0; t < 1000; ++t) hub.publish(reading(t));
  go.count_down();
  ASSERT_TRUE(hub.finish());
  EXPECT_EQ(slow.stamps.back(), 999);
  EXPECT_LE(slow.stamps.size(), 11u);
  EXPECT_EQ(static_cast<std::int64_t>(slow.stamps.size()) + hub.reports()[0].dropped, 1000);
}

TEST(Hub, ImagesThatWaitAreFewForTheirMemory) {
  Taken slow;
  std::latch go(1);
  Hub hub({.events = 1000, .images = 2});
  hub.add(std::make_unique<Hanging>(slow, go));
  hub.publish(reading(0));  // may be taken at once
  for (std::int64_t t = 1; t <= 20; ++t) hub.publish(StereoFrame{Time{t}}), hub.publish(reading(100 + t));
  go.count_down();
  ASSERT_TRUE(hub.finish());
  EXPECT_EQ(hub.reports()[0].dropped, 18);
  EXPECT_EQ(slow.stamps.size(), 23u);
}

TEST(Hub, TroubleThatMayPassIsReportedAndIsNoFailure) {
  Hub hub;
  hub.add(std::make_unique<Unplugged>());
  hub.publish(reading(1));
  EXPECT_EQ(hub.reports()[0].passing, "no cable");
  EXPECT_TRUE(hub.finish());
}

TEST(Hub, TheFirstErrorIsReportedAndLaterEventsStillCome) {
  Hub hub;
  hub.add(std::make_unique<Failing>());
  for (std::int64_t t = 0; t < 10; ++t) hub.publish(reading(t));
  const Result<void> done = hub.finish();
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "failing: the disk is full");
  EXPECT_EQ(hub.reports()[0].taken, 10);
}

}  // namespace hub_test
}  // namespace fbvins
