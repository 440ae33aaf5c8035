#!/usr/bin/env bash
# Brings the JSON Schema of SARIF 2.1.0 to build/sarif-schema/, from the npm package that ships it, for the tests that
# validate against it. Without npm or network: says so and leaves those tests skipped. Run from anywhere, again at will.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
target=build/sarif-schema/sarif-2.1.0.json
[[ -s $target ]] && exit 0
if ! command -v npm >/dev/null; then
  echo "-- SARIF schema: npm is not installed; the tests that need the schema are skipped"
  exit 0
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
if (cd "$folder" && timeout 60 npm pack --silent @microsoft/jest-sarif@1.0.0-beta.0 >/dev/null 2>&1 &&
    tar -xzf ./*.tgz package/lib/schemas/sarif-2.1.0-rtm.5.json); then
  mkdir -p "$(dirname "$target")"
  mv "$folder/package/lib/schemas/sarif-2.1.0-rtm.5.json" "$target"
  echo "-- SARIF schema: $target"
else
  echo "-- SARIF schema: npm could not bring it; the tests that need it are skipped"
fi
