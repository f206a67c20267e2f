// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/web_server.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <thread>

#include "tests/support/web_test_client.hpp"

namespace fbvins {
namespace web_server_test {

using namespace std::chrono_literals;

constexpr const char* kAsk = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";

SharedMessage text(const std::string& bytes) { return std::make_shared<const WebMessage>(WebMessage{bytes}); }

PageFiles a_page() { return {{"/index.html", "text/html", "<p>hello</p>"}, {"/main.js", "text/javascript", "go()"}}; }

class Server : public testing::Test {
 protected:
  void start(WebOptions options = {}) {
    auto made = WebServer::start(options, a_page(),
                                 {.greet = [] { return std::vector{text("greeting")}; },
                                  .command =
                                      [this](std::string_view said) {
                                        const std::lock_guard lock(mutex);
                                        heard.emplace_back(said);
                                      }});
    ASSERT_TRUE(made) << made.error().message;
    server = *std::move(made);
  }
  std::string ask(const std::string& request) { return TestPeer(server->port()).ask(request); }
  template <class Fact>
  bool comes_true(const Fact& fact, std::chrono::milliseconds patience = 5s) {
    for (const auto end = std::chrono::steady_clock::now() + patience; std::chrono::steady_clock::now() < end;) {
      if (fact()) return true;
      std::this_thread::sleep_for(2ms);
    }
    return false;
  }
  void expect_works() { EXPECT_NE(ask(kAsk).find("<p>hello</p>"), std::string::npos); }

