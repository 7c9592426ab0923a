/* From reset to main on an aarch64 processor without an operating system: memory is cached, because unaligned access
 * needs it, and output goes through the debugger's semihosting. Also the functions of a C library that gcc and libm
 * need, because the library itself needs an operating system. */
#include <stddef.h>
#include <stdint.h>

extern uint64_t tables[], bss_start[], bss_end[];
int main(void);
_Thread_local int errno;
const uint64_t __stack_chk_guard = 1;
void __stack_chk_fail(void) {}

__asm__(".section .start, \"ax\"\n.global start\nstart:\n"
        " adrp x0, stack_top\n add x0, x0, :lo12:stack_top\n mov sp, x0\n"
        " mov x0, #(3 << 20)\n msr cpacr_el1, x0\n isb\n bl begin\n");

uint64_t semihosting(uint64_t operation, const void *argument)
{
    register uint64_t x0 __asm__("x0") = operation;
    register const void *x1 __asm__("x1") = argument;
    __asm__ volatile("hlt #0xf000" : "+r"(x0) : "r"(x1) : "memory");
    return x0;
}

void begin(void)
{
    static uint64_t local[64];
    for (uint64_t *to = bss_start; to < bss_end;) {
        *to++ = 0;
    }
    /* Gigabytes 0, devices, and 1, memory, where they are; then caches and translation on. */
    tables[0] = 0x00000401;
    tables[1] = 0x40000705;
    __asm__ volatile("msr mair_el1, %0\n msr tcr_el1, %1\n msr ttbr0_el1, %2\n msr tpidr_el0, %3\n isb\n"
                     "mrs x9, sctlr_el1\n orr x9, x9, %4\n msr sctlr_el1, x9\n isb"
                     : : "r"((uint64_t)0xff00), "r"((uint64_t)0x80803520), "r"(tables), "r"(local), "r"((uint64_t)0x1005)
                     : "x9", "memory");
    const uint64_t exit[2] = {0x20026, (uint64_t)main()};
    semihosting(0x18, exit);
}

void *memcpy(void *restrict to, const void *restrict from, size_t count)
{
    unsigned char *a = to;
    const unsigned char *b = from;
    for (; count >= 16; count -= 16, a += 16, b += 16) {
        __asm__ volatile("ldp x9, x10, [%1]\n stp x9, x10, [%0]" : : "r"(a), "r"(b) : "x9", "x10", "memory");
    }
    while (count-- > 0) {
        *a++ = *b++;
        __asm__ volatile("");
    }
    return to;
}

void *memset(void *to, int value, size_t count)
{
    unsigned char *a = to;
    const uint64_t word = (unsigned char)value * 0x0101010101010101u;
    for (; count >= 16; count -= 16, a += 16) {
        __asm__ volatile("stp %1, %1, [%0]" : : "r"(a), "r"(word) : "memory");
    }
    while (count-- > 0) {
        *a++ = (unsigned char)value;
        __asm__ volatile("");
    }
    return to;
}

void *memmove(void *to, const void *from, size_t count)
{
    unsigned char *a = to;
    const unsigned char *b = from;
    if (a <= b || a >= b + count) {
        return memcpy(to, from, count);
    }
    while (count-- > 0) {
        a[count] = b[count];
        __asm__ volatile("");
    }
    return to;
}
