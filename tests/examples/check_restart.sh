#!/bin/sh
# check_restart.sh <gravel-run> <folder>
#
# A run that ends halfway, or is stopped by Ctrl-C somewhere, and is taken up again ends with the same bits as one in
# one go: the saved state, the last frame and the energies of the last row. States that do not fit are refused. The
# summary tells the losses of the part after the restart alone. What cannot be saved is refused at the start where that
# can be seen, and costs nothing else where it cannot.
set -u
rm -rf "$2"
mkdir -p "$2"
cat >"$2/grains.toml" <<'end'
duration = 2
simulation = {G = 0, timeStep = 0.0009765625, adaptiveTimeStep = false}
field.acceleration = [0, 0, -9.81]
output = {frames = 201, rows = 201}
[[box]]
low = [-0.05, -0.05, 0]
high = [0.05, 0.05, 1]
[[column]]
count = 150
base = [0, 0, 0.01]
radius = 0.03
end
cat >"$2/ball.toml" <<'end'
duration = 3
simulation = {G = 0, timeStep = 0.0009765625, adaptiveTimeStep = false, coeffRestitution = 0}
field.acceleration = [0, 0, -9.81]
output.frames = 0
[[plane]]
normal = [0, 0, 1]
friction = 0.5
[[body]]
position = [0, 0, 1]
radius = 0.1
mass = 1
end
cat >"$2/pair.toml" <<'end'
duration = 1
simulation = {G = 0, timeStep = 0.01, adaptiveTimeStep = false}
output.frames = 0
material = [{name = "a"}, {name = "b"}]
pair = [{materials = ["a", "b"], restitution = 0.5}]
plane = [{material = "a"}]
body = [{position = [0, 0, 1], radius = 0.1, mass = 1, material = "b"}]
end
cat >"$2/driven.toml" <<'end'
duration = 1
simulation = {G = 1e-3, timeStep = 0.0078125, adaptiveTimeStep = false}
field = {acceleration = [0, 0, -1], turn = [0, 0.5, 0]}
collisions.outcome = "merge"
output.frames = 0
plane = [{shake = [0.01, 0, 0.02], shakePeriod = 0.75}]
body = [{position = [0, 0, 0.1], radius = 0.1, mass = 1}, {position = [0, 0, 0.32], radius = 0.1, mass = 1},
        {position = [0, 0, 0.7], radius = 0.1, mass = 1}]
end
cat >"$2/swings.toml" <<'end'
duration = 20
simulation = {G = 0, timeStep = 0.01, adaptiveTimeStep = false}
output.frames = 0
plane = [{shake = [0, 0, 0.01], shakePeriod = 1.37e-6}]
body = [{position = [0, 0, 10], radius = 0.1, mass = 1}]
end
cat >"$2/slow.toml" <<'end'
duration = 2
simulation = {G = 0, timeStep = 5}
output.frames = 0
body = [{mass = 1, velocity = [1, 0, 0]}]
end
cat >"$2/not_finite.toml" <<'end'
duration = 1
simulation = {G = 0, timeStep = 0.1, adaptiveTimeStep = false}
output.frames = 0
body = [{mass = 1e200, velocity = [1e60, 0, 0]}]
end
sed 's/shake = .*, shakeP/shake = [0.01, 0, 0.03], shakeP/' "$2/driven.toml" >"$2/other_shake.toml"
sed 's/0.01]/0.0101]/' "$2/swings.toml" >"$2/other_swings.toml"
sed 's/shake = .0.01/velocity = [0.5, 0, 0], &/' "$2/driven.toml" >"$2/other_belt.toml"
sed 's/shake = .0.01/shake = [0.03/' "$2/driven.toml" >"$2/other_swing_across.toml"
sed 's/turn = .0, 0.5/turn = [0, 0.8/' "$2/driven.toml" >"$2/other_rate.toml"
sed 's/-1], turn/-2], turn/' "$2/driven.toml" >"$2/other_turn.toml"
sed 's/mass = 1}]/mass = 2}]/' "$2/driven.toml" >"$2/other_mass.toml"
sed 's/normal = .*/normal = [0.1, 0, 1]/' "$2/ball.toml" >"$2/other_normal.toml"
sed 's/friction = .*/friction = 0.25/' "$2/ball.toml" >"$2/other_surface.toml"
sed 's/mass = 1/mass = 1\ninertia = 1/' "$2/ball.toml" >"$2/other_inertia.toml"
sed 's/restitution = .*/restitution = 0.6}]/' "$2/pair.toml" >"$2/other_pair.toml"
sed 's/G = 0/G = 1/' "$2/grains.toml" >"$2/other_settings.toml"
sed 's/count = 150/count = 151/' "$2/grains.toml" >"$2/other_bodies.toml"

go() {  # <scene> <name of the run> [option ...]
  scene=$1
  name=$2
  shift 2
  "$run" "$folder/$scene.toml" -q --no-picture -o "$folder/$name" --save "$folder/$name.gravel" "$@"
}
last_energies() { tail -n 1 "$folder/$1/diagnostics.csv" | cut -d , -f 1-13; }
same() {  # <name of the run>: ends as the one in one go
  cmp "$folder/whole.gravel" "$folder/$1.gravel" || exit 1
  cmp "$folder/whole/frames/grains_000200.vtp" "$(ls "$folder/$1"/frames/*.vtp | tail -n 1)" || exit 1
  [ "$(last_energies whole)" = "$(last_energies "$1")" ] || { echo "$1: other energies"; exit 1; }
}
refuses() {  # <exit code> <words> <scene> <option ...>
  expected=$1
  words=$2
  scene=$3
  shift 3
  said=$("$run" "$folder/$scene.toml" -q --no-picture -o "$folder/refused" "$@" 2>&1)
  status=$?
  echo "$said" | grep -q "$words" && [ $status -eq "$expected" ] && return
  echo "ended with $status, not $expected and \"$words\": $said"
  exit 1
}
run=$1
folder=$2

