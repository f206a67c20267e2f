# SPDX-License-Identifier: Apache-2.0
# For the wheels of ./dev wheel: Debian 12's compiler, an older C library and static C++ libraries from a folder that
# packaging/wheel_sysroot makes, named by the environment, as pip passes it on; FBVINS_WHEEL_MACHINE: x86_64 or aarch64.
set(FBVINS_SYSROOT "$ENV{FBVINS_WHEEL_SYSROOT}")
if(NOT EXISTS "${FBVINS_SYSROOT}/usr/include")
  message(FATAL_ERROR "FBVINS_WHEEL_SYSROOT is '${FBVINS_SYSROOT}': there is no /usr/include below it (packaging/wheel_sysroot makes one)")
endif()

set(machine "$ENV{FBVINS_WHEEL_MACHINE}")
set(CMAKE_C_COMPILER ${machine}-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER ${machine}-linux-gnu-g++)
if(NOT machine STREQUAL CMAKE_HOST_SYSTEM_PROCESSOR)
  set(CMAKE_SYSTEM_NAME Linux)
  set(CMAKE_SYSTEM_PROCESSOR ${machine})
endif()
set(FBVINS_CERES_BEFORE_EIGEN ON)  # packaging/wheel_sysroot compiles it with that header
set(CMAKE_SYSROOT ${FBVINS_SYSROOT})
set(CMAKE_FIND_ROOT_PATH ${FBVINS_SYSROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${FBVINS_SYSROOT})
set(ENV{PKG_CONFIG_LIBDIR} ${FBVINS_SYSROOT}/usr/lib/${machine}-linux-gnu/pkgconfig:${FBVINS_SYSROOT}/usr/lib/pkgconfig:${FBVINS_SYSROOT}/usr/share/pkgconfig)

# The C++ library is part of the module and of each program, and nobody else's: where the wheel is installed there may be an older one. The compiler looks for
# libraries beside itself first, so the older ones are named before.
set(libraries "-L${FBVINS_SYSROOT}/lib/${machine}-linux-gnu -L${FBVINS_SYSROOT}/usr/lib/${machine}-linux-gnu -L${FBVINS_SYSROOT}/usr/lib")
set(CMAKE_C_FLAGS_INIT "-include ${CMAKE_CURRENT_LIST_DIR}/wheel_symbols.h")
set(CMAKE_CXX_FLAGS_INIT "${CMAKE_C_FLAGS_INIT}")
set(own_libraries "${libraries} ${FBVINS_SYSROOT}/usr/lib/wheel_shims.o -static-libstdc++")
set(CMAKE_EXE_LINKER_FLAGS_INIT "${libraries}")
if(EXISTS ${FBVINS_SYSROOT}/usr/lib/wheel_shims.o)  # not yet while the first libraries are made
  set(CMAKE_EXE_LINKER_FLAGS_INIT "${own_libraries}")
endif()
set(CMAKE_MODULE_LINKER_FLAGS_INIT "${own_libraries} -Wl,--exclude-libs,ALL")
