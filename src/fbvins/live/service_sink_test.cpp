// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/service_sink.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>

namespace fbvins {
namespace service_sink_test {

/// A service manager's end: a datagram socket of the abstract namespace.
class Manager {
 public:
  Manager()
      : name_("fbvins-service-test-" + std::to_string(getpid())), socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    std::memcpy(at.sun_path + 1, name_.data(), name_.size());
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name_.size());
    EXPECT_EQ(bind(socket_.number(), reinterpret_cast<const sockaddr*>(&at), length), 0);
  }
  std::string address() const { return "@" + name_; }
  /// The next message; empty: there is none.
  std::string told() const {
    char text[512];
    const ssize_t length = recv(socket_.number(), text, sizeof text, 0);
    return length < 0 ? "" : std::string(text, static_cast<std::size_t>(length));
  }

 private:
  std::string name_;
  FileDescriptor socket_;
};

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

LiveStatus status_at(double host_s, std::int64_t images, std::int64_t answers) {
  LiveStatus status;
  status.host_t = Time{} + Duration::from_seconds(host_s);
  status.health = {HealthState::good, HealthReason::none};
  status.counts.images = images;
  status.counts.images_estimated = answers;
  return status;
}

bool has(const std::string& message, const std::string& line) {
  return ("\n" + message).find("\n" + line + "\n") != std::string::npos;
}

TEST(ServiceSink, SaysReadyOnceAndGivesASignOfLifeAtEveryStatus) {
  const Manager manager;
  const File journal(std::tmpfile());
  auto sink = ServiceSink::create(manager.address(), journal.get());
  ASSERT_TRUE(sink) << sink.error().message;
  for (int k = 1; k <= 5; ++k) {
    ASSERT_TRUE((*sink)->take(status_at(k, 20 * k, 20 * k)));
    const std::string message = manager.told();
    EXPECT_EQ(has(message, "READY=1"), k == 1) << message;
    EXPECT_TRUE(has(message, "WATCHDOG=1")) << message;
    EXPECT_TRUE(has(message, "STATUS=good")) << message;
  }
  ASSERT_TRUE((*sink)->finish());
  EXPECT_EQ(manager.told(), "STOPPING=1\n");
}

/// What the service manager restarts for is an estimator that takes images and answers none, whatever is dropped before it.
TEST(ServiceSink, AHungEstimatorGivesNoSignOfLifeUntilItAnswers) {
  const Manager manager;
  const File journal(std::tmpfile());
  auto sink = ServiceSink::create(manager.address(), journal.get());
  ASSERT_TRUE(sink);
  const auto lives_at = [&](const LiveStatus& status) {
    EXPECT_TRUE((*sink)->take(status));
    return has(manager.told(), "WATCHDOG=1");
  };
  EXPECT_TRUE(lives_at(status_at(1, 20, 20)));
  EXPECT_TRUE(lives_at(status_at(2, 40, 22)));
  EXPECT_TRUE(lives_at(status_at(3, 60, 22)));
  for (int k = 5; k < 20; ++k) EXPECT_FALSE(lives_at(status_at(k, 20 * k, 22))) << k;
  EXPECT_TRUE(lives_at(status_at(20, 400, 23)));
}

TEST(ServiceSink, TheFirstImagesMayTakeTheirTimeToo) {
  const Manager manager;
  const File journal(std::tmpfile());
  auto sink = ServiceSink::create(manager.address(), journal.get());
  ASSERT_TRUE(sink);
  for (const double t_s : {100.0, 102.0, 104.0}) {
    ASSERT_TRUE((*sink)->take(status_at(t_s, 20, 0)));
    EXPECT_TRUE(has(manager.told(), "WATCHDOG=1")) << t_s;
  }
  ASSERT_TRUE((*sink)->take(status_at(108, 40, 0)));
  EXPECT_FALSE(has(manager.told(), "WATCHDOG=1"));
}

TEST(ServiceSink, SilentSensorsAreNoReasonForARestart) {
  const Manager manager;
  const File journal(std::tmpfile());
  auto sink = ServiceSink::create(manager.address(), journal.get());
  ASSERT_TRUE(sink);
  for (int k = 1; k < 20; ++k) {
    LiveStatus status = status_at(k, 20, 20);
    status.health = {HealthState::degraded, HealthReason::no_images};
    status.counts.images += k;  // one camera goes on alone
    status.counts.images_incomplete = k;
    ASSERT_TRUE((*sink)->take(status));
    EXPECT_TRUE(has(manager.told(), "WATCHDOG=1")) << k;
  }
}

TEST(ServiceSink, TheJournalGetsChangesWithTheirLevelAndNotMoreThanOneASecond) {
  const Manager manager;
  const File journal(std::tmpfile());
  auto sink = ServiceSink::create(manager.address(), journal.get());
  ASSERT_TRUE(sink);
  for (int k = 0; k < 100; ++k) {  // ten seconds, health flickers ten times a second in the middle three
    LiveStatus status = status_at(1 + 0.1 * k, k, k);
    if (k >= 40 && k < 70 && k % 2 == 0) status.health = {HealthState::degraded, HealthReason::no_images};
    ASSERT_TRUE((*sink)->take(status));
  }
  LiveStatus lost = status_at(20, 100, 100);
  lost.health = {HealthState::lost, HealthReason::no_images};
  ASSERT_TRUE((*sink)->take(lost));
  std::rewind(journal.get());
  std::string text(4096, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), journal.get()));
  EXPECT_EQ(text, "<6>good\n<4>degraded: no_images\n<6>good\n<4>degraded: no_images\n<6>good\n<3>lost: no_images\n");
}

TEST(ServiceSink, ALineBreakInAProblemIsNotAMessageOfItsOwn) {
  const Manager manager;
  const File journal(std::tmpfile());
  auto sink = ServiceSink::create(manager.address(), journal.get());
  ASSERT_TRUE(sink);
  LiveStatus status = status_at(1, 0, 0);
  status.problem = "no cable\nWATCHDOG=trigger";
  ASSERT_TRUE((*sink)->take(status));
  EXPECT_TRUE(has(manager.told(), "STATUS=good; no cable WATCHDOG=trigger"));
}

TEST(ServiceSink, AWrongAddressIsOneSentence) {
  for (const char* address : {"", "x", "relative/path", "/no/such/socket"}) {
    const auto sink = ServiceSink::create(address, stderr);
    ASSERT_FALSE(sink) << address;
    EXPECT_NE(sink.error().message.find("NOTIFY_SOCKET="), std::string::npos);
  }
  EXPECT_FALSE(ServiceSink::create("/" + std::string(200, 'x'), stderr));
}

}  // namespace service_sink_test
}  // namespace fbvins
