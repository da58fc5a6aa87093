#pragma once

#include <cstdlib>
#include <new>

// Counts what each thread takes from the heap, by the operators new of the whole test program and,
// with glibc, by its malloc, which Eigen calls: to be included by one of its files only. Sanitizers
// have a malloc of their own.

namespace amontons::test {
inline thread_local long allocations = 0;
}

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* p, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size)
{
    ++amontons::test::allocations;
    return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size)
{
    ++amontons::test::allocations;
    return __libc_calloc(number, size);
}
void* realloc(void* p, std::size_t size)
{
    ++amontons::test::allocations;
    return __libc_realloc(p, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size)
{
    ++amontons::test::allocations;
    return __libc_memalign(alignment, size);
}
}
#endif

void* operator new(std::size_t size)
{
    ++amontons::test::allocations;
    if (void* p = std::malloc(size)) return p;
    throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment)
{
    ++amontons::test::allocations;
    const auto a = static_cast<std::size_t>(alignment);
    if (void* p = std::aligned_alloc(a, (size + a - 1) / a * a)) return p;
    throw std::bad_alloc();
}
void operator delete(void* p) noexcept
{
    std::free(p);
}
void operator delete(void* p, std::size_t) noexcept
{
    std::free(p);
}
void operator delete(void* p, std::align_val_t) noexcept
{
    std::free(p);
}
void operator delete(void* p, std::size_t, std::align_val_t) noexcept
{
    std::free(p);
}
