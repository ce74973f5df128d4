#!/usr/bin/env bash
# server/setup, server/build and server/run against a small project of their own, with stand-ins for apt-get, sudo and id:
# no network, nothing installed, a few seconds. Prints one line per claim; fails when one does not hold.
set -uo pipefail
source_dir=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
work=$(mktemp -d)
trap 'rm -rf -- "$work"' EXIT
unset RELIT_HTTPLIB_DIR XDG_CACHE_HOME CI MAKEFLAGS
failures=0

claim() { # sentence, command...
    local sentence=$1
    shift
    if "$@"; then
        echo "ok    $sentence"
    else
        failures=$((failures + 1))
        printf 'FAIL  %s\n      %s\n      status %s, output:\n%s\n' "$sentence" "$*" "$status" "$output"
    fi
}
run() { # command...; leaves $output (both streams) and $status
    output=$("$@" 2>&1)
    status=$?
}
is_silent() { [ "$status" = 0 ] && [ -z "$output" ]; }
ended() { [ "$status" = "$1" ]; }
says() { grep -qF -- "$1" <<<"$output"; }

# A project of the same shape, in a path with spaces, whose relitd writes what it was given.
tree="$work/a tree"
export HOME="$work/my home"
mkdir -p "$tree/server" "$HOME" "$work/bin" "$work/elsewhere"
cp "$source_dir"/server/{setup,build,run} "$tree/server/"
echo 'build  dpkg' >"$tree/server/packages.txt"
cat >"$tree/CMakePresets.json" <<'END'
{"version": 6, "configurePresets": [{"name": "release", "generator": "Ninja", "binaryDir": "${sourceDir}/build/release"}],
 "buildPresets": [{"name": "release", "configurePreset": "release"}]}
END
cat >"$tree/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.25)
project(tree LANGUAGES CXX)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/server)
set(RELIT_HTTPLIB_DIR "" CACHE PATH "Folder of httplib.h")
add_executable(relitd main.cpp)
END
cat >"$tree/main.cpp" <<'END'
#include <unistd.h>
#include <cstdio>
#include <cstring>
int main(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) std::printf("[%s]", argv[i]);
    if (argc > 1 && !std::strcmp(argv[1], "--bad")) return 2;
    if (argc > 1 && !std::strcmp(argv[1], "--wait")) return std::fflush(stdout), pause(), 0;
}
END
# apt that knows one mirror with one version of cpp-httplib (none at first), a sudo that fails, an id that is nobody's.
cat >"$work/bin/apt-get" <<'END'
#!/bin/sh
echo "$*" >>"$APT_LOG"
case "$MIRROR_HAS $*" in
' '*) echo "E: no network" >&2; exit 100 ;;
*indextargets*) echo 'Debian|Debian|http://mirror.invalid/debian/|/dev/null:1' ;;
*' source '*)
    mkdir cpp-httplib && printf '#define CPPHTTPLIB_VERSION "%s"\n' "$MIRROR_HAS" >cpp-httplib/httplib.h
    tar -cJf "cpp-httplib_$MIRROR_HAS.orig.tar.xz" cpp-httplib ;;
esac
END
printf '#!/bin/sh\necho "Version: %s"\n' "\$MIRROR_HAS" >"$work/bin/apt-cache"
export APT_LOG="$work/apt.log" MIRROR_HAS=
printf '#!/bin/sh\nexit 1\n' >"$work/bin/sudo"
printf '#!/bin/sh\necho 1000\n' >"$work/bin/id"
chmod +x "$work/bin/"*
export PATH="$work/bin:$PATH"

header() { # folder, version
    mkdir -p "$1"
    printf '#define CPPHTTPLIB_VERSION "%s"\n' "$2" >"$1/httplib.h"
}
cache="$HOME/.cache/relit/httplib"

echo "server/setup"
run "$tree/server/setup" --nonsense
claim "an unknown option ends with 2" ended 2
if [ ! -e /usr/include/httplib.h ]; then # one that is new enough would be taken
    header "$cache" 0.40.9
    run "$tree/server/setup"
    claim "an old header in the cache is refused" ended 1
    claim "and the message names the place for a new one" says "$cache"
    claim "and every option" says RELIT_HTTPLIB_DIR
    rm "$cache/httplib.h"
    run "$tree/server/setup"
    claim "without a mirror it stops" ended 1
    claim "and leaves nothing in the cache" test ! -e "$cache/httplib.h"
    run env MIRROR_HAS=0.18.7 "$tree/server/setup"
    claim "a mirror with old versions only is no help" ended 1
    for suite in trixie-backports forky sid trixie; do
        claim "and what $suite has is said" says "$suite: has 0.18.7"
    done
    : >"$APT_LOG"
    run env MIRROR_HAS=0.43.2 "$tree/server/setup"
    claim "a mirror's first suite with a new version gives the header" grep -q 0.43.2 "$cache/httplib.h"
    claim "its name and version are said" says "0.43.2 of trixie-backports"
    claim "and noted beside it" grep -q "0.43.2 of trixie-backports" "$cache/VERSION"
    claim "the other suites are not asked" test "$(grep -c ' update$' "$APT_LOG")" = 1
