#!/usr/bin/env bash
# Builds everything twice, with sanitizers and optimised, and runs all tests in both builds; and the program once more with
# the thread sanitizer, for the tests of batch.
# Installs what is missing (Debian packages). Safe to run again; run from anywhere. Ends with ctest's summary.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source .ci/packages.sh

# tshark, jsonschema, xmllint, parallel, the SARIF schema, npm (which makes the page of HTML reports) and Chromium (which
# opens it) are for tests that are skipped, with a message, without them.
packages=("${BUILD_PACKAGES[@]}" libgtest-dev libgmock-dev libbenchmark-dev python3 python3-jsonschema tshark ccache
          libxml2-utils parallel)
# Where node comes from elsewhere, Debian's npm would take its place.
command -v npm >/dev/null || packages+=(npm)
command -v chromium >/dev/null || packages+=(chromium)
ensure_packages "${packages[@]}"
tests/support/sarif_schema.sh

export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1
export UBSAN_OPTIONS=print_stacktrace=1
# Two checkouts of the same sources share what ccache has compiled.
export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
jobs=$(nproc)

# Configures, builds and tests one preset. Called where a failure must not end the script, so every step is chained.
test_preset() {
  local preset=$1
  say "building with preset $preset (build/$preset)" &&
    cmake --preset "$preset" -DECAUDIT_TESTS=ON &&
    cmake --build --preset "$preset" -j "$jobs" &&
    say "testing with preset $preset" &&
    ctest --preset "$preset" -j "$jobs" --no-tests=error
}

failed=()
test_preset asan || failed+=("the build with sanitizers")
test_preset tsan || failed+=("the build with the thread sanitizer")
# Last, so that its summary closes the output.
test_preset release || failed+=("the optimised build")

for part in "${failed[@]}"; do say "FAILED: $part, see above" >&2; done
[[ ${#failed[@]} -eq 0 ]]
