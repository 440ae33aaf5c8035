# shellcheck shell=bash
# Sourced by cli/quickstart.sh and tests/run.sh: Debian packages, installed only where they are missing.

# What the program needs to be built.
# shellcheck disable=SC2034  # used by the scripts that source this file
BUILD_PACKAGES=(g++ cmake ninja-build pkg-config libpcap-dev zlib1g-dev libzstd-dev qt6-base-dev
                nlohmann-json3-dev libcli11-dev)

# Says what is going on, apart from the output of the tools.
say() { printf '== %s\n' "$*"; }

# Prints those of the given packages that are not installed.
missing_packages() {
  local package
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || printf '%s\n' "$package"
  done
}

as_root() {
  if [[ $(id -u) -eq 0 ]]; then
    "$@"
  else
    sudo "$@"
  fi
}

# Installs what is missing; fails with the command to run when it cannot.
ensure_packages() {
  local missing
  if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    say "this is no Debian system: nothing is installed; needed are: $*"
    return 0
  fi
  mapfile -t missing < <(missing_packages "$@")
  if [[ ${#missing[@]} -eq 0 ]]; then
    say "all needed packages are installed"
    return 0
  fi
  say "installing ${missing[*]}"
  if [[ $(id -u) -ne 0 ]] && ! command -v sudo >/dev/null; then
    say "neither root nor sudo: please run as root: apt-get install ${missing[*]}" >&2
    return 1
  fi
  export DEBIAN_FRONTEND=noninteractive
  as_root apt-get update -qq
  if ! as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}"; then
    say "the packages could not be installed; Debian 12, Ubuntu 22.04 and newer ones have them" >&2
    return 1
  fi
}
