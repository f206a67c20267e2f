// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/tag_alignment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace fbvins {
namespace {

using Vec12 = Eigen::Matrix<double, 12, 1>;
using Mat12 = Eigen::Matrix<double, 12, 12>;

constexpr int kCells = 8;
/// Of the white margin, this part of a cell is compared; corners of the margin are not, other things may touch the tag there.
constexpr double kMargin = 0.7;
/// Pixels that are compared: of a larger tag, evenly so many.
constexpr int kFewest = 150, kMost = 2500;
constexpr int kIterations = 12;
/// Errors of neighbouring pixels are not independent: factor on the covariance.
constexpr double kCorrelated = 8;
constexpr double kLeastContrast = 15, kLargestResidual = 0.12;  ///< grey values; of the contrast
constexpr double kLargestMove_px = 1.5;
/// Priors: blur, and how far the response is from a line.
constexpr double kBlur_px = 0.8, kBlurSigma_px = 0.4, kBend = 0, kBendSigma = 0.5;
constexpr double kReach_sigma = 3.5;

struct Pixel {
  Vec3 ray;
  double grey;
};

/// What is estimated beside the pose: grey values of black and of white in the middle, how white changes towards the right and
/// the bottom edge, the blur, and the bend of the response, f = m + bend m (1 - m) of a white share m.
struct Look {
  double black = 0, white = 0, right = 0, down = 0, blur_px = kBlur_px, bend = kBend;
};

/// Share of one cell [0, 1] in a Gaussian of unit integral around x, and its derivatives by x and by sigma.
struct Share {
  double value, by_x, by_sigma;
};
Share share_of(double x, double sigma) {
  const double a = -x / sigma, b = (1 - x) / sigma;
  const auto cumulative = [](double z) { return 0.5 * std::erfc(-z * std::numbers::sqrt2 / 2); };
  const auto density = [](double z) { return std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi); };
  const double da = density(a), db = density(b);
  return {cumulative(b) - cumulative(a), (da - db) / sigma, (a * da - b * db) / sigma};
}

/// White share around (u, v), in cells from the top left, with the derivatives by u, v and both sigmas.
struct White {
  double value = 1, by_u = 0, by_v = 0, by_sigma_u = 0, by_sigma_v = 0;
};
White white_at(const TagCells& cells, double u, double v, double sigma_u, double sigma_v) {
  const auto first = [](double x, double s) { return std::max(0, static_cast<int>(std::floor(x - kReach_sigma * s))); };
  const auto last = [](double x, double s) { return std::min(kCells - 1, static_cast<int>(std::floor(x + kReach_sigma * s))); };
  std::array<Share, kCells> column;
  const int left = first(u, sigma_u), right = last(u, sigma_u);
  for (int i = left; i <= right; ++i) column[static_cast<std::size_t>(i)] = share_of(u - i, sigma_u);
  White out;
  for (int j = first(v, sigma_v); j <= last(v, sigma_v); ++j) {
    const Share row = share_of(v - j, sigma_v);
    for (int i = left; i <= right; ++i) {
      if (!cells[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)]) continue;
      const Share& c = column[static_cast<std::size_t>(i)];
      out.value -= row.value * c.value;
      out.by_u -= row.value * c.by_x, out.by_v -= row.by_x * c.value;
      out.by_sigma_u -= row.value * c.by_sigma, out.by_sigma_v -= row.by_sigma * c.value;
    }
  }
  return out;
}

class Alignment {
 public:
  Alignment(const ImageView& image, const Camera& camera, const TagCells& cells, double size_m)
      : image_(image), camera_(camera), cells_(cells), cell_m_(size_m / kCells) {}

  bool begin(const Pose<Cn, T>& start) {
    pose_ = start;
    if (!collect()) return false;
    std::vector<double> greys;
    for (const Pixel& p : pixels_) greys.push_back(p.grey);
    std::ranges::sort(greys);
    look_ = {.black = greys[greys.size() / 10], .white = greys[greys.size() * 9 / 10]};
    return look_.white - look_.black > kLeastContrast;
  }

