// SPDX-License-Identifier: Apache-2.0
// How much rendered images resemble real ones. Renders the preset `normal` along a real recording's trajectory,
// with its IMU and at its stamps, measures both, and prints a Markdown table.
//
//   realism RECORDING [--preset NAME] [--trajectory CSV --imu CSV] [--seeds N] [--set NAME=VALUE] [--jpeg QUALITY]
//
// JPEG removes noise and weak corners. If the real images are JPEG, the rendered ones must be compressed with the same
// quality before they are compared: --jpeg (92 for V1_01_easy_keyframes, by its quantisation tables).
#include <fmt/format.h>
#include <turbojpeg.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "fbvins/config/option_fields.hpp"
#include "fbvins/features/fast.hpp"
#include "fbvins/features/hamming.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/features/pyramid.hpp"
#include "fbvins/features/shi_tomasi.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/pipeline/system.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {
namespace {

/// Named figures in order of the table; each is the mean of what was added.
class Figures {
 public:
  void add(const std::string& name, double value) {
    if (!sums_.count(name)) order_.push_back(name);
    sums_[name].first += value;
    sums_[name].second += 1;
  }
  double mean(const std::string& name) const {
    const auto at = sums_.find(name);
    return at == sums_.end() ? NAN : at->second.first / at->second.second;
  }
  const std::vector<std::string>& names() const { return order_; }

