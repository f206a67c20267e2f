# SPDX-License-Identifier: Apache-2.0
# Install and export. A downstream project calls find_package(fbvins COMPONENTS core io loop live sim) and links fbvins::<component>,
# or fbvins::fbvins for all components found. The same names work in a project that uses add_subdirectory.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/fbvins)

# One export set for each component, so that only the libraries of requested components are looked for.
add_library(fbvins_all INTERFACE)
add_library(fbvins::fbvins ALIAS fbvins_all)
foreach(component ${FBVINS_COMPONENTS})
  list(TRANSFORM FBVINS_${component}_MODULES PREPEND fbvins_ OUTPUT_VARIABLE modules)
  add_library(fbvins_component_${component} INTERFACE)
  add_library(fbvins::${component} ALIAS fbvins_component_${component})
  target_link_libraries(fbvins_component_${component} INTERFACE ${modules})
  target_link_libraries(fbvins_all INTERFACE fbvins_component_${component})
  set_target_properties(fbvins_component_${component} PROPERTIES EXPORT_NAME ${component})
  if(FBVINS_EIGEN_HEADER)
    # A user's sources run the same Eigen and inline code: of two kinds under one name the linker would take either for both.
    target_compile_options(fbvins_component_${component} INTERFACE -ffp-contract=off
      "$<BUILD_INTERFACE:SHELL:-include ${FBVINS_EIGEN_HEADER}>"
      "$<INSTALL_INTERFACE:SHELL:-include $<INSTALL_PREFIX>/${CMAKE_INSTALL_INCLUDEDIR}/fbvins/core/eigen_as_on_x86_64.hpp>")
  endif()
  install(TARGETS fbvins_component_${component} ${modules} EXPORT fbvins-${component}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT devel)
  install(EXPORT fbvins-${component} NAMESPACE fbvins:: DESTINATION ${package_folder} FILE fbvins-${component}-targets.cmake COMPONENT devel)
endforeach()

if(FBVINS_EIGEN_HEADER)
  install(FILES ${FBVINS_EIGEN_HEADER} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/fbvins/core COMPONENT devel)
endif()
install(DIRECTORY include/fbvins DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT devel FILES_MATCHING PATTERN "*.hpp")
if(FBVINS_BUILD_LAB)
  install(DIRECTORY lab/include/fbvins DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT devel FILES_MATCHING PATTERN "*.hpp")
endif()
configure_package_config_file(cmake/fbvinsConfig.cmake.in ${PROJECT_BINARY_DIR}/fbvinsConfig.cmake INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/fbvinsConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/fbvinsConfig.cmake ${PROJECT_BINARY_DIR}/fbvinsConfigVersion.cmake DESTINATION ${package_folder} COMPONENT devel)
