#!/usr/bin/env bash
# Installs what is missing (Debian packages), builds the program, and checks a sample capture with it.
# Safe to run again; run from anywhere.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source .ci/packages.sh

ensure_packages "${BUILD_PACKAGES[@]}"

needed=$(sed -n '1s/[^0-9]*\([0-9.]*\).*/\1/p' CMakeLists.txt)
found=$(cmake --version | sed -n '1s/[^0-9]*\([0-9][0-9.]*\).*/\1/p')
if ! printf '%s\n' "$needed" "$found" | sort -CV; then
  say "CMake $needed or newer is needed, and this is $found. Two ways, where the system has no newer package:" >&2
  say "  python3 -m pip install --user cmake     (and ~/.local/bin first in PATH)" >&2
  say "  the packages of https://apt.kitware.com" >&2
  exit 1
fi

say "building the program (build/release)"
cmake --preset release -DECAUDIT_TESTS=OFF
cmake --build --preset release --target ecaudit ecaudit_pages

program=build/release/cli/ecaudit
sample=samples/captures/init-to-op-refused.pcapng
say "checking a sample: $program check $sample"
status=0
"$program" check "$sample" || status=$?
case $status in
  1) say "exit status 1: the sample holds a fault on purpose, and the report above names it" ;;
  *) say "exit status $status, but 1 was expected: something is wrong with this build" >&2
     exit 1 ;;
esac

page=$(mktemp)
trap 'rm -f "$page"' EXIT
if ! "$program" check --quiet --fail-on never -o "html=$page" "$sample" >/dev/null 2>&1; then
  cat <<END

Left out: HTML reports (-o report.html). They need npm and its registry while the program is built:
  sudo apt-get install npm && cli/quickstart.sh
END
fi

cat <<END

Next:
  $program check CAPTURE.pcapng           check a capture of your own
  $program check --help                   options, among them JSON reports and settings for CI
  $program explain al-refused             what a rule checks, why, and what to do
  sudo cmake --install build/release      install the program
END
