#!/bin/sh
# run.sh MINUTES: each libFuzzer target (clang, preset "fuzz") and the attack on the whole program for so long. What fails
# is in build/found.
set -eu
minutes=${1:-5}
cd "$(dirname "$0")/../.."
cmake --preset fuzz >/dev/null
cmake --build --preset fuzz
mkdir -p build/found
status=0
for source in tests/fuzz/fuzz_*.cpp; do
  target=$(basename "$source" .cpp)
  mkdir -p "build/found/$target"
  dictionary=tests/fuzz/dictionaries/$target.dict
  set -- "build/found/$target"
  for folder in corpus regressions; do
    [ ! -d "tests/fuzz/$folder/$target" ] || set -- "$@" "tests/fuzz/$folder/$target"
  done
  [ ! -f "$dictionary" ] || set -- -dict="$dictionary" "$@"
  "build/fuzz/tests/fuzz/$target" -max_total_time=$((minutes * 60)) -rss_limit_mb=2048 -timeout=20 \
    -artifact_prefix="build/found/$target-" -print_final_stats=1 "$@" 2>"build/found/$target.log" || status=1
  grep -E "stat::number_of_executed_units|ERROR|SUMMARY" "build/found/$target.log" | sed "s/^/$target: /"
done
python3 tests/fuzz/attack.py build/fuzz/cli/ecaudit --minutes "$minutes" --seed "$(date +%s)" --keep build/found/attack \
  samples/captures/*.pcap* || status=1
exit $status
