// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/camera_chain.hpp"

#include "fbvins/core/median.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

namespace fbvins {
namespace {

/// The camera at hand and another one.
using Link = Pose<Cn, Cn>;

/// How far apart two poses are, in the larger of angle (rad) and translation by the board's distance.
double difference(const Link& a, const Link& b, double distance_m) {
  return so3_log(a.q.conjugate() * b.q).norm() + (a.p - b.p).norm() / std::max(distance_m, 1e-3);
}

/// The link with which most others agree, averaged with those that do.
Link agreed(const std::vector<Link>& links, double distance_m) {
  std::size_t best = 0;
  double best_median = std::numeric_limits<double>::infinity();
  std::vector<double> differences(links.size());
  const std::size_t step = std::max<std::size_t>(1, links.size() / 200);
  for (std::size_t i = 0; i < links.size(); i += step) {
    for (std::size_t j = 0; j < links.size(); ++j) differences[j] = difference(links[i], links[j], distance_m);
    const double typical = median(differences);
    if (typical >= best_median) continue;
    best_median = typical;
    best = i;
  }
  Vec3 turn = Vec3::Zero(), move = Vec3::Zero();
  int count = 0;
  for (const Link& link : links) {
    if (difference(links[best], link, distance_m) > 2 * best_median + 1e-9) continue;
    turn += so3_log(links[best].q.conjugate() * link.q);
    move += link.p - links[best].p;
    ++count;
  }
  return links[best].boxplus(move / count, turn / count);
}

const PosedView* view_of(const std::vector<PosedView>& stamp, int camera) {
  const auto found = std::ranges::find(stamp, camera, [](const PosedView& v) { return v.view.camera; });
  return found == stamp.end() ? nullptr : &*found;
}

/// T_CbCa of every stamp at which both see the board; the mean distance of the board.
std::vector<Link> links_of(const std::vector<std::vector<PosedView>>& stamps, int a, int b, double& distance_m) {
  std::vector<Link> out;
  distance_m = 0;
  for (const auto& stamp : stamps) {
    const PosedView *first = view_of(stamp, a), *second = view_of(stamp, b);
    if (!first || !second) continue;
    out.push_back(second->T_CnT * first->T_CnT.inverse());
    distance_m += second->T_CnT.p.norm();
  }
  if (!out.empty()) distance_m /= static_cast<double>(out.size());
  return out;
}

}  // namespace

std::vector<std::vector<PosedView>> joined_by_stamp(std::vector<PosedView> views, double tolerance_s) {
  std::ranges::stable_sort(views, [](const PosedView& a, const PosedView& b) {
    return a.view.t != b.view.t ? a.view.t < b.view.t : a.view.camera < b.view.camera;
  });
  std::vector<std::vector<PosedView>> out;
  for (PosedView& view : views) {
    const bool same = !out.empty() && (view.view.t - out.back().front().view.t).seconds() <= tolerance_s &&
                      !view_of(out.back(), view.view.camera);
    if (!same) out.emplace_back();
    out.back().push_back(std::move(view));
  }
  return out;
}

Result<std::vector<Pose<Cn, C0>>> chain_cameras(const std::vector<std::vector<PosedView>>& stamps, int cameras) {
  std::vector<std::vector<int>> common(cameras, std::vector<int>(cameras, 0));
  for (const auto& stamp : stamps)
    for (const PosedView& a : stamp)
      for (const PosedView& b : stamp) ++common[a.view.camera][b.view.camera];
  std::vector<std::optional<Pose<Cn, C0>>> known(cameras);
  known[0] = Pose<Cn, C0>();
  for (int round = 1; round < cameras; ++round) {
    int from = -1, to = -1;
    for (int a = 0; a < cameras; ++a)
      for (int b = 0; b < cameras; ++b)
        if (known[a] && !known[b] && common[a][b] > 0 && (from < 0 || common[a][b] > common[from][to])) from = a, to = b;
    if (from < 0) break;
    double distance_m = 0;
    const std::vector<Link> links = links_of(stamps, from, to, distance_m);
    known[to] = agreed(links, distance_m) * *known[from];
  }
  std::vector<Pose<Cn, C0>> out;
  for (int k = 0; k < cameras; ++k) {
    if (!known[k])
      return Error{
          ErrorCode::invalid_argument,
          fmt::format("cam{} never sees the board at the same time as cam0 or a camera that is connected with cam0: record "
                      "the board where two cameras see it, or check that their images have the same stamps",
                      k)};
    out.push_back(*known[k]);
  }
  return out;
}

std::vector<RigFrame> rig_frames(const std::vector<std::vector<PosedView>>& stamps, const std::vector<Pose<Cn, C0>>& T_CnC0,
                                 const Board& board) {
  std::vector<RigFrame> out;
  for (const auto& stamp : stamps) {
    const auto fullest = std::ranges::max_element(stamp, {}, [](const PosedView& v) { return v.view.corners.size(); });
    RigFrame frame{stamp.front().view.t, {}, T_CnC0[fullest->view.camera].inverse() * fullest->T_CnT};
    for (const PosedView& posed : stamp) {
      SeenBoard seen{posed.view.camera, {}};
      for (const BoardCorner& corner : posed.view.corners)
        seen.corners.push_back({corner.index, board.corner(corner.index), corner.pixel});
      frame.views.push_back(std::move(seen));
    }
    out.push_back(std::move(frame));
  }
  return out;
}

}  // namespace fbvins
