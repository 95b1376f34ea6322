#!/bin/sh
# check_progress.sh <gravel-run> <folder>
#
# The lines that tell how far a run has come fit a terminal of 80 columns, and the time that is left is never negative,
# although here it is longer than any number of seconds.
set -u
rm -rf "$2"
mkdir -p "$2"
cat >"$2/endless.toml" <<'end'
duration = 1e300
units.time = "seconds of a clock that stands on the surface of the Earth at sea level"
simulation = {G = 0, timeStep = 0.333, adaptiveTimeStep = false}
output.frames = 0
[[body]]
mass = 1
end
"$1" "$2/endless.toml" --no-picture -o "$2/out" >"$2/printed" &
run=$!
while ! grep -q "starting" "$2/printed"; do
  kill -0 $run 2>/dev/null || { echo "the run did not begin"; exit 1; }
  sleep 0.05
done
sleep 0.5
kill -INT $run
wait $run
grep " % " "$2/printed"
[ "$(grep -c " % " "$2/printed")" -eq 2 ] && grep -q "^  0.0 %  [0-9.e+]* years left" "$2/printed" &&
  [ -z "$(grep " %  " "$2/printed" | grep ".\{80\}")" ]
