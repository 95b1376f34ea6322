#!/bin/sh
# check_two_runs.sh <gravel-run> <folder>
#
# A second run into the output folder of one that goes on is refused and leaves the files of that one alone. When
# the first one is stopped, the folder is free again.
set -u
rm -rf "$2"
mkdir -p "$2"
cat >"$2/endless.toml" <<'end'
duration = 1e9
simulation = {G = 0, timeStep = 1e-3, adaptiveTimeStep = false}
output = {frames = 1, rows = 2}
[[body]]
mass = 1
end
"$1" "$2/endless.toml" -q --no-picture -o "$2/out" &
first=$!
while [ ! -e "$2/out/frames/endless.pvd" ]; do
  kill -0 $first 2>/dev/null || { echo "the first run did not begin"; exit 1; }
  sleep 0.05
done
said=$("$1" "$2/endless.toml" --duration 1 -q --no-picture -o "$2/out" 2>&1)
status=$?
test -e "$2/out/frames/endless.pvd"
kept=$?
kill -TERM $first
wait $first
stopped=$?
"$1" "$2/endless.toml" --duration 1 -q --no-picture -o "$2/out"
after=$?
echo "first $stopped, second $status, index kept $kept, after it $after: $said"
case "$stopped $status $kept $after $said" in
  "130 1 0 0 gravel-run: another gravel-run is writing to the output folder $2/out; "*) exit 0 ;;
  *) exit 1 ;;
esac
