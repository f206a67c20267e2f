// SPDX-License-Identifier: Apache-2.0
// Damaged recordings that open_dataset refuses: an error of one sentence that names the file and the line or field.
#include "tests/broken_datasets/delivered.hpp"

namespace fbvins::test {
namespace refused_datasets_test {

struct Refused {
  const char* name;
  Damage damage;
  const char* sentence;  ///< after the dataset's path
};

void PrintTo(const Refused& c, std::ostream* out) { *out << c.name; }

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
     "/mav0/imu0/data.csv:3: the stamp was already there (220 of 221 rows are unusable): 220 rows have the stamp of another: what arrives in a block needs a stamp for each, by "
     "the sensor's own clock or its rate"},
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
     "/mav0/cam0/sensor.yaml:7: data: its 3x3 part is not a rotation: its columns are not of length 1 and orthogonal by up to 0.21"},
    {"MountingMirrored", [](Files& f) { replace(f["cam0/sensor.yaml"], "[1.0, 0.0", "[-1.0, 0.0"); },
     "/mav0/cam0/sensor.yaml:7: data: its 3x3 part is not a rotation, but mirrors"},
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
     "/mav0/cam0/sensor.yaml:15: distortion_model: 'fov' is not supported, only radtan (plumb_bob, rational_polynomial), equidistant "
     "(fisheye) and none"},
    {"DistortionTooLong", [](Files& f) { replace(f["cam0/sensor.yaml"], "-0.0002]", "-0.0002, 0.5, 0.1]"); },
     "/mav0/cam0/sensor.yaml:16: distortion_coefficients: has 6 numbers where 4, 5, 8, 12 or 14 are known"},
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
     "/mav0/imu0/data.csv: stamps 1499999999.900000123 to 1500000001.000000123 s do not overlap the images' 1600000000.000000123 to 1600000000.950000123 s: "
     "the clocks are 100000000.100 s apart: stamp both by one clock"},
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

}  // namespace refused_datasets_test
}  // namespace fbvins::test
