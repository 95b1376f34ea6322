#!/bin/sh
# install-dependencies.sh run|tests|benchmarks|gates ...
#
# Installs with apt what these groups need and is not there yet; does nothing, quickly, when all is there.
# On a system without apt it says what is needed and leaves it at that. Used by examples/run and tests/run.
set -eu

library="g++ cmake ninja-build pkg-config libeigen3-dev libnanoflann-dev"
run="libcli11-dev libtomlplusplus-dev libstb-dev libtachyon-mt-0-dev"
tests="catch2 binutils"
benchmarks="libbenchmark-dev"
gates="clang clang-format clang-tidy libomp-dev libclang-rt-dev"

wanted="$library"
for group in "$@"; do
  case $group in
    run) wanted="$wanted $run" ;;
    tests) wanted="$wanted $tests" ;;
    benchmarks) wanted="$wanted $benchmarks" ;;
    gates) wanted="$wanted $gates" ;;
    *) echo "$0: no group \"$group\"; allowed: run tests benchmarks gates" >&2; exit 2 ;;
  esac
done

if ! command -v apt-get >/dev/null 2>&1 || ! command -v dpkg-query >/dev/null 2>&1; then
  echo "This system has no apt, so nothing is installed here. What gravel needs (names as in Debian):"
  echo "  $wanted"
  echo "Going on with what is there."
  exit 0
fi

missing=
for package in $wanted; do
  status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
  if [ "$status" != installed ]; then
    missing="$missing $package"
  fi
done
if [ -z "$missing" ]; then
  exit 0
fi

if [ "$(id -u)" -eq 0 ]; then
  as_root=
elif command -v sudo >/dev/null 2>&1; then
  as_root=sudo
else
  echo "Missing packages:$missing"
  echo "Install them as root: apt-get install --no-install-recommends$missing"
  echo "Going on with what is there."
  exit 0
fi

echo "Installing:$missing"
# A package index that is out of reach or partly stale is no reason to stop: it may hold what is needed.
$as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq update </dev/null || true
install() {
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -y -o Dpkg::Use-Pty=0 \
    install --no-install-recommends "$@" </dev/null
}
# shellcheck disable=SC2086
if install $missing; then
  exit 0
fi
# One name that this system does not know must not keep the others away; the build says what it cannot do without.
for package in $missing; do
  install "$package" || echo "Not installed: $package. Going on with what is there."
done
