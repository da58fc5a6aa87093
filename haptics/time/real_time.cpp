#include "haptics/time/real_time.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <exception>
#include <fstream>
#include <limits>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <thread>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

// Two threads, and a third one to compare with:
//
//   simulation (the caller)                     loop (SCHED_FIFO)
//   newest pose  <---- TripleBuffer ----------  handle's pose of each tick
//   step, condense
//   operator     ----- TripleBuffer --------->  newest operator, tick, force
//                                               record into memory made before

namespace amontons {
namespace {

constexpr long kWarmUp = 20;     // ticks before faults are counted
constexpr double kWatched = 1;   // how long the rate of steps is watched before it is reported [s]
constexpr double kSlow = 0.8;    // share of the requested steps below which it is reported
constexpr double kSlowest = 0.2; // period of a simulation that still counts as running [s]
constexpr std::size_t kStackTouched = 1 << 16; // bytes of the loop's stack, before the first tick
constexpr double kRampDown = SafetyOptions{}.ramp_down; // from any force to none at the end [s]

timespec to_timespec(double t)
{
    timespec out;
    out.tv_sec = static_cast<time_t>(std::floor(t));
    out.tv_nsec = static_cast<long>(1e9 * (t - std::floor(t)));
    return out;
}

double clock_now(clockid_t clock = CLOCK_MONOTONIC)
{
    timespec t;
    clock_gettime(clock, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Sleeps until that time on the monotonic clock, an absolute one: errors do not add up.
void sleep_until(double t)
{
    const timespec at = to_timespec(t);
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
    }
}

/// Of the calling thread. @returns "" or why not
std::string become_real_time(int priority)
{
    prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
    sched_param p{};
    p.sched_priority = priority;
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &p);
    return error == 0 ? "" : std::strerror(error);
}

/// Small numbers cost much and mean nothing here.
void flush_denormals()
{
#if defined(__SSE2__)
    _mm_setcsr(_mm_getcsr() | 0x8040u); // FTZ and DAZ
#endif
}

[[gnu::noinline]] void touch_stack()
{
    unsigned char stack[kStackTouched];
    volatile unsigned char* at = stack;
    for (std::size_t i = 0; i < kStackTouched; i += 1024)
        at[i] = 0;
}

/// By the kernel since it started, to make room for larger pieces; 0 where it does not count them.
long pages_moved()
{
    std::ifstream in("/proc/vmstat");
    std::string name;
    for (long count = 0; in >> name >> count;)
        if (name == "pgmigrate_success") return count;
    return 0;
}

/// Takes the last force away evenly: the run ends with none, whatever ended it.
template <class Real>
void fade_out(HapticLoop<Real>& loop, Device& device, double start, long tick, double period)
{
    const auto ticks = static_cast<long>(std::ceil(kRampDown / period));
    for (long k = 1; k <= ticks; ++k) {
        sleep_until(start + static_cast<double>(tick + k - 1) * period);
        const double left = static_cast<double>(ticks - k) / static_cast<double>(ticks - k + 1);
        device.write(loop.fade_out(left), clock_now() - start);
    }
}

struct PoseAtTime {
    HandPose handle;
    double time = 0;
};

/// Wake-ups of a thread that does nothing else.
void sleep_bare(double start, double period, long ticks, int priority, bool scheduler,
                const std::atomic<bool>& stop, std::vector<double>& wake, long& missed)
{
    if (scheduler) become_real_time(priority);
    for (long k = 0; k < ticks && !stop; ++k) {
        const double due = start + (static_cast<double>(k) + 0.5) * period; // between the loop's
        sleep_until(due);
        const double late = clock_now() - due;
        if (wake.size() < wake.capacity()) wake.push_back(late);
        if (late <= period) continue;
        ++missed;
        k += static_cast<long>(late / period);
    }
}

} // namespace

template <class Real>
RealTimeRun run_in_real_time(HapticLoop<Real>& loop, Device& device, int most_contacts,
                             const Publisher<Real>& publish, const RealTimeOptions& options)
{
    RealTimeRun run;
    const double period = options.period;
    const auto ticks = std::lround(options.duration / period);
    run.records.resize(static_cast<std::size_t>(ticks)); // written, so the pages are there

    // ---- Bare thread and first operator
    if (options.bare) {
        run.bare_wake.resize(static_cast<std::size_t>(ticks));
        run.bare_wake.clear();
    }
    TripleBuffer<ReducedOperator<Real>> operators{ReducedOperator<Real>(most_contacts)};
    TripleBuffer<PoseAtTime> poses;
    std::atomic<bool> done{false}, stopped{false}; // stopped: the simulation, for good
    std::atomic<long> ticked{0}, overloaded{0};
    std::atomic<std::size_t> recorded{0}; // records that the simulation's thread may read
    std::atomic<SafetyState> state{SafetyState::no_operator};
    SafetyState last_reported = SafetyState::no_operator;
    const auto report_state = [&] {
        const SafetyState now = state;
        if (now != last_reported && options.on_state) options.on_state(now);
        last_reported = now;
    };
    std::uint64_t sequence = 0;

    ++run.steps;
    if (publish(operators.back(), {}, 0, ++sequence))
        operators.publish();
    else
        ++run.failed_steps;

    // ---- Scheduler and memory
    if (options.scheduler) {
        // First all present pages, so that the loop's arrays have theirs even if they were not yet
        // written; what the simulation reserves later gets its own where it writes, not at once.
        if (options.own_process)
            malloc_trim(0); // addresses that the heap has reserved and not used are not locked
        run.locked = mlockall(MCL_CURRENT) == 0;
        mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT);
    }
    // Matrices that a step frees stay with the process: given back and fetched again, each of their
    // pages would fault, and be locked, in every step.
    if (options.own_process) {
        mallopt(M_MMAP_MAX, 0);
        mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
    }

