// SPDX-License-Identifier: Apache-2.0
// Private to io: which part of a recording is requested; counts, rates and gaps of what a format's reader has found.
#pragma once

#include <string>
#include <vector>

#include "fbvins/io/dataset.hpp"

namespace fbvins {

/// Fills in the fields of `contents.info` on frames and IMU samples, with a warning for each long gap. Needs a frame.
void describe(DatasetContents& contents);

/// Where the clock of frames and readings, in the order recorded, wrapped or stepped back (clock_steps.hpp): continues the
/// stamps, with a warning that names the recording.
void continue_stamps(DatasetContents& contents, const std::string& name);

/// With a warning for each of several cameras whose images stay away for a second or more while another's come.
void warn_of_silent_cameras(DatasetContents& contents);

/// Keeps the frames that the options ask for; an error where there is none.
Result<void> cut_frames(const DatasetOptions& options, std::vector<FrameEntry>& frames);

/// Whether readings before the first frame kept belong to a part that is left out.
inline bool begins_later(const DatasetOptions& options) { return options.skip_frames > 0 || options.start_s > 0; }
/// Whether frames at either end are left out.
inline bool is_part(const DatasetOptions& options) {
  return begins_later(options) || options.duration_s > 0 || options.max_frames > 0;
}

}  // namespace fbvins
