// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/web_routes.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace web_routes_test {

const PageFiles kFiles{{"/index.html", "text/html", "<p>", false}, {"/main.js", "text/javascript", "zipped", true}};

int status(const WebRequest& request, const WebOptions& options = {}, std::size_t viewers = 0) {
  return answer_to(request, options, kFiles, "drone", viewers).status;
}

TEST(WebRoutes, GiveTheFilesByTheirNames) {
  const WebAnswer page = answer_to({.host = "127.0.0.1:80", .target = "/?a=b", .reads = true}, {}, kFiles, "drone", 0);
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.bytes, "<p>");
  const WebAnswer script = answer_to({.host = "drone.local", .target = "/main.js", .reads = true}, {}, kFiles, "drone", 0);
  EXPECT_EQ(script.type, "text/javascript");
  EXPECT_TRUE(script.gzip);
  EXPECT_EQ(status({.host = "127.0.0.1", .target = "/../main.js", .reads = true}), 404);
  EXPECT_EQ(status({.host = "127.0.0.1", .target = "/main.js"}), 405);
}

TEST(WebRoutes, ForeignNamesAndPagesAreRefusedBeforeAnythingElse) {
  EXPECT_EQ(status({.host = "example.org", .target = "/stream", .upgrades = true}), 403);
  EXPECT_EQ(status({.host = "127.0.0.1", .origin = "http://example.org", .target = "/stream", .upgrades = true}), 403);
}

TEST(WebRoutes, TheStreamWantsTokenUpgradeAndRoom) {
  WebOptions options;
  options.token = "0123456789abcdef", options.most_viewers = 2;
  const WebRequest good{.host = "127.0.0.1", .target = "/stream?token=0123456789abcdef", .upgrades = true};
  EXPECT_EQ(status(good, options, 1), 101);
  EXPECT_EQ(status(good, options, 2), 503);
  WebRequest request = good;
  request.upgrades = false;
  EXPECT_EQ(status(request, options), 426);
  request = good, request.target = "/stream?token=0123456789abcdee";
  EXPECT_EQ(status(request, options), 401);
}

}  // namespace web_routes_test
}  // namespace fbvins
