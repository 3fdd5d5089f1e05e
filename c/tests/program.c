/* Walks a gear along deflections and prints the bits of every output, the same on every machine. The test beside it computes them in Rust. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "gmhm.h"

/* Not initialised: gmhm_init takes bytes that hold anything. */
static gmhm_joint joint;
static gmhm_feed_forward feed;
enum { PLACES = 8 };
static gmhm_term joint_terms[PLACES], feed_terms[PLACES];
static gmhm_store store;
static gmhm_link line;
static uint8_t block[1024], damaged[1024], other[1024];

/* A flash of four sectors. */
enum { SECTOR = 1024, FLASH = 4 * SECTOR };
static uint8_t cells[FLASH];

static uint32_t flash_read(void *context, uint32_t address, uint8_t *to, uint32_t length)
{
    if (context != cells || address > FLASH || length > FLASH - address) {
        return 1;
    }
    memcpy(to, cells + address, length);
    return 0;
}

static uint32_t flash_write(void *context, uint32_t address, const uint8_t *from, uint32_t length)
{
    uint32_t k;
    if (context != cells || address % 64 != 0 || length % 64 != 0 || address > FLASH || length > FLASH - address) {
        return 1;
    }
    for (k = 0; k < length; k++) {
        cells[address + k] &= from[k];
    }
    return 0;
}

static uint32_t flash_erase(void *context, uint32_t first, uint32_t end)
{
    if (context != cells || first % SECTOR != 0 || end % SECTOR != 0 || first > end || end > FLASH) {
        return 1;
    }
    memset(cells + first, 0xff, end - first);
    return 0;
}

/* The drive behind the link: its joint. */
static void send(void *context, const uint8_t *bytes, uint32_t length)
{
    uint32_t k;
    (void)context;
    for (k = 0; k < length; k++) {
        printf("%02x", bytes[k]);
    }
    printf("\n");
}

/* A block with the words of its set-up, or without them. */
static uint16_t put_in_force(gmhm_joint *to, const uint8_t *bytes, uint32_t length)
{
    uint16_t code = gmhm_init_with_terms(to, joint_terms, PLACES, bytes, length);
    return code == GMHM_ERROR_MISSING ? gmhm_load_any(to, bytes, length, 0) : code;
}

static uint16_t adopt(void *context, const uint8_t *bytes, uint32_t length)
{
    return bytes ? put_in_force((gmhm_joint *)context, bytes, length) : GMHM_OK;
}

