#!/bin/sh
# Builds the fuzz targets with sanitizers and for speed, runs each of them from its kept corpus in both forms, and
# prints what came of it: tests/fuzz/run.sh [EXECUTIONS]. New inputs and findings stay in build/fuzz_work.
set -u
cd "$(dirname "$0")/../.." || exit 1
executions=${1:-200000}
work=build/fuzz_work
targets=$(sed -n 's/^trn_fuzz(\([a-z_]*\) .*/\1/p' CMakeLists.txt)

build() { # folder, sanitizers
  log=$1.log
  CC=clang-14 CXX=clang++-14 cmake -B "$1" -GNinja -DTRN_FUZZ=ON -DTRN_NO_PCH=ON -DTRN_FUZZ_SANITIZE="$2" >"$log" &&
    echo "$targets" | xargs nice -n 10 ninja -C "$1" -j1 >>"$log" && return
  tail -n 20 "$log"
  exit 1
}

# The longest input: what a target needs to say something, and no more.
length_of() {
  case $1 in
    config_fuzz) echo 5000 ;;
    eds_fuzz) echo 1200 ;;
    session_log_fuzz) echo 900 ;;
    message_fuzz) echo 4000 ;;
    page_message_fuzz) echo 600 ;;
    can_frame_fuzz | gateway_fuzz | program_wire_fuzz) echo 400 ;;
    table_fuzz | modbus_fuzz) echo 300 ;;
    *) echo 192 ;;
  esac
}

statistic() { # name, log
  sed -n "s/^stat::$1: *//p" "$2" | tail -n 1
}

run() { # target, folder, form
  found=$work/$1
  log=$found/$3.log
  mkdir -p "$found/inputs" "$found/findings"
  dictionary=tests/fuzz/${1%_fuzz}.dict
  [ -f "$dictionary" ] || dictionary=
  nice -n 15 "$2/$1" ${dictionary:+"-dict=$dictionary"} -max_len="$(length_of "$1")" -runs="$executions" \
    -entropic=0 -timeout=60 -rss_limit_mb=2048 -print_final_stats=1 -artifact_prefix="$found/findings/" \
    "$found/inputs" "tests/fuzz/corpus/$1" >"$log" 2>&1 || failed=1
  printf '%-18s %-10s %10s %9s %9s\n' "$1" "$3" "$(statistic number_of_executed_units "$log")" \
    "$(statistic average_exec_per_sec "$log")" "$(find "$found/findings" -type f | wc -l)"
}

mkdir -p build
build build/fuzz address,undefined
build build/fuzz_fast ""
failed=0
printf '%-18s %-10s %10s %9s %9s\n' target form executions 'a second' findings
for target in $targets; do
  run "$target" build/fuzz sanitized
  run "$target" build/fuzz_fast fast
done
exit "$failed"
