/* A reversal of the deflection. */
typedef struct gear_turning_point {
    real theta; /* rad */
    real eta;   /* shape of the loop there, 1 at the middle of the rated cycle */
} gear_turning_point;

/* A branch: eta = eta_0 + s * (slope - min(s * bend, 2)), s = (theta - theta_0) / A. */
typedef struct gear_branch {
    gear_turning_point anchor; /* the newest turning point, or the origin of the initial curve */
    real slope;                /* 2, but where pairs were merged */
    real bend;                 /* 2 on the initial curve, else 1; negative where the deflection falls */
} gear_branch;

/* Law masing: the nested reversals. */
typedef struct gear_memory {
    real theta;    /* the last good deflection, rad */
    real filtered; /* the same after the input play */
    real eta;
    real sign; /* 1 rising, -1 falling, 0 before the first movement */
    real origin;
    gear_branch branch;
    gear_turning_point points[GEAR_TURNING_POINTS]; /* outermost first; none on the initial curve */
    uint32_t count;
    uint32_t merged_pairs; /* pairs of turning points given up because there was no room */
    bool merging;
} gear_memory;

