// SPDX-License-Identifier: Apache-2.0
#include "apps/kept_map.hpp"

#include <gtest/gtest.h>

#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <vector>

#include "tests/support/test_files.hpp"

namespace fbvins::app {
namespace kept_map_test {

class CountingMapper final : public Mapper {
 public:
  MapUpdate process(const Keyframe& keyframe) override {
    ++keyframes;
    MapUpdate update;
    update.t = keyframe.t;
    return update;
  }
  int keyframes = 0;
};

/// A disk that finishes a file only when it is told to.
class SlowDisk {
 public:
  Result<void> write(const std::string& path, std::string_view bytes) {
    std::unique_lock lock(mutex_);
    begun_.emplace_back(path, bytes);
    changed_.notify_all();
    changed_.wait(lock, [&] { return open_ || allowed_ >= begun_.size(); });
    return result_;
  }
  void wait_for_begin(std::size_t files) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return begun_.size() >= files; });
  }
  void finish(std::size_t files) {
    const std::lock_guard lock(mutex_);
    allowed_ = files;
    changed_.notify_all();
  }
  void open(Result<void> result = {}) {
    const std::lock_guard lock(mutex_);
    result_ = std::move(result);
    open_ = true;
    changed_.notify_all();
  }
  std::vector<std::pair<std::string, std::string>> begun() {
    const std::lock_guard lock(mutex_);
    return begun_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::pair<std::string, std::string>> begun_;
  std::size_t allowed_ = 0;
  bool open_ = false;
  Result<void> result_;
};

