// SPDX-License-Identifier: Apache-2.0
// Parameters of the lens models: fx, fy, cx, cy in px, then the distortion's. With n = (x/z, y/z) and s = |n|^2, a pixel is
// (fx u + cx, fy v + cy) of the distorted (u, v) that each model states. The formulas are in src/fbvins/camera/lenses.hpp.
#pragma once

#include <variant>

namespace fbvins {

/// Pinhole with two radial and two tangential coefficients (Brown), OpenCV's and Kalibr's "radtan".
struct PinholeRadtan {
  double fx = 1, fy = 1, cx = 0, cy = 0;  ///< px
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;
};

/// Kannala-Brandt with four coefficients, Kalibr's "equidistant", OpenCV's fisheye, Basalt's "kb4".
struct KannalaBrandt {
  double fx = 1, fy = 1, cx = 0, cy = 0;  ///< px
  double k1 = 0, k2 = 0, k3 = 0, k4 = 0;
};

/// Double sphere, "ds" of Kalibr and Basalt (Usenko, Demmel, Cremers 2018, section 3.5): d1 = sqrt(s + 1), w = xi d1 + 1,
/// d2 = sqrt(s + w^2), (u, v) = n / (alpha d2 + (1 - alpha) w); xi in (-1, 1), alpha in [0, 1].
struct DoubleSphere {
  double fx = 1, fy = 1, cx = 0, cy = 0;  ///< px
  double xi = 0, alpha = 0;
};

/// Extended unified, "eucm" of Kalibr and Basalt (Khomutenko, Garcia, Martinet 2016): d = sqrt(beta s + 1),
/// (u, v) = n / (alpha d + 1 - alpha); alpha in [0, 1], beta > 0.
struct ExtendedUnified {
  double fx = 1, fy = 1, cx = 0, cy = 0;  ///< px
  double alpha = 0, beta = 1;
};

/// Unified projection followed by Brown's distortion (Mei, Rives 2007), "omni" with "radtan" of Kalibr, "MEI" of camodocal:
/// n / (xi sqrt(s + 1) + 1), distorted as PinholeRadtan does; xi >= 0.
struct UnifiedRadtan {
  double fx = 1, fy = 1, cx = 0, cy = 0;  ///< px
  double xi = 0, k1 = 0, k2 = 0, p1 = 0, p2 = 0;
};

/// Pinhole with a third radial coefficient, ROS's "plumb_bob": n (1 + k1 s + k2 s^2 + k3 s^3) and PinholeRadtan's tangential
/// part.
struct PinholeRadtan5 {
  double fx = 1, fy = 1, cx = 0, cy = 0;  ///< px
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
};

/// OpenCV's rational model, ROS's "rational_polynomial", the same divided by 1 + k4 s + k5 s^2 + k6 s^3.
struct PinholeRational {
  double fx = 1, fy = 1, cx = 0, cy = 0;  ///< px
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0, k4 = 0, k5 = 0, k6 = 0;
};

using LensModel =
    std::variant<PinholeRadtan, KannalaBrandt, DoubleSphere, ExtendedUnified, UnifiedRadtan, PinholeRadtan5, PinholeRational>;

}  // namespace fbvins
