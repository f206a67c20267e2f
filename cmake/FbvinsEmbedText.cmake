# SPDX-License-Identifier: Apache-2.0
# fbvins_embed_text(OUT FILE NAME ...): writes the C++ source OUT with a function `std::string NAME()` in namespace fbvins for each FILE, which
# returns its text. Declare them where they are used.
function(fbvins_embed_text OUT)
  set(FUNCTIONS "")
  while(ARGN)
    list(POP_FRONT ARGN file name)
    file(READ ${file} text)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    string(APPEND FUNCTIONS "std::string ${name}();\nstd::string ${name}() {\n  return R\"FBVINSTEXT(${text})FBVINSTEXT\";\n}\n\n")
  endwhile()
  file(CONFIGURE OUTPUT ${OUT} @ONLY CONTENT "// Made by cmake/FbvinsEmbedText.cmake.\n#include <string>\n\nnamespace fbvins {\n\n@FUNCTIONS@}  // namespace fbvins\n")
endfunction()
