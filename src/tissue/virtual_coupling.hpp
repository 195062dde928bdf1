// Simulated operator of an instrument: a mass with damping and a virtual coupling to the scripted target, pushed back
// by contact (METHODS §11). Translation only; rotation and jaw follow the script.
#pragma once

#include <Eigen/Cholesky>
#include <span>
#include <vector>

#include "contact/response_output.hpp"
#include "scene/motion.hpp"
#include "scene/world.hpp"

namespace trocar {

struct OperatorState {
    Vector3 position = Vector3::Zero();  ///< m, of the body origin, world
    Vector3 velocity = Vector3::Zero();  ///< m/s
};

/// One operator, the bodies that it moves (they share its pose), and its state over a tick.
struct DrivenOperator {
    const OperatorModel* model = nullptr;
    std::span<const Index> bodies = {};
    Vector3 target = Vector3::Zero();           ///< m, world
    Vector3 target_velocity = Vector3::Zero();  ///< m/s
    Wrench external = {};      ///< constant over the tick: reaction of tissue, and the output's own wrenches
    OperatorState state = {};  ///< in and out
    Wrench load = {};          ///< out: mean of contacts and `external` over the tick, moments about the world origin
    double work = 0.0;         ///< out: J, of `load` on the operator, summed over the sub-steps
};

/// Advances all operators over dt in `substeps` semi-implicit steps. Virtual couplings and damping are explicit.
/// Contacts are implicit and solved for all operators together, because two opposing operators must not both yield to
/// the same depth. Handles contacts of the output that involve an operator's bodies and no tissue. Contacts with tissue
/// come as DrivenOperator::external.
class VirtualCouplings {
public:
    /// `frame` holds the vertex velocities to which gaps and face velocities refer, and the operators' part of them
    /// (operator_motion). Scripted motion continues within the tick. Writes the contact forces computed here to
    /// `contact_forces`, one entry per contact of the output.
    void advance(const Topology& topology, const Frame& frame, const ResponseOutput& output, double dt, int substeps,
                 std::span<DrivenOperator> operators, std::span<ContactForce> contact_forces);

private:
    /// A contact between operators; its rate is v_plus·n − v_minus·n + offset.
    struct Row {
        std::size_t source = 0;  ///< contact of the output
        Index plus = -1;         ///< operator pushed along the normal, -1: none
        Index minus = -1;        ///< operator that takes the reaction, -1: none
        Vector3 normal = Vector3::Zero();
        Vector3 plus_point = Vector3::Zero();
        Vector3 minus_point = Vector3::Zero();
        double first_depth = 0.0;  ///< m, at the start of the tick
        double offset = 0.0;       ///< m/s, part of the rate not due to operators
        double stiffness = 0.0;
        double damping = 0.0;           ///< >= 0, implicit
        double explicit_damping = 0.0;  ///< <= 0
        StepLaw law;                    ///< of the sub-step
        double limit = 0.0;             ///< N, largest force
        bool bilateral = false;
        bool pulls = false;
        double depth = 0.0;  ///< m, at the start of the sub-step; negative: open
        bool on = false;
        bool capped = false;  ///< on, and at its limit
        double force = 0.0;   ///< N, of the sub-step, within the limit
    };

    void collect(const Topology& topology, const Frame& frame, const ResponseOutput& output, double dt,
                 std::span<const DrivenOperator> operators);
    [[nodiscard]] double rate(const Row& row, const Eigen::VectorXd& velocity) const;
    void solve(double h, std::span<const DrivenOperator> operators);

    std::vector<Row> rows_;
    std::vector<Vector3> first_position_;
    Eigen::MatrixXd matrix_;
    Eigen::VectorXd start_, free_, right_side_, velocity_, solved_;
    Eigen::LDLT<Eigen::MatrixXd> factor_;
};

}  // namespace trocar
