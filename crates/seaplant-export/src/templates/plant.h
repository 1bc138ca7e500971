/*
@REMARKS@
 *
 * State x[13]: north, east, down [m]; quaternion w, x, y, z from body to world; velocity over
 * ground in body axes u, v, w [m/s], p, q, r [rad/s].
 * Input tau[6]: force and moment on the body X, Y, Z [N], K, M, N [N m].
 * Current[3]: velocity of the water north, east, down [m/s], constant and irrotational.
 * Of axes that the plant does not have, translations keep their velocity, and rotations their angle:
 * p, q and r of those follow from the others, and are not read from x.
 */
#ifndef SEAPLANT_PLANT_H
#define SEAPLANT_PLANT_H

#include <math.h>

#define SEAPLANT_COEFFICIENTS @COUNT@
#define SEAPLANT_THRUSTERS @THRUSTERS@

/* 1 for each axis that the plant has: surge, sway, heave, roll, pitch, yaw. */
static const int seaplant_own[6] = {@OWN@};

/* The coefficients, in SI units. */
static const double seaplant_theta[SEAPLANT_COEFFICIENTS] = {
@THETA@};

@STD@
static inline void seaplant_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* M, rigid body plus added mass; zero where the plant has no entry. */
static inline void seaplant_mass(const double theta[], double mass[6][6])
{
    int i, j;
    for (i = 0; i < 6; ++i)
        for (j = 0; j < 6; ++j)
            mass[i][j] = 0.0;
@MASS@}

/* C(M, nu) nu + damping + restoring: what stands beside M nu' on the left. `nu` is relative to the
   water, `down` is the world's down in body axes. */
static inline void seaplant_forces(const double theta[], const double nu[6], const double down[3],
                            double n[6])
{
    double mass[6][6], p[6], moment[3];
    int i, j;
    seaplant_mass(theta, mass);
    for (i = 0; i < 6; ++i) {
        p[i] = 0.0;
        for (j = 0; j < 6; ++j)
            p[i] += mass[i][j] * nu[j];
    }
    seaplant_cross(&nu[3], &p[0], &n[0]);
    seaplant_cross(&nu[0], &p[0], &n[3]);
    seaplant_cross(&nu[3], &p[3], moment);
    for (i = 0; i < 3; ++i)
        n[3 + i] += moment[i];
    (void)down;
@FORCES@}

/* nu'_r = M^-1 (tau - n) on the plant's axes, zero on others. Returns 0, or 1 if M is not positive
   definite, which other coefficients than those above may make it. */
static inline int seaplant_acceleration(const double theta[], const double nu[6], const double down[3],
                                 const double tau[6], double rate[6])
{
    double mass[6][6], l[6][6], n[6], y[6], sum;
    int own[6], count = 0, i, j, k;
    seaplant_mass(theta, mass);
    seaplant_forces(theta, nu, down, n);
    for (i = 0; i < 6; ++i) {
        rate[i] = 0.0;
        if (seaplant_own[i])
            own[count++] = i;
    }
    for (i = 0; i < count; ++i) {
        for (j = 0; j <= i; ++j) {
            sum = mass[own[i]][own[j]];
            for (k = 0; k < j; ++k)
                sum -= l[i][k] * l[j][k];
            if (i == j) {
                if (!(sum > 0.0))
                    return 1;
                l[i][i] = sqrt(sum);
            } else {
                l[i][j] = sum / l[j][j];
            }
        }
        sum = tau[own[i]] - n[own[i]];
        for (k = 0; k < i; ++k)
            sum -= l[i][k] * y[k];
        y[i] = sum / l[i][i];
    }
    for (i = count - 1; i >= 0; --i) {
        sum = y[i];
        for (k = i + 1; k < count; ++k)
            sum -= l[k][i] * rate[own[k]];
        rate[own[i]] = sum / l[i][i];
    }
    return 0;
}

/* Takes a vector from the world to the body by the quaternion q = w, x, y, z. */
static inline void seaplant_to_body(const double q[4], const double world[3], double body[3])
{
    double w = q[0], x = q[1], y = q[2], z = q[3];
    double s = 2.0 / (w * w + x * x + y * y + z * z);
    body[0] = (1.0 - s * (y * y + z * z)) * world[0] + s * (x * y + w * z) * world[1] + s * (x * z - w * y) * world[2];
    body[1] = s * (x * y - w * z) * world[0] + (1.0 - s * (x * x + z * z)) * world[1] + s * (y * z + w * x) * world[2];
    body[2] = s * (x * z + w * y) * world[0] + s * (y * z - w * x) * world[1] + (1.0 - s * (x * x + y * y)) * world[2];
}

/* Sets p, q and r of rotations that the plant does not have to those that hold their angles; `down`
   is the world's down in body axes. */
