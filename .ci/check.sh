#!/usr/bin/env bash
# Checks the form of the sources and of new commit messages; changes nothing. Run from anywhere: .ci/check.sh [--tidy BUILD_DIR]
#   --tidy BUILD_DIR   also run clang-tidy (slow); BUILD_DIR holds compile_commands.json
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

mapfile -t sources < <(find decoder analyzers cli samples tests -path tests/build/layer_violations -prune -o \
                          \( -name '*.h' -o -name '*.cpp' \) -print | sort)
cmake -P .ci/check_layers.cmake
.ci/check_commits.sh

if command -v clang-format >/dev/null; then
  clang-format --dry-run -Werror "${sources[@]}"
  echo "-- format: ${#sources[@]} files checked"
else
  echo "-- format: skipped, clang-format is not installed"
fi

if [[ "${1:-}" == --tidy ]]; then
  build="${2:?--tidy needs the build directory}"
  mapfile -t units < <(find decoder analyzers cli samples -name '*.cpp' | sort)
  printf '%s\0' "${units[@]}" | xargs -0 -n 4 -P "$(nproc)" clang-tidy --quiet -p "$build"
  echo "-- clang-tidy: ${#units[@]} files checked"
fi