Keyframe at_s(double t_s) {
  Keyframe keyframe;
  keyframe.t = Time{1'000'000'000} + Duration::from_seconds(t_s);
  return keyframe;
}

class KeptMapTest : public ::testing::Test {
 protected:
  ~KeptMapTest() override { disk.open(); }

  CountingMapper mapper;
  SlowDisk disk;
  KeptMap kept{mapper,
               {.whole = [this] { return "map of " + std::to_string(mapper.keyframes); },
                .news =
                    [this](bool anew) {
                      if (mapper.keyframes == told_of) return std::string();
                      told_of = mapper.keyframes;
                      return (anew ? "anew " : "news ") + std::to_string(mapper.keyframes);
                    }},
               "flat.fbm",
               [this](const std::string& path, std::string_view bytes) { return disk.write(path, bytes); }};
  int told_of = 0;
};

TEST_F(KeptMapTest, ASlowDiskHoldsUpNoKeyframeAndTheNewestMapIsNext) {
  kept.process(at_s(0));
  kept.process(at_s(29));
  kept.process(at_s(31));
  disk.wait_for_begin(1);
  for (int second = 32; second < 300; ++second) EXPECT_EQ(kept.process(at_s(second)).t, at_s(second).t);
  ASSERT_EQ(disk.begun().size(), 1u) << "one file at a time, and no map waits in memory";
  EXPECT_EQ(disk.begun()[0].second, "news 3");
  disk.finish(1);
  kept.finish();
  kept.process(at_s(300));
  disk.wait_for_begin(2);
  EXPECT_EQ(disk.begun()[1].first, "flat.fbm");
  EXPECT_EQ(disk.begun()[1].second, "news 272");
}

TEST_F(KeptMapTest, AfterNewsThatWereLostAllIsWrittenAgain) {
  disk.open(Error{ErrorCode::unwritable, "full"});
  for (const int second : {0, 31, 62}) kept.process(at_s(second)), kept.wait();
  disk.open();
  for (const int second : {93, 124}) kept.process(at_s(second)), kept.wait();
  std::vector<std::string> written;
  for (const auto& [path, bytes] : disk.begun()) written.push_back(bytes);
  EXPECT_EQ(written, (std::vector<std::string>{"news 2", "anew 3", "anew 4", "news 5"}));
}

TEST_F(KeptMapTest, WhoAsksForTheKeptMapGetsItsNewsAndIsToldAtOnceWhereThereAreNone) {
  std::vector<bool> told;
  kept.save_requested_to("flat.fbm");
  disk.open();
  for (const int second : {0, 1}) {
    kept.request_save([&](const Result<void>& saved) { told.push_back(saved.ok()); });
    kept.process(at_s(second));
    kept.wait();
    told_of = mapper.keyframes + 1;  // nothing changes with the next one
  }
  EXPECT_EQ(told, (std::vector<bool>{true, true}));
  ASSERT_EQ(disk.begun().size(), 1u);
  EXPECT_EQ(disk.begun()[0], (std::pair<std::string, std::string>{"flat.fbm", "news 1"}));
}

TEST_F(KeptMapTest, ARequestedMapIsToldWhenItIsWritten) {
  std::vector<bool> told;
  std::mutex mutex;
  const KeptMap::Told note = [&](const Result<void>& saved) {
    const std::lock_guard lock(mutex);
    told.push_back(saved.ok());
  };
  kept.save_requested_to("wish.fbm");
  kept.request_save(note);
  kept.process(at_s(0));
  kept.request_save(note);
  disk.wait_for_begin(1);
  kept.process(at_s(1));
  EXPECT_TRUE((std::lock_guard(mutex), told.empty()));
  disk.open(Error{ErrorCode::unwritable, "full"});
  kept.wait();
  kept.process(at_s(2));
  kept.finish();
  EXPECT_EQ(told, (std::vector<bool>{false, false})) << "the second wish was not lost";
  EXPECT_EQ(disk.begun()[1].first, "wish.fbm");
  EXPECT_EQ(disk.begun()[1].second, "map of 3");
}

TEST_F(KeptMapTest, OneFileServesAllWhoAskedAndTheEndTellsTheRest) {
  std::vector<std::string> told;
  const auto note = [&](const char* who) {
    return [&told, who](const Result<void>& saved) { told.push_back(who + std::string(saved ? ": saved" : ": not")); };
  };
  kept.save_requested_to("wish.fbm");
  kept.request_save(note("page"));
  kept.request_save(note("ROS"));
  disk.open();
  kept.process(at_s(0));
  kept.finish();
  EXPECT_EQ(told, (std::vector<std::string>{"page: saved", "ROS: saved"}));
  EXPECT_EQ(disk.begun().size(), 1u);
  kept.request_save(note("late"));
  kept.finish();
  EXPECT_EQ(told.back(), "late: not");
}

TEST_F(KeptMapTest, AMapOfWhichAPartCannotBeReadIsToldAndNotWritten) {
  KeptMap unreadable(mapper,
                     {.whole = []() -> Result<std::string> {
                        return Error{ErrorCode::malformed, "flat.fbm: damaged map"};
                      },
                      .news = {}},
                     "", [this](const std::string& path, std::string_view bytes) { return disk.write(path, bytes); });
  unreadable.save_requested_to("wish.fbm");
  std::string told;
  unreadable.request_save([&](const Result<void>& saved) { told = saved ? "saved" : saved.error().message; });
  unreadable.process(at_s(0));
  EXPECT_EQ(told, "flat.fbm: damaged map");
  EXPECT_TRUE(disk.begun().empty());
}

TEST_F(KeptMapTest, WhatIsAskedForIsDoneBeforeTheNextKeyframe) {
  std::vector<int> keyframes;
  kept.process(at_s(0));
  const auto act = [&] { keyframes.push_back(mapper.keyframes); };
  EXPECT_TRUE(kept.before_next_keyframe(act));
  EXPECT_FALSE(kept.before_next_keyframe(act)) << "one at a time";
  EXPECT_TRUE(keyframes.empty());
  kept.process(at_s(1));
  kept.process(at_s(2));
  EXPECT_EQ(keyframes, std::vector<int>{1}) << "once";
}

class MakeKeptMap : public ::testing::Test {
 protected:
  static StereoRig rig() {
    StereoRig r;
    r.cameras.assign(2, {Camera(PinholeRadtan{400, 400, 376, 240}, 752, 480), {}});
    r.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
    return r;
  }
  const test::Folder own_folder{"kept_map"};
  const std::string folder = own_folder.path();
  const std::string file = folder + "/flat.fbm";
};

TEST_F(MakeKeptMap, ADamagedFileIsSetAsideAndTheFlightKeepsANewMap) {
  std::ofstream(file) << "rubbish";
  std::ofstream(file + ".journal") << "of it";
  MapArguments arguments;
  arguments.load = arguments.save = file;
  const auto map = make_kept_map(arguments, rig(), {});
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ((*map)->keyframes(), 0);
  EXPECT_EQ(arguments.save, file);
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_EQ(std::filesystem::file_size(file + ".bad"), 7u);
  EXPECT_FALSE(std::filesystem::exists(file + ".journal"));
  EXPECT_EQ(std::filesystem::file_size(file + ".bad.journal"), 5u) << "they belong together";
}

TEST_F(MakeKeptMap, AFileWithDamageFoundInFlightIsSetAsideAfterIt) {
  std::ofstream(file) << "a map";
  std::ofstream(file + ".journal") << "of it";
  retire_kept_map(file, "flat.fbm: damaged map: keyframe 7 is not as it was written");
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_FALSE(std::filesystem::exists(file + ".journal"));
  EXPECT_EQ(std::filesystem::file_size(file + ".bad"), 5u);
  EXPECT_EQ(std::filesystem::file_size(file + ".bad.journal"), 5u);
}

TEST_F(MakeKeptMap, WithoutAFolderTheFlightHasAMapAndKeepsNone) {
  MapArguments arguments;
  arguments.save = folder + "/unplugged/flat.fbm";
  const auto map = make_kept_map(arguments, rig(), {});
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_TRUE(*map);
  EXPECT_EQ(arguments.save, "");
}

TEST_F(MakeKeptMap, WhatIsNotTheOldFilesFaultStaysAnError) {
  std::ofstream(file) << "rubbish";
  MapArguments arguments{.load = file, .save = file, .vocabulary = folder + "/none.fbv"};
  EXPECT_FALSE(make_kept_map(arguments, rig(), {}));
  EXPECT_TRUE(std::filesystem::exists(file)) << "not set aside";
}

}  // namespace kept_map_test
}  // namespace fbvins::app
