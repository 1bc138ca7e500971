/* What Rust's standard library calls and Debian 12's C library for WebAssembly lacks; newer releases
   of that library have all of it. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* There is one thread: the program asks how many there are before it starts others. As in newer
   libraries, none can be started. */
int pthread_attr_init(void *attributes) { return 0; }
int pthread_attr_setstacksize(void *attributes, size_t size) { return 0; }
int pthread_attr_destroy(void *attributes) { return 0; }
int pthread_create(void *thread, const void *attributes, void *(*start)(void *), void *given) {
    return EAGAIN;
}
int pthread_join(void *thread, void **result) { return EINVAL; }
int pthread_detach(void *thread) { return EINVAL; }

/* The folder that the page gives the program holds no links, so that a path to a file is real as
   soon as its `.` and `..` are taken out. */
char *realpath(const char *restrict path, char *restrict resolved) {
    struct stat there;
    size_t length = strlen(path), end = 0;
    char *real = resolved ? resolved : malloc(length + 2);
    if (real == NULL || stat(path, &there) != 0)
        return NULL;
    for (const char *step = path; *step != '\0';) {
        size_t size = strcspn(step, "/");
        if (size == 2 && strncmp(step, "..", 2) == 0) {
            while (end > 0 && real[--end] != '/') {
            }
        } else if (size > 0 && !(size == 1 && *step == '.')) {
            real[end++] = '/';
            memcpy(real + end, step, size);
            end += size;
        }
        step += size;
        step += strspn(step, "/");
    }
    if (end == 0)
        real[end++] = '/';
    real[end] = '\0';
    return real;
}
