// SPDX-License-Identifier: Apache-2.0
// What open_dataset returns for damaged recordings: an error of one sentence that names the file and the line or
// field, or everything that is intact, with a count of what was left out.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "fbvins/io/dataset.hpp"
#include "tests/broken_datasets/toy_dataset.hpp"

namespace fbvins::test {
namespace broken_datasets_test {

using Lines = std::vector<std::string>;
using Damage = void (*)(Files&);

constexpr const char* kCam0 = "cam0/data.csv";
constexpr const char* kCam1 = "cam1/data.csv";
constexpr const char* kImu = "imu0/data.csv";
constexpr const char* kTruth = "state_groundtruth_estimate0/data.csv";

std::string rows(const char* name, const RowCounts& c) {
  if (c.bad() == 0) return "";
  std::string out = fmt::format("; {}:", name);
  for (auto [count, what] : {std::pair{c.malformed, "malformed"},
                             {c.not_finite, "not finite"},
                             {c.duplicates, "duplicate"},
                             {c.backwards, "backwards"}})
    if (count > 0) out += fmt::format(" {} {}", count, what);
  return out + fmt::format(", first line {}", c.first_bad.substr(c.first_bad.find(".csv:") + 5,
                                                                 c.first_bad.find(": ") - c.first_bad.find(".csv:") - 5));
}

std::string images(const char* name, const CameraInfo& c) {
  std::string out;
  for (auto [count, what] : {std::pair{c.unpaired, "unpaired"},
                             {c.images.missing, "missing"},
                             {c.images.corrupt, "corrupt"},
                             {c.images.wrong_size, "wrong size"}})
    if (count > 0) out += fmt::format("; {}: {} {}", name, count, what);
  return out;
}

/// Reads to the end: "frames/left/right images/IMU samples delivered; what was left out".
std::string deliver(Dataset& data) {
  int frames = 0, left = 0, right = 0, imu = 0;
  Time last_imu{-1}, last_image{-1};
  while (auto event = data.next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) {
      EXPECT_GT(sample->t, last_imu);
      EXPECT_TRUE(sample->gyro_radps.allFinite() && sample->accel_mps2.allFinite());
      last_imu = sample->t;
      ++imu;
      continue;
    }
    const StereoFrame& frame = std::get<StereoFrame>(*event);
    EXPECT_GT(frame.t, last_image);
    EXPECT_TRUE(frame.left || frame.right);
    last_image = frame.t;
    ++frames;
    for (auto [image, count] : {std::pair{frame.left.get(), &left}, {frame.right.get(), &right}}) {
      if (!image) continue;
      EXPECT_EQ(image->width(), kToyWidth);
      EXPECT_EQ(image->height(), kToyHeight);
      ++*count;
    }
  }
  EXPECT_FALSE(data.next()) << "the end stays the end";
  const DatasetInfo& info = data.info();
  return fmt::format("{}/{}/{}/{}", frames, left, right, imu) + rows("left", info.left.rows) + rows("right", info.right.rows) +
         rows("imu", info.imu_rows) + rows("truth", info.ground_truth_rows) + images("left", info.left) +
         images("right", info.right) +
         (info.frames_without_image > 0 ? fmt::format("; {} empty frames", info.frames_without_image) : "");
}

// ---------------------------------------------------------------- refused

struct Refused {
  const char* name;
  Damage damage;
  const char* sentence;  ///< after the dataset's path
};

void PrintTo(const Refused& c, std::ostream* out) { *out << c.name; }

template <class Edit>
void edit(Files& files, const char* file, Edit&& change) {
  edit_lines(files.at(file), std::forward<Edit>(change));
}

const Refused kRefused[] = {
    {"NothingInIt",
     [](Files& f) {
       f.clear();
       f["readme.txt"] = "hello";
     },
     ": no cam0/data.csv in it: not a EuRoC dataset"},
    {"RosBag2",
     [](Files& f) {
       f.clear();
       f["../metadata.yaml"] = "rosbag2";
       f["x"] = "";
     },
     ": no cam0/data.csv in it: not a EuRoC dataset (ROS bags are read by fbvins-bags; `fbvins convert` makes a EuRoC folder of one)"},
    {"NoLeftList", [](Files& f) { f.erase(kCam0); }, "/mav0/cam0/data.csv: no such file"},
    {"NoLeftCalibration", [](Files& f) { f.erase("cam0/sensor.yaml"); }, "/mav0/cam0/sensor.yaml: no such file"},
    {"NoRightCalibration", [](Files& f) { f.erase("cam1/sensor.yaml"); }, "/mav0/cam1/sensor.yaml: no such file"},
    {"NoRightList", [](Files& f) { f.erase(kCam1); }, "/mav0/cam1/data.csv: no such file"},
    {"NoImuRows", [](Files& f) { f.erase(kImu); }, "/mav0/imu0/data.csv: no such file"},
    {"NoImuCalibration", [](Files& f) { f.erase("imu0/sensor.yaml"); }, "/mav0/imu0/sensor.yaml: no such file"},
    {"ImuEmpty", [](Files& f) { f[kImu].clear(); }, "/mav0/imu0/data.csv: there are no data rows in it"},
    {"ImuOnlyHeader", [](Files& f) { edit(f, kImu, [](Lines& l) { l.resize(1); }); },
     "/mav0/imu0/data.csv: there are no data rows in it"},
    {"LeftListEmpty", [](Files& f) { f[kCam0].clear(); }, "/mav0/cam0/data.csv: there are no data rows in it"},
    {"ImuTooFewColumns",
     [](Files& f) {
       edit(f, kImu, [](Lines& l) {
         for (std::size_t i = 100; i < l.size(); ++i) l[i] = l[i].substr(0, l[i].rfind(','));
       });
     },
     "/mav0/imu0/data.csv:101: 6 columns where 7 are needed (122 of 221 rows are unusable)"},
    {"ImuAllNaN",
     [](Files& f) {
       edit(f, kImu, [](Lines& l) {
         for (std::size_t i = 1; i < l.size(); ++i) replace(l[i], "0.01", "nan");
       });
     },
     "/mav0/imu0/data.csv:2: a value is not a usable number (221 of 221 rows are unusable)"},
    {"ImuOneStampForAll",
     [](Files& f) {
       edit(f, kImu, [](Lines& l) {
         for (std::size_t i = 2; i < l.size(); ++i) l[i] = l[1];
       });
     },
     "/mav0/imu0/data.csv:3: the stamp was already there (220 of 221 rows are unusable)"},
    {"ImuFromTheEnd", [](Files& f) { edit(f, kImu, [](Lines& l) { std::reverse(l.begin() + 1, l.end()); }); },
     "/mav0/imu0/data.csv:3: the stamp is out of order (220 of 221 rows are unusable)"},
    {"ListWithoutNames",
     [](Files& f) {
       edit(f, kCam0, [](Lines& l) {
         for (auto& s : l) s = s.substr(0, s.find(','));
       });
     },
     "/mav0/cam0/data.csv:2: 1 columns where 2 are needed (20 of 20 rows are unusable)"},
    {"StampsInSeconds",
     [](Files& f) {
       edit(f, kCam0, [](Lines& l) {
         for (std::size_t i = 1; i < l.size(); ++i) l[i].insert(10, 1, '.');
       });
     },
     "/mav0/cam0/data.csv:2: '1600000000.000000123' is not a stamp in nanoseconds (20 of 20 rows are unusable)"},
    {"ListIsBinary", [](Files& f) { f[kCam0] = f[toy_image(0, 0)]; }, "/mav0/cam0/data.csv:"},
    {"NamesLeaveTheFolder",
     [](Files& f) {
       edit(f, kCam0, [](Lines& l) {
         for (std::size_t i = 1; i < l.size(); ++i) l[i].replace(20, std::string::npos, "../../../etc/passwd");
       });
     },
     "/mav0/cam0/data.csv:2: '../../../etc/passwd' is not the name of an image file (20 of 20 rows are unusable)"},
    {"YamlSyntax", [](Files& f) { replace(f["cam0/sensor.yaml"], "comment: toy", "comment: [toy"); },
     "/mav0/cam0/sensor.yaml:4: "},
    {"YamlEmpty", [](Files& f) { f["cam1/sensor.yaml"].clear(); }, "/mav0/cam1/sensor.yaml: holds no fields"},
    {"YamlBinary", [](Files& f) { f["cam1/sensor.yaml"] = f[toy_image(0, 0)]; }, "/mav0/cam1/sensor.yaml:"},
    {"MountingTooShort", [](Files& f) { replace(f["cam0/sensor.yaml"], "0.0, 0.0, 0.0, 1.0]", "0.0, 0.0, 0.0]"); },
     "/mav0/cam0/sensor.yaml:7: data: has 15 numbers where 16 are needed"},
    {"MountingMissing", [](Files& f) { replace(f["cam0/sensor.yaml"], "T_BS", "T_SB"); },
     "/mav0/cam0/sensor.yaml: T_BS: is missing"},
    {"MountingNoRotation", [](Files& f) { replace(f["cam0/sensor.yaml"], "[1.0, 0.0", "[1.1, 0.0"); },
     "/mav0/cam0/sensor.yaml:7: data: its 3x3 part is not a rotation"},
    {"MountingMirrored", [](Files& f) { replace(f["cam0/sensor.yaml"], "[1.0, 0.0", "[-1.0, 0.0"); },
     "/mav0/cam0/sensor.yaml:7: data: its 3x3 part is not a rotation"},
    {"MountingNaN", [](Files& f) { replace(f["cam1/sensor.yaml"], "0.1", "nan"); },
     "/mav0/cam1/sensor.yaml:7: data: holds something that is not a number"},
    {"MaskMissing", [](Files& f) { f["cam0/sensor.yaml"] += "mask: legs.png\n"; }, "/mav0/cam0/sensor.yaml:17: mask: "},
    {"MaskOfAnotherSize",
     [](Files& f) {
       f["cam0/sensor.yaml"] += "mask: legs.png\n";
       f["cam0/legs.png"] = make_png(1, {.width = 32, .height = 24});
     },
     "/mav0/cam0/sensor.yaml:17: mask: legs.png has 32 x 24 pixels, the camera 64 x 48"},
    {"MaskOutsideOfTheImage", [](Files& f) { f["cam1/sensor.yaml"] += "mask_circles: [[90, 90, 10]]\n"; },
     "/mav0/cam1/sensor.yaml:17: mask_circles: its number 1 holds no pixel of the image of 64 x 48"},
    {"FocalLengthNegative", [](Files& f) { replace(f["cam0/sensor.yaml"], "[40.0", "[-40.0"); },
     "/mav0/cam0/sensor.yaml:14: intrinsics: the focal lengths are not positive"},
    {"IntrinsicsThree", [](Files& f) { replace(f["cam0/sensor.yaml"], "31.5, 23.5", "31.5"); },
     "/mav0/cam0/sensor.yaml:14: intrinsics: has 3 numbers where 4 are needed"},
    {"ResolutionZero", [](Files& f) { replace(f["cam0/sensor.yaml"], "[64, 48]", "[64, 0]"); },
     "/mav0/cam0/sensor.yaml:12: resolution: 0 is not a number of pixels"},
    {"ResolutionWord", [](Files& f) { replace(f["cam0/sensor.yaml"], "[64, 48]", "big"); },
     "/mav0/cam0/sensor.yaml:12: resolution: is not a list of numbers"},
    {"DistortionUnknown", [](Files& f) { replace(f["cam0/sensor.yaml"], "radial-tangential", "fov"); },
     "/mav0/cam0/sensor.yaml:15: distortion_model: 'fov' is not supported, only radial-tangential, radtan, equidistant and none"},
    {"DistortionTooLong", [](Files& f) { replace(f["cam0/sensor.yaml"], "-0.0002]", "-0.0002, 0.5]"); },
     "/mav0/cam0/sensor.yaml:16: distortion_coefficients: has 5 numbers where 4 are needed"},
    {"DistortionOfAnotherModel",
     [](Files& f) { replace(f["cam0/sensor.yaml"], "pinhole\nintrinsics: [", "eucm\nintrinsics: [0.6, 1.1, "); },
     "/mav0/cam0/sensor.yaml:15: distortion_model: 'radial-tangential' is not supported, only none"},
    {"TooFewIntrinsics", [](Files& f) { replace(f["cam0/sensor.yaml"], "pinhole", "ds"); },
     "/mav0/cam0/sensor.yaml:14: intrinsics: has 4 numbers where 6 are needed"},
    {"ModelUnknown", [](Files& f) { replace(f["cam0/sensor.yaml"], "pinhole", "cylinder"); },
     "/mav0/cam0/sensor.yaml:13: camera_model: 'cylinder' is not supported, only pinhole, ds, eucm and omni"},
    {"NoBaseline", [](Files& f) { f["cam1/sensor.yaml"] = f["cam0/sensor.yaml"]; },
     "/mav0/cam1/sensor.yaml: the two cameras are 0 m apart, not between 1 mm and 10 m"},
    {"NoiseZero", [](Files& f) { replace(f["imu0/sensor.yaml"], "1.7e-04", "0"); },
     "/mav0/imu0/sensor.yaml:4: gyroscope_noise_density: 0 is not positive"},
    {"NoiseMissing", [](Files& f) { replace(f["imu0/sensor.yaml"], "accelerometer_random_walk", "something"); },
     "/mav0/imu0/sensor.yaml: accelerometer_random_walk: is missing"},
    {"AllImagesMissing", [](Files& f) { std::erase_if(f, [](const auto& e) { return e.first.ends_with(".png"); }); },
     "/mav0/cam0/data/1600000000000000123.png: no such file, nor any other of the images listed"},
    {"ImuOfAnotherDay",
     [](Files& f) {
       edit(f, kImu, [](Lines& l) {
         for (std::size_t i = 1; i < l.size(); ++i) --l[i][1];
       });
     },
     "/mav0/imu0/data.csv: stamps 1499999999.900000123 to 1500000001.000000123 s do not overlap the images' 1600000000.000000123 to 1600000000.950000123 s"},
    {"RightOfAnotherDay",
     [](Files& f) {
       edit(f, kCam1, [](Lines& l) {
         for (std::size_t i = 1; i < l.size(); ++i) --l[i][1];
       });
     },
     "/mav0/cam1/data.csv: no stamp lies within 3 ms of one of cam0's"},
    {"CalibrationOfAnotherSize", [](Files& f) { replace(f["cam1/sensor.yaml"], "[64, 48]", "[60, 44]"); },
     "/mav0/cam1/data/1600000000000000123.png: 64 x 48 pixels where the calibration says 60 x 44 (none of 8 right images tried can be used)"},
    {"CalibrationOfHalfTheSize", [](Files& f) { replace(f["cam1/sensor.yaml"], "[64, 48]", "[32, 24]"); },
     "/mav0/cam1/sensor.yaml:14: intrinsics: the principal point (31.5, 23.5) lies outside the middle third of an image of 32 x 24: is the calibration that of images twice as large?"},
    {"NoImageCanBeRead",
     [](Files& f) {
       for (int i = 0; i < kToyFrames; ++i) f[toy_image(0, i)] = "this is no image";
     },
     "/mav0/cam0/data/1600000000000000123.png: neither PNG nor JPEG (none of 8 left images tried can be used)"},
};

class RefusedDataset : public testing::TestWithParam<Refused> {};

TEST_P(RefusedDataset, IsNamedInOneSentence) {
  Files files = toy_dataset();
  GetParam().damage(files);
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/toy";
  write_folder(files, path + "/mav0");
  const auto data = open_dataset(path);
  ASSERT_FALSE(data);
  const std::string& message = data.error().message;
  const std::string expected = path + GetParam().sentence;
  if (expected.back() == ':' || expected.back() == ' ') EXPECT_TRUE(message.starts_with(expected)) << message;
  else EXPECT_EQ(message, expected);
  EXPECT_EQ(message.find('\n'), std::string::npos);
}
INSTANTIATE_TEST_SUITE_P(Table, RefusedDataset, testing::ValuesIn(kRefused),
                         [](const auto& row) { return std::string(row.param.name); });

// ---------------------------------------------------------------- delivered, less what is broken

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
     "20/20/20/221; truth: 2 malformed 1 not finite, first line 4"},
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