/* The frame of the request `status`. The test beside this file computes it. */
static const uint8_t STATUS[] = {0x00, 0x03, 0x01, 0x02, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x05, 0xce, 0x2b, 0xbe, 0x22, 0x00};

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
    uint32_t found = 0;
    uint16_t code;
    gmhm_sample sample;
    gmhm_output out, again;
    gmhm_solution aim;
    gmhm_status status;
    gmhm_limits limits = {1e-3f, 0.125f, 0.5f, 400.0f, INFINITY};
    gmhm_demand demand = {0.0f, 0.0f, 1.0f, 1u, 0u};
    gmhm_contribution now;
    gmhm_flash flash = {cells, FLASH, SECTOR, 4, 0, 2 * SECTOR, 2 * SECTOR, flash_read, flash_write, flash_erase};
    gmhm_drive drive = {&joint, send, adopt, NULL, NULL, NULL, NULL, NULL};

    if (count != 3) {
        return failed("usage: program BLOCK OTHER");
    }
    length = read_file(words[1], block);
    other_length = read_file(words[2], other);
    memset(&sample, 0, sizeof sample);
    memset(&joint, 0xa5, sizeof joint);
    memset(joint_terms, 0xa5, sizeof joint_terms);
    memset(feed_terms, 0xa5, sizeof feed_terms);

    /* Nothing in force: everything answers, nothing happens. */
    memcpy(damaged, block, sizeof block);
    damaged[length / 2] ^= 1;
    if (gmhm_init(&joint, damaged, length) != GMHM_ERROR_CHECKSUM) {
        return failed("a damaged block is refused");
    }
    if (gmhm_step(&joint, &sample, &out) != GMHM_FLAG_NOT_LOADED || gmhm_invert(&joint, 1.0f, NULL, &aim) != GMHM_FLAG_NOT_LOADED
        || gmhm_get_status(&joint, &status) != GMHM_FLAG_NOT_LOADED || status.flags != GMHM_FLAG_NOT_LOADED) {
        return failed("a joint without parameters says so");
    }
    if (gmhm_init(NULL, block, length) != GMHM_NULL || gmhm_init(&joint, NULL, length) != GMHM_NULL
        || gmhm_load(NULL, block, length) != GMHM_NULL || gmhm_load_any(NULL, block, length, 0) != GMHM_NULL || gmhm_step(NULL, &sample, &out) != GMHM_FLAG_NOT_LOADED
        || gmhm_step(&joint, NULL, &out) != GMHM_FLAG_NOT_LOADED || gmhm_step(&joint, &sample, NULL) != GMHM_FLAG_NOT_LOADED
        || gmhm_invert(NULL, 0.0f, NULL, &aim) != GMHM_FLAG_NOT_LOADED || gmhm_get_status(NULL, &status) != GMHM_FLAG_NOT_LOADED
        || gmhm_feed_forward_init(NULL, block, length, &limits) != GMHM_NULL || gmhm_store_init(&store, NULL) != GMHM_NULL
        || gmhm_link_init(NULL, &flash, 1) != GMHM_NULL) {
        return failed("NULL is answered");
    }
    gmhm_restart(NULL);

    /* A whole sector holds more than the block. */
    if (put_in_force(&joint, block, sizeof block) != GMHM_OK) {
        return failed("the block is loaded");
    }
    gmhm_get_status(&joint, &status);
    printf("%s %08lx %08lx %08lx %08lx %x\n", status.gear, (unsigned long)status.crc32, bits(status.period_s),
           bits(status.rated_deflection_rad), bits(status.range_rad), (unsigned)status.needs);
    limits.period_s = status.period_s > 0.0f ? status.period_s : 1e-3f;
    memset(&feed, 0xa5, sizeof feed);
    code = gmhm_feed_forward_init_with_terms(&feed, feed_terms, PLACES, block, sizeof block, &limits);
    printf("%x %x\n", (unsigned)code, (unsigned)gmhm_feed_forward_needs(&feed));

    for (k = 0; k < 2000; k++) {
        /* Triangles of growing and shrinking size, exact in floating point. */
        uint32_t phase = k % 256, size = 1 + k / 256 % 5;
        float triangle = (float)(phase < 128 ? phase : 256 - phase) / 64.0f - 1.0f;
        sample.deflection_rad = status.rated_deflection_rad * triangle * (float)size / 4.0f;
        sample.motor_angle_rad = (float)phase / 64.0f;
        sample.velocity_rad_per_s = phase < 128 ? 0.5f : -0.5f;
        sample.motor_velocity_rad_per_s = phase < 128 ? 2.0f : -2.0f;
        sample.time_s = (float)k / 1024.0f;
        sample.temperature_c = 20.0f + (float)k / 128.0f;
        gmhm_step(&joint, &sample, &out);
        print_output(&out);
        gmhm_invert(&joint, 0.5f * out.torque_nm, &sample, &aim);
        printf("%08lx %x\n", bits(aim.deflection_rad), (unsigned)aim.flags);
        demand.torque_nm = 0.75f * out.torque_nm;
        found = gmhm_feed_forward_step(&feed, &demand, &sample, &now);
        printf("%08lx %08lx %08lx %x\n", bits(now.offset_rad), bits(now.hysteresis_nm), bits(now.joint_terms_nm), (unsigned)found);
    }

    /* No number moves anything. */
    sample.deflection_rad = nanf("");
    gmhm_step(&joint, &sample, &again);
    if (again.torque_nm != out.torque_nm || !(again.flags & GMHM_FLAG_REFUSED)) {
        return failed("NaN is refused");
    }
    if (!(gmhm_invert(&joint, INFINITY, NULL, &aim) & GMHM_FLAG_REFUSED)) {
        return failed("an infinite torque is refused");
    }

    /* A refusal leaves what is in force; a good block replaces it. */
    if (gmhm_load(&joint, damaged, length) != GMHM_ERROR_CHECKSUM || !(gmhm_get_status(&joint, &status) & GMHM_FLAG_REFUSED)) {
        return failed("a refused block changes nothing");
    }
    found = status.crc32;
    if (gmhm_load_any(&joint, other, other_length, 0) != GMHM_OK || gmhm_get_status(&joint, &status) != 0 || status.crc32 == found) {
        return failed("another block is put in force");
    }
    gmhm_restart(&joint);
    if (gmhm_sdo_abort(GMHM_ERROR_CHECKSUM) != 0x05040004u || gmhm_sdo_abort(0xffffu) != 0x08000000u) {
        return failed("refusals have SDO abort codes");
    }

    /* Blocks in flash. */
    memset(cells, 0xff, sizeof cells);
    flash.second_slot = SECTOR;
    if (gmhm_store_init(&store, &flash) != GMHM_PLACE || gmhm_store_write(&store, block, length) != GMHM_PLACE) {
        return failed("slots that overlap are refused");
    }
    flash.second_slot = 2 * SECTOR;
    if (gmhm_store_init(&store, &flash) != GMHM_OK || gmhm_store_read(&store, damaged, sizeof damaged, &found) != GMHM_NO_BLOCK) {
        return failed("an empty store holds no block");
    }
    if (gmhm_stamp(block, length, 1) != GMHM_OK || gmhm_store_write(&store, block, length) != GMHM_OK
        || gmhm_store_write(&store, block, length) != GMHM_NOT_NEWER || gmhm_stamp(other, other_length, 2) != GMHM_OK
        || gmhm_store_write(&store, other, other_length) != GMHM_OK) {
        return failed("two blocks are stored");
    }
    if (gmhm_store_read(&store, damaged, sizeof damaged, &found) != GMHM_OK || found != other_length || memcmp(damaged, other, found) != 0
        || gmhm_store_roll_back(&store) != GMHM_OK || gmhm_store_read(&store, damaged, sizeof damaged, &found) != GMHM_OK || found != length
        || memcmp(damaged, block, found) != 0 || gmhm_store_roll_back(&store) != GMHM_NO_BLOCK) {
        return failed("the newest block is read, and the one before it");
    }

    /* The link boots from it and answers. */
    memset(&joint, 0, sizeof joint);
    if (gmhm_init(&joint, other, 0) == GMHM_OK || gmhm_link_init(&line, &flash, 42) != GMHM_OK || gmhm_link_boot(&line, &drive) != GMHM_OK
        || gmhm_get_status(&joint, &status) != 0 || status.sequence != 1) {
        return failed("the link boots from the store");
    }
    if (gmhm_link_receive(&line, &drive, STATUS, sizeof STATUS) != GMHM_OK || gmhm_link_elapse(&line, &drive, 100) != GMHM_OK) {
        return failed("the link answers");
    }
    return 0;
}
