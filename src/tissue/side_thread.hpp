// A second thread for what a stepper can do beside the rest of a tick: started and waited for within it.
#pragma once

#include <atomic>
#include <exception>
#include <thread>

namespace trocar {

class SideThread {
public:
    SideThread();
    /// Waits for work that is still done.
    ~SideThread();
    SideThread(const SideThread&) = delete;
    SideThread& operator=(const SideThread&) = delete;
    SideThread(SideThread&&) = delete;
    SideThread& operator=(SideThread&&) = delete;

    /// There will be work soon: the thread waits for it awake for a while, since waking takes longer than much work.
    void rouse();
    /// Calls work() in the thread; `work` has to live until `join`, which comes before the next call.
    template <typename Work>
    void start(const Work& work) {
        begin([](const void* what) { (*static_cast<const Work*>(what))(); }, &work);
    }
    /// Waits until the work is done, and throws what it has thrown.
    void join();
    /// Calls work() in the thread and meanwhile() here; ends when both have ended, and throws what either has thrown,
    /// of both that of `meanwhile`.
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
    void wait_awake_while(State now) const;

    std::atomic<State> state_ = State::idle;
    void (*act_)(const void*) = nullptr;
    const void* what_ = nullptr;
    std::exception_ptr thrown_;
    std::thread thread_;
};

}  // namespace trocar
