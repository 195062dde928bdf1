// Triangle pairs for tests: the data's files, and families of our own for machines without the data, all with corners
// on small grids or built so that the hard cases are frequent.
#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "geometry/exact.hpp"
#include "support/random_vectors.hpp"

namespace trocar::test {

struct TrianglePairCase {
    Corners first;
    Corners second;
};

struct KnownPair : TrianglePairCase {
    int truth = -1;
    std::string pair_class;
};

inline std::vector<KnownPair> read_pairs(const std::filesystem::path& file) {
    std::vector<KnownPair> pairs;
    std::ifstream stream(file);
    std::string line;
    while (std::getline(stream, line)) {
        std::istringstream words(line);
        KnownPair pair;
        for (Corners* t : {&pair.first, &pair.second}) {
            for (Vector3& corner : *t) {
                for (int i = 0; i < 3; ++i) {
                    std::string word;
                    words >> word;
                    corner[i] = std::strtod(word.c_str(), nullptr);
                }
            }
        }
        words >> pair.truth >> pair.pair_class;
        pairs.push_back(pair);
    }
    return pairs;
}

/// The files of the data.
inline const std::vector<const char*> data_families{"random", "lattice", "near_coplanar", "sliver",     "huge_offset",
                                                    "tiny",   "shared",  "coplanar",      "needle_ulp", "degenerate"};

/// Corners on the lattice {0, …, size-1}^3 times `step` plus `offset`.
inline TrianglePairCase lattice_pair(std::mt19937_64& random, int size, double step = 1.0, double offset = 0.0) {
    std::uniform_int_distribution<int> coordinate(0, size - 1);
    TrianglePairCase pair;
    for (Corners* t : {&pair.first, &pair.second}) {
        for (Vector3& corner : *t) corner = step * random_vector(coordinate, random) + Vector3::Constant(offset);
    }
    return pair;
}

/// Corners uniform in the unit cube.
inline TrianglePairCase random_pair(std::mt19937_64& random) {
    std::uniform_real_distribution<double> coordinate(0.0, 1.0);
    TrianglePairCase pair;
    for (Corners* t : {&pair.first, &pair.second}) {
        for (Vector3& corner : *t) corner = random_vector(coordinate, random);
    }
    return pair;
}

/// Moves every coordinate by -1, 0 or +1 rounding unit.
inline void jitter(std::mt19937_64& random, Corners& t) {
    std::uniform_int_distribution<int> path(-1, 1);
    for (Vector3& corner : t) {
        for (int i = 0; i < 3; ++i) {
            const int step = path(random);
            if (step != 0) corner[i] = std::nextafter(corner[i], step * HUGE_VAL);
        }
    }
}

/// Second triangle with corners that are combinations of the first's, in doubles: on its plane, edges or corners but
/// for rounding.
inline TrianglePairCase nearly_touching_pair(std::mt19937_64& random) {
    TrianglePairCase pair = random_pair(random);
    std::uniform_int_distribution<int> eighths(-2, 8);
    std::uniform_int_distribution<int> kind(0, 3);
    for (Vector3& corner : pair.second) {
        if (kind(random) == 0) continue;
        const double a = eighths(random) / 8.0;
        const double b = eighths(random) / 8.0;
        corner = pair.first[0] + a * (pair.first[1] - pair.first[0]) + b * (pair.first[2] - pair.first[0]);
    }
    if (kind(random) == 0) jitter(random, pair.second);
    return pair;
}

/// Of triangles that are segments or points.
inline TrianglePairCase without_area(std::mt19937_64& random, TrianglePairCase pair) {
    pair.first[2] = random() % 2 == 0 ? pair.first[1] : Vector3(0.5 * (pair.first[0] + pair.first[1]));
    if (random() % 3 == 0) pair.second = {pair.second[0], pair.second[0], pair.second[0]};
    return pair;
}

/// The six orders of three corners.
inline constexpr std::array<std::array<std::size_t, 3>, 6> corner_orders{
    {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
inline Corners reordered(const Corners& t, const std::array<std::size_t, 3>& order) {
    return {t[order[0]], t[order[1]], t[order[2]]};
}
inline Corners scaled(const Corners& t, double factor) {
    return {Vector3(t[0] * factor), Vector3(t[1] * factor), Vector3(t[2] * factor)};
}

}  // namespace trocar::test
