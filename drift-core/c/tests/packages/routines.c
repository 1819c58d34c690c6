/* What a compiler may call and a C library would bring. */
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif
void *memcpy(void *to, const void *from, size_t bytes);
void *memset(void *to, int with, size_t bytes);
#ifdef __cplusplus
}
#endif

void *memcpy(void *to, const void *from, size_t bytes) {
    /* volatile: else the compiler turns the loop into a call of memcpy. */
    volatile unsigned char *into = (unsigned char *)to;
    const unsigned char *of = (const unsigned char *)from;
    while (bytes-- > 0u) *into++ = *of++;
    return to;
}

void *memset(void *to, int with, size_t bytes) {
    volatile unsigned char *into = (unsigned char *)to;
    while (bytes-- > 0u) *into++ = (unsigned char)with;
    return to;
}
