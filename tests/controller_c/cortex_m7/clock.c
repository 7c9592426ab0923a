/* Instructions in thousands: with `-icount shift=0` each is a nanosecond, and this timer of 25 MHz counts down. */
#include <stdint.h>

double clock_us(void)
{
    static volatile uint32_t *const timer = (uint32_t *)0xE000E010;
    static uint32_t last = 0xFFFFFF;
    static double us;
    timer[1] = 0xFFFFFF;
    timer[0] |= 5;
    const uint32_t now = timer[2];
    us += 0.04 * ((last - now) & 0xFFFFFF);
    last = now;
    return us;
}
