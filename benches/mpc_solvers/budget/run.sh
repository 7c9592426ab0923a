#!/usr/bin/env bash
# Budgets of the controllers in C of the shipped models: bytes of struct and stack, instructions of a step on x86-64
# (gcc -O2, valgrind --tool=callgrind) without an iteration and per iteration, code on a Cortex-M7; and additions,
# multiplications, divisions and square roots of the same steps (operations.py), also with 40 iterations, the cap.
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

# operations IS_PUSHED: floating-point operations in steps of the program without vectors.
operations() {
  valgrind --tool=callgrind --dump-instr=yes --compress-pos=no --callgrind-out-file=callgrind.out \
    --toggle-collect="${name}_controller_step" ./plain "$stages" "$1" $steps >/dev/null 2>&1
  python3 "$here/operations.py" plain callgrind.out
}

echo "| d | N | state, kB | stack, kB | instructions, thousands | per iteration | with the consistent lift: stack, kB | calm | pushed | code, kB | without it | operations, thousands | per iteration | at the cap |"
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
      compile=(gcc -std=gnu99 -O2 -g -ffp-contract=off -DREAL=$real -DNAME=$name -DHEADER="\"${name}_controller.h\""
        -DJUMP="\"${name}_jump.h\"" "-DGO1_D${d}_MAX_HORIZON=$stages" -I. "${name}_controller.c" "$name.c"
        "$here/budget.c")
      "${compile[@]}" -lm -o budget
      "${compile[@]}" -fno-tree-vectorize -no-pie -lm -o plain
      calm_operations=$(operations 0)
      pushed_operations=$(operations 1)
      read -r bytes _ _ _ _ _ _ calm <<<"$(counted ./budget "$stages" 0 $steps)"
      read -r _ _ stack _ _ iterations _ pushed <<<"$(counted ./budget "$stages" 1 $steps)"
      read -r _ _ _ _ _ _ _ lifted <<<"$(counted ./budget "$stages" 0 $steps 1)"
      read -r _ _ deeper _ _ _ _ lifted_pushed <<<"$(counted ./budget "$stages" 1 $steps 1)"
      awk -v d=$d -v n=$stages -v p=$precision -v b="$bytes" -v s="$stack" -v c="$calm" -v f="$pushed" -v i="$iterations" \
        -v code="$code" -v steps=$steps -v plain="$plain" -v l="$lifted" -v lp="$lifted_pushed" -v deeper="$deeper" \
        -v co="$calm_operations" -v po="$pushed_operations" 'BEGIN {
          turn = operations = cap = "-"
          if (i + 0 != 0) {
            turn = sprintf("%.0f", (f - c) / i / 1000)
            operations = sprintf("%.1f", (po - co) / i / 1000)
            cap = sprintf("%.0f", (co / steps + 40 * (po - co) / i) / 1000)
          }
          printf("| %d, %s | %d | %.0f | %.1f | %.0f | %s | %.1f | %.0f | %.0f | %.0f | %.0f | %.1f | %s | %s |\n", d, p, n,
            b / 1000, s / 1000, c / steps / 1000, turn, deeper / 1000, l / steps / 1000, lp / steps / 1000, code / 1000,
            plain / 1000, co / steps / 1000, operations, cap)
        }'
    done
  done
done
