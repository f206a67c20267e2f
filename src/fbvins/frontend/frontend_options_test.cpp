// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/frontend_options.hpp"

#include <gtest/gtest.h>

#include <set>

#include "fbvins/core/options.hpp"
#include "fbvins/frontend/frontend_registry.hpp"

namespace fbvins {
namespace frontend_options_test {

StereoRig rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{.fx = 200, .fy = 200, .cx = 160, .cy = 120}, 320, 240), {}});
  rig.cameras[1].T_BC = Pose<B, C0>(Quat::Identity(), Vec3(0.11, 0, 0));
  return rig;
}

TEST(FrontendRegistry, EveryNameMakesAFrontendThatTakesAnImage) {
  const std::vector<std::string> names = frontend_names();
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
  for (const std::string& name : names) {
    auto frontend = make_frontend(rig(), name);
    ASSERT_TRUE(frontend.ok()) << name << ": " << frontend.error().message;
    SensorPacket packet;
    packet.frame.set_image(0, std::make_shared<const Image>(320, 240, std::uint8_t{90}));
    EXPECT_TRUE((*frontend)->process(packet, StatePrior{}).has(0)) << name;
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

/// It stays registered for the other tests of this process.
TEST(FrontendRegistry, OneOfYourOwnIsMadeByItsNameAndReadsItsOptions) {
  struct Blind final : Frontend {
    TrackedFrame process(const SensorPacket& packet, const StatePrior&) override {
      TrackedFrame out;
      out.set_has(0, packet.frame.left() != nullptr);
      return out;
    }
  };
  const auto told = std::make_shared<std::string>();
  const auto make = [told](const StereoRig&, const FrontendOptions& options) -> Result<std::unique_ptr<Frontend>> {
    *told = options.own;
    return std::unique_ptr<Frontend>(std::make_unique<Blind>());
  };
  ASSERT_TRUE(register_frontend({"blind", "sees nothing", make}).ok());
  EXPECT_EQ(frontend_names().back(), "blind");
  EXPECT_NE(frontend_meanings().find("blind: sees nothing"), std::string::npos);
  EXPECT_EQ(default_frontend(), "boost");
  FrontendOptions options;
  options.kind = "blind";
  options.own = "dark=1";
  EXPECT_TRUE(validate(options).ok());
  EXPECT_TRUE(make_frontend(rig(), options).ok());
  EXPECT_EQ(*told, "dark=1");
  EXPECT_NE(register_frontend({"blind", "", make}).error().message.find("already"), std::string::npos);
  EXPECT_NE(register_frontend({"a|b", "", make}).error().message.find("'a|b'"), std::string::npos);
}

TEST(FrontendRegistry, AFileThatIsNoPluginIsRefusedByName) {
  const std::string absent = testing::TempDir() + "/absent.so";
  EXPECT_NE(load_frontends(absent).error().message.find(absent), std::string::npos);
  EXPECT_NE(load_frontends("libm.so.6").error().message.find("./libm.so.6"), std::string::npos) << "not the system's";
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
