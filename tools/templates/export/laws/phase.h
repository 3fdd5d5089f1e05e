/* Law phase: the memory integral in pseudo-time phi = asin(theta / A). */
typedef struct gear_memory {
    real theta;     /* the last good deflection, rad */
    real u;         /* sin(phi) */
    real g;         /* cos(phi) */
    real direction; /* d: -1, 0 before the first movement, 1 */
    real transient; /* n of m = q * d * g + s * u + n */
} gear_memory;