static inline void seaplant_hold(const double down[3], double nu[6])
{
    (void)down, (void)nu;
@HELD@}

/* dx/dt with other coefficients than seaplant_theta. */
static inline int seaplant_deriv_of(const double theta[], const double x[13], const double tau[6],
                             const double current[3], double dx[13])
{
    static const double e3[3] = {0.0, 0.0, 1.0};
    const double *q = &x[3];
    double down[3], nu[6], water[3], relative[6], turning[3], conjugate[4];
    int i, failed;
    for (i = 0; i < 6; ++i)
        nu[i] = x[7 + i];
    seaplant_to_body(q, e3, down);
    seaplant_hold(down, nu);
    seaplant_to_body(q, current, water);
    for (i = 0; i < 6; ++i)
        relative[i] = i < 3 && seaplant_own[i] ? nu[i] - water[i] : nu[i];
    failed = seaplant_acceleration(theta, relative, down, tau, &dx[7]);
    /* In body axes a constant current turns. */
    seaplant_cross(&nu[3], water, turning);
    for (i = 0; i < 3; ++i)
        if (seaplant_own[i])
            dx[7 + i] -= turning[i];
    conjugate[0] = q[0];
    for (i = 1; i < 4; ++i)
        conjugate[i] = -q[i];
    seaplant_to_body(conjugate, nu, dx);
    dx[3] = 0.5 * (-q[1] * nu[3] - q[2] * nu[4] - q[3] * nu[5]);
    dx[4] = 0.5 * (q[0] * nu[3] + q[2] * nu[5] - q[3] * nu[4]);
    dx[5] = 0.5 * (q[0] * nu[4] + q[3] * nu[3] - q[1] * nu[5]);
    dx[6] = 0.5 * (q[0] * nu[5] + q[1] * nu[4] - q[2] * nu[3]);
    return failed;
}

/* dx/dt of the plant. */
static inline void seaplant_deriv(const double x[13], const double tau[6], const double current[3],
                           double dx[13])
{
    (void)seaplant_deriv_of(seaplant_theta, x, tau, current, dx);
}

/* One classical Runge-Kutta step of h seconds with tau held; x becomes the state at its end. Steps
   of 0.02 s or less follow roll and pitch. */
static inline int seaplant_step_of(const double theta[], double x[13], const double tau[6],
                            const double current[3], double h)
{
    static const double part[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    static const double e3[3] = {0.0, 0.0, 1.0};
    double at[13], rate[13], sum[13], down[3], norm = 0.0;
    int i, stage, failed = 0;
    for (i = 0; i < 13; ++i)
        sum[i] = rate[i] = 0.0;
    for (stage = 0; stage < 4; ++stage) {
        for (i = 0; i < 13; ++i)
            at[i] = x[i] + part[stage] * h * rate[i];
        failed |= seaplant_deriv_of(theta, at, tau, current, rate);
        for (i = 0; i < 13; ++i)
            sum[i] += weight[stage] * rate[i];
    }
    for (i = 0; i < 13; ++i)
        x[i] += h / 6.0 * sum[i];
    for (i = 3; i < 7; ++i)
        norm += x[i] * x[i];
    for (i = 3; i < 7; ++i)
        x[i] /= sqrt(norm);
    seaplant_to_body(&x[3], e3, down);
    seaplant_hold(down, &x[7]);
    return failed;
}

static inline int seaplant_step(double x[13], const double tau[6], const double current[3], double h)
{
    return seaplant_step_of(seaplant_theta, x, tau, current, h);
}

/* A quaternion w, x, y, z of roll, pitch and heading, rad. */
static inline void seaplant_quaternion(double roll, double pitch, double heading, double q[4])
{
    double a = cos(0.5 * roll), b = sin(0.5 * roll), c = cos(0.5 * pitch), d = sin(0.5 * pitch);
    double e = cos(0.5 * heading), f = sin(0.5 * heading);
    q[0] = a * c * e + b * d * f;
    q[1] = b * c * e - a * d * f;
    q[2] = a * d * e + b * c * f;
    q[3] = a * c * f - b * d * e;
}

/* Roll, pitch and heading, rad, of a quaternion w, x, y, z of length one. */
static inline void seaplant_angles(const double q[4], double angles[3])
{
    double sine = 2.0 * (q[0] * q[2] - q[3] * q[1]);
    sine = sine > 1.0 ? 1.0 : sine < -1.0 ? -1.0 : sine;
    angles[0] = atan2(2.0 * (q[0] * q[1] + q[2] * q[3]), 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2]));
    angles[1] = asin(sine);
    angles[2] = atan2(2.0 * (q[0] * q[3] + q[1] * q[2]), 1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3]));
}
@ACTUATORS@
#endif
