#!/usr/bin/env bash
# Builds archives with one program that needs no library of the system, with documents and samples:
#   ecaudit-VERSION-linux-x86_64.tar.gz    runs on any Linux with a kernel from 3.2 on; with man pages
#   ecaudit-VERSION-windows-x86_64.zip     runs on Windows 10 and 11; compiled by mingw-w64
#
#   cli/packaging/portable.sh [OUTPUT_FOLDER [linux|windows|all]]     default: build/portable all
#
# Needs what cli/quickstart.sh installs, and Debian's sources of the libraries (a deb-src line). Network: Debian's archive, and
# npm's registry for the page of HTML reports. Qt Core takes most of the time; the libraries are built once.
set -Eeuo pipefail
trap 'say "failed in line $LINENO of $0" >&2' ERR
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source .ci/packages.sh

output=${1:-build/portable}
systems=${2:-all}
case $systems in
  linux | windows) ;;
  all) systems="linux windows" ;;
  *) say "unknown system '$systems': linux, windows or all" >&2; exit 2 ;;
esac
mkdir -p "$output/sources"
output=$(cd "$output" && pwd)
jobs=$(nproc)
toolchain=$PWD/cli/packaging/windows/mingw.cmake
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || echo 315532800)}

packages=("${BUILD_PACKAGES[@]}" dpkg-dev flex bison)
[[ $systems == *windows* ]] && packages+=(g++-mingw-w64-x86-64-posix libz-mingw-w64-dev qt6-base-dev-tools zip)
ensure_packages "${packages[@]}"

# Runs a command; its output goes into a log, and is shown when the command fails.
logged() {
  local log=$1
  shift
  "$@" >>"$log" 2>&1 || { tail -n 20 "$log" >&2; say "failed: see $log" >&2; exit 1; }
}

# Unpacks Debian's source of a package.
source_of() {
  local package=$1
  [[ -d $output/sources/$package ]] && return
  say "fetching the source of $package"
  if ! (cd "$output/sources" && apt-get source --download-only "$package" >/dev/null); then
    say "no source of $package: add a deb-src line to the sources of apt, and run apt-get update" >&2
    exit 1
  fi
  dpkg-source --no-check -x "$(ls "$output/sources/$package"_*.dsc)" "$output/sources/$package.part" >/dev/null 2>&1
  mv "$output/sources/$package.part" "$output/sources/$package"
}

# build_library SYSTEM PACKAGE SOURCE_FOLDER OPTIONS...: with CMake, installed into the folder of libraries.
build_library() {
  local system=$1 package=$2 folder=$3 build=$output/$1/$2
  shift 3
  logged "$build.log" cmake -S "$output/sources/$folder" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    "-DCMAKE_INSTALL_PREFIX=$output/$system/libraries" "$@"
  logged "$build.log" cmake --build "$build" -j "$jobs"
  logged "$build.log" cmake --install "$build"
}

build_qt() {
  local system=$1 off=() feature
  shift
  [[ -f $output/$system/libraries/lib/libQt6Core.a ]] && return
  source_of qt6-base
  say "building Qt Core for $system"
  for feature in gui widgets network sql dbus testlib concurrent printsupport icu glib zstd journald syslog \
                 system_pcre2 system_zlib system_doubleconversion; do
    off+=("-DFEATURE_$feature=OFF")
  done
  build_library "$system" qt6-base qt6-base -DBUILD_SHARED_LIBS=OFF -DQT_BUILD_EXAMPLES=OFF -DQT_BUILD_TESTS=OFF "${off[@]}" "$@"
}

