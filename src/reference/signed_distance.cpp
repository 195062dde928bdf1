#include "reference/signed_distance.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "geometry/exact.hpp"
#include "reference/closest_points.hpp"

namespace trocar {
void SignedDistance::prepare(const Triangles& triangles, Range range, const Matrix3X& position) {
    range_ = range;
    tree_.prepare(triangles, range, position);
    if (range.count == 0) return;
    std::map<std::array<Index, 2>, std::array<Index, 2>> edge_owner;  // directed edge -> triangle, corner
    first_vertex_ = triangles.middleCols(range.first, range.count).minCoeff();
    const Index last_vertex = triangles.middleCols(range.first, range.count).maxCoeff();
    for (Index t = range.first; t < range.end(); ++t) {
        for (int c = 0; c < 3; ++c) edge_owner[{triangles(c, t), triangles((c + 1) % 3, t)}] = {t, c};
    }
    neighbour_.assign(at(range.count), {-1, -1, -1});
    on_rim_.assign(at(last_vertex - first_vertex_ + 1), 0);
    for (Index t = range.first; t < range.end(); ++t) {
        for (int c = 0; c < 3; ++c) {
            const Index a = triangles(c, t);
            const Index b = triangles((c + 1) % 3, t);
            const auto found = edge_owner.find({b, a});
            if (found != edge_owner.end()) {
                neighbour_[at(t - range.first)][static_cast<std::size_t>(c)] = found->second[0];
            } else {
                on_rim_[at(a - first_vertex_)] = 1;
                on_rim_[at(b - first_vertex_)] = 1;
            }
        }
    }
    refit(triangles, position);
}

void SignedDistance::refit(const Triangles& triangles, const Matrix3X& position) {
    tree_.refit(triangles, position);
    face_normal_.resize(3, range_.count);
    vertex_normal_.setZero(3, static_cast<Eigen::Index>(on_rim_.size()));
    for (Index t = range_.first; t < range_.end(); ++t) {
        const auto corner = triangles.col(t);
        const Vector3 normal = area_normal(corners_of(triangles, position, t)).normalized();
        face_normal_.col(t - range_.first) = normal;
        for (int c = 0; c < 3; ++c) {
            const Vector3 u = position.col(corner[(c + 1) % 3]) - position.col(corner[c]);
            const Vector3 v = position.col(corner[(c + 2) % 3]) - position.col(corner[c]);
            const double angle = std::atan2(u.cross(v).norm(), u.dot(v));
            vertex_normal_.col(corner[c] - first_vertex_) += angle * normal;
        }
    }
}

SurfacePoint SignedDistance::nearest(const Triangles& triangles, const Matrix3X& position, const Vector3& p) const {
    SurfacePoint best;
    double best_square = std::numeric_limits<double>::infinity();
    tree_.visit_near(p, [&](Index t) {
        const auto [a, b, c] = corners_of(triangles, position, t);
        const Vector3 w = closest_weights(p, a, b, c);
        const double square = (p - w[0] * a - w[1] * b - w[2] * c).squaredNorm();
        if (square < best_square) {
            best_square = square;
            best.triangle = t;
            best.weights = w;
        }
        return best_square;
    });
    if (best.triangle < 0) return best;
    const auto corner = triangles.col(best.triangle);
    const auto& w = best.weights;
    const Index local = best.triangle - range_.first;
    Vector3 pseudonormal = face_normal_.col(local);
    for (int c = 0; c < 3; ++c) {
        if (w[c] == 1.0) {
            pseudonormal = vertex_normal_.col(corner[c] - first_vertex_);
            best.beyond_rim = on_rim_[at(corner[c] - first_vertex_)] != 0;
        } else if (w[c] == 0.0 && w[(c + 1) % 3] < 1.0 && w[(c + 2) % 3] < 1.0) {
            // On the edge from corner c + 1 to corner c + 2.
            const Index other = neighbour_[at(local)][static_cast<std::size_t>((c + 1) % 3)];
            if (other < 0) {
                best.beyond_rim = true;
            } else {
                pseudonormal += face_normal_.col(other - range_.first);
            }
        }
    }
    const Vector3 foot =
        w[0] * position.col(corner[0]) + w[1] * position.col(corner[1]) + w[2] * position.col(corner[2]);
    const Vector3 off = p - foot;
    const double sign = off.dot(pseudonormal) >= 0.0 ? 1.0 : -1.0;
    const double distance = std::sqrt(best_square);
    best.signed_distance = sign * distance;
    best.normal = distance > 1e-12 ? Vector3(sign / distance * off) : Vector3(pseudonormal.normalized());
    return best;
}

}  // namespace trocar
