#!/usr/bin/env bash
# Budgets of the controllers in C of the shipped models: bytes of struct and stack, instructions of a step on x86-64
# (gcc -O2, valgrind --tool=callgrind) without an iteration and per iteration, code on a Cortex-M7.
# usage: benches/mpc_solvers/budget/run.sh ROMC
set -euo pipefail
romc=$(realpath "$1")
here=$(cd "$(dirname "$0")" && pwd)
root=$here/../../..
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
steps=60
board="-mcpu=cortex-m7 -mfpu=fpv5-d16 -mfloat-abi=hard -mthumb"

# counted PROGRAM ARGUMENTS: instructions in steps, and what the program prints.
counted() {
  valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect="${name}_controller_step" "$@" 2>&1 |
    sed -n 's/.*Collected : //p; s/^\([0-9]* bytes.*\)/\1/p' | tr '\n' ' '
}

echo "| d | N | state, kB | stack, kB | instructions, thousands | per iteration | with the consistent lift: stack, kB | calm | pushed | code, kB | without it |"
for precision in f64 f32; do
  real=double
  [ "$precision" = f32 ] && real=float
  for d in 2 4 6; do
    name=go1_d$d
    "$romc" compile "$root/models/go1-d$d.json" --emit controller-c --precision "$precision" \
      --out-dir "$work/$precision" >/dev/null
    cd "$work/$precision/$name-controller-c"
    arm-none-eabi-gcc -std=c99 -O2 -ffp-contract=off $board -c "${name}_controller.c" "$name.c"
    code=$(arm-none-eabi-size "${name}_controller.o" "$name.o" | awk 'NR > 1 { sum += $1 + $2 } END { print sum }')
    arm-none-eabi-gcc -std=c99 -O2 -ffp-contract=off "-DGO1_D${d}_CONSISTENT_LIFT=0" $board -c "${name}_controller.c"
    plain=$(arm-none-eabi-size "${name}_controller.o" "$name.o" | awk 'NR > 1 { sum += $1 + $2 } END { print sum }')
    for stages in 10 20 50; do
      gcc -std=gnu99 -O2 -g -ffp-contract=off -DREAL=$real -DNAME=$name -DHEADER="\"${name}_controller.h\"" \
        -DJUMP="\"${name}_jump.h\"" "-DGO1_D${d}_MAX_HORIZON=$stages" -I. "${name}_controller.c" "$name.c" \
        "$here/budget.c" -lm -o budget
      read -r bytes _ _ _ _ _ _ calm <<<"$(counted ./budget "$stages" 0 $steps)"
      read -r _ _ stack _ _ iterations _ pushed <<<"$(counted ./budget "$stages" 1 $steps)"
      read -r _ _ _ _ _ _ _ lifted <<<"$(counted ./budget "$stages" 0 $steps 1)"
      read -r _ _ deeper _ _ _ _ lifted_pushed <<<"$(counted ./budget "$stages" 1 $steps 1)"
      awk -v d=$d -v n=$stages -v p=$precision -v b="$bytes" -v s="$stack" -v c="$calm" -v f="$pushed" -v i="$iterations" \
        -v code="$code" -v steps=$steps -v plain="$plain" -v l="$lifted" -v lp="$lifted_pushed" -v deeper="$deeper" 'BEGIN {
          turn = "-"
          if (i + 0 != 0) turn = sprintf("%.0f", (f - c) / i / 1000)
          printf("| %d, %s | %d | %.0f | %.1f | %.0f | %s | %.1f | %.0f | %.0f | %.0f | %.0f |\n", d, p, n, b / 1000, s / 1000,
            c / steps / 1000, turn, deeper / 1000, l / steps / 1000, lp / steps / 1000, code / 1000, plain / 1000)
        }'
    done
  done
done
