// A library to preload (LD_PRELOAD) that counts a thread's allocations: who does not count has the
// C library's own.
#include <cerrno>
#include <cstddef>
#include <cstdint>

namespace {
// Found without allocating, whenever the first thread asks.
__attribute__((tls_model("initial-exec"))) thread_local int64_t allocations = 0;
}  // namespace

extern "C" {

void* __libc_malloc(size_t size);
void* __libc_calloc(size_t number, size_t size);
void* __libc_realloc(void* memory, size_t size);
void* __libc_memalign(size_t alignment, size_t size);

int64_t poise_allocations() { return allocations; }

void* malloc(size_t size) noexcept {
  ++allocations;
  return __libc_malloc(size);
}
void* calloc(size_t number, size_t size) noexcept {
  ++allocations;
  return __libc_calloc(number, size);
}
void* realloc(void* memory, size_t size) noexcept {
  ++allocations;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(size_t alignment, size_t size) noexcept {
  ++allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, size_t alignment, size_t size) noexcept {
  ++allocations;
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}

}  // extern "C"
