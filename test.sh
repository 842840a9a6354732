#!/usr/bin/env bash
# Builds everything and runs every test. Ends with ctest's summary; exit 0 when all passed.
set -u
cd "$(dirname "$(readlink -f "$0")")" || exit 1
. scripts/setup.sh

usage() {
  cat <<'END'
usage: ./test.sh [--long] [--asan | --tsan | --debug] [-R REGEX] [-j N]

  --long   the long form of the proofs (a million poses, 100,000 sessions of the simulated world) and clang-tidy on
           every file; hours
  --asan   address and undefined-behaviour sanitizers    --tsan  thread sanitizer    --debug  no optimisation
  -R       only the tests whose name matches REGEX
END
}

preset=release long= ctest_options=() jobs=$(nproc)
while [ $# -gt 0 ]; do
  case "$1" in
    --long) long=1 ;;
    --asan | --tsan | --debug) preset=${1#--} ;;
    -R | -j)
      [ $# -ge 2 ] || { usage >&2; exit 5; }
      if [ "$1" = -j ]; then jobs=$2; else ctest_options+=(-R "$2"); fi
      shift
      ;;
    -h | --help) usage; exit 0 ;;
    *) usage >&2; exit 5 ;;
  esac
  shift
done

install_packages test
build "$preset" all panel_page
if [ -n "$long" ]; then
  export TRN_LONG=${TRN_LONG:-1000000}
  say "clang-tidy on every file"
  build debug trn_lcm_types  # compiles one source at a time
  /usr/bin/python3 tests/style/run_clang_tidy.py build/debug || die "clang-tidy found something; see above."
fi
exec ctest --test-dir "build/$preset" --output-on-failure -j "$jobs" "${ctest_options[@]}"
