// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/web_access.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace web_access_test {

TEST(WebAddress, IsAPortOrAnAddressWithOne) {
  EXPECT_EQ(parse_web_address("8080")->port, 8080);
  EXPECT_EQ(parse_web_address("8080")->host, "127.0.0.1");
  EXPECT_TRUE(parse_web_address("8080")->loopback());
  EXPECT_EQ(parse_web_address("0.0.0.0:80")->host, "0.0.0.0");
  EXPECT_FALSE(parse_web_address("0.0.0.0:80")->loopback());
  EXPECT_EQ(parse_web_address("[::1]:80")->host, "::1");
  EXPECT_TRUE(parse_web_address("[::1]:80")->loopback());
  for (const char* wrong :
       {"", "x", "80x", "65536", "-1", "1.2.3:80", "name:80", "1.2.3.4", "1.2.3.4:", "[::1]", "[::1:80", "::1:80"})
    EXPECT_FALSE(parse_web_address(wrong)) << wrong;
}

TEST(Host, IsAnAddressOrThisMachine) {
  for (const char* fine : {"127.0.0.1", "127.0.0.1:8080", "localhost:8080", "LOCALHOST", "[::1]:8080", "192.168.1.5:80", "drone",
                           "Drone.local:8080"})
    EXPECT_TRUE(host_allowed(fine, "drone")) << fine;
  for (const char* foreign : {"", "evil.example", "localhost.evil.example", "drone.evil.example", "127.0.0.1.evil.example:80",
                              "[::1", "[::1]x", ".local"})
    EXPECT_FALSE(host_allowed(foreign, "drone")) << foreign;
  EXPECT_FALSE(host_allowed("", ""));
  EXPECT_FALSE(host_allowed(".local", ""));
}

TEST(Origin, IsTheHostItself) {
  EXPECT_TRUE(origin_allowed("", "127.0.0.1:8080"));
  EXPECT_TRUE(origin_allowed("http://127.0.0.1:8080", "127.0.0.1:8080"));
  for (const char* foreign :
       {"http://127.0.0.1:8081", "http://127.0.0.1", "https://127.0.0.1:8080", "http://evil.example", "null"})
    EXPECT_FALSE(origin_allowed(foreign, "127.0.0.1:8080")) << foreign;
}

TEST(Token, IsComparedWhole) {
  EXPECT_TRUE(token_equal("secret", "secret"));
  for (const char* wrong : {"", "s", "secre", "secretsecret", "secrex", "Secret"})
    EXPECT_FALSE(token_equal(wrong, "secret")) << wrong;
  EXPECT_EQ(token_of("/stream?token=abc"), "abc");
  EXPECT_EQ(token_of("/stream?x=1&token=abc&y=2"), "abc");
  EXPECT_EQ(token_of("/stream?xtoken=abc"), "");
  EXPECT_EQ(token_of("/stream"), "");
  EXPECT_EQ(make_token()->size(), 32u);
  EXPECT_NE(*make_token(), *make_token());
  EXPECT_TRUE(token_usable(*make_token()));
  EXPECT_FALSE(token_usable("short"));
  EXPECT_FALSE(token_usable("with a blank"));
}

}  // namespace web_access_test
}  // namespace fbvins