    const long moved_before = pages_moved();
    const double start = clock_now() + 5 * period; // the threads are there by then
    std::string refusal;
    std::size_t count = 0;

    // ---- The loop's thread
    std::thread haptic([&] {
        if (options.scheduler) refusal = become_real_time(options.priority);
        flush_denormals();
        touch_stack();
        rusage before{}, after{};
        HandPose pose_seen;
        Wrench sent;
        long k = 0, last = -1;
        while (k < ticks && !(options.stop && *options.stop)) {
            const double due = start + static_cast<double>(k) * period;
            sleep_until(due);
            const double woke = clock_now(), time = woke - start;
            if (static_cast<long>(count) == kWarmUp) getrusage(RUSAGE_THREAD, &before);
            const double cpu = clock_now(CLOCK_THREAD_CPUTIME_ID);
            const DeviceSample sample = device.read(time);
            TickRecord& record = run.records[count];
            record = loop.tick(sample, operators, time, stopped);
            device.write(record.sent, time);
            sent = record.sent;
            state.store(record.state, std::memory_order_relaxed);
            if (sample.valid && !is_broken(sample.pose)) pose_seen = sample.pose;
            poses.back() = {loop.handle_of(pose_seen), time};
            poses.publish();
            if (options.advance) options.advance(k - last);
            const double end = clock_now();
            if (!record.proxy.converged && record.proxy.contacts > 0 &&
                end - woke >= options.budget)
                overloaded.fetch_add(1, std::memory_order_relaxed);
            ticked.fetch_add(1, std::memory_order_relaxed);
            record.wake = woke - due;
            record.compute = end - woke;
            record.cpu = clock_now(CLOCK_THREAD_CPUTIME_ID) - cpu;
            ++count;
            recorded.store(count, std::memory_order_release);
            last = k;
            // What is missed is missed: the next full period that lies ahead.
            k = std::max(k + 1, static_cast<long>(std::ceil((end - start) / period)));
        }
        getrusage(RUSAGE_THREAD, &after);
        if (static_cast<long>(count) > kWarmUp) {
            run.page_faults =
                after.ru_minflt - before.ru_minflt + after.ru_majflt - before.ru_majflt;
            run.waits = after.ru_nvcsw - before.ru_nvcsw;
            run.preempted = after.ru_nivcsw - before.ru_nivcsw;
        }
        done = true;
        if (!sent.force.isZero(0) || !sent.torque.isZero(0))
            fade_out(loop, device, start, k, period);
    });

