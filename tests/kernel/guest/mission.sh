# A mission on the guest's own links: vantage-units on vcan0, TCP and pseudo terminals, and vantaged that finds them
# there. Sourced by checks.
yard=/host/yard
here=/tmp/mission

# The robot file with the links that vantage-units printed: each table's lines below its header, new tables at the end.
with_links() { # ROBOT FILE, LINKS FILE
  awk 'FNR == NR { if (/^\[/) table = $0; else if (NF) lines[table] = lines[table] $0 "\n"; next }
    { print } /^\[/ && ($0 in lines) { printf "%s", lines[$0]; delete lines[$0] }
    END { for (table in lines) printf "%s\n%s", table, lines[table] }' "$2" "$1"
}

start_units() { # The mission of another folder than the yard, if given.
  local yard=${1:-$yard}
  kill $(pidof vantaged vantage-units) 2>/dev/null || true # Of a check that failed.
  mkdir -p $here
  /host/bin/vantage-units $yard/mission.toml --folder $here/ports --can vcan0 --threads 1 \
    >$here/links 2>/tmp/units.log </dev/null &
  units=$!
  need "the units do not start" wait_for grep -q gnss $here/links
  sleep 1
  mkdir -p $here/yard
  cp $yard/* $here/yard/
  sed 's/^backend = .*/backend = "hardware"/' $yard/robot.toml >$here/plain.toml
  with_links $here/plain.toml $here/links >$here/yard/robot.toml
}
stop_units() {
  kill $units 2>/dev/null || true
  wait $units 2>/dev/null || true
}

start_mission() {
  rm -rf $here/run
  /host/bin/vantaged $here/yard/mission.toml --out $here/run --threads 1 >$here/out 2>/tmp/vantaged.log </dev/null &
  mission=$!
}
# The mission's log has a line that matches, or the mission is over.
told() { grep -qE "$1" /tmp/vantaged.log; }
need_told() { # PATTERN, SECONDS
  for _ in $(seq $(($2 * 5))); do
    told "$1" && return 0
    kill -0 $mission 2>/dev/null || break
    sleep 0.2
  done
  echo "vantaged did not say '$1': $(tail -n 2 /tmp/vantaged.log | tr '\n' ' ')" >&3
  exit 1
}
need_told_twice() { # PATTERN, SECONDS
  for _ in $(seq $(($2 * 5))); do
    [ "$(grep -cE "$1" /tmp/vantaged.log)" -ge 2 ] && return 0
    sleep 0.2
  done
  echo "vantaged did not say '$1' twice" >&3
  exit 1
}
# As a person does, once the program has said how. The drive's time-out is proven anew meanwhile.
release_robot() {
  need_told 'to release it, .*kill -USR1' 10
  local before
  before=$(grep -c 'the robot was released after F01' /tmp/vantaged.log || true)
  for _ in $(seq 10); do
    kill -USR1 $mission
    sleep 3
    [ "$(grep -c 'the robot was released after F01' /tmp/vantaged.log || true)" -gt "$before" ] && return 0
  done
  echo "the robot is not released: $(tail -n 2 /tmp/vantaged.log | tr '\n' ' ')" >&3
  exit 1
}
# The robot waits to be released: it was stopped after the last release.
is_stopped() { grep -E 'the robot (is stopped|was released)' /tmp/vantaged.log | tail -n 1 | grep -q 'is stopped'; }
# In a slow machine the drive may well seem silent on the way: then the robot is released again, as a person would.
mission_ends() { # EXIT CODE, SECONDS
  local code=0
  for _ in $(seq $(($2 * 5))); do
    kill -0 $mission 2>/dev/null || break
    if is_stopped; then
      kill -USR1 $mission
      sleep 3
    fi
    sleep 0.2
  done
  kill -0 $mission 2>/dev/null && { echo "the mission does not end" >&3; exit 1; }
  wait $mission || code=$?
  cat $here/out >>/tmp/vantaged.log
  [ $code -eq "$1" ] || { echo "it exits with $code: $(tail -n 2 /tmp/vantaged.log | tr '\n' ' ')" >&3; exit 1; }
}
