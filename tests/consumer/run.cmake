# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD=<build folder> -DSOURCE=<tests/consumer> -DCXX=<compiler> -DTUTORIAL=<file> -DEXAMPLES=<examples> -DFBVINS=<program> -P run.cmake
# For another architecture also -DTOOLCHAIN=<file> -DSYSROOT=<folder> -DEMULATOR=<program and arguments>.
# Installs into a fresh prefix, then configures, builds and runs users' projects against it alone.
set(folder ${BUILD}/consumer)
file(REMOVE_RECURSE ${folder})
function(step)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "failed: ${ARGN}")
  endif()
endfunction()
function(build project)
  step(${CMAKE_COMMAND} -S ${SOURCE}/${project} -B ${folder}/${project} -G Ninja -DCMAKE_BUILD_TYPE=Release
    -DCMAKE_CXX_COMPILER=${CXX} -DFBVINS_INCLUDE=${folder}/prefix/include -DTUTORIAL=${TUTORIAL} ${installed} ${ARGN})
  step(${CMAKE_COMMAND} --build ${folder}/${project})
endfunction()
step(${CMAKE_COMMAND} --install ${BUILD} --prefix ${folder}/prefix)
set(installed -DCMAKE_PREFIX_PATH=${folder}/prefix)
if(TOOLCHAIN)
  # Packages are looked for below the sysroot only, but for this one.
  file(GLOB_RECURSE config ${folder}/prefix/fbvinsConfig.cmake)
  get_filename_component(config ${config} DIRECTORY)
  set(installed -Dfbvins_DIR=${config} -DCMAKE_TOOLCHAIN_FILE=${TOOLCHAIN} -DFBVINS_SYSROOT=${SYSROOT})
endif()

# The core, as on a machine that has none of the other components' libraries.
set(hidden "")
foreach(package Ceres PNG yaml-cpp PkgConfig nlohmann_json CLI11)
  list(APPEND hidden -DCMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
endforeach()
build(core ${hidden})
step(${EMULATOR} ${folder}/core/consumer)
execute_process(COMMAND readelf --dynamic ${folder}/core/consumer OUTPUT_VARIABLE linked)
if(linked MATCHES "lib(ceres|zip|png|turbojpeg|yaml)")
  message(FATAL_ERROR "a user of the core links more than it needs:\n${linked}")
endif()

# A component that is not there is said by name.
file(MAKE_DIRECTORY ${folder}/absent)
file(WRITE ${folder}/absent/CMakeLists.txt "cmake_minimum_required(VERSION 3.22)
project(absent LANGUAGES CXX)
find_package(fbvins REQUIRED COMPONENTS loop teleport)
")
execute_process(COMMAND ${CMAKE_COMMAND} -S ${folder}/absent -B ${folder}/absent/build ${installed} ${hidden}
  RESULT_VARIABLE result ERROR_VARIABLE message OUTPUT_QUIET)
if(result EQUAL 0 OR NOT message MATCHES "teleport" OR NOT message MATCHES "Ceres")
  message(FATAL_ERROR "asking for what is absent must fail by name, but: ${result}\n${message}")
endif()

if(TOOLCHAIN)
  return()  # the rest is the same on every architecture, and slow under emulation
endif()

# A frontend in a plugin (examples/own_frontend).
step(${CMAKE_COMMAND} -S ${EXAMPLES}/own_frontend -B ${folder}/own_frontend -G Ninja -DCMAKE_CXX_COMPILER=${CXX} ${installed} ${hidden})
step(${CMAKE_COMMAND} --build ${folder}/own_frontend)
step(${FBVINS} simulate normal --seconds 4 --seed 1 --out ${folder}/flight --quiet)
step(${FBVINS} run ${folder}/flight --plugin ${folder}/own_frontend/libown_frontend.so --frontend blocks --out ${folder}/blocks --quiet)
file(READ ${folder}/blocks/summary.json summary)
string(JSON error_m GET ${summary} result accuracy ape_m rmse)
string(JSON coverage GET ${summary} result coverage share)
if(error_m GREATER 0.05 OR coverage LESS 0.7)
  message(FATAL_ERROR "the frontend of examples/own_frontend: an error of ${error_m} m at a coverage of ${coverage}")
endif()
message(STATUS "blocks: ${error_m} m, coverage ${coverage}")

# A factor of a sensor that the library does not know (examples/own_factor).
step(${CMAKE_COMMAND} -S ${EXAMPLES}/own_factor -B ${folder}/own_factor -G Ninja -DCMAKE_CXX_COMPILER=${CXX} ${installed})
step(${CMAKE_COMMAND} --build ${folder}/own_factor)
execute_process(COMMAND ${folder}/own_factor/own_factor ${folder}/flight 1.08 RESULT_VARIABLE result OUTPUT_VARIABLE said)
if(NOT result EQUAL 0 OR NOT said MATCHES "^[1-9][0-9]+ poses, [1-9][0-9]+ readings used, [0-9]+ left out, scale 1\\.0[5-9]")
  message(FATAL_ERROR "examples/own_factor: ${result}\n${said}")
endif()
message(STATUS "own_factor: ${said}")

# Recordings and maps, by the lines of the tutorial.
build(recording)
step(${folder}/recording/consumer ${folder}/flight ${folder}/flat.fbm)