// ---------------------------------------------------------------- archives and paths

class BrokenPath : public testing::Test {
 protected:
  void expect_refused(const std::string& path, const std::string& sentence) {
    const auto data = open_dataset(path);
    ASSERT_FALSE(data);
    EXPECT_TRUE(data.error().message.starts_with(path + sentence)) << data.error().message;
    EXPECT_EQ(data.error().message.find('\n'), std::string::npos);
  }
  std::string written(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_.path() + "/" + name, std::ios::binary) << bytes;
    return folder_.path() + "/" + name;
  }
  std::string zip_bytes(const std::string& top = "mav0/") {
    write_zip(toy_dataset(), folder_.path() + "/whole.zip", top);
    std::ifstream in(folder_.path() + "/whole.zip", std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  TemporaryFolder folder_;
};

TEST_F(BrokenPath, Nothing) { expect_refused(folder_.path() + "/nowhere", ": no such file or folder"); }
TEST_F(BrokenPath, EmptyFolder) { expect_refused(folder_.path(), ": no cam0/data.csv in it"); }
TEST_F(BrokenPath, TextFile) { expect_refused(written("a.txt", "hello"), ": neither a EuRoC folder nor a zip archive"); }
TEST_F(BrokenPath, EmptyFile) { expect_refused(written("a.zip", ""), ": neither a EuRoC folder nor a zip archive"); }
TEST_F(BrokenPath, RosBag) {
  expect_refused(written("a.bag", "#ROSBAG V2.0\n"), ": ROS bags are read by fbvins-bags; `fbvins convert`");
}
TEST_F(BrokenPath, PipeDoesNotBlock) {
  const std::string path = folder_.path() + "/pipe";
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  expect_refused(path, ": neither a file nor a folder");
}
TEST_F(BrokenPath, PipeInsideDoesNotBlock) {
  Files files = toy_dataset();
  files.erase(kImu);
  write_folder(files, folder_.path() + "/toy");
  ASSERT_EQ(mkfifo((folder_.path() + "/toy/imu0/data.csv").c_str(), 0600), 0);
  const auto data = open_dataset(folder_.path() + "/toy");
  ASSERT_FALSE(data);
  EXPECT_EQ(data.error().message, folder_.path() + "/toy/imu0/data.csv: not a plain file");
}

TEST_F(BrokenPath, ZipCutOff) {
  const std::string bytes = zip_bytes();
  for (const double part : {0.01, 0.5, 0.99}) {
    const std::string path =
        written("cut.zip", bytes.substr(0, static_cast<std::size_t>(part * static_cast<double>(bytes.size()))));
    expect_refused(path, ": not a whole zip archive (");
  }
}
TEST_F(BrokenPath, ZipOfSomethingElse) {
  write_zip({{"readme.txt", "hello"}}, folder_.path() + "/other.zip", "");
  expect_refused(folder_.path() + "/other.zip", ": no cam0/data.csv in it");
}
TEST_F(BrokenPath, ZipWithTwoDatasets) {
  Files both;
  for (const auto& [name, bytes] : toy_dataset()) both["a/mav0/" + name] = both["b/mav0/" + name] = bytes;
  write_zip(both, folder_.path() + "/two.zip", "");
  expect_refused(folder_.path() + "/two.zip", ": holds 2 datasets (a/mav0/ ...), give one of them");
}
TEST_F(BrokenPath, ZipWithoutImu) {
  Files files = toy_dataset();
  files.erase(kImu);
  write_zip(files, folder_.path() + "/noimu.zip", "mav0/");
  expect_refused(folder_.path() + "/noimu.zip", ":mav0/imu0/data.csv: not in the archive");
}
TEST_F(BrokenPath, ZipWithShadowFilesOfAMac) {
  Files files;
  for (const auto& [name, bytes] : toy_dataset()) files["mav0/" + name] = bytes;
  files["__MACOSX/mav0/cam0/data.csv"] = "shadow";
  write_zip(files, folder_.path() + "/mac.zip", "");
  const auto data = open_dataset(folder_.path() + "/mac.zip");
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data)->info().name, "mac");
  EXPECT_EQ(deliver(**data), "20/20/20/221");
}
TEST_F(BrokenPath, ZipWithDamagedMember) {
  std::string bytes = zip_bytes();
  // The image's bytes lie behind its local header; the directory stays whole, the checksum fails.
  const std::size_t name = bytes.find("mav0/" + toy_image(0, 4));
  bytes[name + 60] ^= 0x55;
  const auto data = open_dataset(written("damaged.zip", bytes));
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ(deliver(**data), "20/19/20/221; left: 1 corrupt");
}