# build_pcap SYSTEM OPTIONS...: files are read, no interface, so none of its drivers.
build_pcap() {
  local system=$1 libraries=$output/$1/libraries build=$output/$1/libpcap driver off=()
  shift
  [[ -f $libraries/lib/libpcap.a ]] && return
  source_of libpcap
  say "building libpcap for $system"
  for driver in USB DBUS BLUETOOTH NETMAP RDMA DPDK LINUX_USBMON; do off+=("-DDISABLE_$driver=ON"); done
  mkdir -p "$build"
  # In its own folder: for Windows it writes a file "NUL:" where it is configured.
  (
    cd "$build"
    logged "$build.log" cmake -S "$output/sources/libpcap" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
      "-DCMAKE_INSTALL_PREFIX=$libraries" -DPCAP_TYPE=null -DENABLE_REMOTE=OFF -DBUILD_WITH_LIBNL=OFF \
      -DCMAKE_DISABLE_FIND_PACKAGE_OpenSSL=ON "${off[@]}" "$@"
  )
  # `install` is out of reach: Debian's linker script for the shared library comes of its own build, and the programs for
  # Windows want a driver.
  logged "$build.log" cmake --build "$build" -j "$jobs" --target pcap_static
  mkdir -p "$libraries"/{include/pcap,lib/pkgconfig}
  cp "$output/sources/libpcap/pcap.h" "$libraries/include"
  cp "$output/sources/libpcap/pcap/"*.h "$libraries/include/pcap"
  cp "$build/libpcap.pc" "$libraries/lib/pkgconfig"
  cp "$build/libpcap.a" "$libraries/lib"
}

