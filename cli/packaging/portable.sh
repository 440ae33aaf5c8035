#!/usr/bin/env bash
# Builds ecaudit-VERSION-linux-x86_64.tar.gz: one program that needs no library of the system, with documents, man pages and
# samples. Runs on any Linux with a kernel from 3.2 on.
#
#   cli/packaging/portable.sh [OUTPUT_FOLDER]     default: build/portable
#
# Needs what cli/quickstart.sh installs, and Debian's sources of Qt and libpcap (a deb-src line). Network: Debian's archive only.
# Qt Core takes most of the time; it and libpcap are built once.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source .ci/packages.sh

output=${1:-build/portable}
mkdir -p "$output"
output=$(cd "$output" && pwd)
libraries=$output/libraries
jobs=$(nproc)

ensure_packages "${BUILD_PACKAGES[@]}" dpkg-dev flex bison

# Unpacks Debian's source of a package into a folder.
source_of() {
  local package=$1 folder=$2
  [[ -d $folder ]] && return
  say "fetching the source of $package"
  mkdir -p "$output/sources"
  if ! (cd "$output/sources" && apt-get source --download-only "$package" >/dev/null); then
    say "no source of $package: add a deb-src line to the sources of apt, and run apt-get update" >&2
    exit 1
  fi
  dpkg-source --no-check -x "$(ls "$output/sources/$package"_*.dsc)" "$folder.part" >/dev/null
  mv "$folder.part" "$folder"
}

if [[ ! -f $libraries/lib/libQt6Core.a ]]; then
  source_of qt6-base "$output/qt6-base"
  say "building Qt Core"
  off=()
  for feature in gui widgets network sql dbus testlib concurrent printsupport icu glib zstd journald syslog \
                 system_pcre2 system_zlib system_doubleconversion; do
    off+=("-DFEATURE_$feature=OFF")
  done
  cmake -S "$output/qt6-base" -B "$output/qt-build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=OFF "${off[@]}" \
    -DQT_BUILD_EXAMPLES=OFF -DQT_BUILD_TESTS=OFF "-DCMAKE_INSTALL_PREFIX=$libraries" >/dev/null
  cmake --build "$output/qt-build" -j "$jobs" >/dev/null
  cmake --install "$output/qt-build" >/dev/null
fi

if [[ ! -f $libraries/lib/libpcap.a ]]; then
  source_of libpcap "$output/libpcap"
  say "building libpcap"
  # Files are read, no interface: none of its drivers.
  (cd "$output/libpcap" &&
     ./configure --prefix="$libraries" --with-pcap=null --disable-shared --disable-usb --disable-dbus --disable-bluetooth \
       --disable-netmap --disable-rdma --without-libnl --without-dag --without-snf --disable-remote &&
     make -j "$jobs" && make install) >"$output/libpcap.log" 2>&1 || { tail -n 20 "$output/libpcap.log" >&2; exit 1; }
fi

say "building the program"
# These stand last on the line of the linker: there they count, after the -pie of the hardened build. A static program at
# addresses of its own choice (-static-pie) ends in the start code of Debian's C library.
{
  PKG_CONFIG_PATH=$libraries/lib/pkgconfig cmake --preset release -B "$output/program" -DECAUDIT_TESTS=OFF \
    "-DCMAKE_PREFIX_PATH=$libraries" "-DCMAKE_CXX_STANDARD_LIBRARIES=-static -no-pie" -DZLIB_USE_STATIC_LIBS=ON \
    "-Dpkgcfg_lib_ZSTD_zstd=$(g++ -print-file-name=libzstd.a)" -DCMAKE_INSTALL_PREFIX=/usr &&
    cmake --build "$output/program" -j "$jobs" --target ecaudit ecaudit_pages
} >"$output/program.log" 2>&1 || { tail -n 20 "$output/program.log" >&2; exit 1; }

program=$output/program/cli/ecaudit
if readelf -d "$program" | grep NEEDED; then
  say "the program needs these libraries of the system" >&2
  exit 1
fi

version=$("$program" --version | sed -n '1s/ecaudit //p')
name=ecaudit-$version-linux-$(uname -m)
rm -rf "${output:?}/$name"
DESTDIR=$output/$name.install cmake --install "$output/program" --strip >/dev/null
mv "$output/$name.install/usr" "$output/$name"
rmdir "$output/$name.install"
tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="@${SOURCE_DATE_EPOCH:-0}" -C "$output" -czf \
  "$output/$name.tar.gz" "$name"
rm -rf "${output:?}/$name"
say "$output/$name.tar.gz"
