# SPDX-License-Identifier: Apache-2.0
# Install and export: a downstream project says find_package(fbvins) and links fbvins::fbvins.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

get_property(modules GLOBAL PROPERTY FBVINS_MODULE_TARGETS)

# All modules under one name.
add_library(fbvins_all INTERFACE)
target_link_libraries(fbvins_all INTERFACE ${modules})
set_target_properties(fbvins_all PROPERTIES EXPORT_NAME fbvins)
add_library(fbvins::fbvins ALIAS fbvins_all)

install(TARGETS fbvins_all ${modules} EXPORT fbvinsTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/fbvins DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.hpp")
install(EXPORT fbvinsTargets NAMESPACE fbvins:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/fbvins)

configure_package_config_file(cmake/fbvinsConfig.cmake.in ${PROJECT_BINARY_DIR}/fbvinsConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/fbvins)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/fbvinsConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/fbvinsConfig.cmake ${PROJECT_BINARY_DIR}/fbvinsConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/fbvins)