fi
header "$cache" 0.41.0
run "$tree/server/setup"
claim "a new header in the cache is enough, and nothing is said" is_silent
header "$work/cache/relit/httplib" 1.0.0
run env XDG_CACHE_HOME="$work/cache" HOME=/nonexistent "$tree/server/setup"
claim "XDG_CACHE_HOME is where the cache is" is_silent
header "$work/old" 0.11.4
run env RELIT_HTTPLIB_DIR="$work/old" "$tree/server/setup"
claim "an old header in RELIT_HTTPLIB_DIR is refused, whatever the cache has" ended 1
claim "and the message names its version" says 0.11.4
header "$work/own" 0.50.0
run env RELIT_HTTPLIB_DIR="$work/own" HOME=/nonexistent "$tree/server/setup"
claim "a new header in RELIT_HTTPLIB_DIR is enough" is_silent
: >"$APT_LOG"
run "$tree/server/setup" --tests
claim "with all packages there apt-get is not called" test ! -s "$APT_LOG"
mkdir -p "$tree/tests/studio" "$tree/tests/js"
echo '{}' | tee "$tree/tests/studio/package-lock.json" >"$tree/tests/js/package-lock.json"
export NPM_LOG="$work/npm.log"
printf '#!/bin/sh\necho "no registry" >&2\nexit 1\n' >"$work/bin/npm"
chmod +x "$work/bin/npm"
run "$tree/server/setup" --tests
claim "where npm fails the rest goes on" ended 0
claim "and that tests will be skipped is said, with npm's words" says "no registry"
cat >"$work/bin/npm" <<'END'
#!/bin/sh
echo "$1 $PWD" >>"$NPM_LOG"
mkdir node_modules && touch node_modules/.package-lock.json
END
run "$tree/server/setup"
claim "without --tests npm is not called" test ! -e "$NPM_LOG"
run "$tree/server/setup" --tests
claim "what the tests of the studio list is installed there" grep -qx "ci $tree/tests/studio" "$NPM_LOG"
claim "and what those of the modules list" grep -qx "ci $tree/tests/js" "$NPM_LOG"
run "$tree/server/setup" --tests
claim "once, until the list changes" test "$(wc -l <"$NPM_LOG")" = 2
echo 'test  relit-no-such-package' >>"$tree/server/packages.txt"
run "$tree/server/setup"
claim "a missing test package does not matter to the build" is_silent
run "$tree/server/setup" --tests
claim "without root a missing package is an error" ended 1
claim "and the line to run is printed" says "apt-get install --no-install-recommends relit-no-such-package"

echo "server/run"
run "$tree/server/run" --version
claim "it builds in a path with spaces and passes a flag on" says "[--version]"
cd "$work/elsewhere" || exit 1
run "$tree/server/run" --a "b c" ""
claim "from another folder, all flags whole and nothing else printed" test "$output" = "[--a][b c][]"
run "$tree/server/run" --bad
claim "relitd's exit status is its own" ended 2
run env RELIT_HTTPLIB_DIR="$work/own" "$tree/server/run"
claim "another RELIT_HTTPLIB_DIR is configured" grep -q "^RELIT_HTTPLIB_DIR:PATH=$work/own$" "$tree/build/release/CMakeCache.txt"
"$tree/server/run" --wait >"$work/wait.log" &
server=$!
for _ in $(seq 100); do
    if [ -s "$work/wait.log" ]; then break; fi
    sleep 0.1
done
kill -TERM $server
wait $server
status=$?
claim "SIGTERM reaches relitd itself" ended 143
mv "$tree/main.cpp" "$work/"
echo 'int main() { return no_such_name; }' >"$tree/main.cpp"
run "$tree/server/run"
claim "a source that does not compile is an error, with the compiler's words" says no_such_name
claim "and the old program is not run in its place" ended 1
mv "$work/main.cpp" "$tree/"

echo "tests/lint"
run "$source_dir/tests/lint" --nonsense
claim "an unknown option ends with 2" ended 2

if [ $failures -gt 0 ]; then
    echo "$failures claims do not hold"
    exit 1
fi
