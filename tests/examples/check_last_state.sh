#!/bin/sh
# check_last_state.sh <gravel-run> <folder>
#
# A run that is stopped ends with one row of the place where it stopped, although every step of it has a row, and with
# the frame of that place, although only the start and the end were to have one.
set -u
rm -rf "$2"
mkdir -p "$2"
cat >"$2/endless.toml" <<'end'
duration = 1e9
simulation = {G = 0, timeStep = 1, adaptiveTimeStep = false}
output = {frames = 2, rows = 1_000_000_000}
[[body]]
mass = 1
end
"$1" "$2/endless.toml" -q --no-picture -o "$2/out" &
run=$!
while [ ! -e "$2/out/diagnostics.csv" ] || [ "$(head -n 9 "$2/out/diagnostics.csv" | wc -l)" -lt 9 ]; do
  kill -0 $run 2>/dev/null || { echo "the run did not begin"; exit 1; }
  sleep 0.05
done
kill -INT $run
wait $run
status=$?
times=$(tail -n 2 "$2/out/diagnostics.csv" | cut -d , -f 1)
before=$(echo "$times" | head -n 1)
last=$(echo "$times" | tail -n 1)
echo "status $status, last rows at $before and $last"
[ $status -eq 130 ] && [ "$before" != "$last" ] && grep "<DataSet " "$2/out/frames/endless.pvd" | tail -n 1 | grep "timestep=\"$last\""