 private:
  std::vector<std::string> order_;
  std::map<std::string, std::pair<double, double>> sums_;
};

void measure_corners(const Pyramid& pyramid, Figures& figures) {
  FastBuffers buffers;
  for (int l : {0, 1})
    for (int threshold : {10, 20, 40}) {
      std::vector<FastCorner> corners;
      detect_fast(pyramid.level(l), 12, threshold, buffers, corners);
      figures.add(fmt::format("FAST corners above {}{}", threshold, l ? ", half size" : ""), static_cast<double>(corners.size()));
    }
}

/// Shares of pixels whose gradient (central differences of the image smoothed 2 x 2) exceeds fixed values.
void measure_gradients(const Pyramid& pyramid, Figures& figures) {
  const PyramidLevel& image = pyramid.level(0);
  std::vector<int> histogram(400, 0);
  int count = 0;
  for (int y = 4; y < image.height - 4; ++y)
    for (int x = 4; x < image.width - 4; ++x, ++count) {
      const auto p = [&](int dx, int dy) { return static_cast<int>(image.row(y + dy)[x + dx]); };
      const double gx = (p(1, -1) + 2 * p(1, 0) + p(1, 1) - p(-1, -1) - 2 * p(-1, 0) - p(-1, 1)) / 8.0;
      const double gy = (p(-1, 1) + 2 * p(0, 1) + p(1, 1) - p(-1, -1) - 2 * p(0, -1) - p(1, -1)) / 8.0;
      ++histogram[static_cast<std::size_t>(std::min(399.0, std::hypot(gx, gy)))];
    }
  for (int limit : {2, 4, 8, 16, 32}) {
    int above = 0;
    for (int i = limit; i < 400; ++i) above += histogram[static_cast<std::size_t>(i)];
    figures.add(fmt::format("share of gradients above {} [%]", limit), 100.0 * above / count);
  }
}

/// An image's features, for the share of ORB features that find their match in another image.
struct View {
  Time t;
  OrbFeatures features;
};

std::vector<Vec2> normalise(const Camera& camera, const OrbFeatures& features) {
  std::vector<Vec2> out;
  for (const Keypoint& k : features.keypoints) out.push_back(camera.undistort(k.pixel).value_or(Vec2::Zero()));
  return out;
}

double verified_share(const Camera& camera, const OrbFeatures& a, const OrbFeatures& b, const Pose<C0, C0>& T_ab) {
  const std::vector<Vec2> na = normalise(camera, a), nb = normalise(camera, b);
  const Mat3 E = hat(T_ab.p.normalized()) * T_ab.R();
  int good = 0;
  for (const DescriptorMatch& m : match_descriptors(a.descriptors, b.descriptors, {})) {
    const Vec3 xa = na[static_cast<std::size_t>(m.a)].homogeneous(), xb = nb[static_cast<std::size_t>(m.b)].homogeneous();
    const Vec3 line = E * xb;
    const double off_px = std::abs(xa.dot(line)) / line.head<2>().norm() * camera.focal_px();
    good += off_px < 6 ? 1 : 0;
  }
  return 100.0 * good / std::max<double>(1.0, static_cast<double>(std::min(a.size(), b.size())));
}

std::optional<Pose<W, B>> pose_at(const std::vector<TrajectoryPoint>& truth, Time t) {
  const auto at = std::lower_bound(truth.begin(), truth.end(), t - Duration::from_seconds(0.03),
                                   [](const TrajectoryPoint& p, Time x) { return p.t < x; });
  std::optional<Pose<W, B>> best;
  double nearest = 0.03;
  for (auto p = at; p != truth.end() && (p->t - t).seconds() < 0.03; ++p)
    if (std::abs((p->t - t).seconds()) < nearest) nearest = std::abs((p->t - t).seconds()), best = p->T_WB;
  return best;
}

void measure_matches(const std::vector<View>& views, const StereoRig& rig, const std::vector<TrajectoryPoint>& truth,
                     Figures& figures) {
  const std::size_t step = 1 + views.size() / 150;  // a sequence has more pairs than the figure needs
  for (std::size_t i = 0; i < views.size(); i += step)
    for (std::size_t j = i + step; j < views.size(); j += step) {
      const auto a = pose_at(truth, views[i].t), b = pose_at(truth, views[j].t);
      if (!a || !b) continue;
      const Pose<C0, C0> T_ab = (*a * rig.T_BC0).inverse() * (*b * rig.T_BC0);
      if (so3_log(T_ab.q).norm() > 0.35) continue;
      for (const auto& [low, high] : {std::pair{0.15, 0.35}, {0.35, 0.7}})
        if (T_ab.p.norm() >= low && T_ab.p.norm() < high)
          figures.add(fmt::format("ORB matches, {} to {} m apart [%]", low, high),
                      verified_share(rig.left, views[i].features, views[j].features, T_ab));
    }
}

/// Measures images one by one.
class Meter {
 public:
  Meter(const StereoRig& rig, bool consecutive)
      : rig_(rig), consecutive_(consecutive), orb_(orb_options()), system_(*System::create({}, rig)) {
    system_.on_tracked_frame([this](const TrackedFrame& frame) { count_tracks(frame); });
  }
  void imu(const ImuSample& sample) {
    if (consecutive_) (void)system_.push(sample);  // finish() says why, where that fails
  }
  void frame(const StereoFrame& frame) {
    pyramid_.build(frame.left->view(), 3);
    measure_corners(pyramid_, figures_);
    measure_gradients(pyramid_, figures_);
    figures_.add("pixel noise, spatial [grey]", estimate_noise(pyramid_.level(0)));
    double sum = 0, squares = 0;
    const int n = frame.left->width() * frame.left->height();
    for (int i = 0; i < n; ++i) sum += frame.left->row(0)[i], squares += std::pow(frame.left->row(0)[i], 2);
    figures_.add("mean grey value", sum / n);
    figures_.add("contrast (standard deviation) [grey]", std::sqrt(squares / n - sum * sum / n / n));
    OrbFeatures right;
    View view{frame.t, {}};
    orb_.extract(frame.left->view(), view.features);
    orb_.extract(frame.right->view(), right);
    const Pose<C0, C0> T_ab = rig_.T_C1C0().inverse().cast_frames<C0, C0>();
    figures_.add("ORB matches, left to right [%]", stereo_share(view.features, right, T_ab));
    views_.push_back(std::move(view));
    if (consecutive_) {
      count_noise(*frame.left);
      (void)system_.push(frame);
    }
  }
  Figures finish(const std::vector<TrajectoryPoint>& truth) {
    measure_matches(views_, rig_, truth, figures_);
    if (consecutive_) {
      if (Result<void> end = system_.finish(); !end) throw std::runtime_error(end.error().message);
      for (const auto& [id, age] : last_age_)
        if (first_frame_of_[id] + 60 < frames_)
          figures_.add("KLT track length (first 60 frames) [frames]", std::min(age, 60) + 1);
      for (double s : survivors_) figures_.add("KLT features kept from frame to frame [%]", s);
    }
    return figures_;
  }

