#!/usr/bin/env bash
# Builds everything once with sanitizers and runs it; then the optimised program with the tests of programs, of memory,
# in a browser and against Wireshark, and the laws over all captures.
#   --quick   for work: a build without optimisation, unit tests and short suites, without laws over all captures
#   --bless [CASE...]   builds the program and writes what the golden cases expect (tests/golden/)
# Installs what is missing (Debian packages). Safe to run again; run from anywhere. Ends with what took how long.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source .ci/packages.sh

quick=false
bless=false
case "${1:-}" in
  --quick) quick=true ;;
  --bless) bless=true; shift ;;
  "") ;;
  *) echo "usage: tests/run.sh [--quick | --bless [CASE...]]" >&2; exit 2 ;;
esac

# tshark, jsonschema, xmllint, parallel, the SARIF schema, npm (which makes the page of HTML reports) and Chromium (which
# opens it) are for tests that are skipped, with a message, without them.
packages=("${BUILD_PACKAGES[@]}" clang libclang-rt-dev dpkg-dev libgtest-dev libgmock-dev libbenchmark-dev python3 python3-jsonschema tshark ccache
          libxml2-utils parallel)
# Where node comes from elsewhere, Debian's npm would take its place.
command -v npm >/dev/null || packages+=(npm)
command -v chromium >/dev/null || packages+=(chromium)
if $bless; then packages=("${BUILD_PACKAGES[@]}" clang libgtest-dev libgmock-dev python3 ccache); fi
ensure_packages "${packages[@]}"
$bless || tests/support/sarif_schema.sh

export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1
export UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1
# Two checkouts of the same sources share what ccache has compiled.
export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
jobs=$(nproc)
failed=()
times=()

# step NAME COMMAND...: runs it, whatever failed before, and keeps its time.
step() {
  local name=$1 begin=$SECONDS status=0
  shift
  say "$name"
  "$@" || status=$?
  times+=("$(printf '%4d s  %s' $((SECONDS - begin)) "$name")")
  [[ $status -eq 0 ]] || failed+=("$name")
  return $status
}

# build PRESET [TARGET...]: configures and builds.
build() {
  local preset=$1
  shift
  cmake --preset "$preset" -DECAUDIT_TESTS=ON && cmake --build --preset "$preset" -j "$jobs" ${@:+--target "$@"}
}

if $bless; then
  build quick ecaudit
  exec tests/golden/run.py --bless --program build/quick/cli/ecaudit "$@"
fi

run() { ctest --preset "$1" -j "$jobs" --no-tests=error "${@:2}"; }

if $quick; then
  step "building" build quick ecaudit ecaudit_unit_tests &&
    { step "quick tests" run quick -R '^(unit|build|golden)\.|^cli\.(Usage|Messages|Gate|Reports|Fields|Samples|Needs)$' || true; }
else
  step "building with sanitizers" build asan &&
    { step "all tests with sanitizers" run asan -LE optimised || true; }
  step "building the optimised program" build release ecaudit ecaudit_law_tests ecaudit_memory_tests ecaudit_make_long_capture &&
    { step "the optimised program" run release -L "program|optimised" || true; }
fi || true

if [[ ! -d ${ECAUDIT_SHARED_DIR:-../shared} ]]; then
  say "../shared is absent: tests that need it were skipped, $(grep -c '^shared ' tests/needs.txt) lines of tests/needs.txt"
fi
say "what took how long"
printf '   %s\n' "${times[@]}"
for part in "${failed[@]}"; do say "FAILED: $part, see above" >&2; done
[[ ${#failed[@]} -eq 0 ]]
