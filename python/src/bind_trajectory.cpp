// SPDX-License-Identifier: Apache-2.0
// Trajectories and their evaluation.
#include <fmt/format.h>
#include <nanobind/stl/tuple.h>

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
    const Time stamp{stamps.data[i]};
    if (!out.poses.empty() && stamp <= out.poses.back().t)
      throw nb::value_error(
          fmt::format("t: row {} has {} ns, which is not after {} ns: stamps must increase", i, stamp.ns, out.poses.back().t.ns)
              .c_str());
    if (!Vec3(at[0], at[1], at[2]).allFinite())
      throw nb::value_error(fmt::format("p: row {} is not finite; leave out rows without a pose", i).c_str());
    if (!(std::abs(rotation.norm() - 1) < 1e-3))
      throw nb::value_error(
          fmt::format("q: row {} has norm {:.6g}; unit quaternions are expected, w first", i, rotation.norm()).c_str());
    out.poses.push_back({stamp, {rotation.normalized(), Vec3(at[0], at[1], at[2])}});
  }
  return out;
}

using TrajectoryState = std::vector<std::tuple<std::int64_t, std::array<double, 7>>>;

/// To the last bit, for pickle.
TrajectoryState state_of(const PyTrajectory& trajectory) {
  TrajectoryState out;
  for (const Point& x : trajectory.poses)
    out.push_back({x.t.ns, {x.T.p.x(), x.T.p.y(), x.T.p.z(), x.T.q.w(), x.T.q.x(), x.T.q.y(), x.T.q.z()}});
  return out;
}
PyTrajectory restored(const TrajectoryState& state) {
  PyTrajectory out;
  for (const auto& [t, n] : state) out.poses.push_back({Time{t}, {Quat(n[3], n[4], n[5], n[6]), Vec3(n[0], n[1], n[2])}});
  return out;
}

/// Rows by their numbers, which numpy has made of a slice, a mask or a list.
PyTrajectory rows_of(const PyTrajectory& trajectory, nb::handle which) {
  const nb::object numpy = nb::module_::import_("numpy");
  const nb::object all = numpy.attr("arange")(trajectory.poses.size());
  const nb::object chosen = numpy.attr("atleast_1d")(all[which]);
  const auto rows = checked<std::int64_t>(chosen, "rows", {kAny});
  PyTrajectory out;
  for (std::size_t i = 0; i < rows.rows(); ++i) out.poses.push_back(trajectory.poses[static_cast<std::size_t>(rows.data[i])]);
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

/// All numbers of an evaluation, in a fixed order.
template <class Take>
void each_number(Evaluation& e, Take take) {
  for (double* x : {&e.truth_path_m, &e.largest_excursion_m, &e.alignment.scale}) take(*x);
  for (int i = 0; i < 4; ++i) take(e.alignment.q.coeffs()[i]);
  for (int i = 0; i < 3; ++i) take(e.alignment.p[i]);
  for (ErrorStatistics* s :
       {&e.absolute_m, &e.absolute_rotation_deg, &e.per_metre_m, &e.per_metre_deg, &e.per_second_m, &e.per_second_deg})
    for (double* x : {&s->max, &s->mean, &s->median, &s->rmse, &s->std}) take(*x);
}
template <class Take>
void each_count(Evaluation& e, Take take) {
  for (int* x : {&e.pairs, &e.absolute_m.count, &e.absolute_rotation_deg.count, &e.per_metre_m.count, &e.per_metre_deg.count,
                 &e.per_second_m.count, &e.per_second_deg.count})
    take(*x);
}
using EvaluationState = std::tuple<int, std::vector<int>, std::vector<double>>;

EvaluationState state_of_evaluation(PyEvaluation& e) {
  EvaluationState out{static_cast<int>(e.kind), {}, {}};
  each_count(e, [&](int x) { std::get<1>(out).push_back(x); });
  each_number(e, [&](double x) { std::get<2>(out).push_back(x); });
  return out;
}
void set_evaluation(PyEvaluation& self, const EvaluationState& state) {
  new (&self) PyEvaluation();
  const auto& [kind, counts, numbers] = state;
  self.kind = static_cast<Alignment>(kind);
  std::size_t i = 0, k = 0;
  each_count(self, [&](int& x) { x = counts.at(i++); });
  each_number(self, [&](double& x) { x = numbers.at(k++); });
}

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

void bind_poses(nb::module_& m) {
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
      .def("__getitem__", &rows_of, "rows"_a, nb::sig("def __getitem__(self, rows: object) -> Trajectory"),
           "A Trajectory of these rows: a slice, a mask or numbers of rows, as NumPy takes them.")
      .def("__reduce__", [](const PyTrajectory& s) { return reduced("trajectory", nb::cast(state_of(s))); })
      .def("__len__", [](const PyTrajectory& s) { return s.poses.size(); })
      .def("__repr__", [](const PyTrajectory& s) { return fmt::format("<fbvins.Trajectory of {} poses>", s.poses.size()); });

  m.def("_restore_trajectory", &restored);
}

void bind_statistics(nb::module_& m) {
  nb::class_<ErrorStatistics>(m, "ErrorStatistics", "Statistics of a list of errors, as evo computes them.")
      .def_ro("count", &ErrorStatistics::count)
      .def_ro("max", &ErrorStatistics::max)
      .def_ro("mean", &ErrorStatistics::mean)
      .def_ro("median", &ErrorStatistics::median)
      .def_ro("rmse", &ErrorStatistics::rmse)
      .def_ro("std", &ErrorStatistics::std)
      .def("__getstate__", [](const ErrorStatistics& s) { return std::tuple(s.count, s.max, s.mean, s.median, s.rmse, s.std); })
      .def("__setstate__",
           [](ErrorStatistics& self, const std::tuple<int, double, double, double, double, double>& s) {
             new (&self)
                 ErrorStatistics{std::get<0>(s), std::get<1>(s), std::get<2>(s), std::get<3>(s), std::get<4>(s), std::get<5>(s)};
           })
      .def("__repr__", [](const ErrorStatistics& s) {
        return fmt::format("<fbvins.ErrorStatistics rmse={:.6g} median={:.6g} max={:.6g} of {}>", s.rmse, s.median, s.max,
                           s.count);
      });
}

void bind_evaluation(nb::module_& m) {
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
      .def("__getstate__", &state_of_evaluation)
      .def("__setstate__", &set_evaluation)
      .def("__str__", [](const PyEvaluation& e) { return app::to_table(e, e.kind); })
      .def("__repr__", [](const PyEvaluation& e) {
        return fmt::format("<fbvins.Evaluation RMSE {:.4f} m over {} poses>", e.absolute_m.rmse, e.pairs);
      });
}

}  // namespace

void bind_trajectory(nb::module_& m) {
  bind_poses(m);
  bind_statistics(m);
  bind_evaluation(m);
  m.def("evaluate", &evaluate, "truth"_a, "estimate"_a, "align"_a = "se3", "max_difference_s"_a = 0.01, "interpolate"_a = false);
}

}  // namespace fbvins::python
