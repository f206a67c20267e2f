# SPDX-License-Identifier: Apache-2.0
# fbvins_web_page: the page in web/ and the JavaScript libraries it uses, as bytes in a library. npm fetches them during the build; without npm, or
# if it reaches no registry, the program serves no page and says so.
find_program(NPM_PROGRAM npm)
if(NOT NPM_PROGRAM)
  message(STATUS "the page of --web is not built in: npm not found")
endif()
file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/web/*)
set(embedded ${CMAKE_CURRENT_BINARY_DIR}/page_files.cpp)
add_custom_command(OUTPUT ${embedded}
  COMMAND ${CMAKE_COMMAND} "-DNPM=${NPM_PROGRAM}" -DSOURCE=${PROJECT_SOURCE_DIR}/web -DFOLDER=${CMAKE_CURRENT_BINARY_DIR}/page -DOUT=${embedded}
    -P ${PROJECT_SOURCE_DIR}/cmake/embed_page.cmake
  DEPENDS ${sources} ${PROJECT_SOURCE_DIR}/cmake/embed_page.cmake
  COMMENT "Embedding the page" VERBATIM)
add_library(fbvins_web_page STATIC ${embedded})
target_link_libraries(fbvins_web_page PUBLIC fbvins_web PRIVATE fbvins_flags)