 private:
  static OrbOptions orb_options() {
    OrbOptions options;
    options.max_features = 800;
    return options;
  }
  double stereo_share(const OrbFeatures& a, const OrbFeatures& b, const Pose<C0, C0>& T_ab) {
    const std::vector<Vec2> na = normalise(rig_.left, a), nb = normalise(rig_.right, b);
    const Mat3 E = hat(T_ab.p.normalized()) * T_ab.R();
    int good = 0;
    for (const DescriptorMatch& m : match_descriptors(a.descriptors, b.descriptors, {})) {
      const Vec3 xa = na[static_cast<std::size_t>(m.a)].homogeneous(), line = E * nb[static_cast<std::size_t>(m.b)].homogeneous();
      good += std::abs(xa.dot(line)) / line.head<2>().norm() * rig_.left.focal_px() < 6 ? 1 : 0;
    }
    return 100.0 * good / std::max<double>(1.0, static_cast<double>(std::min(a.size(), b.size())));
  }
  void count_tracks(const TrackedFrame& frame) {
    ++frames_;
    for (const TrackedFeature& f : frame.features) {
      if (!last_age_.count(f.id.value)) first_frame_of_[f.id.value] = frames_;
      last_age_[f.id.value] = f.age_frames;
    }
    const double before = frame.stats.tracked + frame.stats.lost_flow + frame.stats.lost_check + frame.stats.lost_epipolar;
    if (before > 20) survivors_.push_back(100.0 * frame.stats.tracked / before);
  }
  /// While the camera rests (differences are mostly small), the difference of successive images is noise.
  void count_noise(const Image& image) {
    if (!last_.empty()) {
      std::vector<int> histogram(256, 0);
      int count = 0;
      for (int y = 8; y < image.height() - 8; y += 2)
        for (int x = 8; x < image.width() - 8; x += 2)
          ++histogram[static_cast<std::size_t>(std::abs(image.at(x, y) - last_.at(x, y)))], ++count;
      int sum = 0, at = 0;
      while (sum < 0.683 * count) sum += histogram[static_cast<std::size_t>(at++)];
      if (at <= 5) figures_.add("pixel noise at rest [grey]", interpolated(histogram, 0.683 * count) / std::sqrt(2.0));
    }
    last_ = image;
  }
  static double interpolated(const std::vector<int>& histogram, double wanted) {
    double sum = histogram[0];
    double at = 0.5;
    for (std::size_t i = 1; i < histogram.size() && sum < wanted; ++i) {
      const double h = histogram[i];
      at += sum + h > wanted ? (wanted - sum) / h : 1.0;
      sum += h;
    }
    return at;
  }

