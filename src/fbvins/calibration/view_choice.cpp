// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/view_choice.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

namespace fbvins {
namespace {

using Features = Eigen::Matrix<double, 5, 1>;

/// Place in the image, log of the size, and shape of the affine map from board to image, all about one.
Features features_of(const BoardView& view, const Board& board, double width_px) {
  Vec2 mean_T = Vec2::Zero(), mean = Vec2::Zero();
  const double n = static_cast<double>(view.corners.size());
  for (const BoardCorner& corner : view.corners) {
    mean_T += board.corner(corner.index).head<2>() / n;
    mean += corner.pixel / n;
  }
  Mat2 square = 1e-12 * Mat2::Identity(), mixed = Mat2::Zero();
  for (const BoardCorner& corner : view.corners) {
    const Vec2 d = board.corner(corner.index).head<2>() - mean_T;
    square += d * d.transpose();
    mixed += (corner.pixel - mean) * d.transpose();
  }
  const Mat2 A = mixed * square.inverse(), shape = A * A.transpose();
  const double trace = std::max(shape.trace(), 1e-12);
  Features f;
  f << 2 * mean.x() / width_px, 2 * mean.y() / width_px, 0.5 * std::log(trace), 2 * (shape(0, 0) - shape(1, 1)) / trace,
      4 * shape(0, 1) / trace;
  return f;
}

double log_determinant(const Eigen::MatrixXd& m) {
  const Eigen::LLT<Eigen::MatrixXd> llt(m);
  if (llt.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
  return 2 * llt.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

std::vector<BoardView> spread_views(const std::vector<BoardView>& views, const Board& board, double width_px, int count) {
  if (views.empty()) return {};
  std::vector<Features> features;
  for (const BoardView& view : views) features.push_back(features_of(view, board, width_px));
  std::vector<double> distance(views.size(), std::numeric_limits<double>::infinity());
  const auto fullest = std::ranges::max_element(views, {}, [](const BoardView& v) { return v.corners.size(); });
  std::size_t next = static_cast<std::size_t>(fullest - views.begin());
  std::vector<BoardView> out;
  while (static_cast<int>(out.size()) < std::min<int>(count, static_cast<int>(views.size()))) {
    out.push_back(views[next]);
    for (std::size_t i = 0; i < views.size(); ++i) distance[i] = std::min(distance[i], (features[i] - features[next]).norm());
    distance[next] = -1;
    next = static_cast<std::size_t>(std::ranges::max_element(distance) - distance.begin());
  }
  return out;
}

std::vector<int> most_informative(const std::vector<Eigen::MatrixXd>& information, int count) {
  std::vector<int> chosen;
  if (information.empty()) return chosen;
  // Gains never grow while the sum grows, so that only the one that seems best has to be computed anew.
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(information[0].rows(), information[0].cols());
  for (const Eigen::MatrixXd& one : information) sum += one;
  sum = Eigen::MatrixXd((1e-6 * sum.diagonal().array() + 1e-12).matrix().asDiagonal());
  double now = log_determinant(sum);
  std::priority_queue<std::pair<double, int>> gains;
  for (std::size_t i = 0; i < information.size(); ++i)
    gains.push({log_determinant(sum + information[i]) - now, -static_cast<int>(i)});
  while (!gains.empty() && static_cast<int>(chosen.size()) < count) {
    const int i = -gains.top().second;
    gains.pop();
    const double gain = log_determinant(sum + information[i]) - now;
    if (!gains.empty() && gain < gains.top().first) {
      gains.push({gain, -i});
      continue;
    }
    chosen.push_back(i);
    sum += information[i];
    now = log_determinant(sum);
  }
  std::ranges::sort(chosen);
  return chosen;
}

}  // namespace fbvins
