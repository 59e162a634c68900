// Counts the heap allocations of the process.
#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/framework/toy_components.h"

namespace {
std::atomic<int64_t> allocations{0};
}

void* operator new(size_t size, const std::nothrow_t&) noexcept {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return std::malloc(size == 0 ? 1 : size);
}
void* operator new(size_t size) {
  if (void* memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }

namespace poise {

int64_t AllocationCount() { return allocations.load(std::memory_order_relaxed); }

}  // namespace poise