  const StereoRig& rig_;
  bool consecutive_;
  OrbExtractor orb_;
  Figures figures_;
  Pyramid pyramid_;
  std::vector<View> views_;
  Image last_;
  std::map<std::int64_t, int> last_age_, first_frame_of_;
  std::vector<double> survivors_;
  int frames_ = 0;
  System system_;
};

Figures measure_real(const std::string& path, bool& consecutive, std::vector<Time>& stamps, std::vector<TrajectoryPoint>& truth) {
  DatasetOptions options;
  options.require_imu = false;
  auto data = open_dataset(path, options);
  if (!data) {
    fmt::print(stderr, "{}\n", data.error().message);
    std::exit(2);
  }
  consecutive = (*data)->info().imu_samples > 0 && (*data)->info().image_rate_hz > 15;
  truth = (*data)->ground_truth();
  Meter meter((*data)->rig(), consecutive);
  while (auto event = (*data)->next()) {
    std::visit(Overloaded{[&](const ImuSample& sample) { meter.imu(sample); }, [](const AidingSample&) {},
                          [&](const StereoFrame& frame) {
                            stamps.push_back(frame.t);
                            meter.frame(frame);
                          }},
               *event);
  }
  return meter.finish(truth);
}

/// The image after JPEG compression of that quality.
std::shared_ptr<const Image> through_jpeg(const Image& image, int quality) {
  Image copy(image.width(), image.height());
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  tjhandle writer = tjInitCompress(), reader = tjInitDecompress();
  const bool done =
      tjCompress2(writer, image.row(0), image.width(), 0, image.height(), TJPF_GRAY, &bytes, &size, TJSAMP_GRAY, quality,
                  TJFLAG_ACCURATEDCT) == 0 &&
      tjDecompress2(reader, bytes, size, copy.row(0), image.width(), 0, image.height(), TJPF_GRAY, TJFLAG_ACCURATEDCT) == 0;
  tjFree(bytes);
  tjDestroy(writer);
  tjDestroy(reader);
  if (!done) {
    fmt::print(stderr, "libjpeg-turbo cannot encode an image\n");
    std::exit(2);
  }
  return std::make_shared<const Image>(std::move(copy));
}

Figures measure_rendered(const SimulationOptions& options, bool consecutive, const std::vector<Time>& stamps, int jpeg_quality) {
  Result<Simulation> simulation = prepare_simulation(options);
  if (!simulation) {
    fmt::print(stderr, "{}\n", simulation.error().message);
    std::exit(2);
  }
  simulation->frames.clear();
  for (Time t : stamps)
    if (t > simulation->start + Duration::from_seconds(0.02) && t < simulation->imu.samples.back().t)
      simulation->frames.push_back(t);
  DatasetContents contents = contents_of(*simulation, "rendered");
  const std::vector<TrajectoryPoint> truth = contents.ground_truth;
  Dataset data(std::move(contents), {});
  Meter meter(simulation->rig, consecutive);
  while (auto event = data.next()) {
    std::visit(Overloaded{[&](const ImuSample& sample) { meter.imu(sample); }, [](const AidingSample&) {},
                          [&](StereoFrame& frame) {
                            if (jpeg_quality > 0) {
                              frame.left = through_jpeg(*frame.left, jpeg_quality);
                              frame.right = through_jpeg(*frame.right, jpeg_quality);
                            }
                            meter.frame(frame);
                          }},
               *event);
  }
  return meter.finish(truth);
}

int compare(const std::string& recording, const SimulationOptions& asked, int seeds, int jpeg_quality) {
  SimulationOptions options = asked;
  bool consecutive = false;
  std::vector<Time> stamps;
  std::vector<TrajectoryPoint> truth;
  const Figures real = measure_real(recording, consecutive, stamps, truth);
  Figures rendered;
  for (int seed = 1; seed <= seeds; ++seed) {
    options.seed = seed;
    const Figures one = measure_rendered(options, consecutive, stamps, jpeg_quality);
    for (const std::string& name : one.names()) rendered.add(name, one.mean(name));
  }
  fmt::print("| figure | real | rendered, mean of {} worlds | rendered / real |\n|---|---:|---:|---:|\n", seeds);
  for (const std::string& name : real.names())
    fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} |\n", name, real.mean(name), rendered.mean(name),
               rendered.mean(name) / real.mean(name));
  return 0;
}

}  // namespace
}  // namespace fbvins

int main(int argc, char** argv) {
  using namespace fbvins;
  CLI::App program{"compares rendered images with real ones"};
  std::string recording, preset = "normal", trajectory, imu;
  std::vector<std::string> assignments;
  int seeds = 2, jpeg = 0;
  program.add_option("RECORDING", recording)->required();
  program.add_option("--preset", preset);
  program.add_option("--trajectory", trajectory, "if the recording's own truth is too sparse");
  program.add_option("--imu", imu);
  program.add_option("--seeds", seeds);
  program.add_option("--jpeg", jpeg, "JPEG quality with which the rendered images are compressed first; 0: they are not");
  program.add_option("--set", assignments)->take_all()->allow_extra_args(false);
  CLI11_PARSE(program, argc, argv);
  Result<SimulationOptions> options = simulation_preset(preset);
  if (!options) return fmt::print(stderr, "{}\n", options.error().message), 2;
  options->flight.duration_s = 3600;
  options->recorded.trajectory = trajectory.empty() ? recording + "/mav0/state_groundtruth_estimate0/data.csv" : trajectory;
  options->recorded.imu = imu.empty() ? recording + "/mav0/imu0/data.csv" : imu;
  const auto fields = fields_of(*options);
  for (const std::string& assignment : assignments)
    if (Result<void> set = set_option(fields, assignment); !set) return fmt::print(stderr, "{}\n", set.error().message), 2;
  return compare(recording, *options, seeds, jpeg);
}
