/* Vector table and reset: memory set up, FPU on, semihosting opened, main called. */
#include <stdint.h>
#include <stdlib.h>

extern uint32_t data_begin[], data_end[], data_load[], bss_begin[], bss_end[], stack_top[];
extern void initialise_monitor_handles(void);
extern int main(void);

void reset(void);

static void halt(void) {
    for (;;) {
    }
}

typedef void (*vector_t)(void);
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    vector_t handlers[15];
} vectors = {stack_top, {reset, halt, halt, halt, halt, halt, 0, 0, 0, 0, halt, halt, 0, halt, halt}};

void reset(void) {
    const uint32_t *from = data_load;
    uint32_t *to;
#if defined(__ARM_FP) && !defined(__SOFTFP__)
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
    __asm volatile("dsb\nisb");
#endif
    for (to = data_begin; to < data_end; to++, from++) {
        *to = *from;
    }
    for (to = bss_begin; to < bss_end; to++) {
        *to = 0;
    }
    initialise_monitor_handles();
    exit(main());
}

/* newlib calls these; there are no constructors. */
void _init(void);
void _fini(void);
void _init(void) {}
void _fini(void) {}