go grains whole || exit 1
go grains half --duration 1 || exit 1
go grains halves --restart "$folder/half.gravel" || exit 1
same halves
grep -q "^Taken up at 1 s: " "$folder/halves/summary.txt" || { echo "the summary does not tell of the restart"; exit 1; }

"$run" "$folder/grains.toml" -q --no-picture -o "$folder/stopped" --save "$folder/stopped.gravel" &
process=$!
while [ ! -e "$folder/stopped/frames/grains_000020.vtp" ]; do
  kill -0 $process 2>/dev/null || { echo "the run did not begin"; exit 1; }
  sleep 0.01
done
kill -INT $process
wait $process
[ $? -eq 130 ] || { echo "the run was not stopped"; exit 1; }
go grains continued --restart "$folder/stopped.gravel" || exit 1
same continued

go ball resting --duration 2 || exit 1
grep -q "inelastic hits took 100" "$folder/resting/summary.txt" || { echo "the fall has no losses"; exit 1; }
go ball rested --restart "$folder/resting.gravel" || exit 1
grep "was lost\|put in" "$folder/rested/summary.txt" && { echo "a ball that rests has losses"; exit 1; }

# The longest step is the scene's again after one that the end of the run cut short.
go slow slow_half --duration 1 || exit 1
go slow slow_whole --restart "$folder/slow_half.gravel" || exit 1

refuses 2 "state of another scene: it has 150 bodies, the scene 151" other_bodies --restart "$folder/half.gravel"
refuses 2 "state of another scene: its G is 0, the scene's 1" other_settings --restart "$folder/half.gravel"
refuses 2 "normal, .* of its plane 0 is not the scene's" other_normal --restart "$folder/resting.gravel"
refuses 2 "or material of its plane 0 is not the scene's" other_surface --restart "$folder/resting.gravel"
refuses 2 "inertia, .* of its body 0 is not the scene's" other_inertia --restart "$folder/resting.gravel"
go pair pair_half --duration 0.5 || exit 1
go pair pair_whole --restart "$folder/pair_half.gravel" || exit 1
refuses 2 "its pair of materials 1 and 2 is not the scene" other_pair --restart "$folder/pair_half.gravel"
go driven driven_whole || exit 1
go driven driven_half --duration 0.5 || exit 1
go driven driven_halves --restart "$folder/driven_half.gravel" || exit 1
cmp "$folder/driven_whole.gravel" "$folder/driven_halves.gravel" || exit 1
grep -q "^1 body of 3 merged" "$folder/driven_half/summary.txt" && grep -q "^2 bodies of 3 merged" \
  "$folder/driven_halves/summary.txt" || { echo "no two mergers, one before the restart and one after it"; exit 1; }
refuses 2 "of its plane 0 is not the scene's" other_shake --restart "$folder/driven_half.gravel"
# What moves along the plane, and how fast the field turns. Seen to fail: each of the three went on.
refuses 2 "velocity .* of its plane 0 is not the scene's" other_belt --restart "$folder/driven_half.gravel"
refuses 2 "velocity .* of its plane 0 is not the scene's" other_swing_across --restart "$folder/driven_half.gravel"
refuses 2 "its domain, field or planes are not the scene's" other_rate --restart "$folder/driven_half.gravel"
refuses 2 "its domain, field or planes are not the scene's" other_turn --restart "$folder/driven_half.gravel"
refuses 2 "its mass is 3, the scene's 4" other_mass --restart "$folder/driven_half.gravel"
# The phase of so many swings has lost its last digits. Seen to fail: refused.
go swings swung --duration 15 || exit 1
go swings swung_on --restart "$folder/swung.gravel" || exit 1
refuses 2 "of its plane 0 is not the scene's" other_swings --restart "$folder/swung.gravel"
refuses 2 "is the state at time 2; allowed: one before the end, 2" grains --restart "$folder/whole.gravel"
refuses 1 "^gravel-run: the snapshot .*grains.toml" grains --restart "$folder/grains.toml"
refuses 1 "cannot save to .*: it is a folder" grains --save "$folder/whole"

# So long a name has no room for that of a part beside it; and a part takes no name that something has.
long="$folder/$(printf %0253d 0)"
refuses 1 "cannot save to $long: File name too long" ball --save "$long"
[ ! -e "$folder/refused/summary.txt" ] || { echo "a run began that could not be saved"; exit 1; }
echo mine >"$folder/mine.gravel.part"
go ball mine || exit 1
[ "$(cat "$folder/mine.gravel.part")" = mine ] || { echo "saving touched a file of another name"; exit 1; }
refuses 1 "energies or places are not finite" not_finite --save "$folder/not_finite.gravel"
[ ! -e "$folder/not_finite.gravel" ] || { echo "energies that are not finite were saved"; exit 1; }
[ -e /dev/full ] || exit 0
rm "$folder/refused/summary.txt"
refuses 1 "cannot write /dev/full: " ball --save /dev/full
[ -e "$folder/refused/summary.txt" ] || { echo "a full disk under the state cost the summary"; exit 1; }
