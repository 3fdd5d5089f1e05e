/*
 * @title@
 *
 * Made by gmhm @version@ from @file@, SHA-256
 * @hash@.
 */
#include "@file_stem@.h"

#include <math.h>

@constants@
