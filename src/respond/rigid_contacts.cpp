#include "respond/rigid_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/crossing.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Weights of the point at which the line through `point` along `direction` meets the triangle's plane, not limited to
/// the triangle: the body is rigid, and a force along the line has the same moment and power anywhere on it.
LoadPoint rigid_point(const Topology& topology, const Matrix3X& position, Index triangle, const Vector3& point,
                      const Vector3& direction) {
    const equations::Corners c = corners_of(topology, position, triangle);
    const Vector3 normal = (c[1] - c[0]).cross(c[2] - c[0]);
    const double size = normal.squaredNorm();
    constexpr double least_sine = 1e-3;
    if (std::abs(direction.dot(normal)) <= least_sine * std::sqrt(size)) {
        return LoadPoint::in_triangle(topology, triangle, closest_point_on_triangle(c, point));
    }
    const Vector3 x = point - c[0] - (point - c[0]).dot(normal) / direction.dot(normal) * direction;
    const double w1 = x.cross(c[2] - c[0]).dot(normal) / size;
    const double w2 = (c[1] - c[0]).cross(x).dot(normal) / size;
    return LoadPoint::in_triangle(topology, triangle, Vector3(1.0 - w1 - w2, w1, w2));
}

}  // namespace

void RigidContacts::prepare(const Topology& topology) {
    pieces_.clear();
    curves_.clear();
    known_.assign(at(topology.vertex_count), 0);
    walk_ = 0;
}

bool RigidContacts::takes(const ThesisState& state, Index body_a, Index body_b) const {
    return state.settings.rigid_patch && state.kind(body_a) != BodyKind::tissue &&
           state.kind(body_b) != BodyKind::tissue;
}

void RigidContacts::add(const ThesisState& state, const Frame& frame, const Contact& contact) {
    const Topology& topology = *state.topology;
    const Crossing crossing = cross_triangles(corners_of(topology, frame.position, contact.a),
                                              corners_of(topology, frame.position, contact.b));
    if (crossing.kind != CrossingKind::crossing) return;
    Piece piece;
    piece.a = contact.a;
    piece.b = contact.b;
    piece.body_a = topology.body_of_triangle[at(contact.a)];
    piece.body_b = topology.body_of_triangle[at(contact.b)];
    for (std::size_t i = 0; i < 3; ++i) {
        piece.below_a[i] = crossing.first_depth[i] > 0.0;
        piece.below_b[i] = crossing.second_depth[i] > 0.0;
    }
    piece.from = crossing.ends[0].point;
    piece.to = crossing.ends[1].point;
    // Seen from where b is pushed to, the curve runs counter-clockwise along n_a x n_b.
    if (crossing.first_normal.cross(crossing.second_normal).dot(piece.to - piece.from) < 0.0) {
        std::swap(piece.from, piece.to);
    }
    piece.push = contact.normal;
    piece.depth = contact.depth;
    piece.curve = static_cast<Index>(pieces_.size());
    pieces_.push_back(piece);
}

Index RigidContacts::root(Index piece) {
    while (pieces_[at(piece)].curve != piece) {
        pieces_[at(piece)].curve = pieces_[at(pieces_[at(piece)].curve)].curve;
        piece = pieces_[at(piece)].curve;
    }
    return piece;
}

