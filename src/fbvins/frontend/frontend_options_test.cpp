// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/frontend_options.hpp"

#include <gtest/gtest.h>

#include <set>

#include "fbvins/core/options.hpp"

namespace fbvins {
namespace frontend_options_test {

StereoRig rig() {
  StereoRig rig;
  rig.left = rig.right = Camera(PinholeRadtan{.fx = 200, .fy = 200, .cx = 160, .cy = 120}, 320, 240);
  rig.T_BC1 = Pose<B, C1>(Quat::Identity(), Vec3(0.11, 0, 0));
  return rig;
}

TEST(FrontendRegistry, EveryNameMakesAFrontendThatTakesAnImage) {
  const std::vector<std::string> names = frontend_names();
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
  for (const std::string& name : names) {
    auto frontend = make_frontend(rig(), name);
    ASSERT_TRUE(frontend.ok()) << name << ": " << frontend.error().message;
    SensorPacket packet;
    packet.frame.left = std::make_shared<const Image>(320, 240, std::uint8_t{90});
    EXPECT_TRUE((*frontend)->process(packet, StatePrior{}).has_left) << name;
  }
}

TEST(FrontendRegistry, AnUnknownNameIsAnErrorThatListsThoseThereAre) {
  const auto made = make_frontend(rig(), "surf");
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().code, ErrorCode::invalid_argument);
  EXPECT_NE(made.error().message.find("\"surf\""), std::string::npos);
  for (const std::string& name : frontend_names()) EXPECT_NE(made.error().message.find(name), std::string::npos) << name;
}

TEST(FrontendRegistry, WeightsThatAreNotThereAreAnError) {
  FrontendOptions options;
  options.kind = "boost";
  options.boost.booster.weights = "/nowhere/boost-x.safetensors";
  const auto made = make_frontend(rig(), options);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("boost-x"), std::string::npos);
}

TEST(FrontendOptions, AreValidForEveryNameAndForNoOther) {
  EXPECT_EQ(FrontendOptions{}.kind, "boost");
  FrontendOptions options;
  for (const std::string& name : frontend_names()) {
    options.kind = name;
    EXPECT_TRUE(validate(options).ok()) << name;
  }
  options.kind = "surf";
  EXPECT_NE(validate(options).error().message.find(frontend_choices()), std::string::npos);
}

}  // namespace frontend_options_test
}  // namespace fbvins
