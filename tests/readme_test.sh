#!/usr/bin/env bash
# Runs every command of the README's console blocks against a real server, as a reader would, and holds what it prints against
# what the README shows ("…" stands for anything). Usage: tests/readme_test.sh RELITD [FOLDER for the pictures]
set -euo pipefail
root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
# shellcheck source=tests/support/relitd.sh
. "$root/tests/support/relitd.sh"
relitd=$(realpath -- "$1")
work=$(mktemp -d)
trap 'kill "${server:-}" 2>/dev/null || true; rm -rf "$work"' EXIT

start_relitd "$relitd" "$work"

mkdir "$work/tour"
ln -s "$root/server" "$work/tour/server"
cd "$work/tour"
# Each block becomes a file of its command and a file of the output that it shows.
awk -v work="$work" '
    /^```console$/ { n++; command = sprintf("%s/%02d.command", work, n); shown = sprintf("%s/%02d.shown", work, n)
                     printf "" > command; printf "" > shown; block = 1; next }
    /^```$/        { block = 0 }
    block && /^\$ / { print substr($0, 3) > command; inside = /\x27\{[^\x27]*$/; next }
    block && inside { print > command; if (/\x27$/) inside = 0; next }
    block           { print > shown }
' "$root/README.md"

failed=0
count=0
for command in "$work"/*.command; do
    shown=${command%.command}.shown
    count=$((count + 1))
    sed -i "s|http://127.0.0.1:8080|$address|; s|^curl |curl -sS --fail-with-body |" "$command"
    bash "$command" >"$work/printed" 2>"$work/errors" || [ -s "$shown" ] || { cat "$command" "$work/printed" "$work/errors"; failed=1; }
    # Each line that is shown, as a pattern, is printed somewhere: the order of headers is nobody's promise.
    while IFS= read -r line; do
        pattern=$(printf '%s' "$line" | sed -e 's/[][\\*.^$]/\\&/g' -e 's/…/.*/g')
        tr -d '\r' <"$work/printed" | grep -qx -- "$pattern" && continue
        printf 'README shows: %s\nthe server printed:\n' "$line"
        cat "$work/printed"
        failed=1
    done <"$shown"
done
[ $count -ge 6 ] || { echo "only $count commands found in README.md"; failed=1; }
for picture in plaster.jpg bronze.png wax.jpg sunset.jpg; do
    [ -s "$picture" ] || { echo "no $picture was made"; failed=1; }
done
[ $# -lt 2 ] || cp -- *.jpg *.png "$2"
exit $failed
