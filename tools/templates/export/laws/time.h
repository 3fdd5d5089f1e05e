/* Law time: the memory integral in seconds. */
typedef struct gear_memory {
    real theta; /* the last good deflection, rad */
    real m;     /* m / T_A */
    real carry; /* what the sum rounded off */
} gear_memory;

