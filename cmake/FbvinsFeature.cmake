# SPDX-License-Identifier: Apache-2.0
# fbvins_feature(NAME DESCRIPTION FOUND <value> NEEDS <option>): an option for what needs further libraries. AUTO, the default, builds it
# where they are found, also where they are installed after the first configuration; ON requires them. The global property
# FBVINS_FEATURES lists what is built: names in lower case, without FBVINS_WITH_.
function(fbvins_feature NAME DESCRIPTION)
  cmake_parse_arguments(ARG "" "NEEDS" "FOUND" ${ARGN})
  set(${NAME} AUTO CACHE STRING "${DESCRIPTION}: ON, OFF or AUTO")
  set_property(CACHE ${NAME} PROPERTY STRINGS AUTO ON OFF)
  if(NOT ${ARG_NEEDS} OR NOT ${NAME})
    set(${NAME} OFF PARENT_SCOPE)
  elseif(ARG_FOUND)
    set(${NAME} ON PARENT_SCOPE)
  elseif(${NAME} STREQUAL "AUTO")
    set(${NAME} OFF PARENT_SCOPE)
  else()
    message(FATAL_ERROR "${NAME} is ${${NAME}}, but not all of its libraries were found: ${DESCRIPTION}")
  endif()
  if(NOT ${ARG_NEEDS} OR NOT ${NAME} OR NOT ARG_FOUND)
    return()
  endif()
  string(REPLACE "FBVINS_WITH_" "" feature ${NAME})
  string(TOLOWER ${feature} feature)
  set_property(GLOBAL APPEND PROPERTY FBVINS_FEATURES ${feature})
endfunction()
