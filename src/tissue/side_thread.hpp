// A second thread that runs work of a stepper in parallel, started and joined within a tick.
#pragma once

#include <atomic>
#include <exception>
#include <thread>

namespace trocar {

class SideThread {
public:
    SideThread();
    /// Waits for unfinished work.
    ~SideThread();
    SideThread(const SideThread&) = delete;
    SideThread& operator=(const SideThread&) = delete;
    SideThread(SideThread&&) = delete;
    SideThread& operator=(SideThread&&) = delete;

    /// Announces work. The thread then spins for a while, because waking it can take longer than the work.
    void rouse();
    /// Calls work() in the thread. `work` has to live until `join`, which must precede the next call.
    template <typename Work>
    void start(const Work& work) {
        begin([](const void* what) { (*static_cast<const Work*>(what))(); }, &work);
    }
    /// Waits until the work is done and rethrows its exception.
    void join();
    /// Calls work() in the thread and meanwhile() in the caller, and waits for both. Rethrows an exception of either;
    /// `meanwhile` takes precedence.
    template <typename Work, typename Meanwhile>
    void run(const Work& work, const Meanwhile& meanwhile) {
        start(work);
        try {
            meanwhile();
        } catch (...) {
            finish();
            throw;
        }
        join();
    }

private:
    enum class State { idle, roused, working, done, over };
    void begin(void (*act)(const void*), const void* what);
    std::exception_ptr finish();
    void serve();
    void change(State to);
    void spin_while(State now) const;

    std::atomic<State> state_ = State::idle;
    void (*act_)(const void*) = nullptr;
    const void* what_ = nullptr;
    std::exception_ptr thrown_;
    std::thread thread_;
};

}  // namespace trocar
