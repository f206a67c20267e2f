// SPDX-License-Identifier: Apache-2.0
// What the commands info, doctor, convert and report do.
#include <algorithm>

#include "apps/convert_recording.hpp"
#include "apps/recording_report.hpp"
#include "bindings.hpp"
#include "fbvins/bags/bag_survey.hpp"
#include "fbvins/bags/recording.hpp"
#include "fbvins/doctor/diagnose.hpp"
#include "fbvins/report/report.hpp"
#include "python_types.hpp"

namespace fbvins::python {
namespace {

/// Images between two checks for signals.
constexpr int kFramesBetweenChecks = 16;

void check_signals(int frames) {
  if (frames % kFramesBetweenChecks != 0) return;
  const nb::gil_scoped_acquire acquired;
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

void require_fresh(const Dataset& data) {
  if (data.begun()) throw nb::value_error("this recording has been iterated already: open it again");
}

/// What is in a bag that cannot be opened yet, as JSON; empty where the path is no bag, or nothing but its calibration or topics
/// is missing. Raises nothing: opening it says what is wrong.
std::string survey(const std::string& path, const std::string& calibration) {
  if (!is_bag(path)) return "";
  const RecordingOptions options{{}, calibration, "", {}};
  const Result<BagSurvey> found = survey_bag(path, options);
  if (!found || found->topics.empty() || (found->question.empty() && found->no_calibration.empty())) return "";
  return app::describe(*found).dump();
}

/// `again` opens the recording once more: common mistakes are each compared with all of it.
nb::dict examine_recording(Dataset& recording, const nb::callable& again, bool kalibr) {
  require_fresh(recording);
  nb::object opened_again;
  Dataset* data = &recording;
  int frames = 0;
  const Replay replay = [&](const TakeEvent& take) -> Result<void> {
    if (data == nullptr) {
      const nb::gil_scoped_acquire acquired;
      opened_again = again();
      data = &nb::cast<Dataset&>(opened_again);
    }
    while (auto event = data->next()) {
      if (std::holds_alternative<StereoFrame>(*event)) check_signals(++frames);
      if (!take(*std::move(event))) break;
    }
    data = nullptr;
    return {};
  };
  const Diagnosis diagnosis = value_or_raise([&] {
    nb::gil_scoped_release released;
    return diagnose(recording.rig(), replay, kalibr ? CalibrationStyle::kalibr : CalibrationStyle::euroc);
  }());
  nb::list findings;
  for (const Finding& f : diagnosis.findings) {
    nb::dict finding;
    finding["kind"] = std::string(to_string(f.kind));
    finding["size"] = f.size, finding["sigma"] = f.sigma, finding["unit"] = f.unit;
    finding["measured"] = f.measured, finding["expected"] = f.expected;
    finding["advice"] = f.advice, finding["corrected"] = f.corrected;
    finding["text"] = to_text(f);
    findings.append(finding);
  }
  nb::dict out;
  out["findings"] = findings;
  out["measured"] = diagnosis.measured;
  out["not_judged"] = diagnosis.not_judged;
  out["text"] = to_text(diagnosis);
  out["rig"] = diagnosis.rig;
  return out;
}

int convert(Dataset& data, const std::string& record, const std::string& out) {
  require_fresh(data);
  const bool is_record = data.info().format == "MCAP flight record";
  return value_or_raise([&] {
    nb::gil_scoped_release released;
    return app::convert_recording(data, {is_record ? record : std::string()}, {out}, check_signals);
  }());
}

}  // namespace

void bind_tools(nb::module_& m) {
  m.def(
      "info", [](const Dataset& data) { return app::describe(data).dump(); }, "recording"_a);
  m.def("survey", &survey, "path"_a, "calibration"_a);
  m.def("doctor", &examine_recording, "recording"_a, "again"_a, "kalibr"_a);
  m.def("convert", &convert, "recording"_a, "record"_a, "out"_a);
  m.def(
      "report",
      [](const std::vector<std::string>& folders, const std::string& out, const std::string& truth, const std::string& title) {
        return value_or_raise(write_report(folders, out, truth, title));
      },
      "folders"_a, "out"_a, "truth"_a, "title"_a);
}

}  // namespace fbvins::python