// ---------------------------------------------------------------- whole recordings, options

std::vector<std::int64_t> fingerprint(Dataset& data, int stop_after = 1 << 30) {
  std::vector<std::int64_t> out;
  while (auto event = data.next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) out.push_back(sample->t.ns);
    else {
      const StereoFrame& f = std::get<StereoFrame>(*event);
      out.push_back(-f.t.ns);
      for (int y = 0; y < kToyHeight; ++y)
        for (int x = 0; x < kToyWidth; ++x) out.push_back(f.left->at(x, y) * 256 + f.right->at(x, y));
    }
    if (std::ssize(out) > stop_after) break;
  }
  return out;
}

class ToyDataset : public testing::Test {
 protected:
  ToyDataset() { write_folder(toy_dataset(), path()); }
  std::string path() const { return folder_.path() + "/toy/mav0"; }
  TemporaryFolder folder_;
};

TEST_F(ToyDataset, IsTheSameWithAndWithoutDecodingAhead) {
  const auto first = fingerprint(**open_dataset(path(), {.prefetch_frames = 0}));
  EXPECT_EQ(std::ssize(first), kToyImuSamples + kToyFrames * (1 + kToyWidth * kToyHeight));
  for (int ahead : {1, 2, 8, 100}) EXPECT_EQ(fingerprint(**open_dataset(path(), {.prefetch_frames = ahead})), first) << ahead;
}

