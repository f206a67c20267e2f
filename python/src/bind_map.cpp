// SPDX-License-Identifier: Apache-2.0
// Maps of a System, and the contents of their files.
#include <fmt/format.h>

#include <algorithm>

#include "bindings.hpp"
#include "fbvins/config/config.hpp"
#include "fbvins/loop/loop_map.hpp"
#include "fbvins/loop/map_file.hpp"
#include "python_types.hpp"

namespace fbvins::python {
namespace {

void make_map(PyMap* self, const StereoRig& rig, const std::string& file, const std::string& vocabulary, bool boosted,
              const Config& config) {
  new (self) PyMap{value_or_raise([&] {
    nb::gil_scoped_release released;
    return LoopMap::create(rig, {.file = file, .vocabulary = vocabulary, .boosted = boosted, .loop = config.loop});
  }())};
}

PyTrajectory corrected(const PyMap& self, const std::vector<Odometry>& flight) {
  Trajectory<G> in_G;
  for (const Odometry& o : flight) {
    if (!o.health.has_pose()) continue;
    if (o.reset_counter != flight.front().reset_counter)
      throw nb::value_error("the estimator started again in between: give the odometry of one reset_counter at a time");
    in_G.push_back({o.t, o.gauge.T_GB});
  }
  return self.map->corrected(in_G);
}

struct MapContents {
  PlaceMap map;
};

MapContents load(const std::string& path) {
  return {value_or_raise([&] {
    nb::gil_scoped_release released;
    return load_map(path);
  }())};
}

PyTrajectory keyframes_of(const MapContents& contents) {
  PyTrajectory out;
  for (const MapKeyframe& k : contents.map.keyframes()) out.poses.push_back({k.t, {k.T_MB.q, k.T_MB.p}});
  return out;
}

Array<double> points_of(const MapContents& contents) {
  std::vector<Vec3> points;
  for (const MapKeyframe& k : contents.map.keyframes())
    for (const PlaceFeature& f : k.place.features)
      if (f.has_point()) points.push_back(contents.map.T_MC(k) * f.p_C0());
  return columns(points, [](const Vec3& p) { return p; });
}

}  // namespace

void bind_map(nb::module_& m) {
  nb::class_<PyMap>(m, "Map",
                    "Loop closure, given to System(map=...): recognises places and estimates the pose of W in M. Call "
                    "finish() after the system's finish(), then save().")
      .def("__init__", &make_map, "rig"_a, "file"_a = "", "vocabulary"_a = "", "boosted"_a = false, "config"_a = Config{},
           "file: a map to relocalise in and to extend; empty: a new one, whose M starts equal to W.")
      .def(
          "finish",
          [](PyMap& self) {
            nb::gil_scoped_release released;
            self.map->finish();
          },
          "Last pose-graph optimisation, once the flight is over.")
      .def(
          "adjust",
          [](PyMap& self) {
            FinalAdjustmentReport report = [&] {
              nb::gil_scoped_release released;
              return self.map->adjust();
            }();
            if (!report.refused.empty()) throw nb::value_error(report.refused.c_str());
          },
          "After finish(): bundle adjustment of the whole map. ValueError where the result fits no better; the map is unchanged then.")
      .def("corrected", &corrected, "odometry"_a, "The Trajectory of a flight in M by the map's present state.")
      .def_prop_ro(
          "keyframes", [](const PyMap& self) { return self.map->keyframes(); }, "number of keyframes")
      .def(
          "save", [](const PyMap& self, const std::string& path) { check(self.map->save(path)); }, "path"_a)
      .def("__repr__", [](const PyMap& self) { return fmt::format("<fbvins.Map of {} keyframes>", self.map->keyframes()); });

  nb::class_<MapContents>(m, "MapContents", "Contents of a map file.")
      .def_prop_ro("keyframes", &keyframes_of, "Trajectory of B in M")
      .def_prop_ro("points", &points_of, "float64 (N, 3), m in M")
      .def_prop_ro(
          "sessions",
          [](const MapContents& c) {
            return column<std::int64_t>(c.map.keyframes(), [](const MapKeyframe& k) { return k.session; });
          },
          "int64 (N,), the flight of each keyframe")
      .def_prop_ro("loops",
                   [](const MapContents& c) {
                     return std::count_if(c.map.edges.begin(), c.map.edges.end(),
                                          [](const MapEdge& e) { return e.kind == MapEdge::Kind::loop; });
                   })
      .def_prop_ro(
          "boosted", [](const MapContents& c) { return c.map.boosted; }, "whether the descriptors are boosted")
      .def("__repr__", [](const MapContents& c) { return fmt::format("<fbvins.MapContents of {} keyframes>", c.map.size()); });
  m.def("load_map", &load, "path"_a, "Contents of a map file that `fbvins run --save-map` or Map.save() wrote.");
}

}  // namespace fbvins::python