  void solve() {
    double damping = 1e-3;
    Normal now = normal(pose_, look_);
    for (int i = 0; i < kIterations; ++i) {
      Mat12 A = now.A;
      A.diagonal() *= 1 + damping;
      const Vec12 step = A.ldlt().solve(-now.b);
      const Pose<Cn, T> pose = moved(pose_, step);
      const Look look = changed(look_, step);
      const Normal next = normal(pose, look);
      if (!(next.cost < now.cost)) {
        damping *= 10;
        continue;
      }
      const bool done = now.cost - next.cost < 1e-4 * now.cost;
      pose_ = pose, look_ = look, now = next, damping *= 0.2;
      if (done) break;
    }
    result_ = now;
  }

  std::optional<AlignedTag> aligned(const Pose<Cn, T>& start) const {
    const double variance = std::max(1.0, result_.squared_grey / static_cast<double>(pixels_.size()));
    const double contrast = look_.white - look_.black;
    if (contrast < kLeastContrast || std::sqrt(variance) > kLargestResidual * contrast) return std::nullopt;
    for (const double x : {0, kCells})
      for (const double y : {0, kCells}) {
        const Vec3 corner = cell_m_ * Vec3(x, y, 0);
        const auto before = camera_.pixel_of(start * corner), now = camera_.pixel_of(pose_ * corner);
        if (!before || !now || (*before - *now).norm() > kLargestMove_px) return std::nullopt;
      }
    const Mat12 covariance = kCorrelated * variance * result_.A.inverse();
    return AlignedTag{pose_, covariance.topLeftCorner<6, 6>(), result_.squared_grey, kCorrelated * variance};
  }

 private:
  struct Normal {
    Mat12 A = Mat12::Zero();
    Vec12 b = Vec12::Zero();
    double cost = 0, squared_grey = 0;
  };
  struct OnTag {
    double u, v;
    Vec3 p_T;
    double along;  ///< of the ray, in lengths of it
  };

  std::optional<OnTag> on_tag(const Pose<Cn, T>& pose, const Vec3& ray) const {
    const Vec3 n = pose.q * Vec3::UnitZ();
    const double along = n.dot(pose.p) / n.dot(ray);
    if (!(along > 0)) return std::nullopt;
    const Vec3 p_T = pose.q.conjugate() * Vec3(along * ray - pose.p);
    return OnTag{p_T.x() / cell_m_, kCells - p_T.y() / cell_m_, p_T, along};
  }

