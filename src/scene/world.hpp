// Flat world that every method gets: constant topology, a moving frame, and materials of tissue and contact. Flat
// arrays let a frame be recorded, hashed and replayed bit-identically.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// In the order in which a scene sorts its bodies, so that pair classes have no swapped variants.
enum class BodyKind : std::uint8_t { instrument, rigid, tissue };

/// Words of files, by kind.
inline const std::vector<std::string> body_kind_words{"instrument", "rigid", "tissue"};
/// Kind of one of the words.
BodyKind body_kind_of(const std::string& word);

/// Side of an open sheet: its triangles are counter-clockwise seen from the front.
enum class SheetSide : std::uint8_t { front, back };

/// Description of one body before it becomes part of a Topology.
struct Body {
    std::string name = {};
    BodyKind kind = BodyKind::rigid;
    bool closed = true;           ///< false: an open sheet, without inside.
    std::string instrument = {};  ///< Parts with the same non-empty name are never tested against each other.
    Index vertex_count = 0;
    Triangles triangles = Triangles(3, 0);  ///< 3×T, vertex numbers local to this body (0 … vertex_count-1).
    /// Open sheets: the side on which the other bodies start, which is the outside.
    SheetSide start_side = SheetSide::front;
};

/// Ranges of one body in the flat arrays.
struct BodyRange {
    std::string name = {};
    BodyKind kind = BodyKind::rigid;
    bool closed = true;
    std::string instrument = {};
    Range vertices = {};
    Range triangles = {};
    SheetSide start_side = SheetSide::front;
};

/// Constant for a run. Triangle numbers ascend with body numbers, so a < b in a pair means body(a) <= body(b).
struct Topology {
    Index vertex_count = 0;
    Triangles triangles;  ///< 3×T, global vertex numbers.
    std::vector<BodyRange> bodies;
    std::vector<Index> body_of_triangle;           ///< T entries.
    std::vector<std::array<Index, 2>> body_pairs;  ///< Pairs (first < second) to test, sorted.

    [[nodiscard]] Index triangle_count() const { return static_cast<Index>(triangles.cols()); }
    [[nodiscard]] Index body_count() const { return static_cast<Index>(bodies.size()); }
    /// Body of this vertex, -1: none.
    [[nodiscard]] Index body_of_vertex(Index vertex) const;
    /// Index in body_pairs, -1 if the two are not tested against each other.
    [[nodiscard]] Index body_pair(Index body_a, Index body_b) const;
};

/// Concatenates the bodies in the given order. Every two bodies are tested against each other, except rigid with rigid
/// and parts of one instrument. Throws InputError on an index out of range, a negative count, or a duplicate body name.
Topology make_topology(const std::vector<Body>& bodies);

/// As above, with the body pairs to test given by body number (any order, any kinds).
Topology make_topology(const std::vector<Body>& bodies, const std::vector<std::array<Index, 2>>& body_pairs);

/// Rigid pose of a body at one instant: p_world = rotation * p_body + translation.
struct Pose {
    Vector3 translation = Vector3::Zero();  ///< m, world.
    Quaternion rotation = Quaternion::Identity();
    double jaw = 1.0;  ///< Jaw opening in [0, 1]; 0 is closed.
};

/// State that changes per tick. `previous` and `velocity` belong to the same vertices; velocity = (position - previous)
/// / dt.
struct Frame {
    Matrix3X position = {};  ///< 3×N, m, world.
    Matrix3X previous = {};  ///< 3×N, m, world; the tick before (tick 0: equal to position).
    Matrix3X velocity = {};  ///< 3×N, m/s, world.
    std::int64_t tick = 0;
    double time = 0.0;  ///< s
    /// Vertex ranges that may have moved since the last tick; absent = unknown (compare, or assume all).
    std::optional<std::vector<Range>> moved = std::nullopt;
    /// One per body if the frame comes from a scene, else empty. Rigid and tissue bodies keep their fixed pose.
    std::vector<Pose> pose = {};
    /// One per body, m: part of position - previous from the operator's step at the end of the last tick; the rest is
    /// scripted motion within this tick. Empty: scripts only.
    std::vector<Vector3> operator_motion = {};

    /// m/s, translation of a body by its operator in the last tick; zero for bodies without operator.
    [[nodiscard]] Vector3 operator_velocity(Index body, double dt) const {
        return at(body) < operator_motion.size() ? Vector3(operator_motion[at(body)] / dt) : Vector3::Zero();
    }
    /// 64-bit FNV-1a over the bits of `position` and the tick; equal frames have equal hashes on every machine.
    [[nodiscard]] std::uint64_t hash() const;
    [[nodiscard]] bool all_finite() const { return position.allFinite(); }
};

/// A spring of the tissue model. METHODS §4: f = [k (|x_j - x_i| - rest) + preload] u + damping ((v_j - v_i)·u) u.
struct Spring {
    Index i = -1;
    Index j = -1;
    double rest = 0.0;     ///< m
    double k = 0.0;        ///< N/m
    double preload = 0.0;  ///< N, tension at rest length
    double damping = 0.0;  ///< N s/m
};

/// Closed surface of a tissue body that resists volume change (METHODS §4). The over-pressure inside is -bulk_modulus
/// (V - volume) / volume.
struct Enclosure {
    Triangles triangles = Triangles(3, 0);  ///< 3×T, counter-clockwise seen from outside
    double volume = 0.0;                    ///< m³ at rest, > 0
    double bulk_modulus = 0.0;              ///< Pa
};

/// Contact law of two bodies from the scene; NaN where the scene has no value and the method's default applies.
struct ContactLaw {
    double k = std::numeric_limits<double>::quiet_NaN();   ///< N/m
    double mu = std::numeric_limits<double>::quiet_NaN();  ///< N s/m, viscous
};

/// Material data as flat arrays, so that responses do not depend on the tissue model. Arrays cover all N vertices;
/// entries of other vertices are 0 (mass 0 = kinematic). Empty when the scene has no tissue.
struct Materials {
    std::vector<Spring> springs;
    std::vector<Enclosure> enclosures;       ///< one per body that names a bulk modulus
    Matrix3X rest_bias;                      ///< 3×N, N; keeps the preloaded rest state static (METHODS §4).
    std::vector<std::uint8_t> pinned;        ///< N; 1 = held in place.
    std::vector<double> mass;                ///< N; kg
    std::vector<double> area;                ///< N; m², one third of the adjacent triangles' rest area
    std::vector<double> mean_stiffness;      ///< N; N/m, mean k of the springs at the vertex
    std::vector<double> triangle_stiffness;  ///< T; N/m, mean k of the triangle's three edge springs (0: not tissue)
    std::vector<double> drag;                ///< N; kg/s, coefficient of -drag * v (gamma of thesis eq. 3.1)
    int substeps = 4;                        ///< integrator sub-steps per tick
    double strain_limit = 1.0;               ///< largest edge strain before the limiter acts
    std::vector<ContactLaw> contact_laws;    ///< one per Topology::body_pairs entry (also without tissue).
    /// Trocar (fulcrum) point of each body, if it has one (m, world), and tip point (m, body frame).
    std::vector<std::optional<Vector3>> trocar_point;
    std::vector<Vector3> tip;

    /// The integrator moves this vertex: it has mass and is not pinned.
    [[nodiscard]] bool is_free(Index vertex) const {
        return mass[at(vertex)] > 0.0 && (pinned.empty() || pinned[at(vertex)] == 0);
    }
};

}  // namespace trocar
