#include "reference/closest_points.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {

Vector3 closest_weights(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
    // Regions of the plane by signs of dot products (Ericson 2005, Real-Time Collision Detection, 5.1.5).
    const Vector3 ab = b - a;
    const Vector3 ac = c - a;
    const Vector3 ap = p - a;
    const double d1 = ab.dot(ap);
    const double d2 = ac.dot(ap);
    if (d1 <= 0.0 && d2 <= 0.0) return {1.0, 0.0, 0.0};
    const Vector3 bp = p - b;
    const double d3 = ab.dot(bp);
    const double d4 = ac.dot(bp);
    if (d3 >= 0.0 && d4 <= d3) return {0.0, 1.0, 0.0};
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3) {
        const double v = d1 / (d1 - d3);
        return {1.0 - v, v, 0.0};
    }
    const Vector3 cp = p - c;
    const double d5 = ab.dot(cp);
    const double d6 = ac.dot(cp);
    if (d6 >= 0.0 && d5 <= d6) return {0.0, 0.0, 1.0};
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6) {
        const double w = d2 / (d2 - d6);
        return {1.0 - w, 0.0, w};
    }
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 && (d4 - d3) + (d5 - d6) > 0.0) {
        const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {0.0, 1.0 - w, w};
    }
    const double sum = va + vb + vc;
    if (!(sum > 0.0)) return {1.0, 0.0, 0.0};
    return {va / sum, vb / sum, vc / sum};
}

std::array<double, 2> closest_places(const Vector3& a0, const Vector3& a1, const Vector3& b0, const Vector3& b1) {
    // Ericson 2005, 5.1.9.
    const Vector3 d1 = a1 - a0;
    const Vector3 d2 = b1 - b0;
    const Vector3 r = a0 - b0;
    const double a = d1.squaredNorm();
    const double e = d2.squaredNorm();
    const double f = d2.dot(r);
    if (a == 0.0 && e == 0.0) return {0.0, 0.0};
    if (a == 0.0) return {0.0, std::clamp(f / e, 0.0, 1.0)};
    const double c = d1.dot(r);
    if (e == 0.0) return {std::clamp(-c / a, 0.0, 1.0), 0.0};
    const double b = d1.dot(d2);
    const double denominator = a * e - b * b;
    double s = denominator > 0.0 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
    double t = (b * s + f) / e;
    if (t < 0.0) {
        t = 0.0;
        s = std::clamp(-c / a, 0.0, 1.0);
    } else if (t > 1.0) {
        t = 1.0;
        s = std::clamp((b - c) / a, 0.0, 1.0);
    }
    return {s, t};
}

FeatureDistance distance_of(const FeaturePair& pair, const std::array<Vector3, 4>& points) {
    FeatureDistance result;
    if (pair.kind == FeaturePair::Kind::vertex_face) {
        const Vector3 w = closest_weights(points[0], points[1], points[2], points[3]);
        result.weight = {1.0, -w[0], -w[1], -w[2]};
    } else {
        const auto [s, t] = closest_places(points[0], points[1], points[2], points[3]);
        result.weight = {1.0 - s, s, -(1.0 - t), -t};
    }
    Vector3 across = Vector3::Zero();
    for (std::size_t i = 0; i < 4; ++i) across += result.weight[i] * points[i];
    result.distance = across.norm();
    if (result.distance > 0.0) result.normal = across / result.distance;
    return result;
}

double safe_part_of_motion(const FeaturePair& pair, const std::array<Vector3, 4>& points,
                           const std::array<Vector3, 4>& motion) {
    const std::size_t split = pair.kind == FeaturePair::Kind::vertex_face ? 1 : 2;
    const Vector3 mean = 0.25 * (motion[0] + motion[1] + motion[2] + motion[3]);
    std::array<double, 2> longest{0.0, 0.0};
    for (std::size_t i = 0; i < 4; ++i) {
        double& side = longest.at(i < split ? 0 : 1);
        side = std::max(side, (motion[i] - mean).norm());
    }
    const double closing = longest[0] + longest[1];
    if (closing == 0.0) return 1.0;
    const double first = distance_of(pair, points).distance;
    if (closing < 0.9 * first) return 1.0;
    constexpr double margin = 0.1;
    double done = 0.0;
    double part = (1.0 - margin) * first / closing;
    constexpr int most_advances = 200;
    for (int advance = 0; advance < most_advances; ++advance) {
        std::array<Vector3, 4> moved = points;
        for (std::size_t i = 0; i < 4; ++i) moved[i] += (done + part) * motion[i];
        const double distance = distance_of(pair, moved).distance;
        if (done > 0.0 && distance < margin * first) break;
        done += part;
        if (done >= 1.0) return 1.0;
        part = 0.9 * (distance - margin * first * 0.5) / closing;
        if (!(part > 1e-6)) break;
    }
    return done;
}

}  // namespace trocar
