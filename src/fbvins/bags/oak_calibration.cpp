// SPDX-License-Identifier: Apache-2.0
// The calibration that Luxonis's library stores in an OAK and writes as JSON: centimetres, each camera's place against another
// one's, the IMU's against one of them.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "fbvins/bags/foreign_calibration.hpp"
#include "fbvins/camera/opencv_lens.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/image_decode.hpp"

namespace fbvins {
namespace {

constexpr double kCentimetre_m = 0.01;
constexpr int kFisheye = 1, kMostSteps = 16;

/// p in `to` of the camera, or of the IMU, that holds it.
struct Placed {
  int to = -1;
  Pose<C0, C0> T;
};

Placed read_placed(YamlReader& yaml, const YAML::Node& map) {
  Placed out;
  out.to = static_cast<int>(yaml.number_between(map, "toCameraSocket", -1, 100, -1));
  if (out.to < 0) return out;
  const std::vector<double> r = yaml.numbers(map, "rotationMatrix", 9);
  const YAML::Node t = yaml.get(map, "translation");
  const Vec3 p_cm(yaml.number(t, "x"), yaml.number(t, "y"), yaml.number(t, "z"));
  Mat3 R;
  R << r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8];
  if (yaml.ok() && (!((R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() < 3e-3) || !(R.determinant() > 0)))
    yaml.complain(map, "rotationMatrix", "is not a rotation");
  if (yaml.ok() && !(p_cm.norm() < 1e3)) yaml.complain(map, "translation", "is more than ten metres; it is in centimetres");
  if (yaml.ok()) out.T = {Quat(R).normalized(), Vec3(kCentimetre_m * p_cm)};
  return out;
}

Camera read_lens(YamlReader& yaml, const YAML::Node& map) {
  const std::vector<double> k = yaml.numbers(map, "intrinsicMatrix", 9);
  const auto side = [&](const char* field) {
    return static_cast<int>(yaml.number_between(map, field, 1, kLargestImageSide_px, 1));
  };
  const int width = side("width"), height = side("height");
  const std::vector<double> d = yaml.numbers(map, "distortionCoeff");
  if (yaml.ok() && !(k[0] > 0 && k[4] > 0)) yaml.complain(map, "intrinsicMatrix", "the focal lengths are not positive");
  if (!yaml.ok()) return {};
  const bool fisheye = yaml.number_between(map, "cameraType", 0, 100, 0) == kFisheye;
  const std::array<double, 4> f{k[0], k[4], k[2], k[5]};
  const std::vector<double> four(d.begin(), d.begin() + std::min<std::ptrdiff_t>(4, std::ssize(d)));
  const Result<Camera> camera = fisheye ? fisheye_camera(f, four, width, height) : opencv_camera(f, d, width, height);
  if (!camera) yaml.complain(map, "distortionCoeff", camera.error().message);
  return camera ? *camera : Camera();
}

/// From one socket's axes to another's, along the chain, whose links lead from each camera to one other.
std::optional<Pose<C0, C0>> between(const std::map<int, Placed>& links, int to, int from) {
  std::map<int, Pose<C0, C0>> known{{from, {}}};  // takes coordinates of `from` to each
  for (int step = 0; step < kMostSteps && !known.contains(to); ++step)
    for (const auto& [socket, placed] : links) {
      if (placed.to < 0) continue;
      if (known.contains(socket)) known.try_emplace(placed.to, placed.T * known.at(socket));
      if (known.contains(placed.to)) known.try_emplace(socket, placed.T.inverse() * known.at(placed.to));
    }
  const auto found = known.find(to);
  return found == known.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

Result<StereoRig> parse_oak(YamlReader yaml) {  // JSON is YAML
  constexpr int kLeft = 1, kRight = 2;
  const YAML::Node& root = yaml.root();
  const YAML::Node list = yaml.get(root, "cameraData"), pair = yaml.get(root, "stereoRectificationData");
  std::map<int, YAML::Node> cameras;
  std::map<int, Placed> links;
  if (!list.IsDefined() || !list.IsSequence()) yaml.complain(root, "cameraData", "is missing or empty");
  for (std::size_t i = 0; yaml.ok() && list.IsSequence() && i < list.size(); ++i) {
    if (!list[i].IsSequence() || list[i].size() != 2 || !list[i][1].IsMap() || !list[i][0].IsScalar()) {
      yaml.complain(root, "cameraData", "is not a list of sockets and cameras");
      break;
    }
    const int socket = list[i][0].as<int>(-1);
    cameras.emplace(socket, list[i][1]);
    links.emplace(socket, read_placed(yaml, yaml.get(list[i][1], "extrinsics")));
  }
  const Placed imu = read_placed(yaml, yaml.get(root, "imuExtrinsics"));  // takes coordinates of the IMU to that camera's
  if (yaml.ok() && imu.to < 0)
    yaml.complain(root, "imuExtrinsics", "the device's IMU has no place against a camera: calibrate with `fbvins calibrate`");
  const int left = static_cast<int>(yaml.number_between(pair, "leftCameraSocket", 0, 100, kLeft)),
            right = static_cast<int>(yaml.number_between(pair, "rightCameraSocket", 0, 100, kRight));
  std::vector<MountedCamera> mounted;
  for (const int socket : {left, right}) {
    if (!yaml.ok() || !cameras.contains(socket)) continue;
    const auto T = between(links, imu.to, socket);
    if (!T) yaml.complain(root, "cameraData", fmt::format("the camera of socket {} has no place against the IMU", socket));
    else mounted.push_back({read_lens(yaml, cameras.at(socket)), (imu.T.inverse() * *T).cast_frames<B, C0>()});
  }
  if (yaml.ok() && mounted.empty()) yaml.complain(root, "cameraData", "has neither a left nor a right camera (sockets 1 and 2)");
  if (!yaml.ok()) return yaml.error();
  const StereoRig rig = with_cameras({}, mounted);
  if (Result<void> good = check_rig(rig, yaml.file()); !good) return good.error();
  return rig;
}

}  // namespace fbvins
