#!/usr/bin/env bash
# Makes scenes/pictures/NAME.webp of every scene, or of those named: the replay page of `unilateral`, in Chromium without a window.
#   scenes/make_pictures.sh [i2t_poke …]      needs the program built (./run.sh) and chromium; TROCAR_DATA for data: meshes
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
program=${TROCAR:-$PWD/build/release/bin/trocar}
browser=${CHROMIUM:-chromium}
largest=40000 # bytes of one picture
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

picture() { # page, file: what the page itself draws and puts as WebP into its document
    "$browser" --headless=new --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader \
        --enable-logging=stderr --hide-scrollbars --force-device-scale-factor=1 --disable-background-networking \
        --disable-component-update --disable-sync --no-first-run --user-data-dir="$work/profile" \
        --virtual-time-budget=20000 --window-size=600,600 \
        --dump-dom "file://$1#picture=1&field=displacement" >"$work/dom" 2>"$work/browser.log"
    if grep -q CONSOLE "$work/browser.log" || ! grep -q 'data-picture="data:image/webp' "$work/dom"; then
        echo "$1: the page draws no picture" >&2
        cat "$work/browser.log" >&2
        exit 1
    fi
    grep -o 'data-picture="data:image/webp;base64,[^"]*' "$work/dom" | head -1 | cut -d, -f2 | base64 -d >"$2"
}

names=("$@")
if [ $# -eq 0 ]; then
    for file in scenes/*.json; do names+=("$(basename "$file" .json)"); done
fi
mkdir -p scenes/pictures
for name in "${names[@]}"; do
    "$program" view "scenes/$name.json" --output "$work/$name.html" >/dev/null || {
        echo "$name: no picture" >&2
        continue
    }
    picture "$work/$name.html" "scenes/pictures/$name.webp"
    size=$(stat -c %s "scenes/pictures/$name.webp")
    if [ "$size" -gt "$largest" ]; then
        echo "$name: a picture of $size bytes, expected at most $largest" >&2
        exit 1
    fi
    echo "scenes/pictures/$name.webp $size bytes"
done
