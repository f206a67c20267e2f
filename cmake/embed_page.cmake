# SPDX-License-Identifier: Apache-2.0
# Writes OUT, a C++ source with every file of the page (SOURCE) and of the libraries it uses, compressed by gzip. FOLDER holds temporary files.
#   cmake -DNPM=npm -DSOURCE=web -DFOLDER=build/page -DOUT=page_files.cpp -P embed_page.cmake
cmake_minimum_required(VERSION 3.22)

set(TYPES html text/html css text/css js text/javascript svg image/svg+xml)
# The files of libraries that the page uses: path in the package, and name on the page.
set(LIBRARIES
  three/build/three.core.min.js three.core.min.js
  three/build/three.module.min.js three.module.min.js
  three/examples/jsm/controls/OrbitControls.js OrbitControls.js
  uplot/dist/uPlot.esm.js uPlot.esm.js
  uplot/dist/uPlot.min.css uPlot.min.css)

# Fetches the libraries in the versions of the lock file, unless they are there already.
function(fetch_libraries RESULT)
  file(SHA256 ${SOURCE}/package-lock.json wanted)
  set(stamp ${FOLDER}/installed)
  if(EXISTS ${stamp})
    file(READ ${stamp} installed)
    if(installed STREQUAL wanted)
      set(${RESULT} TRUE PARENT_SCOPE)
      return()
    endif()
  endif()
  file(MAKE_DIRECTORY ${FOLDER})
  file(COPY ${SOURCE}/package.json ${SOURCE}/package-lock.json DESTINATION ${FOLDER})
  execute_process(COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --fetch-retries=1 --fetch-timeout=20000 --loglevel=error
    WORKING_DIRECTORY ${FOLDER} RESULT_VARIABLE failed OUTPUT_VARIABLE said ERROR_VARIABLE said)
  if(failed)
    message(STATUS "the page is not built in: npm could not fetch its libraries: ${said}")
    set(${RESULT} FALSE PARENT_SCOPE)
    return()
  endif()
  file(WRITE ${stamp} ${wanted})
  set(${RESULT} TRUE PARENT_SCOPE)
endfunction()

# Appends FILE, which the page knows as NAME, to BYTES and TABLE.
function(embed FILE NAME)
  string(REGEX MATCH "[a-z]+$" suffix ${NAME})
  list(FIND TYPES ${suffix} place)
  math(EXPR place "${place} + 1")
  list(GET TYPES ${place} type)
  file(ARCHIVE_CREATE OUTPUT ${FOLDER}/packed PATHS ${FILE} FORMAT raw COMPRESSION GZip)
  file(READ ${FOLDER}/packed hex HEX)
  string(REGEX REPLACE "(................................)" "\\1\n" hex ${hex})
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," hex ${hex})
  string(MAKE_C_IDENTIFIER ${NAME} symbol)
  set(BYTES "${BYTES}constexpr unsigned char k_${symbol}[] = {\n${hex}};\n" PARENT_SCOPE)
  set(TABLE "${TABLE}      {\"/${NAME}\", \"${type}; charset=utf-8\", {reinterpret_cast<const char*>(k_${symbol}), sizeof k_${symbol}}, true},\n" PARENT_SCOPE)
endfunction()

set(BYTES "")
set(TABLE "")
set(here FALSE)
if(NPM)
  fetch_libraries(here)
endif()
if(here)
  file(GLOB page ${SOURCE}/*.html ${SOURCE}/*.css ${SOURCE}/*.js ${SOURCE}/*.svg)
  foreach(file ${page})
    get_filename_component(name ${file} NAME)
    embed(${file} ${name})
  endforeach()
  while(LIBRARIES)
    list(POP_FRONT LIBRARIES file name)
    file(READ ${FOLDER}/node_modules/${file} text)
    string(REPLACE "from 'three'" "from './three.module.min.js'" text "${text}")  # no import map: the page has no inline script
    file(WRITE ${FOLDER}/library/${name} "${text}")
    embed(${FOLDER}/library/${name} ${name})
  endwhile()
endif()
file(WRITE ${OUT} "// Made by cmake/embed_page.cmake.
#include \"fbvins/web/page_files.hpp\"

namespace fbvins {
namespace {
${BYTES}}  // namespace

PageFiles page_files() {
  return {
${TABLE}  };
}

}  // namespace fbvins
")
