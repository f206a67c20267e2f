# SPDX-License-Identifier: Apache-2.0
# Debian packages by CPack: fbvins (programs, data, service) and libfbvins-dev (headers and libraries). `./dev package`.
# Dependencies of the programs are found by dpkg-shlibdeps in the built files.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME fbvins)
set(CPACK_PACKAGE_VENDOR "FB-VINS")
set(CPACK_PACKAGE_CONTACT "FB-VINS developers <fbvins@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "stereo visual-inertial odometry for drones")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL runtime devel)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME fbvins)
set(CPACK_DEBIAN_RUNTIME_DESCRIPTION "FB-VINS: position, velocity and attitude from a stereo camera and an IMU
 Programs that estimate poses with covariance and health from recordings and live sensors; MAVLink, flight records, maps; a systemd service.")
if(CMAKE_CROSSCOMPILING)
  # dpkg-shlibdeps only knows the packages installed here, which are of another architecture: so Debian 12's names are listed. They are those of
  # `readelf --dynamic` on all programs, fbvins-bags and fbvins-live included.
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
  string(JOIN ", " CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "libc6 (>= 2.36)" "libstdc++6 (>= 12)" libgcc-s1 "libfmt9 (>= 9.1.0+ds1)"
    "libyaml-cpp0.7 (>= 0.7.0)" libzip4 libpng16-16 zlib1g libturbojpeg0 libceres3 libcholmod3 libspqr2 libcxsparse3 libgoogle-glog0v6 "liblapack3 | liblapack.so.3"
    "libblas3 | libblas.so.3" libatlas3-base libddsc0debian liblz4-1 libbz2-1.0 libzstd1 libsqlite3-0 libnettle8 libapriltag3 passwd)
else()
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS passwd)
endif()
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/conffiles ${PROJECT_SOURCE_DIR}/packaging/postinst
  ${PROJECT_SOURCE_DIR}/packaging/prerm)

set(CPACK_DEBIAN_DEVEL_PACKAGE_NAME libfbvins-dev)
set(CPACK_DEBIAN_DEVEL_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVEL_DESCRIPTION "FB-VINS: headers and static libraries
 For programs that call find_package(fbvins COMPONENTS core io loop live sim).")
set(CPACK_DEBIAN_DEVEL_PACKAGE_DEPENDS "libeigen3-dev, libfmt-dev")
if(FBVINS_EIGEN_HEADER)
  string(APPEND CPACK_DEBIAN_DEVEL_PACKAGE_DEPENDS ", libsimde-dev")
endif()
set(CPACK_DEBIAN_DEVEL_PACKAGE_RECOMMENDS "libceres-dev, libyaml-cpp-dev, libzip-dev, libpng-dev, libturbojpeg0-dev, nettle-dev")
include(CPack)