TEST_F(ToyDataset, CanBeLeftEarly) {
  for (int stop : {0, 10, 5000, 20000}) {
    auto data = open_dataset(path(), {.prefetch_frames = 3});
    ASSERT_TRUE(data);
    if (stop > 0) fingerprint(**data, stop);
    data->reset();  // with frames ready and in work
  }
}

TEST_F(ToyDataset, SkipsAndStops) {
  auto data = open_dataset(path(), {.skip_frames = 5, .max_frames = 4});
  ASSERT_TRUE(data);
  EXPECT_EQ((*data)->info().frames, 4);
  EXPECT_EQ((*data)->info().first_image.ns, toy_stamp_ns(5));
  EXPECT_EQ((*data)->info().last_image.ns, toy_stamp_ns(8));
  EXPECT_EQ(deliver(**data), "4/4/4/101");  // IMU up to the stamp of frame 8
  EXPECT_EQ(open_dataset(path(), {.skip_frames = 20}).error().message,
            path() + "/cam0/data.csv: no frames are left after skipping 20");
  EXPECT_EQ(open_dataset(path(), {.skip_frames = -1}).error().message, "skip_frames = -1 is outside [0, 1000000000]");
}

TEST_F(ToyDataset, ImuComesJustFarEnoughToInterpolate) {
  auto data = open_dataset(path());
  ASSERT_TRUE(data);
  Time imu{0};
  while (auto event = (*data)->next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) imu = sample->t;
    else EXPECT_EQ(imu, std::get<StereoFrame>(*event).t);  // in the toy dataset both have the same stamps
  }
  EXPECT_EQ(imu.ns, kToyStart_ns + 1'000'000'000);
}

