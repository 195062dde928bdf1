// Contact force between bodies that do not touch: the counterpart of residual penetration.
#pragma once

#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "contact/contact.hpp"
#include "contact/response_output.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Records the forces of body pairs together with their clearance. Forces that pull by design (grasps) and dampers do
/// not count. Clearance is the distance of triangles (geometry/triangle_distance).
class ForceWithoutTouch {
public:
    /// `counted`: one flag per Topology::body_pairs entry. The topology outlives the object.
    ForceWithoutTouch(const Topology& topology, const Frame& first, std::span<const std::uint8_t> counted);

    /// m, an upper bound of the clearance of two bodies on the frame of the call, 0 where one is inside the other.
    using Bound = std::function<double(Index body_a, Index body_b)>;
    /// Call after every tick with the frame after it, its effect and its contact forces.
    void observe(const Frame& after, const ResponseOutput& output, std::span<const ContactForce> contact_forces,
                 const Bound& bound);

    /// m, largest clearance over pairs and ticks with more than 1 % of the pair's peak force. A tick's clearance is the
    /// smaller of those at its start and end. NaN without such a tick. NaN too where a response output has forces that
    /// no contact carries, since they belong to no pair.
    [[nodiscard]] double largest() const;

private:
    /// A tick of a pair.
    struct Sample {
        double force = 0.0;      ///< N
        double clearance = 0.0;  ///< m
    };
    struct Pair {
        double start =
            std::numeric_limits<double>::infinity();  ///< m, bound at the end of the last tick; infinite: none
        double force = 0.0;                           ///< N, in this tick
        double peak = 0.0;                            ///< N
        std::vector<Sample> samples;                  ///< none has both less force and less clearance than another
    };
    [[nodiscard]] Index pair_of(const ContactForceLaw& contact) const;
    [[nodiscard]] double clearance(const Frame& frame, Index pair, double bound);
    static void keep(Pair& pair, double force, double clearance);

    const Topology* topology_;
    std::vector<std::uint8_t> counted_;
    std::vector<Pair> pairs_;  ///< per Topology::body_pairs entry; none once a force belonged to no pair
    Frame before_;             ///< positions at the start of the tick
    std::vector<TrianglePair> near_;
};

}  // namespace trocar
