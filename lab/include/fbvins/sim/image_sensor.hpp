// SPDX-License-Identifier: Apache-2.0
// Converts radiance to grey values: exposure control with lag, lens blur and vignetting, veiling glare,
// shot and read noise, gain, saturation. One ImageSensor per camera; images in order of time.
//
//   ImageSensor sensor(options, camera, factor, seed);
//   double exposure_s = sensor.exposure_s();      // render the radiance for that exposure
//   Image image = sensor.expose(radiance, frame);
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

struct CameraModelOptions {
  int time_samples = 4;
  double line_delay_us = 0;
  double untriggered_ms = 0;
  double untriggered_drift_us_per_s = 0;
  bool auto_exposure = true;
  double target_level = 130;
  double exposure_lag_frames = 8;
  double min_exposure_ms = 0.3;
  double max_exposure_ms = 5;
  double max_gain = 6;
  double gain_step_db = 0;
  std::string intervals_ms = "";
  double interval_for_s = 3;
  double sensitivity = 60;
  double shot_noise = 0.012;
  double read_noise = 0.4;
  double black_level = 0;
  double blur_px = 0.65;
  double vignetting = 0.35;
  double glare = 0.02;
  double right_gain = 0.94;
  double stamp_jitter_us = 20;
  double stamp_noise_us = 0;
  double drop_share = 0;
  double time_offset_ms = 0;
  double later_ms = 0;
  int legs = 0;
  int propellers = 0;
  int dirt = 0;
  double dirt_from_s = 0;
  double dirt_until_s = 1e6;

  template <class V>
  void visit(V&& v) {
    v("time_samples", time_samples, "", "instants rendered and summed over the exposure; they also antialias", 1, 64);
    v("line_delay_us", line_delay_us, "us", "rolling shutter: time from line to line, 0 for a global shutter", 0.0, 200.0);
    v("untriggered_ms", untriggered_ms, "ms",
      "no common trigger: each camera but the first takes its images this long before the one before it", 0.0, 1000.0);
    v("untriggered_drift_us_per_s", untriggered_drift_us_per_s, "us/s",
      "how much earlier with each second, as clocks of their own would", 0.0, 1e4);
    v("auto_exposure", auto_exposure, "", "exposure follows the images' mean level");
    v("target_level", target_level, "", "mean grey value that the exposure aims at", 5.0, 250.0);
    v("exposure_lag_frames", exposure_lag_frames, "", "time constant of the exposure control, in frames", 0.0, 200.0);
    v("min_exposure_ms", min_exposure_ms, "ms", "shortest exposure", 0.01, 50.0);
    v("max_exposure_ms", max_exposure_ms, "ms", "longest exposure; in less light the gain rises", 0.01, 50.0);
    v("max_gain", max_gain, "", "largest gain; the smallest is 1", 1.0, 100.0);
    v("gain_step_db", gain_step_db, "dB", "steps of the gain, 0 for none", 0.0, 12.0);
    v("intervals_ms", intervals_ms, "",
      "intervals between images that the exposure control changes between, in ms, apart by commas: the longest exposure grows "
      "with the interval; empty: always that of image_rate_hz");
    v("interval_for_s", interval_for_s, "s", "how long an interval stays", 0.1, 1e4);
    v("sensitivity", sensitivity, "1/ms", "grey value of radiance 1 after one millisecond at gain 1", 0.1, 10000.0);
    v("shot_noise", shot_noise, "", "variance of the grey value per grey value and gain", 0.0, 5.0);
    v("read_noise", read_noise, "", "standard deviation in grey values at gain 1", 0.0, 50.0);
    v("black_level", black_level, "", "grey value without light", 0.0, 100.0);
    v("blur_px", blur_px, "px", "standard deviation of the lens' blur", 0.0, 5.0);
    v("vignetting", vignetting, "", "light lost at 45 degrees from the axis", 0.0, 0.95);
    v("glare", glare, "", "share of the light that the lens scatters over the image", 0.0, 0.9);
    v("right_gain", right_gain, "", "the right camera's brightness, relative to the left's", 0.1, 10.0);
    v("stamp_jitter_us", stamp_jitter_us, "us", "jitter of the right image's stamp, standard deviation", 0.0, 2000.0);
    v("stamp_noise_us", stamp_noise_us, "us", "noise of the stamps of all images of a frame, standard deviation", 0.0, 1e4);
    v("drop_share", drop_share, "", "share of stereo frames that are lost", 0.0, 0.9);
    v("time_offset_ms", time_offset_ms, "ms", "IMU stamp less image stamp of the same instant", -100.0, 100.0);
    v("later_ms", later_ms, "ms",
      "each camera but the first takes its images this much later than the one before it, with the same stamps", 0.0, 10.0);
    v("legs", legs, "", "legs of the vehicle in the view of each camera, at the same pixels in every image", 0, 6);
    v("propellers", propellers, "", "turning propellers in the view of each camera, in its upper corners", 0, 2);
    v("dirt", dirt, "", "blots and hairs on the lens of the first camera, out of focus", 0, 6);
    v("dirt_from_s", dirt_from_s, "s", "when the dirt comes, since the start", 0.0, 1e6);
    v("dirt_until_s", dirt_until_s, "s", "when it is wiped off", 0.0, 1e6);
  }
};

class ImageSensor {
 public:
  ImageSensor(const CameraModelOptions& options, const Camera& camera, double brightness, std::uint64_t seed);

  /// Exposure time of the next image.
  double exposure_s() const { return exposure_ms_ * 1e-3; }
  double gain() const { return gain_; }
  /// The exposure of the next image may be longer by this factor than the options say.
  void allow_longer(double factor);
  /// Sets exposure and gain to the values that they settle at for this radiance.
  void settle(const std::vector<float>& radiance);
  /// Image of the radiance (row by row, changed in place). `frame` seeds the noise.
  Image expose(std::vector<float>& radiance, std::int64_t frame);

 private:
  void blur(std::vector<float>& image);
  void add_glare(std::vector<float>& image) const;
  void follow(double mean_radiance, double share);
  void divide_product();

  CameraModelOptions options_;
  int width_, height_;
  double brightness_;
  std::uint64_t seed_;
  double exposure_ms_, gain_ = 1, log_product_, longer_ = 1;
  std::vector<float> falloff_, rows_;
  double lit_pixels_ = 1;  // of an image
};

}  // namespace fbvins
