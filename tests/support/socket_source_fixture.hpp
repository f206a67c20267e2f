// SPDX-License-Identifier: Apache-2.0
// For tests of the socket: a source that runs in a thread, and what it delivers.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "fbvins/live/socket_source.hpp"
#include "tests/support/socket_test_sender.hpp"

namespace fbvins::socket_source_fixture {

using namespace std::chrono_literals;
using test::bytes_of;
using test::hello_message;
using test::TestSender;

/// Keeps what arrives, for a test to wait for.
class Inbox final : public SensorInput {
 public:
  void push(const ImuSample& sample) override {
    change([&] { readings_.push_back(sample); });
  }
  void push(StereoFrame frame) override {
    change([&] { frames_.push_back(std::move(frame)); });
  }
  void push_anchor(Anchor anchor) override {
    change([&] { anchors_.push_back(std::move(anchor)); });
  }
  void say(const std::string& what) {
    change([&] { said_.push_back(what); });
  }

  std::vector<ImuSample> readings(std::size_t count) { return wait_for(readings_, count); }
  std::vector<Anchor> anchors(std::size_t count) { return wait_for(anchors_, count); }
  std::vector<StereoFrame> frames(std::size_t count) { return wait_for(frames_, count); }
  void drop_frames() {
    change([&] { frames_.clear(); });
  }
  /// True if a message with these words comes within ten seconds.
  bool hears(const std::string& words) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, 10s, [&] {
      return std::any_of(said_.begin(), said_.end(), [&](const auto& s) { return s.find(words) != std::string::npos; });
    });
  }

 private:
  void change(const auto& what) {
    const std::lock_guard lock(mutex_);
    what();
    changed_.notify_all();
  }
  template <class T>
  std::vector<T> wait_for(const std::vector<T>& values, std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, 10s, [&] { return values.size() >= count; });
    return values;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<ImuSample> readings_;
  std::vector<StereoFrame> frames_;
  std::vector<Anchor> anchors_;
  std::vector<std::string> said_;
};

class SocketSourceTest : public testing::Test {
 protected:
  /// A machine may be too busy to say hello at once, or for ten seconds; a sender that never comes must not hang the test.
  void open(std::optional<StereoRig> rig, double hello_s = 30) {
    const auto begin = std::chrono::steady_clock::now();
    auto source = SocketSource::open(path(), {.rig = std::move(rig),
                                              .say = [this](const auto& what) { inbox_.say(what); },
                                              .give_up = [=] { return std::chrono::steady_clock::now() - begin > 60s; },
                                              .hello_s = hello_s});
    ASSERT_TRUE(source) << source.error().message;
    source_ = *std::move(source);
    status_ = source_->status_sink();
    thread_ = std::thread([this] { EXPECT_TRUE(source_->run(inbox_)); });
  }
  void SetUp() override { open(test::socket_test_rig()); }
  void TearDown() override { end(); }
  void end() {
    if (!thread_.joinable()) return;
    source_->stop();
    thread_.join();
    source_.reset();
  }
  std::string path() const { return folder_.path(); }
  /// The source's answer to this first message.
  std::string refusal(const FbvinsSocketHello& hello, const FileDescriptor& memory, int copies = 1) {
    TestSender sender(path());
    sender.send(bytes_of(hello), memory.number(), copies);
    EXPECT_EQ(sender.answer(), std::uint32_t{FBVINS_SOCKET_GOODBYE});
    return sender.last<FbvinsSocketGoodbye>().text;
  }
  /// A good sender is still served.
  void expect_service(std::int64_t t_ns = 77) {
    TestSender sender(path());
    ASSERT_EQ(sender.begin(), std::uint32_t{FBVINS_SOCKET_WELCOME});
    inbox_.drop_frames();
    sender.send_frame(t_ns, 0, 1);
    const auto frames = inbox_.frames(1);
    ASSERT_EQ(frames.size(), 1u);
    EXPECT_EQ(frames[0].t, Time{t_ns});
  }

  test::SocketFolder folder_;
  Inbox inbox_;
  std::unique_ptr<SocketSource> source_;
  std::unique_ptr<Sink> status_;
  std::thread thread_;
};

}  // namespace fbvins::socket_source_fixture
