/* From reset to main on a Cortex-M7, output through the debugger's semihosting. */
#include <stdint.h>
#include <stdlib.h>

extern uint32_t data_start[], data_end[], data_load[], bss_start[], bss_end[], stack_top[];
int main(void);
void initialise_monitor_handles(void);

/* newlib calls these, and crt0 is not linked. */
void _init(void) {}
void _fini(void) {}

void reset(void)
{
    volatile uint32_t *const coprocessors = (uint32_t *)0xE000ED88;
    *coprocessors |= 0xFu << 20;
    __asm__ volatile("dsb\n isb");
    for (uint32_t *to = data_start, *from = data_load; to < data_end;) {
        *to++ = *from++;
    }
    for (uint32_t *to = bss_start; to < bss_end;) {
        *to++ = 0;
    }
    initialise_monitor_handles();
    exit(main());
}

static void stop(void) { abort(); }

__attribute__((section(".vectors"), used)) static void (*const VECTORS[16])(void) = {
    (void (*)(void))stack_top, reset, stop, stop, stop, stop, stop,
};
