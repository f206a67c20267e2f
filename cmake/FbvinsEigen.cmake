# SPDX-License-Identifier: Apache-2.0
# The same bytes on arm64 as on x86-64 (docs/service.md): Eigen's SSE2 code runs there by SIMDe. FBVINS_BEFORE_EIGEN: the compiler options
# for it, for sources with SKIP_PRECOMPILE_HEADERS; all others get them from fbvins_flags or with the precompiled headers.
set(FBVINS_BEFORE_EIGEN "")
if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
  return()
endif()
find_path(FBVINS_SIMDE simde/x86/sse2.h)
if(NOT FBVINS_SIMDE)
  message(STATUS "SIMDe not found (Debian: libsimde-dev): results will differ from x86-64 in the last digits")
  return()
endif()
set(FBVINS_EIGEN_HEADER ${PROJECT_SOURCE_DIR}/src/fbvins/core/eigen_as_on_x86_64.hpp)
set(FBVINS_BEFORE_EIGEN -include ${FBVINS_EIGEN_HEADER})
target_compile_options(fbvins_flags INTERFACE
  "$<$<NOT:$<BOOL:$<TARGET_PROPERTY:PRECOMPILE_HEADERS_REUSE_FROM>>>:SHELL:-include ${FBVINS_EIGEN_HEADER}>")
foreach(kind library cold program command test)
  list(PREPEND FBVINS_PRECOMPILED_${kind} ${FBVINS_EIGEN_HEADER})
endforeach()