/// Pieces on a common triangle of the same two bodies hang together.
void RigidContacts::trace(const ThesisState& state, const Frame& frame) {
    by_triangle_.clear();
    for (std::size_t p = 0; p < pieces_.size(); ++p) {
        by_triangle_.emplace_back(pieces_[p].a, static_cast<Index>(p));
        by_triangle_.emplace_back(pieces_[p].b, static_cast<Index>(p));
    }
    std::sort(by_triangle_.begin(), by_triangle_.end());
    for (std::size_t i = 1; i < by_triangle_.size(); ++i) {
        if (by_triangle_[i].first != by_triangle_[i - 1].first) continue;
        const Index one = by_triangle_[i - 1].second;
        const Index two = by_triangle_[i].second;
        if (pieces_[at(one)].body_a != pieces_[at(two)].body_a || pieces_[at(one)].body_b != pieces_[at(two)].body_b) {
            continue;
        }
        pieces_[at(root(two))].curve = root(one);
    }
    curves_.clear();
    curve_of_root_.assign(pieces_.size(), -1);
    for (std::size_t p = 0; p < pieces_.size(); ++p) {
        Index& number = curve_of_root_[at(root(static_cast<Index>(p)))];
        if (number < 0) {
            number = static_cast<Index>(curves_.size());
            curves_.push_back({.body_a = pieces_[p].body_a, .body_b = pieces_[p].body_b});
        }
        Curve& curve = curves_[at(number)];
        const double length = (pieces_[p].to - pieces_[p].from).norm();
        curve.centre += 0.5 * length * (pieces_[p].from + pieces_[p].to);
        curve.length += length;
    }
    for (Curve& curve : curves_) curve.centre /= std::max(curve.length, std::numeric_limits<double>::min());
    for (std::size_t p = 0; p < pieces_.size(); ++p) {
        add_piece(state, frame, pieces_[p], curves_[at(curve_of_root_[at(root(static_cast<Index>(p)))])]);
    }
    constexpr double least_area = 1e-6;  // of a square as long as the curve
    for (Curve& curve : curves_) {
        curve.closed = curve.area.norm() > least_area * curve.length * curve.length;
        if (curve.closed) curve.normal = curve.area;
        push_out_of_the_closed_body(state, curve);
        curve.normal.normalize();
        if (curve.closed && !curve.ends_at_rim && state.settings.blended_normal) lean_with_the_surface(curve);
        curve.highest = -std::numeric_limits<double>::infinity();
        curve.lowest = std::numeric_limits<double>::infinity();
    }
    measure_depths(state, frame);
    pieces_.clear();
}

/// What a piece adds to its curve, whose centre is known.
void RigidContacts::add_piece(const ThesisState& state, const Frame& frame, const Piece& piece, Curve& curve) {
    const Vector3 from = piece.from - curve.centre;
    const Vector3 to = piece.to - curve.centre;
    const double length = (to - from).norm();
    curve.area += 0.5 * from.cross(to);
    curve.chord += to - from;
    curve.normal += length * piece.push;
    curve.radius = std::max({curve.radius, from.norm(), to.norm()});
    const Vector3 middle = 0.5 * (piece.from + piece.to);
    for (auto& [side, triangle] : {std::pair<Side&, Index>{curve.side_a, piece.a}, {curve.side_b, piece.b}}) {
        const Vector3 face = area_normal(*state.topology, frame.position, triangle).normalized();
        side.faces += length * face;
        if (!state.settings.blended_normal) {
            side.blended = side.faces;
            continue;
        }
        const Vector3 weights =
            closest_point_on_triangle(corners_of(*state.topology, frame.position, triangle), middle);
        side.blended += length * state.surface.blended_normal(*state.topology, frame.position, triangle, weights);
    }
    curve.depth = std::max(curve.depth, piece.depth);
}

/// Where one of the two bodies is open: its own normals do not tell where it belongs, the closed body's do. A curve
/// that ends at its rim has no area, or that of a bend, which points along the open body instead of out of the closed
/// one.
void RigidContacts::push_out_of_the_closed_body(const ThesisState& state, Curve& curve) {
    const std::vector<BodyRange>& bodies = state.topology->bodies;
    const bool a_is_closed = bodies[at(curve.body_a)].closed;
    if (a_is_closed == bodies[at(curve.body_b)].closed) return;
    const Vector3 outward = a_is_closed ? curve.side_a.blended : Vector3(-curve.side_b.blended);
    constexpr double rounding = 1e-6;
    if (outward.norm() <= rounding * curve.length) return;  // passes through opposite faces alike
    curve.ends_at_rim = curve.chord.norm() > rounding * curve.length;
    if (curve.ends_at_rim) {
        curve.normal = outward;
    } else if (curve.normal.dot(outward) < 0.0) {
        curve.normal = -curve.normal;
    }
}

