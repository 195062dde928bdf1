#include "geometry/random.hpp"

#include <gtest/gtest.h>

namespace trocar {
namespace {

TEST(Random, GivesThePublishedValuesOfSplitmix64) {
    // From the task "Pseudo-random numbers/Splitmix64" of Rosetta Code.
    Random random(1234567);
    for (const std::uint64_t value : {6457827717110365317ULL, 3203168211198807973ULL, 9817491932198370423ULL,
                                      4593380528125082431ULL, 16408922859458223821ULL}) {
        EXPECT_EQ(random.next(), value);
    }
}

TEST(Random, DrawsAreMadeOfTheSameNumbers) {
    Random remainders(1234567);
    for (const std::size_t value : {7U, 3U, 3U, 1U, 1U}) EXPECT_EQ(remainders.below(10), value);
    Random signs(1234567);
    for (const double value : {-0.29984091595718376, -0.6527118066581747, 0.06441460812483846}) {
        EXPECT_EQ(signs.signed_unit(), value);
    }
}

TEST(Random, ShuffleSwapsFromTheLastEntryDown) {
    std::vector<int> numbers{0, 1, 2, 3, 4, 5};
    Random(1234567).shuffle(numbers);
    EXPECT_EQ(numbers, (std::vector<int>{0, 2, 1, 4, 5, 3}));
}

TEST(Random, FibonacciSlotIsTheHighestBitsOfTheProduct) {
    EXPECT_EQ(fibonacci_slot(1, 10), 0x278U);
    EXPECT_EQ(fibonacci_slot(2, 10), 0x0F1U);
    EXPECT_EQ(fibonacci_slot(0x100000001ULL, 16), 0x1D81U);
}

}  // namespace
}  // namespace trocar
