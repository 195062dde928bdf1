// Triangle pairs in the lanes of a batch.
#pragma once

#include "detect/triangle_filter.hpp"
#include "geometry/triangle_families.hpp"

namespace trocar::test {

inline void put(const TrianglePairCase& pair, std::size_t lane, TriangleBatch& batch) {
    const auto difference = [lane](const Vector3& to, const Vector3& from, TriangleBatch::Lanes& lanes) {
        for (std::size_t k = 0; k < 3; ++k) {
            const auto axis = static_cast<Eigen::Index>(k);
            lanes[k][lane] = static_cast<float>(to[axis] - from[axis]);
        }
    };
    difference(pair.first[1], pair.first[0], batch.u1);
    difference(pair.first[2], pair.first[0], batch.v1);
    difference(pair.second[1], pair.second[0], batch.u2);
    difference(pair.second[2], pair.second[0], batch.v2);
    difference(pair.first[0], pair.second[0], batch.w);
}

}  // namespace trocar::test
