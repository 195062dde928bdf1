// Compliant contact law of the reference solver: an elastic foundation over the area of one of two surfaces, sampled at
// equal points of its triangles. implicit_solver.hpp states the law.
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
    /// For the given body pairs at positions x (3×N, m), with points² samples per triangle. The scene outlives the
    /// object.
    ElasticFoundation(const Scene& scene, const std::vector<std::array<Index, 2>>& contact_bodies, int points,
                      const Matrix3X& x);

    /// Energy (J) at positions x for a step of h (s; 0: no damping). Unless `terms` is null, appends each sample in
    /// contact and sets `smallest_gap` (m) to minus the largest depth.
    double energy(const Matrix3X& x, double h, std::vector<ContactTerm>* terms, double& smallest_gap);
    /// Stores the depths at the end of a step for the damping of the next one. False if a point is deeper than
    /// `most_depth`.
    bool remember_depths(const Matrix3X& x);

private:
    /// Area of the slave surface, sampled against the master.
    struct Foundation {
        Index slave = -1;
        Index master = -1;
        double kappa = 0.0;                ///< N/m³
        double eta = 0.0;                  ///< N s/m³
        std::vector<Vector3> weights;      ///< barycentric weights of the sample points of one triangle
        std::vector<double> area;          ///< m², rest area of the slave's triangles
        std::vector<double> depth_before;  ///< per triangle and point, >= 0
        double side = 1.0;                 ///< open sheet: side on which the slave starts, +1 front, -1 back
        double most_depth = 0.0;           ///< m, beyond it the shortest exit is not the point of entry.
        // Samples are skipped while their clearance exceeds the largest displacement since `searched_from`.
        std::vector<double> clearance;  ///< m, per triangle and point
        Matrix3X searched_from;         ///< 3×N, m, positions of the last full search
    };
    void lay(Index slave, Index master, const ContactLaw& law, double share, int points, const Matrix3X& x);
    [[nodiscard]] double most_depth_of(Index master, const Matrix3X& x) const;
    template <typename Use>
    void for_each_sample(Foundation& foundation, const Matrix3X& x, Use&& use);

    const Scene* scene_ = nullptr;
    std::vector<Foundation> foundations_;
    std::vector<SignedDistance> masters_;  ///< per body, prepared if it is a master
};

}  // namespace trocar
