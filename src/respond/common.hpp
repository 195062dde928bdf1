// What every response of ours needs: the class of a body pair, the contact law that applies to it, and the gap of a
// contact as an Effect tells it.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "contact/contact.hpp"
#include "contact/effect.hpp"
#include "geometry/types.hpp"
#include "method/entry.hpp"
#include "respond/equations.hpp"
#include "scene/vertex_springs.hpp"
#include "scene/world.hpp"

namespace trocar {

/// The five classes of thesis §3.4; bodies are sorted by kind, so there are no swapped variants.
enum class CollisionClass : std::uint8_t {
    instrument_instrument,
    instrument_rigid,
    instrument_tissue,
    rigid_tissue,
    tissue_tissue,
    none
};
CollisionClass collision_class(BodyKind a, BodyKind b);

/// Corners of a triangle, m, world.
equations::Corners corners_of(const Topology& topology, const Matrix3X& position, Index triangle);

/// Stiffness and damping per body pair: a number given to the method wins, else the scene's law, else the default.
/// Built once per run; a look-up is one table entry.
class PairLaws {
public:
    /// k and mu are NaN where the method was given no number.
    void prepare(const Topology& topology, const Materials& materials, double k, double mu);
    /// N/m; NaN when neither method nor scene says anything.
    [[nodiscard]] double k(Index body_a, Index body_b) const { return law(body_a, body_b).k; }
    /// N s/m; 2 when neither method nor scene says anything (METHODS §12).
    [[nodiscard]] double mu(Index body_a, Index body_b) const { return law(body_a, body_b).mu; }
    [[nodiscard]] CollisionClass kind(Index body_a, Index body_b) const { return law(body_a, body_b).kind; }

private:
    struct Law {
        double k = std::numeric_limits<double>::quiet_NaN();
        double mu = std::numeric_limits<double>::quiet_NaN();
        CollisionClass kind = CollisionClass::none;
    };
    [[nodiscard]] const Law& law(Index a, Index b) const {
        return table_[static_cast<std::size_t>(a) * static_cast<std::size_t>(bodies_) + static_cast<std::size_t>(b)];
    }
    Index bodies_ = 0;
    std::vector<Law> table_;
};

/// Stiffness between non-deformable bodies where nobody says otherwise, N/m (METHODS §12).
inline constexpr double rigid_stiffness = 1000.0;
/// ResponseEntry::without_tissue of responses that have springs alone where nothing has a mass.
inline constexpr const char* acts_as_penalty = "acts as penalty between bodies without tissue";

/// The point of a triangle that has these barycentric weights.
ContactPoint point_in_triangle(const Topology& topology, Index triangle, const Vector3& weights);

/// Translation that a hand gave a body in the last tick, m/s; zero for bodies that no hand leads.
Vector3 hand_velocity(const Frame& frame, double dt, Index body);
/// How fast scripts alone open the gap of a contact within the tick, m/s: of the velocities that it was written for
/// (vertices as in the frame, face_velocity), the part that is neither tissue's nor a hand's.
double scripted_rate(const Topology& topology, const Frame& frame, double dt, const LinearContact& contact);
/// For a contact whose gap was measured at the frame, where scripts have made this tick's motion already: tells it at
/// the start of the tick, as LinearContact wants it. It closes at the end of the tick where it was measured, not one
/// tick's motion beyond.
void tell_at_start(const Topology& topology, const Frame& frame, double dt, LinearContact& contact);

/// Parameters that most responses share.
Parameter stiffness_parameter(const std::string& default_meaning);
Parameter damping_parameter();

}  // namespace trocar
