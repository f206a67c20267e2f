# SPDX-License-Identifier: Apache-2.0
# fbvins_module(NAME [COLD] [PLAIN] DEPS ... PRIVATE_DEPS ... SOURCES ... TESTS ... RELEASE_TESTS ... TEST_DEPS ...)
# One static library fbvins_<NAME> and one test program fbvins_<NAME>_test beside it. RELEASE_TESTS, with the label `release`, are
# another: statistics over many flights, which sanitizers would make minutes long. DEPS and TEST_DEPS name modules where they can, other
# libraries otherwise. COLD: compiled with -O1. A cold module must not instantiate products or
# decompositions of Eigen: the linker could use its slow copy of a template everywhere (tests/cold_modules.py). PLAIN: without precompiled headers.
# Users link components (FbvinsInstall.cmake).
find_package(Eigen3 3.3 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(Threads REQUIRED)
if(FBVINS_BUILD_TESTS)
  find_package(GTest REQUIRED)
  include(GoogleTest)
  add_library(fbvins_test_main OBJECT ${PROJECT_SOURCE_DIR}/tests/support/test_main.cpp)
  target_link_libraries(fbvins_test_main PRIVATE GTest::gtest)
endif()

# The modules that parse or fly. `./dev test` runs their unit tests once, under sanitizers, and all others in Release.
set(FBVINS_SANITIZED_MODULES core geometry optim types camera imu features io bags eval mocap mavlink frontend estimator pipeline loop
  live web ros2)
set(FBVINS_TESTS all CACHE STRING "Unit tests to build: all; sanitized, of what parses and what flies; unsanitized, the others")
set_property(CACHE FBVINS_TESTS PROPERTY STRINGS all sanitized unsanitized)
if(FBVINS_BUILD_TESTS)
  add_custom_target(sanitized_tests)
endif()

# fbvins_unit_tests(PROGRAM KIND SOURCES ... DEPS ... PROPERTIES ...)
# A test program, where FBVINS_TESTS wants it. KIND: sanitized or unsanitized. DEPS: libraries; PROPERTIES: of each test.
function(fbvins_unit_tests PROGRAM KIND)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS;PROPERTIES" ${ARGN})
  if(NOT FBVINS_BUILD_TESTS OR NOT ARG_SOURCES OR NOT FBVINS_TESTS MATCHES "^(all|${KIND})$")
    return()
  endif()
  add_executable(${PROGRAM} ${ARG_SOURCES})
  target_link_libraries(${PROGRAM} PRIVATE ${ARG_DEPS} fbvins_flags GTest::gtest fbvins_test_main)
  target_include_directories(${PROGRAM} PRIVATE ${PROJECT_SOURCE_DIR})  # tests/support
  fbvins_use_precompiled(${PROGRAM} test)
  fbvins_use_unity(${PROGRAM})
  gtest_discover_tests(${PROGRAM} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 600 ${ARG_PROPERTIES})
  if(KIND STREQUAL "sanitized")
    add_dependencies(sanitized_tests ${PROGRAM})
  endif()
endfunction()

add_library(fbvins_flags INTERFACE)
# Internal headers: for the sources of this repository, not for users of its libraries.
target_include_directories(fbvins_flags INTERFACE ${PROJECT_SOURCE_DIR}/src)
target_compile_options(fbvins_flags INTERFACE
  -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wno-psabi
  # No implicit fused multiply-add, so that kernels give the same bits with every instruction set.
  -ffp-contract=off
  $<$<BOOL:${FBVINS_WERROR}>:-Werror>
  # These depend on what GCC inlines, and are false in std::string and std::optional (its bugs 105651 and 80635). Clang's warnings
  # and the sanitizers look for the same mistakes.
  "$<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds;-Wno-maybe-uninitialized;-Wno-restrict;-Wno-stringop-overflow;-Wno-stringop-overread>")

include(cmake/FbvinsPrecompiled.cmake)
include(cmake/FbvinsEigen.cmake)

# Unity builds: eight sources of a target are compiled as one. All together take half of the time, but a change of one compiles its
# eight again. For these modules, and for tests, each of which has a namespace of its own; in other targets two sources define the
# same local names. A source with the property FBVINS_ALONE is left out: GCC's time grows faster than the number of Eigen's
# decompositions in a unit. Unlike in CMake's own unity builds, no path of this folder is in what is compiled, so that ccache knows it in
# another clone.
set(FBVINS_UNITY_MODULES ${FBVINS_SANITIZED_MODULES} calibration calibration_base checkup config flight report sim v4l2)
option(FBVINS_UNITY "Compile several sources of a target as one" OFF)
set(FBVINS_UNITY_SIZE 8)
if(FBVINS_UNITY)  # a source is no header, though it is included; GCC collects garbage less often: a sixth of the time for a fifth more memory
  target_compile_options(fbvins_flags INTERFACE
    "$<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage;--param=ggc-min-expand=300;--param=ggc-min-heapsize=1500000>")
endif()
function(fbvins_use_unity TARGET)
  if(FBVINS_UNITY)  # at the end of the folder's file, when the options of its sources are known
    cmake_language(EVAL CODE "cmake_language(DEFER CALL fbvins_make_unity ${TARGET})")
  endif()
endfunction()
function(fbvins_make_unity TARGET)
  get_target_property(sources ${TARGET} SOURCES)
  set(together "")
  set(others "")
  foreach(source ${sources})
    get_source_file_property(options ${source} COMPILE_OPTIONS)
    get_source_file_property(definitions ${source} COMPILE_DEFINITIONS)
    get_source_file_property(alone ${source} FBVINS_ALONE)
    if(alone OR options OR definitions OR IS_ABSOLUTE ${source} OR NOT source MATCHES "\\.cpp$")
      list(APPEND others ${source})
    else()
      list(APPEND together ${source})
    endif()
  endforeach()
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  set(number 0)
  while(together)
    list(SUBLIST together 0 ${FBVINS_UNITY_SIZE} batch)
    list(REMOVE_ITEM together ${batch})
    list(TRANSFORM batch REPLACE "(.+)" "#include \"${folder}/\\1\"\n")
    list(JOIN batch "" includes)
    set(file ${CMAKE_CURRENT_BINARY_DIR}/unity/${TARGET}_${number}.cpp)
    file(CONFIGURE OUTPUT ${file} CONTENT "${includes}" @ONLY)
    list(APPEND others ${file})
    math(EXPR number "${number} + 1")
  endwhile()
  set_property(TARGET ${TARGET} PROPERTY SOURCES ${others})
  target_include_directories(${TARGET} PRIVATE ${PROJECT_SOURCE_DIR})
endfunction()

function(fbvins_module NAME)
  cmake_parse_arguments(ARG "COLD;PLAIN" "" "DEPS;PRIVATE_DEPS;SOURCES;TESTS;RELEASE_TESTS;TEST_DEPS" ${ARGN})
  set(target fbvins_${NAME})
  if(ARG_SOURCES)
    add_library(${target} STATIC ${ARG_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:fbvins_flags> ${ARG_PRIVATE_DEPS})
    if(ARG_COLD)
      if(ARG_PLAIN)
        target_compile_options(${target} PRIVATE ${FBVINS_OPTIONS_cold})
      else()
        fbvins_use_precompiled(${target} cold)
      endif()
      set_property(GLOBAL APPEND PROPERTY FBVINS_COLD_MODULES $<TARGET_FILE:${target}>)
    else()
      set_property(GLOBAL APPEND PROPERTY FBVINS_OTHER_MODULES $<TARGET_FILE:${target}>)
      if(NOT ARG_PLAIN)
        fbvins_use_precompiled(${target} library)
      endif()
    endif()
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  set_target_properties(${target} PROPERTIES EXPORT_NAME module_${NAME})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>)
  foreach(folder ${FBVINS_MODULE_INCLUDES})
    target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${folder}>)
  endforeach()
  list(TRANSFORM ARG_DEPS PREPEND fbvins_ OUTPUT_VARIABLE deps)
  target_link_libraries(${target} ${scope} Eigen3::Eigen fmt::fmt Threads::Threads ${deps})
  set(kind unsanitized)
  if(NAME IN_LIST FBVINS_SANITIZED_MODULES)
    set(kind sanitized)
  endif()
  if(ARG_SOURCES AND NAME IN_LIST FBVINS_UNITY_MODULES)
    fbvins_use_unity(${target})
  endif()
  fbvins_unit_tests(${target}_test ${kind} SOURCES ${ARG_TESTS} DEPS ${target} ${ARG_TEST_DEPS})
  fbvins_unit_tests(${target}_release_test unsanitized SOURCES ${ARG_RELEASE_TESTS} DEPS ${target} ${ARG_TEST_DEPS} PROPERTIES LABELS release)
endfunction()
