/* The physical limit of simulating the paper's loop: its recursion by hand, with its zeros and ones left out. Usage: loop step|called|simulate COUNT;
   called is what a step costs whose caller keeps the state in memory, as a program does that is called once a sample.
   Prints the sums of y and u over the last round of the reference, as examples/src/bin/inner_loops.rs does. */
#include <complex.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROUND = 4000, PART_ROUNDS = 100 };
static const double TS = 0.001, KP = 300.0, KI = 100.0;
static double r[ROUND], cosine, sine, gamma_0, gamma_1;
struct state { double x0, x1, integrator; };

/* x0 + i x1 turns and fades by exp((-0.2 - 2i) Ts); the input enters x0 and is held. The third mode is never excited. */
static void prepare(void) {
    uint32_t seed = 1;
    for (int i = 0; i < ROUND; i++) {
        seed = seed * 1664525u + 1013904223u;
        r[i] = (double)(seed >> 8) / (1 << 24) - 0.4;
    }
    double complex pole = -0.2 - 2.0 * I, turn = cexp(pole * TS), held = (turn - 1.0) / pole;
    cosine = creal(turn), sine = -cimag(turn), gamma_0 = creal(held), gamma_1 = cimag(held);
}

static inline double step(struct state *at, double reference, double *y) {
    *y = at->x0;
    double e = reference - *y;
    at->integrator += KI * TS * e;
    double u = KP * e + at->integrator;
    double x0 = cosine * at->x0 + sine * at->x1 + gamma_0 * u;
    at->x1 = cosine * at->x1 - sine * at->x0 + gamma_1 * u;
    at->x0 = x0;
    return u;
}

/* Not compiled into its caller: the state is read and written at each step. */
__attribute__((noinline)) static double called_step(struct state *at, double reference, double *y) {
    return step(at, reference, y);
}

/* Rounds of the reference, step by step; compiled into its caller with the step that it takes. */
__attribute__((always_inline)) static inline void step_by_step(long rounds, double (*take)(struct state *, double, double *), double *y_sum, double *u_sum) {
    struct state at = {0};
    for (long k = 0; k < rounds; k++) {
        *y_sum = *u_sum = 0.0;
        for (int i = 0; i < ROUND; i++) {
            double y, u = take(&at, r[i], &y);
            *y_sum += y, *u_sum += u;
        }
    }
}

int main(int count, char **arguments) {
    if (count != 3) return fprintf(stderr, "usage: loop step|called|simulate COUNT\n"), 2;
    long rounds = (atol(arguments[2]) + ROUND - 1) / ROUND;
    double y_sum = 0.0, u_sum = 0.0;
    prepare();
    if (!strcmp(arguments[1], "step")) {
        step_by_step(rounds, step, &y_sum, &u_sum);
    } else if (!strcmp(arguments[1], "called")) {
        step_by_step(rounds, called_step, &y_sum, &u_sum);
    } else {
        for (long k = 0; k < rounds; k += PART_ROUNDS) {
            size_t length = (size_t)ROUND * PART_ROUNDS;
            double *y = malloc(length * sizeof *y), *u = malloc(length * sizeof *u);
            if (!y || !u) return 1;
            struct state at = {0};
            for (size_t i = 0; i < length; i++) u[i] = step(&at, r[i % ROUND], &y[i]);
            y_sum = u_sum = 0.0;
            for (size_t i = length - ROUND; i < length; i++) y_sum += y[i], u_sum += u[i];
            free(y), free(u);
        }
    }
    printf("%.12g %.12g\n", y_sum, u_sum);
    return 0;
}
