#!/usr/bin/env bash
# Tests the archives that cli/packaging/portable.sh has built; builds nothing. The programs run as they are unpacked: the one
# for Linux also in a folder that holds nothing else, the one for Windows through wine. Not part of tests/run.sh: the suites
# take some minutes, through wine longer.
#
#   tests/portable.sh [FOLDER [linux|windows|all [SUITE...]]]     default: build/portable all, and all suites below
#
# With both archives and all suites, what the two programs write is compared as well. Ends with sizes, times, and the tests that
# were left out, with reasons (on Windows those of tests/windows/skipped.txt).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source .ci/packages.sh

folder=${1:-build/portable}
systems=${2:-all}
suites=("${@:3}")
if [[ ${#suites[@]} -eq 0 ]]; then
  suites=(Usage Messages Formats Outputs Files Fields Gate NamesAndPaths CountFrom Baseline Config Input Catalogue Explain
          Families Profiles Terminal Verdict Coverage CaptureNext Require Junit Sarif Gitlab Github Markdown Batch SkipDone
          BatchSlaves Merge StartupShow StartupExpect StartupFiles EsiRequirements Diff DecodeJson DecodeText DecodeSelection
          DecodeStreams EventBasics EventSdo EventMailbox EventEeprom SignalTable SignalStreams SignalSamples DeviceFileOptions
          EsiOfEachKind EsiOfOtherProtocols Slice Annotate TwoBusses TapWithTwoClocks HtmlPages HtmlTimeline Fleet CutStartups
          Examples Anonymize PluginFolders HostileFiles FullDisk ReadersThatLeave InterruptedReading)
  windows_suites=(WindowsNames WindowsText WindowsConsole WindowsInterrupt WindowsPlugin WindowsLocks)
else
  windows_suites=()
fi
case $systems in
  linux | windows) ;;
  all) systems="linux windows" ;;
  *) say "unknown system '$systems': linux, windows or all" >&2; exit 2 ;;
esac
packages=(binutils python3)
[[ $systems == *windows* ]] && packages+=(unzip wine64 g++-mingw-w64-x86-64-posix)
ensure_packages "${packages[@]}"

root=$(mktemp -d)
# Without the parts that wine would offer to load: .NET and a browser.
export WINEPREFIX=$root/wine WINEDEBUG=-all WINEDLLOVERRIDES=mscoree,mshtml=
wine=${ECAUDIT_WINE:-/usr/lib/wine/wine64}
wineserver=$(dirname "$wine")/wineserver
finish() {
  if [[ -d $WINEPREFIX ]]; then "$wineserver" -k || true; fi
  rm -rf "$root"
}
trap finish EXIT
failed=0
results=()

fail() {
  say "FAILED: $*" >&2
  failed=1
}

# The newest archive of a system.
archive_of() {
  local found=("$folder"/ecaudit-*-"$1"-*)
  if [[ ! -f ${found[-1]} ]]; then
    say "no archive for $1 in $folder: cli/packaging/portable.sh builds it" >&2
    exit 1
  fi
  printf '%s\n' "${found[@]}" | xargs -d '\n' ls -t | head -n 1
}

# run_suites NAME SUITE...: with what the caller has put into the environment.
run_suites() {
  local name=$1 passed=0 begin=$SECONDS suite status since
  shift
  for suite in "$@"; do
    status=0
    since=$SECONDS
    ECAUDIT_SOURCE_DIR=$PWD python3 tests/cli/run_suite.py "$suite" >"$root/log" 2>&1 || status=$?
    if [[ $status -eq 0 || $status -eq 77 ]]; then
      passed=$((passed + 1))
      say "$name: $suite passes, $((SECONDS - since)) s"
      sed -n "s/^\(test_[^ ]*\) .* skipped /left out: $suite.\1: /p" "$root/log" >>"$root/$name.skipped"
    else
      tail -n 40 "$root/log"
      fail "$name: $suite, $((SECONDS - since)) s"
    fi
  done
  results+=("$name: $passed of $# suites pass, $(wc -l <"$root/$name.skipped") tests left out, $((SECONDS - begin)) s")
}

# sizes NAME ARCHIVE PROGRAM; then, as the caller runs it: the time of one capture.
sizes() { results+=("$1: $(du -h "$2" | cut -f1) packed, $(du -h "$3" | cut -f1) the program"); }
timed() {
  local name=$1 begin
  shift
  "$@" >/dev/null 2>&1 || true  # from here on its file is in memory
  begin=$(date +%s%N)
  "$@" >/dev/null 2>&1 || true
  results+=("$name: $((($(date +%s%N) - begin) / 1000000)) ms for one start-up")
}

# contents NAME FOLDER PART...: what the archive holds, as it is unpacked.
contents() {
  local name=$1 top=$2 part
  shift 2
  for part in share/doc/ecaudit/guide.md share/doc/ecaudit/examples/captures share/doc/ecaudit/libraries/qt-LGPL-3.0.txt \
              share/ecaudit/profiles "$@"; do
    [[ -e $top/$part ]] || fail "$name: $part is not in the archive"
  done
}

