# SPDX-License-Identifier: Apache-2.0
# Debian's arm64 from another machine: Debian's cross compiler, and libraries from a folder that packaging/arm64_sysroot makes.
#   cmake --preset release -B build-arm64 --toolchain cmake/toolchains/arm64.cmake -DFBVINS_SYSROOT=$PWD/build-arm64/sysroot
# Tests run under qemu's user-mode emulation, where that is installed.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES FBVINS_SYSROOT)
if(NOT EXISTS "${FBVINS_SYSROOT}/usr/include")
  message(FATAL_ERROR "FBVINS_SYSROOT is '${FBVINS_SYSROOT}': there is no /usr/include below it (packaging/arm64_sysroot makes one)")
endif()

set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_SYSROOT ${FBVINS_SYSROOT})
set(CMAKE_FIND_ROOT_PATH ${FBVINS_SYSROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${FBVINS_SYSROOT})
set(ENV{PKG_CONFIG_LIBDIR} ${FBVINS_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${FBVINS_SYSROOT}/usr/share/pkgconfig)

# The same processor at every test, with the dot product that kernels ask for.
find_program(FBVINS_EMULATOR NAMES qemu-aarch64-static qemu-aarch64)
if(FBVINS_EMULATOR)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${FBVINS_EMULATOR};-cpu;max;-L;${FBVINS_SYSROOT})
endif()