/// Stamps and left pixels of all frames, which have no right image.
std::vector<std::int64_t> left_images(Dataset& data) {
  std::vector<std::int64_t> out;
  while (auto event = data.next()) {
    const auto* frame = std::get_if<StereoFrame>(&*event);
    if (frame == nullptr) continue;
    EXPECT_EQ(frame->right, nullptr);
    out.push_back(frame->t.ns);
    for (int y = 0; y < kToyHeight; ++y)
      for (int x = 0; x < kToyWidth; ++x) out.push_back(frame->left->at(x, y));
  }
  return out;
}

TEST_F(ToyDataset, OneCamerasFolderIsARecordingOfThatCamera) {
  const Pose<B, C0> mounting[2] = {(*open_dataset(path()))->rig().T_BC0,
                                   (*open_dataset(path()))->rig().T_BC1.cast_frames<B, C0>()};
  const char* chosen[2] = {"left", "right"};
  for (int camera = 0; camera < 2; ++camera) {
    Files files = toy_dataset();
    std::erase_if(files, [&](const auto& e) { return e.first.starts_with(camera == 0 ? "cam1/" : "cam0/"); });
    const TemporaryFolder folder;
    write_folder(files, folder.path() + "/toy/mav0");
    auto alone = open_dataset(folder.path() + "/toy");
    ASSERT_TRUE(alone) << alone.error().message;
    EXPECT_FALSE((*alone)->rig().has_right());
    EXPECT_EQ((*alone)->rig().T_BC0.p, mounting[camera].p);
    EXPECT_EQ((*alone)->info().frames, kToyFrames);
    EXPECT_EQ((*alone)->info().left.unpaired, 0);
    const auto images = left_images(**alone);
    EXPECT_EQ(images.size(), static_cast<std::size_t>(kToyFrames * (1 + kToyWidth * kToyHeight)));
    // The same as one of the two chosen.
    auto of_two = open_dataset(path(), {.camera = chosen[camera]});
    ASSERT_TRUE(of_two);
    EXPECT_EQ((*of_two)->rig().T_BC0.p, mounting[camera].p);
    EXPECT_EQ(left_images(**of_two), images);
  }
}

