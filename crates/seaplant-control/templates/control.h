/*
 * A @LAW@ controller of @NAME@, made by Seaplant @VERSION@.
 * It needs seaplant_plant.h of the same plant beside it, and math.h.
 *
@NOTES@
 *
 * State x[13] as in seaplant_plant.h. Reference: position [m] and its two rates north, east and
 * down; quaternion w, x, y, z of the desired attitude; rate of turn [rad/s] and its rate in
 * desired body axes. Call seaplant_control() every SEAPLANT_CONTROL_PERIOD seconds; tau[6] is the
 * force to ask for until the next call, within the limits [N, N m]; zero, and nothing remembered,
 * where a number that it was given is none.
 */
#ifndef SEAPLANT_CONTROL_H
#define SEAPLANT_CONTROL_H

#include "seaplant_plant.h"

#define SEAPLANT_CONTROL_PERIOD @PERIOD@

/* By axis: surge, sway, heave, roll, pitch, yaw; zero where nothing is controlled. */
static const double seaplant_kp[6] = {@KP@};
static const double seaplant_kd[6] = {@KD@};
static const double seaplant_ki[6] = {@KI@};
static const double seaplant_controlled_mass[6] = {@MASSES@};
static const double seaplant_limit[6] = {@LIMIT@}; /* negative: without */
static const int seaplant_controlled[6] = {@OWN@};

struct seaplant_reference {
    double position[3], velocity[3], acceleration[3];
    double attitude[4], turning[3], turning_rate[3];
};

/* What the controller remembers; begin with zeros. */
struct seaplant_memory {
    double integral[6];
};

/* Error and its rate, and desired velocity and acceleration, all in body axes. */
static inline void seaplant_tracking(const double x[13], const struct seaplant_reference *to,
                              double error[6], double rate[6], double nu[6], double acceleration[6])
{
    const double *q = &x[3], *d = to->attitude;
    double off[4], back[4], away[3], turned[3], slip[3], sign;
    int i;
    /* off = conjugate(desired) * q */
    off[0] = d[0] * q[0] + d[1] * q[1] + d[2] * q[2] + d[3] * q[3];
    off[1] = d[0] * q[1] - d[1] * q[0] - d[2] * q[3] + d[3] * q[2];
    off[2] = d[0] * q[2] + d[1] * q[3] - d[2] * q[0] - d[3] * q[1];
    off[3] = d[0] * q[3] - d[1] * q[2] + d[2] * q[1] - d[3] * q[0];
    sign = off[0] < 0.0 ? -2.0 : 2.0;
    for (i = 0; i < 4; ++i)
        back[i] = off[i];
    for (i = 0; i < 3; ++i)
        away[i] = x[i] - to->position[i];
    seaplant_to_body(q, away, error);
    seaplant_to_body(q, to->velocity, nu);
    seaplant_to_body(q, to->acceleration, acceleration);
    /* From the desired body to the body. */
    seaplant_to_body(back, to->turning, &nu[3]);
    seaplant_to_body(back, to->turning_rate, &acceleration[3]);
    for (i = 0; i < 3; ++i) {
        error[3 + i] = sign * off[1 + i];
        rate[i] = x[7 + i] - nu[i];
        rate[3 + i] = x[10 + i] - nu[3 + i];
    }
    seaplant_cross(&x[10], nu, turned);
    seaplant_cross(&rate[3], &nu[3], slip);
    for (i = 0; i < 3; ++i) {
        acceleration[i] -= turned[i];
        acceleration[3 + i] -= slip[i];
    }
}

/* The force for the next period. */
static inline void seaplant_control(const double x[13], const struct seaplant_reference *to,
                             struct seaplant_memory *memory, double tau[6])
{
    static const double e3[3] = {0.0, 0.0, 1.0};
    double error[6], rate[6], nu[6], acceleration[6], model[6];
    double mass[6][6], down[3];
    int i, j;
    seaplant_tracking(x, to, error, rate, nu, acceleration);
    seaplant_to_body(&x[3], e3, down);
@MODEL@    for (i = 0; i < 6; ++i) {
        tau[i] = 0.0;
        if (!seaplant_controlled[i])
            continue;
        tau[i] = model[i]@FEEDBACK@;
        if (!isfinite(tau[i])) {
            tau[i] = 0.0;
            continue;
        }
        if (seaplant_limit[i] >= 0.0 && fabs(tau[i]) > seaplant_limit[i])
            tau[i] = tau[i] < 0.0 ? -seaplant_limit[i] : seaplant_limit[i];
        else
            memory->integral[i] += seaplant_ki[i] > 0.0 ? SEAPLANT_CONTROL_PERIOD * error[i] : 0.0;
    }
    (void)mass;
    (void)down;
    (void)j;
}

#endif
