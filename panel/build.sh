#!/usr/bin/env bash
# Builds the operator's page: panel/build.sh OUTDIR. Goes straight back when the files there are newer than the sources.
set -eu
out=$(readlink -m "${1:?usage: panel/build.sh OUTDIR}")
root=$(dirname "$(dirname "$(readlink -f "$0")")")
page=$root/panel/page
stamp=$out/index.html

if [ -f "$stamp" ] && [ -z "$(find "$page" "$root/panel/build.sh" "$root/docs/faults.md" -newer "$stamp" \
    -not -path "$page/node_modules*" -type f -print -quit)" ]; then
  exit 0
fi
for tool in node npm; do
  command -v "$tool" >/dev/null || { echo "panel: the page needs $tool: apt-get install nodejs npm" >&2; exit 1; }
done
cd "$page"
if [ ! -f node_modules/.package-lock.json ] || [ package-lock.json -nt node_modules/.package-lock.json ]; then
  echo 'panel: getting the packages of the page'
  npm install --no-save --no-audit --no-fund --loglevel=error  # 'npm ci' wants a lock file that names hosts
  touch node_modules/.package-lock.json
fi
echo 'panel: building the page'
node_modules/.bin/tsc --noEmit
node_modules/.bin/vite build --logLevel warn --emptyOutDir --outDir "$out"
node_modules/.bin/vite build --config vite.report.config.ts --logLevel warn --outDir "$out"
