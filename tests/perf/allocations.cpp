#include "tests/perf/allocations.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <malloc.h>
#include <new>

namespace ecaudit::perf {
namespace {

std::atomic<std::uint64_t> count{0};
std::atomic<std::int64_t> live{0};
std::atomic<std::int64_t> peak{0};

void* Take(std::size_t size, std::size_t alignment) {
  size = std::max<std::size_t>(size, 1);
  void* memory = alignment <= alignof(std::max_align_t)
                     ? std::malloc(size)
                     : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) std::abort();
  ++count;
  const std::int64_t now = live += static_cast<std::int64_t>(malloc_usable_size(memory));
  if (now > peak) peak = now;
  return memory;
}

void GiveBack(void* memory) {
  if (memory != nullptr) live -= static_cast<std::int64_t>(malloc_usable_size(memory));
  std::free(memory);
}

}  // namespace

Allocations CountedAllocations() {
  return {count, live, peak};
}

void ForgetPeak() {
  peak = live.load();
}

}  // namespace ecaudit::perf

// All forms: the library lets the others end in the first, but sanitizers have each of their own.
void* operator new(std::size_t size) {
  return ecaudit::perf::Take(size, 1);
}
void* operator new[](std::size_t size) {
  return ecaudit::perf::Take(size, 1);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return ecaudit::perf::Take(size, 1);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return ecaudit::perf::Take(size, 1);
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return ecaudit::perf::Take(size, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return ecaudit::perf::Take(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  ecaudit::perf::GiveBack(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  ecaudit::perf::GiveBack(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  ecaudit::perf::GiveBack(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  ecaudit::perf::GiveBack(memory);
}
void operator delete[](void* memory) noexcept {
  ecaudit::perf::GiveBack(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  ecaudit::perf::GiveBack(memory);
}
void operator delete(void* memory, const std::nothrow_t&) noexcept {
  ecaudit::perf::GiveBack(memory);
}
void operator delete[](void* memory, const std::nothrow_t&) noexcept {
  ecaudit::perf::GiveBack(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept {
  ecaudit::perf::GiveBack(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  ecaudit::perf::GiveBack(memory);
}