/// The area vector of a curve on one face is that face's normal. It leans as the blended normals along the curve lean
/// against the faces' (a tip that slides over a ball is pushed from the ball's centre), most by the surface whose
/// normals agree along the curve: the flatter one is what the other stands in.
void RigidContacts::lean_with_the_surface(Curve& curve) {
    constexpr double rounding = 1e-12;
    const auto spread = [&](const Side& side) {
        return std::max(0.0, 1.0 - side.faces.norm() / curve.length) + rounding;
    };
    const double spread_a = spread(curve.side_a);
    const double spread_b = spread(curve.side_b);
    const double share_a = spread_b / (spread_a + spread_b);
    const Vector3 lean_a = (curve.side_a.blended - curve.side_a.faces) / curve.length;
    const Vector3 lean_b = (curve.side_b.faces - curve.side_b.blended) / curve.length;
    curve.normal = (curve.normal + share_a * lean_a + (1.0 - share_a) * lean_b).normalized();
}

void RigidContacts::measure_depths(const ThesisState& state, const Frame& frame) {
    for (std::size_t p = 0; p < pieces_.size(); ++p) {
        const Piece& piece = pieces_[p];
        Curve& curve = curves_[at(curve_of_root_[at(root(static_cast<Index>(p)))])];
        for (const Vector3& end : {piece.from, piece.to}) {
            const double height = curve.normal.dot(end - curve.centre);
            curve.highest = std::max(curve.highest, height);
            curve.lowest = std::min(curve.lowest, height);
        }
        const auto facing = [&](Index triangle) {
            return std::abs(area_normal(*state.topology, frame.position, triangle).normalized().dot(curve.normal));
        };
        const double facing_a = facing(piece.a);
        const double facing_b = facing(piece.b);
        if (curve.a < 0 || facing_a > curve.facing_a) {
            curve.a = piece.a;
            curve.facing_a = facing_a;
        }
        if (curve.b < 0 || facing_b > curve.facing_b) {
            curve.b = piece.b;
            curve.facing_b = facing_b;
        }
    }
    for (std::size_t c = 0; c < curves_.size(); ++c) {
        Curve& curve = curves_[c];
        if (!curve.closed && !curve.ends_at_rim) {
            curve.highest = curve.depth;
            curve.lowest = 0.0;
            continue;
        }
        for (const bool of_a : {true, false}) {
            ++walk_;
            inside_.clear();
            find_corners_inside(state, frame, static_cast<Index>(c), of_a);
            walk_inside(state, frame, curve, of_a);
        }
    }
}

/// Corners of the curve's triangles that are inside the other body.
void RigidContacts::find_corners_inside(const ThesisState& state, const Frame& frame, Index curve, bool of_a) {
    const bool at_rim = curves_[at(curve)].ends_at_rim;
    const Index body = of_a ? curves_[at(curve)].body_a : curves_[at(curve)].body_b;
    if (at_rim && state.topology->bodies[at(body)].closed) return;  // nothing is inside an open body
    for (std::size_t p = 0; p < pieces_.size(); ++p) {
        if (curve_of_root_[at(root(static_cast<Index>(p)))] != curve) continue;
        const Index triangle = of_a ? pieces_[p].a : pieces_[p].b;
        for (int i = 0; i < 3; ++i) {
            const Index vertex = state.topology->triangles(i, triangle);
            const bool below = (of_a ? pieces_[p].below_a : pieces_[p].below_b)[at(i)];
            if (known_[at(vertex)] == walk_) continue;
            if (at_rim ? !open_corner_is_inside(state, frame, pieces_[p], of_a, vertex) : !below) continue;
            known_[at(vertex)] = walk_;
            inside_.push_back(vertex);
        }
    }
}

/// On the way over its triangle from the piece to the corner, an open body is inside the closed one behind the piece's
/// face and changes sides at every other piece.
bool RigidContacts::open_corner_is_inside(const ThesisState& state, const Frame& frame, const Piece& piece, bool of_a,
                                          Index vertex) const {
    const Index triangle = of_a ? piece.a : piece.b;
    const Vector3 across = area_normal(*state.topology, frame.position, triangle);
    const Vector3 start = 0.5 * (piece.from + piece.to);
    const Vector3 way = frame.position.col(vertex) - start;
    const auto is_left = [&](const Vector3& line, const Vector3& point) { return line.cross(point).dot(across) > 0.0; };
    bool inside = area_normal(*state.topology, frame.position, of_a ? piece.b : piece.a).dot(way) < 0.0;
    auto other = std::lower_bound(by_triangle_.begin(), by_triangle_.end(), std::pair<Index, Index>{triangle, -1});
    for (; other != by_triangle_.end() && other->first == triangle; ++other) {
        const Piece& met = pieces_[at(other->second)];
        if (&met == &piece || met.body_a != piece.body_a || met.body_b != piece.body_b) continue;
        const Vector3 line = met.to - met.from;
        const bool between = is_left(way, met.from - start) != is_left(way, met.to - start);
        if (between && is_left(line, start - met.from) != is_left(line, start + way - met.from)) inside = !inside;
    }
    return inside;
}

