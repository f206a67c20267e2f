// SPDX-License-Identifier: Apache-2.0
// Damaged recordings of which open_dataset delivers everything that is intact, with a count of what was left out.
#include "tests/broken_datasets/delivered.hpp"

namespace fbvins::test {
namespace skipped_datasets_test {

struct Skipped {
  const char* name;
  Damage damage;
  const char* outcome;  ///< frames/left/right/IMU; what was left out
  int warnings = 1;
};

void PrintTo(const Skipped& c, std::ostream* out) { *out << c.name; }

const Skipped kSkipped[] = {
    {"Whole", [](Files&) {}, "20/20/20/221", 0},
    {"WindowsText",
     [](Files& f) {
       for (const char* name : {kCam0, kCam1, kImu, kTruth}) {
         edit(f, name, [](Lines& l) {
           for (auto& s : l) s += "\r";
           l.insert(l.begin() + 2, "# a remark\r");
           l.push_back("\r");
           l.push_back("  ");
         });
         f[name] = "\xEF\xBB\xBF" + f[name];
       }
     },
     "20/20/20/221", 0},
    {"HeaderWithoutHash",
     [](Files& f) {
       for (const char* name : {kCam0, kCam1, kImu, kTruth}) f[name].erase(0, 1);
     },
     "20/20/20/221", 0},
    {"NoNewlineAtTheEnd",
     [](Files& f) {
       for (const char* name : {kCam0, kCam1, kImu, kTruth}) f[name].pop_back();
     },
     "20/20/20/221", 0},
    {"ImageTwice", [](Files& f) { edit(f, kCam0, [](Lines& l) { l.insert(l.begin() + 5, l[4]); }); },
     "20/20/20/221; left: 1 duplicate, first line 6"},
    {"ImageOutOfOrder", [](Files& f) { edit(f, kCam0, [](Lines& l) { std::swap(l[7], l[9]); }); },
     "20/18/20/221; left: 2 backwards, first line 9; right: 2 unpaired", 2},
    {"ImageFromTheFuture", [](Files& f) { edit(f, kCam0, [](Lines& l) { l[3][1] = '7'; }); },
     "20/19/20/221; left: 1 backwards, first line 4; right: 1 unpaired", 2},
    {"ImuTwice", [](Files& f) { edit(f, kImu, [](Lines& l) { l.insert(l.begin() + 5, 3, l[4]); }); },
     "20/20/20/221; imu: 3 duplicate, first line 6"},
    {"ImuOutOfOrder",
     [](Files& f) {
       edit(f, kImu, [](Lines& l) {
         l.insert(l.begin() + 50, l[10]);
         l.insert(l.begin() + 100, l[20]);
       });
     },
     "20/20/20/221; imu: 2 backwards, first line 51"},
    {"ImuFromTheFuture", [](Files& f) { edit(f, kImu, [](Lines& l) { l[3][1] = '7'; }); },
     "20/20/20/220; imu: 1 backwards, first line 4"},
    {"ImuNaN",
     [](Files& f) {
       edit(f, kImu, [](Lines& l) {
         replace(l[30], "9.8", "nan");
         replace(l[31], "0.01", "-NaN");
       });
     },
     "20/20/20/219; imu: 2 not finite, first line 31"},
    {"ImuInfiniteAndHuge",
     [](Files& f) {
       edit(f, kImu, [](Lines& l) {
         replace(l[30], "9.8", "inf");
         replace(l[40], "9.8", "1e30");
       });
     },
     "20/20/20/219; imu: 2 not finite, first line 31"},
    {"ImuWrongColumns",
     [](Files& f) {
       edit(f, kImu, [](Lines& l) {
         l[10] += ",1";
         l[12] = l[12].substr(0, 30);
         l[14] = "x";
       });
     },
     "20/20/20/218; imu: 3 malformed, first line 11"},
    {"ImuLettersAndEmptyFields",
     [](Files& f) {
       edit(f, kImu, [](Lines& l) {
         replace(l[10], "0.01", "0.o1");
         replace(l[11], "0.01", "");
         replace(l[12], "0.01", "0x1");
       });
     },
     "20/20/20/218; imu: 3 malformed, first line 11", 2},
    {"ImuCutOff", [](Files& f) { f[kImu].resize(f[kImu].size() - 20); }, "20/20/20/220; imu: 1 malformed, first line 222"},
    {"StampsBeyondReason",
     [](Files& f) {
       edit(f, kImu, [](Lines& l) {
         l[9][0] = '-';
         l[10].insert(0, 1, '9');
         l[11][0] = '8';
         l[12].insert(0, "99999999999");
       });
     },
     "20/20/20/217; imu: 4 malformed, first line 10", 2},
    {"ImuMissingInTheMiddle", [](Files& f) { edit(f, kImu, [](Lines& l) { l.erase(l.begin() + 60, l.begin() + 160); }); },
     "20/20/20/121"},
    {"ImuEndsEarly", [](Files& f) { edit(f, kImu, [](Lines& l) { l.resize(101); }); }, "20/20/20/100", 0},
    {"ImagesMissingInTheMiddle",
     [](Files& f) {
       for (auto* n : {kCam0, kCam1}) edit(f, n, [](Lines& l) { l.erase(l.begin() + 5, l.begin() + 15); });
     },
     "10/10/10/221"},
    {"LeftFileMissing", [](Files& f) { f.erase(toy_image(0, 7)); }, "20/19/20/221; left: 1 missing"},
    {"FolderInsteadOfFile",
     [](Files& f) {
       f.erase(toy_image(0, 7));
       f[toy_image(0, 7) + "/x"] = "";
     },
     "20/19/20/221; left: 1 missing"},
    {"BothFilesMissing",
     [](Files& f) {
       f.erase(toy_image(0, 7));
       f.erase(toy_image(1, 7));
     },
     "19/19/19/221; left: 1 missing; right: 1 missing; 1 empty frames"},
    {"RightMissesStamps", [](Files& f) { edit(f, kCam1, [](Lines& l) { l.erase(l.begin() + 3, l.begin() + 6); }); },
     "20/20/17/221; left: 3 unpaired", 1},
    {"RightHasMore", [](Files& f) { edit(f, kCam0, [](Lines& l) { l.erase(l.begin() + 3, l.begin() + 6); }); },
     "20/17/20/221; right: 3 unpaired", 1},
    {"RightALittleLater",
     [](Files& f) {
       edit(f, kCam1, [](Lines& l) {
         for (std::size_t i = 1; i < l.size(); ++i) l[i][12] = '2';
       });
     },
     "20/20/20/221", 0},
    {"ImageNotAnImage", [](Files& f) { f[toy_image(0, 3)] = "this is no image"; }, "20/19/20/221; left: 1 corrupt"},
    {"ImageEmpty", [](Files& f) { f[toy_image(1, 3)].clear(); }, "20/20/19/221; right: 1 corrupt"},
    {"ImageCutOff",
     [](Files& f) {
       auto& i = f[toy_image(0, 3)];
       i.resize(i.size() / 2);
     },
     "20/19/20/221; left: 1 corrupt"},
    {"ImageOneByteShort", [](Files& f) { f[toy_image(0, 3)].pop_back(); }, "20/19/20/221; left: 1 corrupt"},
    {"ImageBitFlipped",
     [](Files& f) {
       auto& i = f[toy_image(0, 3)];
       i[i.size() / 2] ^= 16;
     },
     "20/19/20/221; left: 1 corrupt"},
    {"ImageHeaderClaimsTheWorld", [](Files& f) { f[toy_image(0, 3)].replace(16, 8, "\x7f\xff\xff\xff\x7f\xff\xff\xff", 8); },
     "20/19/20/221; left: 1 corrupt"},
    {"BothImagesCorrupt",
     [](Files& f) {
       for (int c : {0, 1}) f[toy_image(c, 3)].resize(60);
     },
     "19/19/19/221; left: 1 corrupt; right: 1 corrupt; 1 empty frames"},
    {"ImageOfAnotherSize",
     [](Files& f) {
       f[toy_image(1, 3)] = make_png(1, {.width = 32, .height = 48});
       f[toy_image(1, 5)] = make_png(1, {.width = 65});
     },
     "20/20/18/221; right: 2 wrong size"},
    {"ColourAndSixteenBit",
     [](Files& f) {
       f[toy_image(0, 3)] = make_png(1, {.colour = true});
       f[toy_image(1, 3)] = make_png(1, {.sixteen_bit = true});
       f[toy_image(1, 4)] = make_png(1, {.colour = true, .sixteen_bit = true});
     },
     "20/20/20/221", 0},
    {"JpegUnderThatName", [](Files& f) { f[toy_image(0, 3)] = make_jpeg(3); }, "20/20/20/221", 0},
    {"JpegCutOff",
     [](Files& f) {
       f[toy_image(0, 3)] = make_jpeg(3);
       f[toy_image(0, 3)].resize(f[toy_image(0, 3)].size() - 40);
     },
     "20/19/20/221; left: 1 corrupt"},
    {"TruthMissing", [](Files& f) { f.erase(kTruth); }, "20/20/20/221", 0},
    {"TruthUnusable", [](Files& f) { f[kTruth] = "hello\nworld\n"; }, "20/20/20/221"},
    {"TruthPartlyNaN",
     [](Files& f) {
       edit(f, kTruth, [](Lines& l) {
         replace(l[3], ",1,1,0", ",nan,1,0");
         replace(l[4], ",1,1,0", ",1,0,0");
         l[5] = l[4];
       });
     },
     "20/20/20/221; truth: 2 malformed 1 not finite, first line 5"},
};

class SkippedDataset : public testing::TestWithParam<Skipped> {};

TEST_P(SkippedDataset, DeliversTheRestAndCounts) {
  Files files = toy_dataset();
  GetParam().damage(files);
  const TemporaryFolder folder;
  write_folder(files, folder.path() + "/toy");
  const auto data = open_dataset(folder.path() + "/toy");
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ(deliver(**data), GetParam().outcome);
  const auto& warnings = (*data)->info().warnings;
  EXPECT_EQ(std::ssize(warnings), GetParam().warnings) << fmt::format("{}", fmt::join(warnings, "\n"));
  // The same in an archive.
  std::erase_if(files, [](const auto& e) { return e.first.find(".png/") != std::string::npos; });
  write_zip(files, folder.path() + "/toy.zip", "any/name/");
  const auto zipped = open_dataset(folder.path() + "/toy.zip");
  ASSERT_TRUE(zipped) << zipped.error().message;
  EXPECT_EQ(deliver(**zipped), GetParam().outcome);
}
INSTANTIATE_TEST_SUITE_P(Table, SkippedDataset, testing::ValuesIn(kSkipped),
                         [](const auto& row) { return std::string(row.param.name); });

}  // namespace skipped_datasets_test
}  // namespace fbvins::test
