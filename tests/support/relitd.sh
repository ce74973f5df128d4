#!/usr/bin/env bash
# For tests in shell: source it.

# Starts relitd on a free port, with its store in FOLDER/data and its words in FOLDER/log, and waits until it listens. Sets
# $server, its process, and $address, "http://127.0.0.1:PORT".
start_relitd() { # RELITD FOLDER
    "$1" --port 0 --data-dir "$2/data" >"$2/log" 2>&1 &
    # shellcheck disable=SC2034  # for who sources this
    server=$!
    for _ in $(seq 100); do
        address=$(sed -n 's/^relitd listens on //p' "$2/log")
        if [ -n "$address" ]; then return; fi
        sleep 0.05
    done
    cat "$2/log"
    exit 1
}
