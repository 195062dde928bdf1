// Work in a forked child: its answer comes back whole, and whatever else becomes of it is reported.
#include "app/isolated_call.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <functional>
#include <stdexcept>
#include <string>

namespace trocar::app {
namespace {

TEST(IsolatedCall, GivesBackAllThatTheWorkReturns) {
    std::string large;  // more than a pipe holds
    for (int i = 0; i < 300'000; ++i) large += static_cast<char>(i % 251);
    for (const std::string& text : {std::string(), std::string("a\0b", 3), large}) {
        const IsolatedResult result = call_isolated([&text] { return text; }, 10.0);
        EXPECT_TRUE(result.outcome.ok()) << result.outcome.message;
        EXPECT_TRUE(result.bytes == text) << text.size() << " bytes";
    }
}

TEST(IsolatedCall, WhatInterruptedTheWorkSaysNothingOfItsAnswer) {
    const auto work = [] {
        errno = EINTR;  // as a call that a signal interrupted leaves it
        return std::string("answer");
    };
    const IsolatedResult result = call_isolated(work, 5.0);
    EXPECT_TRUE(result.outcome.ok()) << result.outcome.message;
    EXPECT_EQ(result.bytes, "answer");
}

TEST(IsolatedCall, ReportsHowTheWorkEndedThatGaveNoAnswer) {
    const auto ended = [](const std::function<std::string()>& work, OutcomeKind kind, double time_limit_s = 10.0) {
        const IsolatedResult result = call_isolated(work, time_limit_s);
        EXPECT_EQ(result.outcome.kind, kind) << result.outcome.message;
        EXPECT_EQ(result.bytes, "");
        return result.outcome.message;
    };
    EXPECT_EQ(ended([]() -> std::string { throw std::runtime_error("no"); }, OutcomeKind::crashed),
              "exit status 1 without an answer");
    EXPECT_EQ(ended([]() -> std::string { _exit(7); }, OutcomeKind::crashed), "exit status 7 without an answer");
    const auto dies = []() -> std::string {
        raise(SIGKILL);
        return "never";
    };
    EXPECT_EQ(ended(dies, OutcomeKind::crashed), "signal 9 (Killed)");
    const auto hangs = []() -> std::string {
        pause();
        return "never";
    };
    EXPECT_EQ(ended(hangs, OutcomeKind::timed_out, 0.1), "no answer within 0.1 s");
}

}  // namespace
}  // namespace trocar::app
