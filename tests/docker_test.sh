#!/usr/bin/env bash
# What the container relies on, tested without a container: the packages that it installs to run the programs bring every
# library that they are linked to, and its health check knows a server that answers from one that does not.
# Usage: tests/docker_test.sh RELITD RELIT
set -euo pipefail
root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
# shellcheck source=tests/support/relitd.sh
. "$root/tests/support/relitd.sh"
relitd=$(realpath -- "$1")
relit=$(realpath -- "$2")
work=$(mktemp -d)
trap 'kill "${server:-}" 2>/dev/null || true; rm -rf -- "$work"' EXIT
failed=0
fail() {
    echo "docker_test: $*" >&2
    failed=1
}

# Linked directly; what these need in turn is their packages' own business.
awk '$1 == "run" { print $2 }' "$root/server/packages.txt" >"$work/packages"
printf '%s\n' libc6 libstdc++6 libgcc-s1 >>"$work/packages" # of every Debian that has a compiler's output
count=0
for program in "$relitd" "$relit"; do
    for library in $(readelf -d "$program" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p'); do
        file=$(ldd "$program" | awk -v name="$library" '$1 == name || $1 ~ "/" name "$" { print ($3 == "" ? $1 : $3) }')
        file=$(realpath -- "$file")
        package=$(dpkg -S "$file" 2>/dev/null || dpkg -S "${file#/usr}" 2>/dev/null) || true # with /usr merged, either
        package=${package%%:*}
        count=$((count + 1))
        grep -qx -- "$package" "$work/packages" ||
            fail "$(basename "$program") needs $library (package ${package:-unknown}), which is no 'run' line of server/packages.txt"
    done
done
[ $count -ge 8 ] || fail "only $count libraries were looked at"

start_relitd "$relitd" "$work"
port=${address##*:}
RELIT_PORT=$port "$root/docker/healthcheck" || fail "a server that answers is called unhealthy"
kill "$server"
wait "$server" || true
if RELIT_PORT=$port "$root/docker/healthcheck" 2>/dev/null; then fail "a server that is gone is called healthy"; fi
exit $failed
