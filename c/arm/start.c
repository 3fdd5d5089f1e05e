/*
 * Start-up of a Cortex-M without an operating system, for programs that speak to a debugger or an emulator by semihosting: initial memory,
 * floating-point unit, the words of the command line, main. newlib's librdimon does the input and output.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Places that program.ld gives. */
extern uint8_t stack_bottom[], stack_top[], data_load[], data_begin[], data_end[], bss_begin[], bss_end[];

void initialise_monitor_handles(void);
int main(int count, char **words);

enum { SYS_GET_CMDLINE = 0x15, SYS_EXIT_EXTENDED = 0x20, APPLICATION_EXIT = 0x20026, MOST_WORDS = 8, PAINT = 0xa5 };

static int32_t semihost(uint32_t operation, void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return (int32_t)r0;
}

void start(void);

void start(void)
{
    static char line[128], *words[MOST_WORDS + 1];
    struct {
        char *text;
        uint32_t length;
    } request = {line, sizeof line};
    uint8_t *untouched = stack_bottom, *sp;
    char *word;
    int count = 0, status;

    memcpy(data_begin, data_load, (size_t)(data_end - data_begin));
    memset(bss_begin, 0, (size_t)(bss_end - bss_begin));
    /* All but what the call itself needs. */
    __asm__ volatile("mov %0, sp" : "=r"(sp));
    memset(stack_bottom, PAINT, (size_t)(sp - 64 - stack_bottom));
#ifdef __ARM_FP
    /* Full access to coprocessors 10 and 11, the floating-point unit. */
    *(volatile uint32_t *)0xe000ed88 |= 0xfu << 20;
    __asm__ volatile("dsb\n isb");
#endif
    initialise_monitor_handles();
    if (semihost(SYS_GET_CMDLINE, &request) == 0) {
        for (word = strtok(line, " "); word && count < MOST_WORDS; word = strtok(NULL, " ")) {
            words[count++] = word;
        }
    }
    status = main(count, words);
    /* How deep the stack went, for those who have little. */
    while (*untouched == PAINT) {
        untouched++;
    }
    fprintf(stderr, "stack: %lu B\n", (unsigned long)(stack_top - untouched));
    exit(status);
}

static void fault(void)
{
    uint32_t exit_status[2] = {APPLICATION_EXIT, 3};
    for (;;) {
        semihost(SYS_EXIT_EXTENDED, exit_status);
    }
}

/* No interrupt is ever enabled. */
__attribute__((section(".vectors"), used)) static const struct {
    uint8_t *stack;
    void (*reset)(void), (*nmi)(void), (*hard_fault)(void);
} vectors = {stack_top, start, fault, fault};
