// The second thread of a stepper: does what it is given, once, and returns what went wrong.
#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "tissue/side_thread.hpp"

namespace trocar {
namespace {

TEST(SideThread, DoesEachWorkOnceInAnotherThread) {
    SideThread side;
    int done = 0;
    std::thread::id where;
    const auto work = [&] {
        ++done;
        where = std::this_thread::get_id();
    };
    for (int n = 1; n <= 2000; ++n) {
        if (n % 3 != 0) side.rouse();
        if (n % 100 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // long enough to fall asleep
        side.start(work);
        side.join();
        ASSERT_EQ(done, n);
    }
    EXPECT_NE(where, std::this_thread::get_id());
}

TEST(SideThread, IsWaitedForHoweverLongTheWorkTakes) {
    SideThread side;
    bool done = false;
    const auto work = [&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        done = true;
    };
    side.start(work);
    side.join();
    EXPECT_TRUE(done);
}

TEST(SideThread, ThrowsWhatTheWorkHasThrownAndGoesOn) {
    SideThread side;
    const auto fails = [] { throw std::runtime_error("no more"); };
    bool done = false;
    const auto works = [&] { done = true; };
    side.start(fails);
    EXPECT_THROW(side.join(), std::runtime_error);
    side.start(works);
    EXPECT_NO_THROW(side.join());
    EXPECT_TRUE(done);
}

TEST(SideThread, RunsWorkBesideWhatIsDoneMeanwhileAndLeavesWhenBothHaveEnded) {
    SideThread side;
    bool worked = false;
    bool done = false;
    const auto works = [&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        worked = true;
    };
    side.run(works, [&] { done = true; });
    EXPECT_TRUE(worked && done);
    // What is thrown here waits for the work as well, and comes before what the work throws.
    worked = false;
    EXPECT_THROW(side.run(works, [] { throw std::invalid_argument("here"); }), std::invalid_argument);
    EXPECT_TRUE(worked);
    const auto fails = [] { throw std::runtime_error("there"); };
    EXPECT_THROW(side.run(fails, [] { throw std::invalid_argument("here"); }), std::invalid_argument);
    EXPECT_THROW(side.run(fails, [] {}), std::runtime_error);
    worked = false;
    EXPECT_NO_THROW(side.run(works, [] {})) << "nothing of before is left";
    EXPECT_TRUE(worked);
}

TEST(SideThread, EndsWithoutWork) {
    SideThread never_asked;
    SideThread roused;
    roused.rouse();
    SideThread worked;
    const auto work = [] {};
    worked.start(work);
    worked.join();
    worked.rouse();
}

TEST(SideThread, EndsAfterTheWorkThatNobodyWaitsFor) {
    bool done = false;
    const auto work = [&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        done = true;
    };
    {
        SideThread side;
        side.start(work);
    }
    EXPECT_TRUE(done);
}

}  // namespace
}  // namespace trocar