# add_licences FOLDER COMPILER C_LIBRARY ZLIB [PACKAGE...]: the licences of what is linked into the program, and the Debian
# packages whose libraries it holds.
add_licences() {
  local folder=$1/share/doc/ecaudit/libraries
  mkdir -p "$folder"
  cp cli/packaging/libraries.txt "$folder/README.txt"
  cp "$output/sources/qt6-base/LICENSES/LGPL-3.0-only.txt" "$folder/qt-LGPL-3.0.txt"
  cp "$output/sources/qt6-base/LICENSES/GPL-3.0-only.txt" "$folder/qt-GPL-3.0.txt"
  cp "$output/sources/libpcap/LICENSE" "$folder/libpcap.txt"
  cp /usr/share/doc/libzstd-dev/copyright "$folder/zstd.txt"
  cp "/usr/share/doc/$2/copyright" "$folder/compiler.txt"
  cp "/usr/share/doc/$3/copyright" "$folder/c-library.txt"
  cp "/usr/share/doc/$4/copyright" "$folder/zlib.txt"
  {
    find "$output/sources" -name '*.dsc' -printf '%f\n' | sed 's/\.dsc$//; s/_/ /' |
      if [[ $# -gt 4 ]]; then grep -v '^libzstd '; else cat; fi
    dpkg-query -W -f '${source:Package} ${source:Version}\n' "${@:2}"
  } | sort -u >"$folder/debian-sources.txt"
}

version() { sed -n 's/^project(ecaudit.* VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt; }

build_linux() {
  local libraries=$output/linux/libraries build=$output/linux/program
  local name=ecaudit-$(version)-linux-$(uname -m)
  build_qt linux
  build_pcap linux
  say "building the program for linux"
  # The last options of the linker come after the -pie of the hardened build, and win. A static program at addresses of its
  # own choice (-static-pie) ends in the start code of Debian's C library.
  PKG_CONFIG_PATH=$libraries/lib/pkgconfig logged "$build.log" cmake --preset release -B "$build" -DECAUDIT_TESTS=OFF \
    "-DCMAKE_PREFIX_PATH=$libraries" "-DCMAKE_CXX_STANDARD_LIBRARIES=-static -no-pie" -DZLIB_USE_STATIC_LIBS=ON \
    "-Dpkgcfg_lib_ZSTD_zstd=$(g++ -print-file-name=libzstd.a)" -DCMAKE_INSTALL_PREFIX=/usr
  logged "$build.log" cmake --build "$build" -j "$jobs" --target ecaudit ecaudit_pages
  if readelf -d "$build/cli/ecaudit" | grep NEEDED; then
    say "the program needs these libraries of the system" >&2
    exit 1
  fi
  rm -rf "${output:?}/$name"
  DESTDIR=$output/$name.install logged "$build.log" cmake --install "$build" --strip
  mv "$output/$name.install/usr" "$output/$name"
  rmdir "$output/$name.install"
  rm -f "$output/$name/share/doc/ecaudit/changelog.gz"  # a form for Debian's packages
  add_licences "$output/$name" libstdc++6 libc6-dev zlib1g-dev libzstd-dev
  tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$SOURCE_DATE_EPOCH" -C "$output" -cf - "$name" |
    gzip -9n >"$output/$name.tar.gz"
  rm -rf "${output:?}/$name"
  say "$output/$name.tar.gz"
}

build_windows() {
  local libraries=$output/windows/libraries build=$output/windows/program host=$output/windows/host
  local name=ecaudit-$(version)-windows-x86_64
  # The tools of Qt are those of this machine.
  local host_qt=(-DQT_HOST_PATH=/usr "-DQT_HOST_PATH_CMAKE_DIR=/usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)/cmake")
  # Nothing of this machine's own libraries.
  export PKG_CONFIG_LIBDIR=$libraries/lib/pkgconfig
  build_qt windows "-DCMAKE_TOOLCHAIN_FILE=$toolchain" "${host_qt[@]}"
  build_pcap windows "-DCMAKE_TOOLCHAIN_FILE=$toolchain"
  if [[ ! -f $libraries/lib/libzstd.a ]]; then
    source_of libzstd
    say "building zstd for windows"
    build_library windows zstd libzstd/build/cmake "-DCMAKE_TOOLCHAIN_FILE=$toolchain" -DZSTD_BUILD_PROGRAMS=OFF \
      -DZSTD_BUILD_SHARED=OFF -DZSTD_LEGACY_SUPPORT=OFF -DZSTD_MULTITHREAD_SUPPORT=OFF
  fi
  # Headers alone, which must not come with those of this machine's C library.
  mkdir -p "$libraries"/{include,share/cmake}
  cp -r /usr/include/nlohmann /usr/include/CLI "$libraries/include"
  cp -r /usr/share/cmake/nlohmann_json /usr/share/cmake/CLI11 "$libraries/share/cmake"

  say "building the program for windows"
  # A program of this machine packs the profiles.
  logged "$host.log" env -u PKG_CONFIG_LIBDIR cmake --preset release -B "$host" -DECAUDIT_TESTS=OFF -DECAUDIT_HTML=OFF
  logged "$host.log" cmake --build "$host" -j "$jobs" --target ecaudit_pack_profiles
  logged "$build.log" cmake --preset release -B "$build" -DECAUDIT_TESTS=OFF "-DCMAKE_TOOLCHAIN_FILE=$toolchain" \
    "-DCMAKE_FIND_ROOT_PATH=$libraries" "-DCMAKE_PREFIX_PATH=$libraries" "${host_qt[@]}" -DZLIB_USE_STATIC_LIBS=ON \
    "-DECAUDIT_PACK_PROFILES=$(find "$host" -name ecaudit_pack_profiles -type f)" \
    "-DCMAKE_CXX_STANDARD_LIBRARIES=-L$libraries/lib -static -lws2_32 -lshell32" \
    -DCMAKE_INSTALL_BINDIR=. -DCMAKE_INSTALL_DATADIR=share -DCMAKE_INSTALL_PREFIX=/ecaudit
  logged "$build.log" cmake --build "$build" -j "$jobs" --target ecaudit
  if x86_64-w64-mingw32-objdump -p "$build/cli/ecaudit.exe" | grep -iE 'DLL Name: .*(stdc|gcc|pthread|qt|zlib|zstd|pcap)'; then
    say "the program needs these libraries, which Windows does not have" >&2
    exit 1
  fi
  rm -rf "${output:?}/$name" "$output/$name.zip"
  DESTDIR=$output/$name.install logged "$build.log" cmake --install "$build" --strip
  mv "$output/$name.install/ecaudit" "$output/$name"
  rmdir "$output/$name.install"
  rm -f "$output/$name/share/doc/ecaudit/changelog.gz"  # a form for Debian's packages
  add_licences "$output/$name" g++-mingw-w64-x86-64-posix mingw-w64-x86-64-dev libz-mingw-w64-dev
  # Lines end as Windows' own editor wants them.
  sed 's/$/\r/' cli/packaging/windows/README.txt >"$output/$name/README.txt"
  find "$output/$name" -exec touch -h -d "@$SOURCE_DATE_EPOCH" {} +
  (cd "$output" && find "$name" -type f | LC_ALL=C sort | TZ=UTC zip -qX9 "$name.zip" -@)
  rm -rf "${output:?}/$name"
  say "$output/$name.zip"
}

for system in $systems; do
  mkdir -p "$output/$system"
  "build_$system"
done
