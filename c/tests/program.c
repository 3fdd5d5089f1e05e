/* Walks a gear along deflections and prints the bits of every output, the same on every machine. The test beside it computes them in Rust. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "gmhm.h"

/* Not initialised: gmhm_init takes bytes that hold anything. */
static gmhm_joint joint;
static uint8_t block[1024], damaged[1024], other[1024];

static uint32_t read_file(const char *path, uint8_t *to)
{
    FILE *file = fopen(path, "rb");
    size_t length;
    if (!file) {
        return 0;
    }
    length = fread(to, 1, sizeof block, file);
    fclose(file);
    return (uint32_t)length;
}

/* The bits of a number. */
static unsigned long bits(float x)
{
    uint32_t word;
    memcpy(&word, &x, sizeof word);
    return word;
}

static void print_output(const gmhm_output *out)
{
    printf("%08lx %08lx %08lx %08lx %08lx %x\n", bits(out->torque_nm), bits(out->elastic_nm), bits(out->hysteresis_nm), bits(out->terms_nm),
           bits(out->deflection_rad), (unsigned)out->flags);
}

static int failed(const char *what)
{
    fprintf(stderr, "failed: %s\n", what);
    return 1;
}

int main(int count, char **words)
{
    uint32_t length, other_length, k;
    gmhm_sample sample;
    gmhm_output out, again;
    gmhm_solution aim;
    gmhm_status status;

    if (count != 3) {
        return failed("usage: program BLOCK OTHER");
    }
    length = read_file(words[1], block);
    other_length = read_file(words[2], other);
    memset(&sample, 0, sizeof sample);
    memset(&joint, 0xa5, sizeof joint);

    /* Nothing in force: everything answers, nothing happens. */
    memcpy(damaged, block, sizeof block);
    damaged[length / 2] ^= 1;
    if (gmhm_init(&joint, damaged, length) != GMHM_ERROR_CHECKSUM) {
        return failed("a damaged block is refused");
    }
    if (gmhm_step(&joint, &sample).flags != GMHM_FLAG_NOT_LOADED || gmhm_invert(&joint, 1.0f).flags != GMHM_FLAG_NOT_LOADED
        || gmhm_get_status(&joint).flags != GMHM_FLAG_NOT_LOADED) {
        return failed("a joint without parameters says so");
    }
    if (gmhm_init(NULL, block, length) != GMHM_NULL || gmhm_init(&joint, NULL, length) != GMHM_NULL
        || gmhm_load(NULL, block, length) != GMHM_NULL || gmhm_step(NULL, &sample).flags != GMHM_FLAG_NOT_LOADED
        || gmhm_step(&joint, NULL).flags != GMHM_FLAG_NOT_LOADED || gmhm_invert(NULL, 0.0f).flags != GMHM_FLAG_NOT_LOADED
        || gmhm_get_status(NULL).flags != GMHM_FLAG_NOT_LOADED) {
        return failed("NULL is answered");
    }
    gmhm_restart(NULL);

    /* A whole sector holds more than the block. */
    if (gmhm_init(&joint, block, sizeof block) != GMHM_OK) {
        return failed("the block is loaded");
    }
    status = gmhm_get_status(&joint);
    printf("%s %08lx %08lx %08lx %08lx %x\n", status.gear, (unsigned long)status.crc32, bits(status.period_s),
           bits(status.rated_deflection_rad), bits(status.range_rad), (unsigned)status.needs);

    for (k = 0; k < 2000; k++) {
        /* Triangles of growing and shrinking size, exact in floating point. */
        uint32_t phase = k % 256, size = 1 + k / 256 % 5;
        float triangle = (float)(phase < 128 ? phase : 256 - phase) / 64.0f - 1.0f;
        sample.deflection_rad = status.rated_deflection_rad * triangle * (float)size / 4.0f;
        sample.motor_angle_rad = (float)phase / 64.0f;
        sample.velocity_rad_per_s = phase < 128 ? 0.5f : -0.5f;
        sample.motor_velocity_rad_per_s = phase < 128 ? 2.0f : -2.0f;
        sample.time_s = (float)k / 1024.0f;
        out = gmhm_step(&joint, &sample);
        print_output(&out);
        aim = gmhm_invert(&joint, 0.5f * out.torque_nm);
        printf("%08lx %x\n", bits(aim.deflection_rad), (unsigned)aim.flags);
    }

    /* No number moves anything. */
    sample.deflection_rad = nanf("");
    again = gmhm_step(&joint, &sample);
    if (again.torque_nm != out.torque_nm || !(again.flags & GMHM_FLAG_REFUSED)) {
        return failed("NaN is refused");
    }
    if (!(gmhm_invert(&joint, INFINITY).flags & GMHM_FLAG_REFUSED)) {
        return failed("an infinite torque is refused");
    }

    /* A refusal leaves what is in force; a good block replaces it. */
    if (gmhm_load(&joint, damaged, length) != GMHM_ERROR_CHECKSUM || gmhm_get_status(&joint).crc32 != status.crc32) {
        return failed("a refused block changes nothing");
    }
    if (gmhm_load(&joint, other, other_length) != GMHM_OK || gmhm_get_status(&joint).crc32 == status.crc32) {
        return failed("another block is put in force");
    }
    gmhm_restart(&joint);
    if (gmhm_sdo_abort(GMHM_ERROR_CHECKSUM) != 0x05040004u || gmhm_sdo_abort(0xffffu) != 0x08000000u) {
        return failed("refusals have SDO abort codes");
    }
    return 0;
}
