#!/usr/bin/env bash
# Builds the portable archive (cli/packaging/portable.sh), and tests the program in it: in a folder that holds nothing else,
# and with the command-line tests. Not part of tests/run.sh: Qt Core alone takes some minutes.
#
#   tests/portable.sh [OUTPUT_FOLDER]     default: build/portable
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source .ci/packages.sh

output=${1:-build/portable}
begin=$SECONDS
cli/packaging/portable.sh "$output"
say "$((SECONDS - begin)) s for the archive"

archive=$(ls -t "$output"/ecaudit-*-linux-*.tar.gz | head -n 1)
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
tar -C "$root" --strip-components=1 -xzf "$archive"
say "$(du -h "$archive" | cut -f1) packed, $(du -h "$root/bin/ecaudit" | cut -f1) the program"

# No loader and no library is there.
mkdir "$root/alone" "$root/alone/tmp"
cp "$root/bin/ecaudit" samples/captures/init-to-op-refused.pcapng "$root/alone"
if [[ $(id -u) -eq 0 ]]; then
  status=0
  chroot "$root/alone" /ecaudit check -o html=/tmp/report.html /init-to-op-refused.pcapng >"$root/text" || status=$?
  if [[ $status -ne 1 || ! -s $root/alone/tmp/report.html ]]; then
    say "alone in a folder, the program ended with $status instead of 1" >&2
    exit 1
  fi
  say "works in a folder that holds nothing else"
else
  say "not tried in a folder that holds nothing else: that needs root"
fi

failed=0
for suite in Usage Messages Formats Outputs Files Gate NamesAndPaths Baseline Config Input Catalogue Explain Families Verdict \
             Windows Require Junit Sarif Markdown Batch Merge StartupShow StartupExpect Diff DecodeJson DecodeText EventBasics \
             EventSdo SignalTable Slice Annotate HtmlPages Anonymize InterruptedReading FullDisk HostileFiles; do
  status=0
  ECAUDIT=$root/bin/ecaudit ECAUDIT_SOURCE_DIR=$PWD python3 tests/cli/run_suite.py "$suite" >"$root/log" 2>&1 || status=$?
  if [[ $status -ne 0 && $status -ne 77 ]]; then
    tail -n 40 "$root/log"
    say "FAILED: $suite" >&2
    failed=1
  fi
done
[[ $failed -eq 0 ]] && say "all suites pass, $((SECONDS - begin)) s in all"
exit $failed
