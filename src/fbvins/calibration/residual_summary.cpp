// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/residual_summary.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace fbvins {
namespace {

constexpr int kColumns = 16, kBins = 20;

/// Equal steps from 0 to the largest of `at`.
std::vector<ResidualBin> binned(const std::vector<double>& at, const std::vector<const CornerResidual*>& residuals,
                                const Vec2& centre) {
  const double step = at.empty() ? 0 : std::ranges::max(at) / kBins;
  std::vector<ResidualBin> bins(step > 0 ? kBins : 0);
  if (bins.empty()) return bins;
  for (int i = 0; i < kBins; ++i) bins[i].from = i * step, bins[i].to = (i + 1) * step;
  for (std::size_t i = 0; i < at.size(); ++i) {
    ResidualBin& bin = bins[std::min(kBins - 1, static_cast<int>(at[i] / step))];
    const Vec2 &r = residuals[i]->residual_px, out = residuals[i]->pixel - centre;
    ++bin.corners, bin.rms_px += r.squaredNorm(), bin.outwards_px += out.norm() > 0 ? r.dot(out.normalized()) : 0;
  }
  for (ResidualBin& bin : bins)
    if (bin.corners > 0) bin.rms_px = std::sqrt(bin.rms_px / (2 * bin.corners)), bin.outwards_px /= bin.corners;
  return bins;
}

std::vector<ResidualCell> in_cells(const ImageCells& grid, const std::vector<const CornerResidual*>& residuals) {
  std::vector<ResidualCell> cells(static_cast<std::size_t>(grid.count()));
  for (const CornerResidual* r : residuals) {
    ResidualCell& cell = cells[static_cast<std::size_t>(grid.cell_of(r->pixel))];
    ++cell.corners, cell.mean_px += r->residual_px;
  }
  for (ResidualCell& cell : cells)
    if (cell.corners > 0) cell.mean_px /= cell.corners;
  return cells;
}

std::vector<ViewResidual> in_views(const std::vector<const CornerResidual*>& residuals) {
  std::map<Time, ViewResidual> views;
  for (const CornerResidual* r : residuals) {
    ViewResidual& view = views[r->t];
    view.t = r->t, ++view.corners, view.rms_px += r->residual_px.squaredNorm();
  }
  std::vector<ViewResidual> out;
  for (auto& [t, view] : views) {
    view.rms_px = std::sqrt(view.rms_px / (2 * view.corners));
    out.push_back(view);
  }
  return out;
}

}  // namespace

ImageCells ImageCells::of(double width_px, double height_px) {
  return {kColumns, std::max(1, static_cast<int>(std::lround(kColumns * height_px / width_px))), width_px, height_px};
}

int ImageCells::cell_of(const Vec2& pixel) const {
  const int u = std::clamp(static_cast<int>(columns * (pixel.x() + 0.5) / width_px), 0, columns - 1);
  const int v = std::clamp(static_cast<int>(rows * (pixel.y() + 0.5) / height_px), 0, rows - 1);
  return v * columns + u;
}

Vec2 ImageCells::centre(int cell) const {
  return {(cell % columns + 0.5) * width_px / columns - 0.5, (cell / columns + 0.5) * height_px / rows - 0.5};
}

std::vector<CameraResiduals> summarise_residuals(const CameraCalibration& found) {
  std::vector<CameraResiduals> out;
  for (std::size_t k = 0; k < found.cameras.size(); ++k) {
    const Camera& camera = found.cameras[k].camera;
    const Vec2 centre(camera.intrinsics()[2], camera.intrinsics()[3]);
    std::vector<const CornerResidual*> all, in_front;
    std::vector<double> radius_px, angle_rad;
    for (const CornerResidual& r : found.residuals) {
      if (r.camera != static_cast<int>(k)) continue;
      all.push_back(&r), radius_px.push_back((r.pixel - centre).norm());
      if (const auto ray = camera.undistort(r.pixel)) in_front.push_back(&r), angle_rad.push_back(std::atan(ray->norm()));
    }
    const ImageCells grid = ImageCells::of(camera);
    out.push_back(
        {grid, in_cells(grid, all), binned(radius_px, all, centre), binned(angle_rad, in_front, centre), in_views(all)});
  }
  return out;
}

}  // namespace fbvins
