# Sourced by run.sh and test.sh: packages, configure, build. Quiet when there is nothing to do.
# Needs bash, and the current folder at the top of the repository.

say() { printf '%s\n' "$*" >&2; }

die() {
  say "$1"
  exit "${2:-1}"
}

# The packages of scripts/packages.txt that are needed by $1 (build|panel|test) and not there.
missing_packages() {
  local name who command
  while read -r name who command; do
    case "$name" in '' | '#'*) continue ;; esac
    [ "$who" = build ] || [ "$who" = "$1" ] || [ "$1" = test ] || continue
    [ -z "$command" ] || ! command -v "$command" >/dev/null || continue
    case "$(dpkg-query -W -f='${db:Status-Status}' "$name" 2>/dev/null)" in
      installed) ;;
      *) printf '%s\n' "$name" ;;
    esac
  done <scripts/packages.txt
}

# install_packages build|panel|test
install_packages() {
  local missing root=()
  command -v dpkg-query >/dev/null || die "This needs Debian 12; dpkg-query is not here."
  mapfile -t missing < <(missing_packages "$1")
  [ ${#missing[@]} -gt 0 ] || return 0
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || die "Missing packages; as root run: apt-get install ${missing[*]}"
    root=(sudo)
  fi
  say "Installing ${#missing[@]} Debian packages: ${missing[*]}"
  "${root[@]}" apt-get update -q >&2 || die "apt-get update failed; see above."
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" >&2 ||
    die "apt-get install failed; see above."
}

# build PRESET TARGET...: configures the preset when that was not done yet, and builds. Shows progress when
# there is work, nothing when there is none.
build() {
  local preset=$1 folder="build/$1" log
  shift
  if [ ! -f "$folder/build.ninja" ]; then
    say "Configuring ($preset)"
    mkdir -p "$folder"
    log="$folder/configure.log"
    cmake --preset "$preset" >"$log" 2>&1 || { cat "$log" >&2; die "Configuring failed."; }
  fi
  if [ -t 2 ]; then
    cmake --build "$folder" --target "$@" > >(grep --line-buffered -v '^ninja: no work to do' >&2)
  else
    log="$folder/build.log"
    cmake --build "$folder" --target "$@" >"$log" 2>&1 &
    follow $! "$log"
  fi || die "The build failed; see above."
}

# Without a terminal: one line every 20 s while process $1 writes to $2; its whole output if it fails.
follow() {
  local waited=0
  while kill -0 "$1" 2>/dev/null; do
    sleep 0.2
    waited=$((waited + 1))
    [ $((waited % 100)) -ne 0 ] || say "Building: $(tail -n 1 "$2" | cut -c1-100)"
  done
  wait "$1" || { tail -n 60 "$2" >&2; return 1; }
}
