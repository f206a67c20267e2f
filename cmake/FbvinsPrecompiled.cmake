# SPDX-License-Identifier: Apache-2.0
# fbvins_use_precompiled(TARGET KIND): the large headers of other libraries, parsed once for all targets of a kind.
# A compiler accepts precompiled headers only with the same flags: libraries are compiled with -fPIC, programs with
# -fPIE, and a source with options of its own sets SKIP_PRECOMPILE_HEADERS. Headers of this project are not precompiled: a
# source must include what it uses, which -DFBVINS_PRECOMPILED_HEADERS=OFF checks (dev lint, dev check).
set(FBVINS_PRECOMPILED_library <Eigen/Dense> <fmt/format.h> <algorithm> <array> <cmath> <cstdint> <functional> <map> <memory>
  <numeric> <optional> <string> <unordered_map> <vector>)
set(FBVINS_PRECOMPILED_cold ${FBVINS_PRECOMPILED_library})
set(FBVINS_PRECOMPILED_program ${FBVINS_PRECOMPILED_library} <CLI/CLI.hpp> <nlohmann/json.hpp>)
set(FBVINS_PRECOMPILED_command ${FBVINS_PRECOMPILED_program})
set(FBVINS_PRECOMPILED_test ${FBVINS_PRECOMPILED_library} <gtest/gtest.h>)

# Commands and cold modules only read, write and print, so -O1 is fast enough; they compile in a third less time with it.
set(FBVINS_OPTIONS_command $<$<CONFIG:Release>:-O1>)
set(FBVINS_OPTIONS_cold $<$<CONFIG:Release>:-O1>)

# The target that holds the precompiled headers of a kind, made at first use.
function(fbvins_precompiled_holder KIND)
  set(source ${PROJECT_BINARY_DIR}/precompiled_${KIND}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "int main() {}\n")
  if(KIND MATCHES "library|cold|command")
    add_library(fbvins_precompiled_${KIND} OBJECT EXCLUDE_FROM_ALL ${source})
  else()
    add_executable(fbvins_precompiled_${KIND} EXCLUDE_FROM_ALL ${source})
  endif()
  target_link_libraries(fbvins_precompiled_${KIND} PRIVATE fbvins_flags Eigen3::Eigen fmt::fmt Threads::Threads)
  target_compile_options(fbvins_precompiled_${KIND} PRIVATE ${FBVINS_OPTIONS_${KIND}})
  if(KIND MATCHES "program|command")
    find_package(CLI11 REQUIRED)
    find_package(nlohmann_json REQUIRED)
    target_link_libraries(fbvins_precompiled_${KIND} PRIVATE CLI11::CLI11 nlohmann_json::nlohmann_json)
  elseif(KIND STREQUAL "test")
    target_link_libraries(fbvins_precompiled_${KIND} PRIVATE GTest::gtest)
  endif()
  target_precompile_headers(fbvins_precompiled_${KIND} PRIVATE ${FBVINS_PRECOMPILED_${KIND}})
endfunction()

function(fbvins_use_precompiled TARGET KIND)
  target_compile_options(${TARGET} PRIVATE ${FBVINS_OPTIONS_${KIND}})
  if(NOT FBVINS_PRECOMPILED_HEADERS)
    return()
  endif()
  if(NOT TARGET fbvins_precompiled_${KIND})
    fbvins_precompiled_holder(${KIND})
  endif()
  target_precompile_headers(${TARGET} REUSE_FROM fbvins_precompiled_${KIND})
endfunction()
