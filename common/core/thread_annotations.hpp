// Clang's thread safety annotations. With other compilers they are empty.
#pragma once

#if defined(__clang__)
#define OSTEON_THREAD_ANNOTATION(attribute) __attribute__((attribute))
#else
#define OSTEON_THREAD_ANNOTATION(attribute)
#endif

// Of a class: its objects are locks, or hold a lock while they live.
#define OSTEON_CAPABILITY(name) OSTEON_THREAD_ANNOTATION(capability(name))
#define OSTEON_SCOPED_CAPABILITY OSTEON_THREAD_ANNOTATION(scoped_lockable)

// Of a member: who reads or writes it, or what it points to, holds the lock.
#define OSTEON_GUARDED_BY(lock) OSTEON_THREAD_ANNOTATION(guarded_by(lock))
#define OSTEON_PT_GUARDED_BY(lock) OSTEON_THREAD_ANNOTATION(pt_guarded_by(lock))

// Of a function: its caller holds the lock (alone or among readers), or must not hold it.
#define OSTEON_REQUIRES(...) OSTEON_THREAD_ANNOTATION(requires_capability(__VA_ARGS__))
#define OSTEON_REQUIRES_SHARED(...) OSTEON_THREAD_ANNOTATION(requires_shared_capability(__VA_ARGS__))
#define OSTEON_EXCLUDES(...) OSTEON_THREAD_ANNOTATION(locks_excluded(__VA_ARGS__))

// Of a function: it takes or releases the lock; without an argument, the lock is the object itself.
#define OSTEON_ACQUIRE(...) OSTEON_THREAD_ANNOTATION(acquire_capability(__VA_ARGS__))
#define OSTEON_ACQUIRE_SHARED(...) OSTEON_THREAD_ANNOTATION(acquire_shared_capability(__VA_ARGS__))
#define OSTEON_TRY_ACQUIRE(...) OSTEON_THREAD_ANNOTATION(try_acquire_capability(__VA_ARGS__))
#define OSTEON_RELEASE(...) OSTEON_THREAD_ANNOTATION(release_capability(__VA_ARGS__))
#define OSTEON_RELEASE_SHARED(...) OSTEON_THREAD_ANNOTATION(release_shared_capability(__VA_ARGS__))

// Of a function: tells the analysis that the lock is held, or returns it, or is not analysed. The last needs a reason.
#define OSTEON_ASSERT_CAPABILITY(lock) OSTEON_THREAD_ANNOTATION(assert_capability(lock))
#define OSTEON_RETURN_CAPABILITY(lock) OSTEON_THREAD_ANNOTATION(lock_returned(lock))
#define OSTEON_NO_THREAD_SAFETY_ANALYSIS OSTEON_THREAD_ANNOTATION(no_thread_safety_analysis)