    // ---- The bare thread, for the effect of the host
    std::thread bare;
    if (options.bare)
        bare = std::thread([&] {
            sleep_bare(start, period, ticks, options.priority, options.scheduler, done,
                       run.bare_wake, run.bare_missed);
        });

    // ---- The simulation, in this thread
    double next = start, published = start;
    PoseAtTime pose;
    bool has_pose = false, reported_slow = false;
    double watched_from = start;
    long watched_steps = 0;
    const auto watch_rate = [&] {
        const double now = clock_now(), requested = 1 / options.operator_period;
        if (now - watched_from < kWatched) return;
        run.step_rate = static_cast<double>(watched_steps) / (now - watched_from);
        if (run.step_rate < kSlow * requested && !reported_slow && options.on_slow) {
            options.on_slow(run.step_rate);
            reported_slow = true;
        }
        watched_from = now;
        watched_steps = 0;
    };
    while (!done) {
        sleep_until(std::min(next, start + options.duration + period));
        if (done) break;
        report_state();
        next = std::max(next + options.operator_period, clock_now());
        if (poses.fetch()) {
            pose = poses.front();
            has_pose = true;
        }
        if (!has_pose) continue; // the handle is where it was
        if (options.on_overload) {
            const long n = ticked.exchange(0), over = overloaded.exchange(0);
            options.on_overload(n > 0 ? static_cast<double>(over) / static_cast<double>(n) : 0);
        }
        if (options.on_ticks)
            options.on_ticks(
                std::span(run.records).first(recorded.load(std::memory_order_acquire)));
        if (stopped) continue; // the loop takes the force away, and reports it
        const double begin = clock_now();
        ++run.steps;
        bool published_now = false;
        try {
            published_now = publish(operators.back(), pose.handle, pose.time, ++sequence);
        } catch (const std::exception& error) {
            stopped = true;
            run.stopped = error.what();
        }
        if (published_now) {
            // A simulation slower than its set rate is not stale for that reason.
            const double now = clock_now();
            operators.back().period =
                std::max(operators.back().period, std::min(now - published, kSlowest));
            published = now;
            operators.publish();
        } else {
            ++run.failed_steps;
        }
        run.slowest_step = std::max(run.slowest_step, clock_now() - begin);
        ++watched_steps;
        watch_rate();
    }

    // ---- Records and what was refused
    haptic.join();
    report_state();
    if (bare.joinable()) bare.join();
    run.pages_moved = pages_moved() - moved_before;
    if (run.locked) munlockall();
    run.records.resize(count);

    run.fifo = options.scheduler && refusal.empty();
    if (!options.scheduler)
        run.scheduling = "SCHED_OTHER, as requested";
    else if (run.fifo)
        run.scheduling = "SCHED_FIFO " + std::to_string(options.priority);
    else
        run.scheduling = "SCHED_OTHER: SCHED_FIFO refused (" + refusal +
                         "); allow it by ulimit -r, /etc/security/limits.d (rtprio 95) or "
                         "setcap cap_sys_nice,cap_ipc_lock+ep";
    if (options.scheduler)
        run.scheduling += run.locked ? ", memory locked"
                                     : ", memory not locked (ulimit -l, or memlock unlimited)";
    return run;
}

template RealTimeRun run_in_real_time(HapticLoop<float>&, Device&, int, const Publisher<float>&,
                                      const RealTimeOptions&);
template RealTimeRun run_in_real_time(HapticLoop<double>&, Device&, int, const Publisher<double>&,
                                      const RealTimeOptions&);

} // namespace amontons
