# SPDX-License-Identifier: Apache-2.0
# Checks fbvins_feature(): what AUTO, ON and OFF give, with the libraries and without.
#
# usage: cmake -P feature_option.cmake
include(${CMAKE_CURRENT_LIST_DIR}/../cmake/FbvinsFeature.cmake)

# expect(VALUE FOUND NEEDED RESULT): the option set to VALUE.
function(expect VALUE FOUND NEEDED RESULT)
  set(FEATURE ${VALUE} CACHE STRING "" FORCE)
  set(NEEDED_OPTION ${NEEDED})
  fbvins_feature(FEATURE "a feature" FOUND ${FOUND} NEEDS NEEDED_OPTION)
  if(NOT FEATURE STREQUAL RESULT)
    message(SEND_ERROR "${VALUE}, found ${FOUND}, needed option ${NEEDED}: ${FEATURE} instead of ${RESULT}")
  endif()
endfunction()

expect(AUTO "" ON OFF)
expect(AUTO 1 ON ON)  # the same cache after the libraries have been installed
expect(AUTO 1 OFF OFF)
expect(ON 1 ON ON)
expect(OFF 1 ON OFF)
expect(ON "" OFF OFF)
