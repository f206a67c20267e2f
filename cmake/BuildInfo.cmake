# SPDX-License-Identifier: Apache-2.0
# Run in each build: writes OUTPUT anew if the commit, the compiler or the features are others than before.
# In: SOURCE, OUTPUT, COMPILER, FEATURES. A source without git has no commit.
set(commit "")
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=12 --exclude=* OUTPUT_VARIABLE commit ERROR_QUIET
  OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE failed)
if(failed OR NOT EXISTS ${SOURCE}/.git)
  set(commit "not from a repository")
endif()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT [[// Written by cmake/BuildInfo.cmake.
namespace fbvins::app {
extern const char* const kBuildInfo;
const char* const kBuildInfo = "commit: @commit@\ncompiler: @COMPILER@\nfeatures: @FEATURES@";
}  // namespace fbvins::app
]])
