#include "tissue/side_thread.hpp"

#include <hwy/cache_control.h>

#include <utility>

namespace trocar {

SideThread::SideThread() : thread_([this] { serve(); }) {}

SideThread::~SideThread() {
    spin_while(State::working);
    change(State::over);
    thread_.join();
}

void SideThread::rouse() {
    State idle = State::idle;
    if (state_.compare_exchange_strong(idle, State::roused)) state_.notify_one();
}

void SideThread::begin(void (*act)(const void*), const void* what) {
    act_ = act;
    what_ = what;
    change(State::working);
}

void SideThread::join() {
    if (const std::exception_ptr thrown = finish()) std::rethrow_exception(thrown);
}

/// Waits until the work is done. Returns its exception, if any.
std::exception_ptr SideThread::finish() {
    spin_while(State::working);
    state_.store(State::idle);
    return std::exchange(thrown_, nullptr);
}

void SideThread::serve() {
    for (State now = state_.load(); now != State::over; now = state_.load()) {
        if (now == State::roused) {
            spin_while(now);
        } else if (now != State::working) {
            state_.wait(now);
        } else {
            try {
                act_(what_);
            } catch (...) {
                thrown_ = std::current_exception();
            }
            change(State::done);
        }
    }
}

void SideThread::change(State to) {
    state_.store(to);
    state_.notify_one();
}

/// Spins for a while, then blocks: a machine with a single processor has to run the other thread.
void SideThread::spin_while(State now) const {
    constexpr int polls = 4000;
    for (int n = 0; n < polls; ++n) {
        if (state_.load() != now) return;
        hwy::Pause();
    }
    state_.wait(now);
}

}  // namespace trocar
