#include "geometry/continuous_features.hpp"

#include <cmath>

namespace trocar::continuous {
namespace {

double size_of(const MovingPoint& p) { return std::max(p.start.cwiseAbs().maxCoeff(), p.end.cwiseAbs().maxCoeff()); }

void find_sizes(Features& f) {
    f.size_e = size_of(f.e);
    f.size_u = size_of(f.u);
    f.size_w = size_of(f.w);
}

void fill_coplanarity(Features& f) {
    find_sizes(f);
    const double largest = std::max({f.size_e, f.size_u, f.size_w});
    if (!(largest < 1e50 && largest > 1e-50) && largest > 0.0 && std::isfinite(largest)) {
        f.scale = std::ldexp(1.0, std::clamp(-std::ilogb(largest), -1000, 1000));
        for (MovingPoint* line : {&f.e, &f.u, &f.w}) *line = {line->start * f.scale, line->end * f.scale};
        find_sizes(f);
    }
    for (const double one : {f.size_e, f.size_u, f.size_w}) {
        if (one < 1e60 && one > 1e-60) continue;  // products neither over- nor underflow
        f.tolerance = -1.0;
        return;
    }
    const double size = f.size_e * f.size_u * f.size_w;
    // Errors in units of 2^-53: 1 for a difference, at most 12 u·w for entries of the normal and 64 e·u·w for dot
    // products.
    f.tolerance = 2e-14 * size;
    const Vector3 n0 = f.u.start.cross(f.w.start);
    const Vector3 n1 = 0.5 * (f.u.start.cross(f.w.end) + f.u.end.cross(f.w.start));
    const Vector3 n2 = f.u.end.cross(f.w.end);
    f.coplanarity = {f.e.start.dot(n0), (2.0 * f.e.start.dot(n1) + f.e.end.dot(n0)) / 3.0,
                     (f.e.start.dot(n2) + 2.0 * f.e.end.dot(n1)) / 3.0, f.e.end.dot(n2)};
}

}  // namespace

Features vertex_face_features(const MovingPoint& vertex, const MovingTriangle& face) {
    Features f{.points = {&vertex, &face[0], &face[1], &face[2]},
               .edges = false,
               .e = vertex - face[0],
               .u = face[1] - face[0],
               .w = face[2] - face[0]};
    fill_coplanarity(f);
    return f;
}

Features edge_edge_features(const MovingPoint& a, const MovingPoint& b, const MovingPoint& c, const MovingPoint& d) {
    Features f{.points = {&a, &b, &c, &d}, .edges = true, .e = c - a, .u = b - a, .w = d - c};
    fill_coplanarity(f);
    return f;
}

int meet_at(const Features& f, double time, double half) {
    const auto at = [time](const MovingPoint& p) -> Vector3 { return (1.0 - time) * p.start + time * p.end; };
    const Vector3 e = at(f.e);
    const Vector3 u = at(f.u);
    const Vector3 w = at(f.w);
    const Vector3 normal = u.cross(w);
    const double alpha = e.cross(w).dot(normal);  // these two times |normal|²
    const double beta = (f.edges ? e.cross(u) : u.cross(e)).dot(normal);
    const double one = normal.squaredNorm();
    // Sums of 12 products of four sizes with at most 200 roundings; no factor changes faster than twice its size.
    const double relative = 5e-14 + 100.0 * half;
    const double u_w = f.size_u * f.size_w;
    const double alpha_error = relative * f.size_e * f.size_w * u_w;
    const double beta_error = relative * f.size_e * f.size_u * u_w;
    const double one_error = relative * u_w * u_w;
    struct Bounded {
        double value;
        double error;
    };
    const std::array<Bounded, 4> conditions{
        {{alpha, alpha_error},
         {beta, beta_error},
         {f.edges ? one - alpha : one - alpha - beta, one_error + alpha_error + (f.edges ? 0.0 : beta_error)},
         {f.edges ? one - beta : one, one_error + (f.edges ? beta_error : 0.0)}}};
    int answer = 1;
    for (const Bounded& condition : conditions) {
        if (condition.value < -condition.error) return -1;
        if (!(condition.value > condition.error)) answer = 0;
    }
    return answer;
}

}  // namespace trocar::continuous