  /// Pixels of the tag and its margin.
  bool collect() {
    Vec2 low(1e9, 1e9), high(-1e9, -1e9);
    for (const double x : {-kMargin, kCells + kMargin})
      for (const double y : {-kMargin, kCells + kMargin}) {
        const auto p = camera_.pixel_of(pose_ * (cell_m_ * Vec3(x, y, 0)));
        if (!p || !camera_.inside(*p, 1)) return false;
        low = low.cwiseMin(*p), high = high.cwiseMax(*p);
      }
    const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt((high - low).prod() / kMost))));
    for (int y = static_cast<int>(low.y()); y <= high.y(); y += step)
      for (int x = static_cast<int>(low.x()); x <= high.x(); x += step) {
        const auto ray = camera_.ray(Vec2(x, y));
        const auto at = ray ? on_tag(pose_, *ray) : std::nullopt;
        if (!at) continue;
        const auto outside = [](double c) { return c < 0 || c > kCells; };
        const auto beyond = [](double c) { return c < -kMargin || c > kCells + kMargin; };
        if (beyond(at->u) || beyond(at->v) || (outside(at->u) && outside(at->v))) continue;
        pixels_.push_back({*ray, static_cast<double>(image_.row(y)[x])});
      }
    return static_cast<int>(pixels_.size()) >= kFewest;
  }

  /// Cells per pixel in the middle of the tag, along a row and along a column of it.
  Vec2 cells_per_pixel(const Pose<Cn, T>& pose) const {
    const Vec3 middle = 0.5 * kCells * cell_m_ * Vec3(1, 1, 0);
    const auto here = camera_.pixel_of(pose * middle), right = camera_.pixel_of(pose * (middle + cell_m_ * Vec3::UnitX())),
               up = camera_.pixel_of(pose * (middle + cell_m_ * Vec3::UnitY()));
    if (!here || !right || !up) return Vec2::Ones();
    Mat2 J;  // pixels per cell
    J << *right - *here, *up - *here;
    const Mat2 inverse = J.inverse();
    return {inverse.row(0).norm(), inverse.row(1).norm()};
  }

  Normal normal(const Pose<Cn, T>& pose, const Look& look) const {
    Normal out;
    const Vec2 scale = cells_per_pixel(pose);
    const Mat3 R = pose.R();
    for (const Pixel& pixel : pixels_) {
      const auto at = on_tag(pose, pixel.ray);
      if (!at) continue;
      const White m = white_at(cells_, at->u, at->v, look.blur_px * scale.x(), look.blur_px * scale.y());
      const double x = at->u / 4 - 1, y = at->v / 4 - 1;  // -1 to 1 across the tag
      const double contrast = look.white + look.right * x + look.down * y - look.black;
      const double bent = m.value + look.bend * m.value * (1 - m.value), slope = contrast * (1 + look.bend * (1 - 2 * m.value));
      const double r = look.black + contrast * bent - pixel.grey;
      const double by_u = slope * m.by_u + 0.25 * look.right * bent, by_v = slope * m.by_v + 0.25 * look.down * bent;
      // Of a point of the plane on this ray, by the plane's pose (dp in the camera, dtheta in T).
      const Vec3 n = R.col(2);
      const double cosine = n.dot(pixel.ray);
      const Vec3 ray_T = R.transpose() * pixel.ray;
      Eigen::Matrix<double, 3, 6> J;
      J.leftCols<3>() = ray_T * (n.transpose() / cosine) - R.transpose();
      // dn = R (dtheta x e_z), so that dalong = -dn . P / cosine with P = along ray - p
      const Vec3 dalong = -Vec3(-at->p_T.y(), at->p_T.x(), 0) / cosine;
      J.rightCols<3>() = ray_T * dalong.transpose() + hat(at->p_T);
      Vec12 j;
      j.head<6>() = (by_u * J.row(0) - by_v * J.row(1)).transpose() / cell_m_;
      j.tail<6>() << 1 - bent, bent, bent * x, bent * y, slope * (m.by_sigma_u * scale.x() + m.by_sigma_v * scale.y()),
          contrast * m.value * (1 - m.value);
      out.A += j * j.transpose();
      out.b += j * r;
      out.squared_grey += r * r;
    }
    out.cost = out.squared_grey;
    add_prior(out, 10, look.blur_px - kBlur_px, kBlurSigma_px);
    add_prior(out, 11, look.bend - kBend, kBendSigma);
    return out;
  }

  /// As of one pixel of the usual noise.
  static void add_prior(Normal& out, int i, double off, double sigma) {
    constexpr double kNoise_grey = 3;
    const double weight = kNoise_grey * kNoise_grey / (sigma * sigma);
    out.A(i, i) += weight, out.b[i] += weight * off, out.cost += weight * off * off;
  }

  static Pose<Cn, T> moved(const Pose<Cn, T>& pose, const Vec12& step) {
    return {(pose.q * so3_exp(step.segment<3>(3))).normalized(), Vec3(pose.p + step.head<3>())};
  }
  static Look changed(const Look& look, const Vec12& s) {
    return {look.black + s[6],
            look.white + s[7],
            look.right + s[8],
            look.down + s[9],
            std::clamp(look.blur_px + s[10], 0.3, 3.0),
            std::clamp(look.bend + s[11], -0.9, 0.9)};
  }

  const ImageView& image_;
  const Camera& camera_;
  const TagCells& cells_;
  double cell_m_;
  std::vector<Pixel> pixels_;
  Pose<Cn, T> pose_;
  Look look_;
  Normal result_;
};

}  // namespace

std::optional<AlignedTag> align_tag(const ImageView& image, const Camera& camera, const TagCells& cells, double size_m,
                                    const Pose<Cn, T>& start) {
  Alignment alignment(image, camera, cells, size_m);
  if (!alignment.begin(start)) return std::nullopt;
  alignment.solve();
  return alignment.aligned(start);
}

}  // namespace fbvins
