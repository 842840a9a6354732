#!/usr/bin/env bash
# Builds Trunnion when needed and runs a program on simulated drives, faster than real time.
set -u
root=$(dirname "$(readlink -f "$0")")

usage() {
  cat <<'END'
usage: ./run.sh [PROGRAM] [--machine CONFIG.toml] [options of 'trunnion run']

Without a program: the five-axis impeller of examples/, which run by their name alone (./run.sh probe). Without
--machine: the machine that a comment of the program's first lines names, or the cradle.
./run.sh --help-run lists all options, as --report DIR, --trace FILE.csv, --tools FILE.tbl, --json.
END
}

case "${1-}" in
  -h | --help) usage; exit 0 ;;
  --help-run) set -- --help ;;
esac
(
  cd "$root" || exit 1
  . scripts/setup.sh
  install_packages build
  build release trunnion
) || exit
# From the caller's folder: what the options mean, and which of them take a value, is the program's business.
exec "$root/build/release/trunnion" run --project "$root" "$@"