  std::mutex mutex;
  std::vector<std::string> heard;
  std::unique_ptr<WebServer> server;
};

TEST_F(Server, GivesItsFilesAndNothingElse) {
  start();
  const std::string answer = ask(kAsk);
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200 ")) << answer;
  for (const char* line : {"Content-Type: text/html", "Content-Security-Policy: default-src 'none'",
                           "X-Content-Type-Options: nosniff", "X-Frame-Options: DENY"})
    EXPECT_NE(answer.find(line), std::string::npos) << line;
  EXPECT_NE(ask("GET /main.js?x HTTP/1.1\r\nHost: localhost\r\n\r\n").find("go()"), std::string::npos);
  EXPECT_EQ(ask("HEAD / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").find("hello"), std::string::npos);
  for (const char* path :
       {"/../main.js", "/%2e%2e/main.js", "//etc/passwd", "/etc/passwd", "/index.html/", "/main.js%00", "/stream/"})
    EXPECT_TRUE(ask(std::string("GET ") + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n").starts_with("HTTP/1.1 404 ")) << path;
  EXPECT_TRUE(ask("DELETE / HTTP/1.1\r\nHost: localhost\r\n\r\n").starts_with("HTTP/1.1 405 "));
  EXPECT_TRUE(ask("GET /stream HTTP/1.1\r\nHost: localhost\r\n\r\n").starts_with("HTTP/1.1 426 "));
}

TEST_F(Server, AnswersOneConnectionAgain) {
  start();
  TestPeer peer(server->port());
  for (int i = 0; i < 3; ++i) EXPECT_NE(peer.ask(kAsk).find("<p>hello</p>"), std::string::npos);
}

TEST_F(Server, RefusesForeignNamesAndForeignPages) {
  start();
  for (const char* request : {"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n", "GET / HTTP/1.1\r\n\r\n",
                              "GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\n\r\n"})
    EXPECT_TRUE(ask(request).starts_with("HTTP/1.1 403 ")) << request;
  EXPECT_TRUE(TestPeer(server->port()).watch("evil.example").starts_with("HTTP/1.1 403 "));
  EXPECT_TRUE(TestPeer(server->port()).watch("localhost:1", "Origin: http://localhost:2\r\n").starts_with("HTTP/1.1 403 "));
  EXPECT_TRUE(TestPeer(server->port()).watch("localhost:1", "Origin: http://localhost:1\r\n").starts_with("HTTP/1.1 101 "));
}

TEST_F(Server, WantsTheTokenOfEveryViewer) {
  WebOptions options;
  options.token = "0123456789abcdef";
  start(options);
  expect_works();  // the page itself is no secret
  EXPECT_TRUE(TestPeer(server->port()).watch().starts_with("HTTP/1.1 401 "));
  EXPECT_TRUE(TestPeer(server->port()).watch("localhost", "", "/stream?token=0123456789abcdee").starts_with("HTTP/1.1 401 "));
  EXPECT_TRUE(TestPeer(server->port()).watch("localhost", "", "/stream?token=0123456789abcdef").starts_with("HTTP/1.1 101 "));
}

TEST_F(Server, GreetsAndStreamsToTenViewers) {
  start();
  std::vector<std::unique_ptr<TestPeer>> peers;
  for (int i = 0; i < 10; ++i) {
    peers.push_back(std::make_unique<TestPeer>(server->port()));
    ASSERT_TRUE(peers.back()->watch().starts_with("HTTP/1.1 101 "));
    EXPECT_EQ(peers.back()->message(), "greeting");
  }
  EXPECT_EQ(server->viewers(), 10);
  for (int i = 0; i < 100; ++i) server->send(text(std::to_string(i)));
  for (const auto& peer : peers)
    for (int i = 0; i < 100; ++i) ASSERT_EQ(peer->message(), std::to_string(i));
  peers.clear();
  EXPECT_TRUE(comes_true([&] { return server->viewers() == 0; }));
}

TEST_F(Server, TakesCommandsAndDropsThoseWhoSendTooMuch) {
  start();
  TestPeer peer(server->port());
  peer.watch();
  peer.say("one");
  peer.say(std::string(1000, 'x'));
  EXPECT_TRUE(comes_true([&] { return std::lock_guard(mutex), heard.size() == 2; }));
  EXPECT_EQ(heard[0], "one");
  TestPeer talker(server->port());
  talker.watch();
  for (int i = 0; i < 500 && talker.say("again"); ++i) {
  }
  EXPECT_TRUE(talker.closed_within(2s));
  TestPeer shouter(server->port());
  shouter.watch();
  shouter.say(std::string(5000, 'x'));
  EXPECT_TRUE(shouter.closed_within(2s));
  EXPECT_TRUE(comes_true([&] { return server->viewers() == 1; }));
}

TEST_F(Server, LimitsViewersAndHeaders) {
  start({.most_viewers = 1});
  TestPeer first(server->port());
  first.watch();
  EXPECT_EQ(first.message(), "greeting");
  EXPECT_TRUE(TestPeer(server->port()).watch().starts_with("HTTP/1.1 503 "));
  TestPeer wordy(server->port());
  wordy.send("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(20'000, 'x'));
  EXPECT_TRUE(wordy.closed_within(2s));
  expect_works();
}

TEST_F(Server, DropsThoseWhoSendNothing) {
  start({.header_patience = 200ms});
  TestPeer silent(server->port());
  EXPECT_TRUE(silent.closed_within(5s));
  TestPeer slow(server->port());
  slow.send("GET / HT");
  EXPECT_TRUE(slow.closed_within(5s));
}

/// Ten times as many as it takes, each with half a request, and nobody's time runs out.
TEST_F(Server, SlowConnectionsKeepNobodyOut) {
  start({.most_connections = 16, .header_patience = 1h, .patience = 1h});
  TestPeer viewer(server->port());
  viewer.watch();
  EXPECT_EQ(viewer.message(), "greeting");
  std::vector<std::unique_ptr<TestPeer>> slow;
  for (int i = 0; i < 160; ++i) {
    slow.push_back(std::make_unique<TestPeer>(server->port()));
    if (i % 2 == 0) slow.back()->send("GET / HT");
    if (i % 40 == 39) expect_works();
  }
  EXPECT_TRUE(slow.front()->closed_within(5s)) << "the oldest made room";
  server->send(text("still here"));
  EXPECT_EQ(viewer.message(), "still here") << "viewers are never dropped for newcomers";
}

TEST_F(Server, OneThatDoesNotReadIsDroppedAndTheOthersGoOn) {
  start({.patience = 300ms});
  TestPeer stuck(server->port()), reader(server->port());
  stuck.watch();
  reader.watch();
  EXPECT_EQ(reader.message(), "greeting");
  ASSERT_TRUE(comes_true([&] { return server->viewers() == 2; }));
  const SharedMessage large = text(std::string(100'000, 'x'));
  std::chrono::nanoseconds longest{0};
  int read = 0;
  for (int i = 0; i < 1000 && server->dropped_viewers() == 0; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    server->send(large);
    longest = std::max(longest, std::chrono::steady_clock::now() - begin);
    ASSERT_TRUE(reader.message());
    ++read;
    std::this_thread::sleep_for(5ms);
  }
  EXPECT_EQ(server->dropped_viewers(), 1);
  EXPECT_TRUE(comes_true([&] { return server->viewers() == 1; }));
  EXPECT_GT(read, 10);
}

TEST_F(Server, GarbageEndsAConnectionAndNothingElse) {
  start();
  std::mt19937 random(1);
  for (int i = 0; i < 500; ++i) {
    std::string bytes(random() % 2000, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    if (i % 3 == 0) bytes = "GET /stream HTTP/1.1\r\n" + bytes;
    TestPeer peer(server->port());
    if (i % 3 == 1) peer.watch();  // garbage inside of the stream
    peer.send(bytes + "\r\n\r\n");
  }
  expect_works();
  EXPECT_TRUE(comes_true([&] { return server->viewers() == 0; }));
}

std::size_t open_files() {
  const std::filesystem::directory_iterator all("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

/// FBVINS_WEB_CONNECTIONS=100000 for the full number.
TEST_F(Server, ManyConnectionsInARowLeaveNothingBehind) {
  start();
  expect_works();
  const char* wanted = std::getenv("FBVINS_WEB_CONNECTIONS");
  const int connections = wanted ? std::atoi(wanted) : 3000;
  const std::size_t before = open_files();
  int connected = 0;
  for (int i = 0; i < connections; ++i) {
    TestPeer peer(server->port());
    connected += peer.connected() ? 1 : 0;
    if (i % 4 == 1) peer.send(kAsk);
    if (i % 4 == 2) peer.send("GET /stream HTTP/1.1\r\n");
    if (i % 4 == 3) peer.ask(kAsk);
  }
  EXPECT_EQ(connected, connections);
  EXPECT_TRUE(comes_true([&] { return open_files() <= before; })) << before << " before, " << open_files() << " now";
  expect_works();
}

TEST_F(Server, SaysWhyItCannotListen) {
  start();
  const auto second = WebServer::start({.address = {"127.0.0.1", server->port()}}, a_page(), {});
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("the page cannot be served at 127.0.0.1 port"), std::string::npos);
}

TEST_F(Server, AnAddressInUseIsTriedAgain) {
  start();
  const std::uint16_t port = server->port();
  auto second = WebServer::start({.address = {"127.0.0.1", port}, .try_again = 10ms}, a_page(), {});
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ((*second)->port(), 0);
  EXPECT_NE((*second)->problem().find("cannot be served"), std::string::npos) << (*second)->problem();
  (*second)->send(text("to nobody"));
  server.reset();
  ASSERT_TRUE(comes_true([&] { return (*second)->problem().empty(); }, 30s));
  server = *std::move(second);
  EXPECT_EQ(server->port(), port);
  expect_works();
}

TEST_F(Server, EndsWithViewersAndSendingThreads) {
  start();
  TestPeer peer(server->port());
  peer.watch();
  ASSERT_TRUE(comes_true([&] { return server->viewers() == 1; }));
  std::jthread sender([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) server->send(text("again"));
  });
  std::this_thread::sleep_for(50ms);
  server->stop();
  std::this_thread::sleep_for(20ms);
  sender.request_stop();
  sender.join();
  server.reset();
}

}  // namespace web_server_test
}  // namespace fbvins
