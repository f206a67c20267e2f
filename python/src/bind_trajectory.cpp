// SPDX-License-Identifier: Apache-2.0
// Trajectories and their evaluation.
#include <fmt/format.h>

#include "apps/evaluation_report.hpp"
#include "bindings.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/io/trajectory.hpp"
#include "python_types.hpp"

namespace fbvins::python {
namespace {

using Point = StampedPose<AnyWorld>;

PyTrajectory make_trajectory(nb::handle t, nb::handle p, nb::handle q) {
  const auto stamps = checked<std::int64_t>(t, "t", {kAny});
  const auto n = static_cast<std::int64_t>(stamps.rows());
  const auto positions = checked<double>(p, "p", {n, 3}), quaternions = checked<double>(q, "q", {n, 4});
  PyTrajectory out;
  for (std::size_t i = 0; i < stamps.rows(); ++i) {
    const double* at = positions.data + 3 * i;
    const double* w = quaternions.data + 4 * i;
    const Quat rotation(w[0], w[1], w[2], w[3]);
    if (!(std::abs(rotation.norm() - 1) < 1e-3))
      throw nb::value_error(
          fmt::format("q: row {} has norm {:.6g}; unit quaternions are expected, w first", i, rotation.norm()).c_str());
    out.poses.push_back({Time{stamps.data[i]}, {rotation.normalized(), Vec3(at[0], at[1], at[2])}});
  }
  return out;
}

PyTrajectory read(const std::string& path) { return value_or_raise(read_trajectory(path)).poses<AnyWorld>(); }

void write(const PyTrajectory& trajectory, const std::string& path) {
  TumWriter writer = value_or_raise(TumWriter::create(path));
  for (const Point& point : trajectory.poses) writer.write(point.t, point.T);
  check(writer.close());
}

struct PyEvaluation : Evaluation {
  Alignment kind = Alignment::se3;
};

PyEvaluation evaluate(const PyTrajectory& truth, const PyTrajectory& estimate, const std::string& align, double max_difference_s,
                      bool interpolate) {
  EvaluationOptions options;
  const auto alignment = alignment_from_string(align);
  if (!alignment)
    throw nb::value_error(fmt::format("align: 'se3', 'yaw', 'sim3' or 'none' is expected, not '{}'", align).c_str());
  options.alignment = *alignment;
  options.association.max_difference_s = max_difference_s;
  if (interpolate) options.association.method = AssociationMethod::interpolate_truth;
  Result<Evaluation> evaluation = [&] {
    nb::gil_scoped_release released;
    return fbvins::evaluate(truth, estimate, options);
  }();
  return {value_or_raise(std::move(evaluation)), *alignment};
}

}  // namespace

void bind_trajectory(nb::module_& m) {
  nb::class_<PyTrajectory>(m, "Trajectory", "Poses of the body in one world, in order of time.")
      .def(nb::new_(&make_trajectory), "t"_a, "p"_a, "q"_a,
           "t: int64 (N,), ns. p: float64 (N, 3), m. q: float64 (N, 4), unit quaternions, w first. Both take body to world.")
      .def_static("read", &read, "path"_a, "A TUM file, or a CSV of EuRoC or of `fbvins run`, recognised by content.")
      .def("write", &write, "path"_a, "As TUM: t x y z qx qy qz qw, seconds.")
      .def_prop_ro(
          "t", [](const PyTrajectory& s) { return column<std::int64_t>(s.poses, [](const Point& x) { return x.t.ns; }); },
          "int64 (N,), ns")
      .def_prop_ro(
          "p", [](const PyTrajectory& s) { return columns(s.poses, [](const Point& x) { return x.T.p; }); }, "float64 (N, 3), m")
      .def_prop_ro(
          "q", [](const PyTrajectory& s) { return columns(s.poses, [](const Point& x) { return wxyz(x.T.q); }); },
          "float64 (N, 4), body to world, w first")
      .def_prop_ro(
          "R", [](const PyTrajectory& s) { return columns(s.poses, [](const Point& x) { return x.T.R(); }); },
          "float64 (N, 3, 3), body to world")
      .def("__len__", [](const PyTrajectory& s) { return s.poses.size(); })
      .def("__repr__", [](const PyTrajectory& s) { return fmt::format("<fbvins.Trajectory of {} poses>", s.poses.size()); });

  nb::class_<ErrorStatistics>(m, "ErrorStatistics", "Statistics of a list of errors, as evo computes them.")
      .def_ro("count", &ErrorStatistics::count)
      .def_ro("max", &ErrorStatistics::max)
      .def_ro("mean", &ErrorStatistics::mean)
      .def_ro("median", &ErrorStatistics::median)
      .def_ro("rmse", &ErrorStatistics::rmse)
      .def_ro("std", &ErrorStatistics::std)
      .def("__repr__", [](const ErrorStatistics& s) {
        return fmt::format("<fbvins.ErrorStatistics rmse={:.6g} median={:.6g} max={:.6g} of {}>", s.rmse, s.median, s.max,
                           s.count);
      });

  nb::class_<PyEvaluation>(m, "Evaluation",
                           "Errors of an estimate against the truth; str() is the table that `fbvins eval` prints.")
      .def_ro("pairs", &PyEvaluation::pairs, "number of poses compared")
      .def_ro("truth_path_m", &PyEvaluation::truth_path_m)
      .def_prop_ro(
          "scale", [](const PyEvaluation& e) { return e.alignment.scale; }, "of the alignment; 1 unless sim3")
      .def_prop_ro(
          "T_truth_estimate", [](const PyEvaluation& e) { return matrix_of(e.alignment.q, e.alignment.p); },
          "(4, 4), takes the estimate's world (after scaling) to the truth's")
      .def_ro("absolute_m", &PyEvaluation::absolute_m)
      .def_ro("absolute_deg", &PyEvaluation::absolute_rotation_deg)
      .def_ro("per_metre_m", &PyEvaluation::per_metre_m, "relative error over a metre of path")
      .def_ro("per_metre_deg", &PyEvaluation::per_metre_deg)
      .def_ro("per_second_m", &PyEvaluation::per_second_m, "relative error over a second")
      .def_ro("per_second_deg", &PyEvaluation::per_second_deg)
      .def("__str__", [](const PyEvaluation& e) { return app::to_table(e, e.kind); })
      .def("__repr__", [](const PyEvaluation& e) {
        return fmt::format("<fbvins.Evaluation RMSE {:.4f} m over {} poses>", e.absolute_m.rmse, e.pairs);
      });

  m.def("evaluate", &evaluate, "truth"_a, "estimate"_a, "align"_a = "se3", "max_difference_s"_a = 0.01, "interpolate"_a = false);
}

}  // namespace fbvins::python