TEST_F(ToyDataset, TakesAnotherCalibration) {
  const std::string camchain = folder_.path() + "/camchain.yaml", imu = folder_.path() + "/imu.yaml";
  std::ofstream(camchain) << "cam0:\n  T_cam_imu:\n  - [1, 0, 0, 0.5]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n"
                             "  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n  distortion_model: equidistant\n"
                             "  intrinsics: [41, 42, 31, 23]\n  resolution: [64, 48]\n  timeshift_cam_imu: 0.012\n"
                             "cam1:\n  T_cn_cnm1:\n  - [1, 0, 0, -0.2]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n"
                             "  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n  distortion_model: radtan\n"
                             "  intrinsics: [43, 44, 31, 23]\n  resolution: [64, 48]\n";
  std::ofstream(imu) << "imu0:\n  accelerometer_noise_density: 0.01\n  accelerometer_random_walk: 0.002\n"
                        "  gyroscope_noise_density: 0.003\n  gyroscope_random_walk: 0.0004\n  update_rate: 200.0\n";
  auto data = open_dataset(path(), {.kalibr_camchain = camchain, .kalibr_imu = imu});
  ASSERT_TRUE(data) << data.error().message;
  const StereoRig& rig = (*data)->rig();
  EXPECT_EQ(rig.left.model_name(), "pinhole-equidistant");
  EXPECT_EQ(rig.right.model_name(), "pinhole-radtan");
  EXPECT_LT((rig.T_BC0.p - Vec3(-0.5, 0, 0)).norm(), 1e-12);
  EXPECT_LT((rig.T_BC1.p - Vec3(-0.3, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(rig.time_offset_s, 0.012);
  EXPECT_EQ(rig.imu_noise.accel_noise_density_mps2_rthz, 0.01);
  EXPECT_NEAR(rig.image_rate_hz, 20, 1e-9);
  // 12 ms later on the IMU's clock: the third sample after each image is the first at or after it.
  Time last_imu{0};
  while (auto event = (*data)->next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) last_imu = sample->t;
    else EXPECT_EQ((last_imu - std::get<StereoFrame>(*event).t).ns, 15'000'000);
  }
  EXPECT_EQ(open_dataset(path(), {.kalibr_imu = imu}).error().message, "kalibr_imu is given without kalibr_camchain");
  EXPECT_EQ(open_dataset(path(), {.kalibr_camchain = imu}).error().message, imu + ": cam0: is missing or empty");
}

}  // namespace broken_datasets_test
}  // namespace fbvins::test
