#include "view/pack.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <random>

#include "support/base64.hpp"

namespace trocar {
namespace {

Matrix3X random_positions(Index count, std::mt19937& random, const Vector3& low, const Vector3& high) {
    std::uniform_real_distribution<double> part(0.0, 1.0);
    Matrix3X positions(3, count);
    for (Index i = 0; i < count; ++i) {
        for (int axis = 0; axis < 3; ++axis) positions(axis, i) = low[axis] + part(random) * (high[axis] - low[axis]);
    }
    return positions;
}

std::uint16_t unzigzag(std::uint16_t number) {
    return static_cast<std::uint16_t>((number >> 1U) ^ ((number & 1U) != 0 ? 0xffffU : 0U));
}

/// Inverse of frame_bytes, as src/web/source/data.js has it.
std::vector<std::vector<std::uint16_t>> frames_of(std::string_view bytes, const std::vector<std::uint16_t>& rest) {
    const std::size_t size = rest.size();
    const std::size_t high = bytes.size() / 2;
    std::vector<std::vector<std::uint16_t>> frames;
    std::vector<std::uint16_t> last = rest;
    for (std::size_t at = 0; at < high;) {
        std::uint16_t change = 0;
        for (std::size_t i = 0; i < size; ++i, ++at) {
            if (i % (size / 3) == 0) change = 0;
            const auto low_byte = static_cast<unsigned char>(bytes[at]);
            const auto high_byte = static_cast<unsigned char>(bytes[high + at]);
            change =
                static_cast<std::uint16_t>(change + unzigzag(static_cast<std::uint16_t>(low_byte | high_byte << 8U)));
            last[i] = static_cast<std::uint16_t>(last[i] + change);
        }
        frames.push_back(last);
    }
    return frames;
}

TEST(Quantiser, ACoordinateComesBackToHalfAStep) {
    std::mt19937 random(7);
    const Vector3 low(-0.3, 0.01, -2.0);
    const Vector3 high(0.1, 0.02, 5.0);
    const Quantiser quantiser(low, high);
    const Matrix3X positions = random_positions(2000, random, low, high);
    for (Index i = 0; i < static_cast<Index>(positions.cols()); ++i) {
        EXPECT_TRUE(quantiser.holds(positions.col(i)));
        for (int axis = 0; axis < 3; ++axis) {
            const double back = quantiser.coordinate(quantiser.number(positions(axis, i), axis), axis);
            EXPECT_LE(std::abs(back - positions(axis, i)), 0.5000001 * (high[axis] - low[axis]) / Quantiser::largest);
        }
    }
}

TEST(Quantiser, WhatLiesOutsideIsPutOnTheBorderAndReported) {
    const Quantiser quantiser(Vector3(0, 0, 0), Vector3(1, 1, 0));
    EXPECT_DOUBLE_EQ(quantiser.coordinate(quantiser.number(7.0, 0), 0), 1.0);
    EXPECT_DOUBLE_EQ(quantiser.coordinate(quantiser.number(-1e30, 1), 1), 0.0);
    EXPECT_FALSE(quantiser.holds(Vector3(0.5, 1.1, 0.0)));
    EXPECT_TRUE(quantiser.holds(Vector3(0.5, 1.0, 0.0))) << "a flat scene has a box too";
    // Half a step beyond the border is rounded to it and loses no more than within.
    for (const double beyond : {0.45, 0.55}) {
        const Vector3 by = beyond * quantiser.step().x() * Vector3::UnitX();
        EXPECT_EQ(quantiser.holds(Vector3(0.0, 0.5, 0.0) - by), beyond < 0.5) << beyond;
        EXPECT_EQ(quantiser.holds(Vector3(1.0, 0.5, 0.0) + by), beyond < 0.5) << beyond;
    }
}

TEST(Frames, ComeBackAsTheyWere) {
    std::mt19937 random(3);
    const Quantiser quantiser(Vector3(-1, -1, -1), Vector3(1, 1, 1));
    const auto frame = [&] {
        return quantised(random_positions(37, random, Vector3(-1, -1, -1), Vector3(1, 1, 1)), quantiser);
    };
    const std::vector<std::uint16_t> rest = frame();
    std::vector<std::vector<std::uint16_t>> frames{rest};
    for (int i = 0; i < 20; ++i) frames.push_back(frame());
    frames.push_back(std::vector<std::uint16_t>(rest.size(), 65535));
    frames.push_back(std::vector<std::uint16_t>(rest.size(), 0));
    EXPECT_EQ(frames_of(frame_bytes(frames, rest), rest), frames);
}

TEST(Frames, OneThatDoesNotChangeCostsNothing) {
    const std::vector<std::uint16_t> rest(3000, 777);
    const std::vector<std::vector<std::uint16_t>> frames(100, rest);
    EXPECT_EQ(frame_bytes(frames, rest), std::string(600000, '\0'));
    EXPECT_LT(deflated(frame_bytes(frames, rest)).size(), 1000U);
}

TEST(Deflated, ZlibGivesTheBytesBack) {
    for (const std::size_t size : {0U, 1U, 2U, 3U, 1000U}) {
        std::string bytes;
        for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(i * i % 251);
        const std::string packed = test::from_base64(deflated(bytes));
        std::string back(size + 1, '\0');
        uLongf length = back.size();
        ASSERT_EQ(uncompress(reinterpret_cast<Bytef*>(back.data()), &length,
                             reinterpret_cast<const Bytef*>(packed.data()), packed.size()),
                  Z_OK);
        EXPECT_EQ(back.substr(0, length), bytes);
        EXPECT_EQ(deflated(bytes).size() % 4, 0U);
    }
}

}  // namespace
}  // namespace trocar