/// From the corners below a face that they cross, over triangles that do not cross: what the curve encloses. a's part
/// of the overlap lies where b is pushed to, b's on the other side, and neither reaches further aside than the curve.
void RigidContacts::walk_inside(const ThesisState& state, const Frame& frame, Curve& curve, bool of_a) {
    for (std::size_t next = 0; next < inside_.size(); ++next) {
        const Vector3 x = frame.position.col(inside_[next]) - curve.centre;
        const double height = curve.normal.dot(x);
        if ((of_a ? height : -height) < 0.0) continue;
        if (!curve.ends_at_rim && (x - height * curve.normal).norm() > curve.radius) continue;
        curve.highest = std::max(curve.highest, height);
        curve.lowest = std::min(curve.lowest, height);
        for (const Index t : state.surface.triangles_at(inside_[next])) {
            if (crosses(t)) continue;
            for (int i = 0; i < 3; ++i) {
                const Index vertex = state.topology->triangles(i, t);
                if (known_[at(vertex)] == walk_) continue;
                known_[at(vertex)] = walk_;
                inside_.push_back(vertex);
            }
        }
    }
}

bool RigidContacts::crosses(Index triangle) const {
    const auto found =
        std::lower_bound(by_triangle_.begin(), by_triangle_.end(), std::pair<Index, Index>{triangle, -1});
    return found != by_triangle_.end() && found->first == triangle;
}

LinearContact RigidContacts::contact_of(const ThesisState& state, const Frame& frame, const Curve& curve) const {
    const bool push_b = state.kind(curve.body_b) == BodyKind::instrument;
    const LoadPoint a = rigid_point(*state.topology, frame.position, curve.a, curve.centre, curve.normal);
    const LoadPoint b = rigid_point(*state.topology, frame.position, curve.b, curve.centre, curve.normal);
    LinearContact linear;
    linear.gap = curve.lowest - curve.highest;
    linear.normal = push_b ? curve.normal : Vector3(-curve.normal);
    linear.vertices = push_b ? b.vertices : a.vertices;
    linear.weights = push_b ? b.weights : a.weights;
    linear.face_velocity = (push_b ? a : b).blend(frame.velocity).dot(linear.normal);
    if (push_b) {
        linear.reaction_body = curve.body_a;
        linear.reaction_point = a.blend(frame.position);
    }
    return linear;
}

void RigidContacts::give_law(const ThesisState& state, const Frame& frame, Index body_a, Index body_b, double share,
                             LinearContact& linear) const {
    double mobility = 0.0;
    for (const Index body : {body_a, body_b}) {
        if (const auto& device = state.device(body)) mobility += 1.0 / device->mass;
    }
    double k = state.stiffness(body_a, body_b, 0.0, -1);
    double mu = state.laws.mu(body_a, body_b);
    const Vector3 point_velocity = LoadPoint{linear.vertices, linear.weights}.blend(frame.velocity);
    const bool stiff = state.settings.hold_rigid && mobility > 0.0;
    if (stiff) {
        const double settle = state.settings.rigid_settle;
        k = std::max(k, 1.0 / (mobility * settle * settle));
        const double critical = 2.0 * std::sqrt(k / mobility);
        // An impact shall not begin with more than f_max.
        const double closing = linear.face_velocity - point_velocity.dot(linear.normal);
        const bool limited = state.settings.clamp && closing * critical > state.settings.f_max;
        mu = std::max(mu, limited ? state.settings.f_max / closing : critical);
    }
    linear.k = share * k;
    linear.mu = share * mu;
    if (!stiff && state.settings.clamp) linear.gap = std::max(linear.gap, -state.settings.f_max / k);
    tell_at_start(*state.topology, frame, state.dt, linear);
}

}  // namespace trocar