test_linux() {
  local archive program=$root/linux/bin/ecaudit status=0
  archive=$(archive_of linux)
  mkdir "$root/linux"
  tar -C "$root/linux" --strip-components=1 -xzf "$archive"
  sizes linux "$archive" "$program"
  contents linux "$root/linux" share/man/man1/ecaudit.1.gz share/man/man1/ecaudit-wireshark.1.gz share/bash-completion/completions/ecaudit
  # No library, no loader, and so no version of a symbol that an older system would not have.
  readelf -lW "$program" | grep INTERP && fail "linux: the program needs a loader"
  readelf -dW "$program" 2>/dev/null | grep NEEDED && fail "linux: the program needs these libraries"
  readelf -VW "$program" | grep -o 'GLIBC[A-Z]*_[0-9.]*' && fail "linux: the program needs these versions"
  # The oldest kernel that its C library runs on.
  results+=("linux: $(readelf -nW "$program" | sed -n 's/.*OS: Linux, ABI: /for kernels from /p')")

  mkdir -p "$root/alone/tmp"
  cp "$program" samples/captures/init-to-op-refused.pcapng "$root/alone"
  if [[ $(id -u) -eq 0 ]]; then
    chroot "$root/alone" /ecaudit check -o html=/tmp/report.html /init-to-op-refused.pcapng >"$root/text" || status=$?
    [[ $status -eq 1 ]] || fail "linux: alone in a folder, the program ended with $status instead of 1"
    # Its page is inside.
    grep -q '^<!doctype html>' "$root/alone/tmp/report.html" || fail "linux: alone in a folder, no page"
  else
    results+=("linux: not tried in a folder that holds nothing else, which needs root")
  fi
  timed linux "$program" check samples/captures/clean-startup.pcapng
  ECAUDIT=$program run_suites linux "${suites[@]}"
}

test_windows() {
  local archive top
  archive=$(archive_of windows)
  mkdir "$root/windows"
  unzip -q "$archive" -d "$root/windows"
  top=$(find "$root/windows" -mindepth 1 -maxdepth 1)
  sizes windows "$archive" "$top/ecaudit.exe"
  contents windows "$top" README.txt
  # These are in every Windows 10.
  objdump -p "$top/ecaudit.exe" | sed -n 's/.*DLL Name: //p' |
    grep -viE '^(kernel32|user32|advapi32|shell32|ole32|ws2_32|msvcrt|version|authz|netapi32|userenv|winmm|mpr|api-ms-win-core-synch-l1-2-0)\.dll$' &&
    fail "windows: the program needs these libraries"
  mkdir "$WINEPREFIX"
  # Where the kernel places memory at random, one start in a thousand finds an address taken that wine needs, and ends with 1.
  printf '#!/bin/sh\nexec setarch -R "%s" "$@"\n' "$wine" >"$root/wine64"
  chmod +x "$root/wine64"
  export ECAUDIT_WINE=$root/wine64
  wine=$ECAUDIT_WINE
  # The services of wine run from here to the end. Started by a test, they would hold its pipes, and it would wait for their end.
  "$wineserver" -p
  "$wine" wineboot </dev/null >/dev/null 2>&1
  timed windows "$wine" "$top/ecaudit.exe" check samples/captures/clean-startup.pcapng
  x86_64-w64-mingw32-g++-posix -static -municode -o "$root/silent_pipe.exe" tests/windows/silent_pipe.cpp
  ECAUDIT=$PWD/tests/windows/run_in_wine.sh ECAUDIT_EXE=$top/ecaudit.exe ECAUDIT_SYSTEM=windows ECAUDIT_SILENT_PIPE=$root/silent_pipe.exe \
    run_suites windows "${suites[@]}" "${windows_suites[@]}"
}

# Both programs write the same bytes: all formats over all samples, and the commands that write what is in one.
test_same() {
  local exe capture words before=$failed compared=0
  exe=$(ls "$root"/windows/*/ecaudit.exe)
  cd samples/captures
  same() {
    "$root/linux/bin/ecaudit" "$@" >"$root/out.linux" 2>"$root/err.linux" </dev/null || true
    "$wine" "$exe" "$@" >"$root/out.windows" 2>"$root/err.windows" </dev/null || true
    cmp "$root/out.linux" "$root/out.windows" && cmp "$root/err.linux" "$root/err.windows" || fail "not the same: ${*:0:5}"
    compared=$((compared + 1))
  }
  for words in text json junit sarif markdown github gitlab; do same check --format "$words" ./*.pcap*; done
  for capture in *.pcap*; do
    for words in "decode --format jsonl" "events --format csv" "signals --states" startup; do
      # shellcheck disable=SC2086  # words of the command line
      same $words "$capture"
    done
  done
  cd ../..
  [[ $failed -ne $before ]] || results+=("linux and windows: $compared command lines write the same bytes")
}

for system in $systems; do
  : >"$root/$system.skipped"
  say "testing the archive for $system"
  "test_$system"
done
if [[ $systems == "linux windows" && ${#windows_suites[@]} -gt 0 ]]; then
  say "comparing what both programs write"
  test_same
fi
for system in $systems; do sort "$root/$system.skipped" | sed "s/^/   $system, /"; done
printf '== %s\n' "${results[@]}"
exit $failed
