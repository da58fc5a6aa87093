#pragma once

#include <dlfcn.h>
#include <pthread.h>

// Counts the locks that each thread takes, also uncontended ones, for which no system
// call shows, by the functions of the whole test program that std::mutex and its kind call: to be
// included by one of its files only. Sanitizers have their own there.

namespace amontons::test {

inline thread_local long locks = 0;

template <class Lock> int count_lock(const char* name, Lock* lock)
{
    ++locks;
    const auto real = reinterpret_cast<int (*)(Lock*)>(::dlsym(RTLD_NEXT, name));
    return real(lock);
}

} // namespace amontons::test

extern "C" {
int pthread_mutex_lock(pthread_mutex_t* m) noexcept
{
    return amontons::test::count_lock("pthread_mutex_lock", m);
}
int pthread_mutex_trylock(pthread_mutex_t* m) noexcept
{
    return amontons::test::count_lock("pthread_mutex_trylock", m);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* m) noexcept
{
    return amontons::test::count_lock("pthread_rwlock_rdlock", m);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* m) noexcept
{
    return amontons::test::count_lock("pthread_rwlock_wrlock", m);
}
int pthread_spin_lock(pthread_spinlock_t* m) noexcept
{
    return amontons::test::count_lock("pthread_spin_lock", m);
}
}
