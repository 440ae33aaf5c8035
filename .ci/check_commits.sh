#!/usr/bin/env bash
# Checks the messages of new commits; changes nothing. Run from anywhere inside a checkout: .ci/check_commits.sh [RANGE]
#   RANGE   commits to check (default: those that the upstream branch lacks; without an upstream the last one)
# A subject is `area: imperative`, at most 72 characters; after a blank line a body has symptom, cause, change and test.
set -euo pipefail

if ! git rev-parse --verify --quiet HEAD >/dev/null; then
  echo "-- commits: skipped, no git history"
  exit 0
fi
if [[ -n "${1:-}" ]]; then
  commits=("$1")
elif upstream=$(git rev-parse --abbrev-ref --symbolic-full-name '@{upstream}' 2>/dev/null); then
  commits=("$upstream..HEAD")
else
  commits=(-1 HEAD)
fi

# Words that begin no imperative.
other_forms='^(add|chang|remov|updat|renam|mov|us|improv|rewrit)(ed|es|ing)$|^(fix|report|show|count|check|test)(ed|es|s|ing)$|^(the|a|an|no|what|where|when|it|this)$'
bad=0
count=0
complain() {
  echo "$1: $2"
  bad=1
}
for commit in $(git rev-list --no-merges "${commits[@]}"); do
  count=$((count + 1))
  short=$(git log -1 --format=%h "$commit")
  subject=$(git log -1 --format=%s "$commit")
  body=$(git log -1 --format=%b "$commit")
  name="$short \"$subject\""
  (( ${#subject} <= 72 )) || complain "$name" "the subject has ${#subject} characters, more than 72"
  if [[ "$subject" =~ ^[a-z][a-z0-9_.,/\ -]*:\ ([^\ ]+) ]]; then
    verb="${BASH_REMATCH[1],,}"
    [[ ! "$verb" =~ $other_forms ]] || complain "$name" "\"$verb\" is no imperative: write \"area: add ...\""
  else
    complain "$name" "the subject is not \"area: imperative\""
  fi
  [[ "$subject" != *. ]] || complain "$name" "the subject ends with a full stop"
  [[ -n "${body//[[:space:]]/}" ]] || complain "$name" "no body: symptom, cause, change, test"
done
if (( bad )); then exit 1; fi
echo "-- commits: $count checked"
