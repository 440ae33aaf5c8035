#!/usr/bin/env bash
# Installs what is missing (Debian packages), builds the program, and checks a sample capture with it.
# Safe to run again; run from anywhere.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source .ci/packages.sh

ensure_packages "${BUILD_PACKAGES[@]}"

say "building the program (build/release)"
cmake --preset release -DECAUDIT_TESTS=OFF
cmake --build --preset release --target ecaudit

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

cat <<END

Next:
  $program check CAPTURE.pcapng           check a capture of your own
  $program check --help                   options, among them JSON reports and settings for CI
  $program explain al-refused             what a rule checks, why, and what to do
  sudo cmake --install build/release      install the program
END
