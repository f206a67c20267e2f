# SPDX-License-Identifier: Apache-2.0
# Ceres::ceres in the folder that includes this file.
find_package(Ceres REQUIRED)
if(FBVINS_BEFORE_EIGEN)
  # A static Ceres contains copies of Eigen's own code for arm64, and the linker would use them for all other code, too.
  find_library(FBVINS_CERES NAMES libceres.so REQUIRED)
  get_target_property(configurations Ceres::ceres IMPORTED_CONFIGURATIONS)
  foreach(configuration ${configurations})
    set_target_properties(Ceres::ceres PROPERTIES IMPORTED_LOCATION_${configuration} ${FBVINS_CERES})
  endforeach()
endif()
