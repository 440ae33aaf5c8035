#!/usr/bin/env bash
# run.sh MINUTES [TARGET...]: each libFuzzer target (clang, preset "fuzz"), or those named, and the attack on the whole
# program ("attack") for so long. RUNS=N: until so many inputs were run, if that is earlier. What fails is in build/found.
set -eu
minutes=${1:-5}
targets=("${@:2}")
cd "$(dirname "$0")/../.."
cmake --preset fuzz -DECAUDIT_TESTS=ON >/dev/null
cmake --build --preset fuzz
if [[ ${#targets[@]} -eq 0 ]]; then
  for source in tests/fuzz/fuzz_*.cpp; do targets+=("$(basename "$source" .cpp)"); done
  targets+=(attack)
fi
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
# Where memory was taken is told by the input that fails, run alone. What was given back stays unused until 4 MB more were:
# more than an analysis of most inputs takes, and less than what caches and page tables have room for.
export ASAN_OPTIONS=malloc_context_size=1:quarantine_size_mb=4
mkdir -p build/found
status=0
for target in "${targets[@]}"; do
  found=build/found/$target
  if [[ $target == attack ]]; then
    UBSAN_OPTIONS=halt_on_error=0 python3 tests/fuzz/attack.py build/fuzz/cli/ecaudit --minutes "$minutes" \
      --runs "${RUNS:-0}" --seed "${SEED:-$(date +%s)}" --keep "$found" samples/captures/*.pcap* || status=1
    continue
  fi
  mkdir -p "$found"
  # Without entropic: it counts the features of all inputs again and again, up to three quarters of the time of targets
  # that run the whole analysis.
  arguments=("-entropic=0" "-max_total_time=$((minutes * 60))" "-runs=${RUNS:--1}" -rss_limit_mb=2048 -timeout=20
             "-artifact_prefix=$found-" -print_final_stats=1 -print_funcs=0)
  [[ ! -f tests/fuzz/dictionaries/$target.dict ]] || arguments+=("-dict=tests/fuzz/dictionaries/$target.dict")
  arguments+=("$found")
  for folder in corpus regressions; do
    [[ ! -d tests/fuzz/$folder/$target ]] || arguments+=("tests/fuzz/$folder/$target")
  done
  "build/fuzz/tests/fuzz/$target" "${arguments[@]}" 2>"$found.log" || status=1
  grep -E "stat::number_of_executed_units|stat::average_exec_per_sec|ERROR|runtime error|SUMMARY" "$found.log" |
    sed "s/^/$target: /" || true
done
exit $status
