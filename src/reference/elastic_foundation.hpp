// The compliant law of the reference solver: an elastic foundation over the area of one of two surfaces, sampled at
// equal points of its triangles (the law is reported in implicit_solver.hpp).
#pragma once

#include <array>
#include <vector>

#include "reference/contact_term.hpp"
#include "reference/signed_distance.hpp"
#include "scene/scene.hpp"

namespace trocar {

class ElasticFoundation {
public:
    /// No foundation.
    ElasticFoundation() = default;
    /// For the given body pairs at the place x, with points² samples on a triangle. The scene outlives the object.
    ElasticFoundation(const Scene& scene, const std::vector<std::array<Index, 2>>& contact_bodies, int points,
                      const Matrix3X& x);

    /// Energy at the place x, J, for a step of h (s; 0: no damping). Adds each sample that presses to `terms` unless
    /// null, and then puts minus the largest depth into `smallest_gap`, m.
    double energy(const Matrix3X& x, double h, std::vector<ContactTerm>* terms, double& smallest_gap);
    /// Keeps the depths at the end of a step for the damping of the next one. False when a point is so deep that its
    /// shortest way out is no longer the way in.
    bool remember_depths(const Matrix3X& x);

private:
    /// One surface's area sampled against another body.
    struct Foundation {
        Index slave = -1;
        Index master = -1;
        double kappa = 0.0;                ///< N/m³
        double eta = 0.0;                  ///< N s/m³
        std::vector<Vector3> weights;      ///< of the sample points of one triangle, in its corners
        std::vector<double> area;          ///< m², rest area of the slave's triangles
        std::vector<double> depth_before;  ///< per triangle and point, >= 0
        double side = 1.0;                 ///< of an open sheet on which the slave starts: +1 front, -1 back
        double most_depth = 0.0;           ///< m, beyond it the shortest way out is no longer the way in
        // Samples that were outside by more than all vertices have moved since need not be examined.
        std::vector<double> clearance;  ///< m, per triangle and point
        Matrix3X searched_from;         ///< 3×N, positions of that look
    };
    void lay(Index slave, Index master, const ContactLaw& law, double share, int points, const Matrix3X& x);
    [[nodiscard]] double triangle_area(Index t) const;
    [[nodiscard]] double most_depth_of(Index master, const Matrix3X& x) const;
    template <typename Use>
    void for_each_sample(Foundation& foundation, const Matrix3X& x, Use&& use);

    const Scene* scene_ = nullptr;
    std::vector<Foundation> foundations_;
    std::vector<SignedDistance> masters_;  ///< per body, prepared when it is one
};

}  // namespace trocar
