#!/usr/bin/env bash
# Builds Trunnion when needed and runs a program on simulated drives, faster than real time.
set -u
start=$PWD
cd "$(dirname "$(readlink -f "$0")")" || exit 1
. scripts/setup.sh

usage() {
  cat <<'END'
usage: ./run.sh [PROGRAM] [--machine CONFIG.toml] [options of 'trunnion run']

Without a program: the five-axis impeller of examples/. Without --machine: the cradle. Programs of examples/ get the
tool table that lies there.
Options: --trace FILE.csv, --json, --tools FILE.tbl, --vars FILE.var; ./run.sh --help-run lists them all.
END
}

# A path given by the caller, as seen from the top of the repository.
resolve() {
  case "$1" in
    /* | -) printf '%s\n' "$1" ;;
    *) if [ -e "$start/$1" ] || [ ! -e "$1" ]; then printf '%s/%s\n' "$start" "$1"; else printf '%s\n' "$1"; fi ;;
  esac
}

program= machine= tools= options=()
while [ $# -gt 0 ]; do
  case "$1" in
    -h | --help) usage; exit 0 ;;
    --help-run) options+=(--help); shift ;;
    --machine | --tools | --vars | --trace)
      [ $# -ge 2 ] || { usage >&2; exit 5; }
      [ "$1" != --machine ] || machine=$2
      [ "$1" != --tools ] || tools=$2
      options+=("$1" "$(resolve "$2")")
      shift 2
      ;;
    --machine=*) machine=${1#*=}; options+=(--machine "$(resolve "$machine")"); shift ;;
    -*) options+=("$1"); shift ;;
    *) [ -z "$program" ] || { usage >&2; exit 5; }; program=$1; options+=("$(resolve "$1")"); shift ;;
  esac
done
if [ -z "$program" ]; then
  program=examples/impeller.ngc
  options+=("$program")
fi
case "$program" in examples/* | */examples/*) [ -n "$tools" ] || options+=(--tools examples/tools.tbl) ;; esac
[ -n "$machine" ] || options+=(--machine configs/cradle.toml)

install_packages build
build release trunnion
exec build/release/trunnion run "${options[@]}"
