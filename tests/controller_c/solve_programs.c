/* Solves programs of the structured solver in C that is made from its Rust, from standard input to standard output, in
 * doubles of native byte order. Sizes are macros: NX, NU, REAL, LINKED. Each program has four counts (rows on inputs,
 * soft, links, pairs on inputs), the diagonals of the cost, price and
 * softness, x0, for each of ten places a, b, c, rows on inputs, links and bounds, and the soft rows. It is
 * solved three times: from x0, then by the last solution from shares of it. */
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef REAL real;

#include "solver_stage.h"

#include "solver.c"

enum { HORIZON = 10, MOST_ROWS = 32 };

static double number(void)
{
    double value = 0;
    if (fread(&value, sizeof value, 1, stdin) != 1) {
        exit(0);
    }
    return value;
}

static void read_all(real *to, int count)
{
    for (int i = 0; i < count; ++i) {
        to[i] = (real)number();
    }
}

static void put(real value)
{
    const double wide = (double)value;
    (void)fwrite(&wide, sizeof wide, 1, stdout);
}

static void put_all(const real *values, int count)
{
    for (int i = 0; i < count; ++i) {
        put(values[i]);
    }
}

static solver_stage stages[HORIZON];
static real memory[HORIZON * MOST_ROWS * SOLVER_ROW_NUMBERS];
static real input[HORIZON * MOST_ROWS][NU], soft[MOST_ROWS][NU];
static real links[HORIZON * MOST_ROWS][NU], gains[HORIZON][NU][NU];

static solver_program read_program(real x0[NX])
{
    solver_program p;
    memset(&p, 0, sizeof p);
    memset(stages, 0, sizeof stages);
    memset(memory, 0, sizeof memory);
    p.stages = stages;
    p.stages_len = HORIZON;
    p.rows = memory;
    p.first = 3;
    p.shape.input = (int)number();
    p.shape.soft = (int)number();
    p.shape.link = (int)number();
    p.shape.pairs = (int)number();
    p.matrices.input = input;
    p.matrices.soft = soft;
    p.links.rows = links;
    p.links.gains = gains;
    read_all(p.cost.state, NX);
    read_all(p.cost.terminal, NX);
    read_all(p.cost.input, NU);
    p.cost.slack = (real)number();
    p.links.softness = (real)number();
    read_all(x0, NX);
    for (int place = 0; place < HORIZON; ++place) {
        solver_stage *stage = &stages[place];
        stage->input_rows = place * p.shape.input;
        read_all(stage->a[0], NX * NX);
        read_all(stage->b[0], NX * NU);
        read_all(stage->c, NX);
        read_all(input[stage->input_rows], p.shape.input * NU);
        read_all(links[place * p.shape.link], p.shape.link * NU);
        read_all(memory + place * solver_shape_memory(&p.shape), solver_shape_rows(&p.shape));
    }
    read_all(soft[0], p.shape.soft * NU);
    return p;
}

int main(void)
{
    static const real SHARES[3] = {1, (real)0.7, (real)0.4};
    for (;;) {
        solver_settings settings = {40, (real)1e-9, (real)1e-8, (real)1e-6};
        real x0[NX], x[NX];
        solver_program p = read_program(x0);
        for (int turn = 0; turn < 3; ++turn) {
            for (int i = 0; i < NX; ++i) {
                x[i] = SHARES[turn] * x0[i];
            }
            put(solver_program_prepare(&p) ? 1 : 0);
            const solver_report report = solver_program_solve(&p, x, turn > 0, &settings);
            put((real)report.outcome);
            put((real)report.iterations);
            put(report.residuals.primal);
            put(report.residuals.dual);
            put(report.residuals.gap);
            for (int k = 0; k < HORIZON; ++k) {
                const solver_stage *stage = &stages[solver_program_at(&p, k)];
                const int count = solver_shape_rows(&p.shape);
                put_all(stage->v, NU);
                put_all(stage->x, NX);
                put(stage->t);
                put_all(solver_program_bounds_mut(&p, k) + 2 * count, count);
            }
            solver_program_shift(&p);
        }
    }
}
