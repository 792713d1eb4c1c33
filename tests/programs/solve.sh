#!/usr/bin/env bash
# cdprcal-solve: a canonical log in, the initial pose out, and its exit codes.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
solve="$CDPRCAL_BIN/cdprcal-solve"
expect() { # code, then the command
  local code=0
  "${@:2}" >"$work/out" 2>"$work/err" || code=$?
  if [[ $code != "$1" ]]; then
    printf 'expected exit %s, got %s: %s\n' "$1" "$code" "${*:2}"
    cat "$work/out" "$work/err"
    exit 1
  fi
}

expect 0 "$solve" --version
expect 2 "$solve"
expect 2 "$solve" irma4 "$work/absent.csv"
grep -q absent.csv "$work/err"
printf 'time_s,length_1_m\n0,one\n' >"$work/text.csv"
expect 2 "$solve" irma4 "$work/text.csv"
grep -q 'text.csv:2' "$work/err"
[[ ! -s "$work/out" ]]

# One sample says nothing about where the platform hangs: exit 1, in words and as JSON.
header=time_s,length_1_m,length_2_m,length_3_m,length_4_m,roll_rad,pitch_rad,yaw_rad
printf '%s\n0,1,1,1,1,0,0,0\n0.1,1,1,1,1,0,0,0\n' "$header" >"$work/two.csv"
expect 1 "$solve" irma4 "$work/two.csv" --method kinematic
grep -q unobservable "$work/out"
expect 1 "$solve" irma4 "$work/two.csv" --method kinematic --json
grep -q '"status": "unobservable"' "$work/out"
expect 2 "$solve" irma4 "$work/two.csv" --method guess
grep -q 'unified, static, kinematic' "$work/err"
# A result that could not be written is not done.
if [[ -e /dev/full ]]; then
  for format in "" --json; do
    code=0
    "$solve" irma4 "$work/two.csv" --method kinematic $format >/dev/full 2>"$work/err" || code=$?
    [[ $code == 2 ]]
    grep -q 'standard output' "$work/err"
  done
fi
echo "cdprcal-solve: ok"
