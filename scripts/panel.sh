# Sourced by run.sh: the operator's page of a machine on simulated drives. Needs bash, and $root: the repository's top.

panel_usage() {
  cat <<'END'
usage: ./run.sh --panel [PROGRAM] [--machine CONFIG.toml] [--tools FILE.tbl] [--port PORT]

Starts a daemon on simulated drives and the operator's page, homes the machine, loads the program and starts it. The
address that is printed opens the page in a browser of this computer. Ctrl-C ends all of it. PROGRAM and machine are
found as without --panel; the page can load the other programs of PROGRAM's folder. --port: 8470, 0: a free one.
END
}

# What drives the machine of config $1, and its inputs and outputs, as "DRIVES IO".
kinds_of() {
  python3 -c 'import sys, tomllib
config = tomllib.load(open(sys.argv[1], "rb"))
print(config["drives"]["type"], config.get("io", {}).get("type", "none"))' "$1" 2>/dev/null
}

# Waits until file $1 has a line with $2; false if process $3 ends before.
wait_for_line() {
  until grep -q -- "$2" "$1"; do
    kill -0 "$3" 2>/dev/null || return 1
    sleep 0.05
  done
}

end_panel() {
  trap - EXIT
  trap '' INT TERM
  [ -z "$panel" ] || kill "$panel" 2>/dev/null
  [ -z "$daemon" ] || kill "$daemon" 2>/dev/null
  wait
  rm -rf "$work"
  exit "$1"
}

# The joints that do not know their position yet, as the daemon tells.
unhomed() {
  "$trunnion" status --json --machine "$machine" --timeout 20 |
    python3 -c 'import json, sys; print(*(j["name"] for j in json.load(sys.stdin)["joints"] if not j["homed"]))'
}

# run_panel OPTIONS...: from the caller's folder.
run_panel() {
  local port=8470 given=() files trunnion="$root/build/release/trunnion" tools=() machine
  daemon='' panel='' work=''  # for the trap
  while [ $# -gt 0 ]; do
    case "$1" in
      --port=*) port=${1#*=} ;;
      --machine=* | --tools=*) given+=("$1") ;;
      --port | --machine | --tools)
        [ $# -ge 2 ] || { panel_usage >&2; exit 5; }
        if [ "$1" = --port ]; then port=$2; else given+=("$1" "$2"); fi
        shift
        ;;
      -h | --help) panel_usage; exit 0 ;;
      -*) panel_usage >&2; exit 5 ;;
      *) given+=("$1") ;;
    esac
    shift
  done
  files=$("$trunnion" run --project "$root" "${given[@]}" --files) || exit
  mapfile -t files <<<"$files"
  machine=$(readlink -m "${files[1]}")
  case "$(kinds_of "$machine")" in
    *' modbus' | canopen* | modbus*)
      die "$machine has real drives or devices; --panel is for simulated ones, as those of configs/cradle.toml" 3 ;;
  esac
  [ -f "${files[0]}" ] || die "there is no program '${files[0]}'" 2

  work=$(mktemp -d) || exit
  trap 'end_panel $?' EXIT
  trap 'end_panel 0' INT TERM
  # A copy: the daemon writes into its table.
  [ -z "${files[2]-}" ] || { cp "${files[2]}" "$work/tools.tbl" && tools=(--tools "$work/tools.tbl"); } || exit
  serve_page "$(readlink -f "${files[0]}")"
}

# serve_page PROGRAM: with the variables of run_panel.
serve_page() {
  : >"$work/panel.log"
  "$trunnion" panel --machine "$machine" --listen "127.0.0.1:$port" --page "$root/build/release/panel" \
    --programs "$(dirname "$1")" >"$work/panel.log" 2>&1 &
  panel=$!
  wait_for_line "$work/panel.log" '^Panel of' "$panel" || {
    cat "$work/panel.log" >&2
    die "The panel did not start; another port: ./run.sh --panel --port PORT (0: a free one)" 4
  }
  : >"$work/daemon.log"
  "$trunnion" daemon --machine "$machine" "${tools[@]}" >"$work/daemon.log" 2>&1 &
  daemon=$!
  wait_for_line "$work/daemon.log" ' socket ' "$daemon" || {
    tail -n 20 "$work/daemon.log" >&2
    die "The daemon did not start; see above." 4
  }
  cat "$work/panel.log"
  [ -z "$(unhomed)" ] || "$trunnion" home --wait --machine "$machine" >/dev/null || die "Homing failed." 4
  "$trunnion" load "$1" --machine "$machine" >/dev/null || die "The program was not loaded." 2
  "$trunnion" start --machine "$machine" >/dev/null || die "The program did not start." 4
  say "$(basename "$1") was started; open the address in a browser of this computer. Ctrl-C ends all of it."
  wait -n "$panel" "$daemon"
  tail -n 20 "$work/panel.log" "$work/daemon.log" >&2
  die "The panel or the daemon has ended; see above." 4
}
