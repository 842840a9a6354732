#!/usr/bin/env bash
# Builds Trunnion when needed and runs a program on simulated drives, faster than real time.
set -u
root=$(dirname "$(readlink -f "$0")")

usage() {
  cat <<'END'
usage: ./run.sh [PROGRAM] [--machine CONFIG.toml] [options of 'trunnion run']
       ./run.sh --panel [PROGRAM] [--machine CONFIG.toml] [--port PORT]

Without a program: the five-axis impeller of examples/, which run by their name alone (./run.sh probe). Without
--machine: the machine that a comment of the program's first lines names, or the cradle.
./run.sh --help-run lists all options, as --report DIR, --trace FILE.csv, --tools FILE.tbl, --json.
--panel: the operator's page instead, with a daemon in real time on simulated drives (./run.sh --panel --help).
END
}

needs=build targets=(trunnion) panel=
case "${1-}" in
  -h | --help) usage; exit 0 ;;
  --help-run) set -- --help ;;
  --panel) panel=1 needs=panel targets=(trunnion panel_page); shift ;;
esac
(
  cd "$root" || exit 1
  . scripts/setup.sh
  install_packages "$needs"
  build release "${targets[@]}"
) || exit
if [ -n "$panel" ]; then
  . "$root/scripts/setup.sh"
  . "$root/scripts/panel.sh"
  run_panel "$@"
fi
# From the caller's folder: what the options mean, and which of them take a value, is the program's business.
exec "$root/build/release/trunnion" run --project "$root" "$@"
