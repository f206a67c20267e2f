// SPDX-License-Identifier: Apache-2.0
// One corrected calibration from all findings, judged before it is offered: the recording is examined again with it, and it is
// taken only where fewer figures are wrong then and the images fit it no worse. Pure function.
//
//   Result<CorrectedRig> corrected = correct_rig(rig, diagnosis, replay, style);
//   if (corrected && corrected->rig) write(*corrected->rig); else tell(corrected->why_not);
#pragma once

#include "fbvins/doctor/diagnose.hpp"

namespace fbvins {

struct CorrectedRig {
  std::optional<StereoRig> rig = {};  ///< for the images as they are named; none where nothing is offered
  Diagnosis after;                    ///< of the recording with it
  std::string why_not;                ///< a sentence without its full stop; empty with a rig
};

/// `before`: of the recording with the calibration as given, by diagnose().
Result<CorrectedRig> correct_rig(const StereoRig& rig, const Diagnosis& before, const Replay& replay, CalibrationStyle style);

/// Whether a recording examined again with a corrected calibration shows that it is better; if not, why.
Result<void> is_better(const Diagnosis& before, const Diagnosis& after);

}  // namespace fbvins
